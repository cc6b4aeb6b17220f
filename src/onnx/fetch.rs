//! Fetches the file of one model: from a folder that has it or the files to convert, or else from its sources in
//! order. Every file is checked against its pinned SHA-256 before conversion, and the result after it.

use super::convert::{ConversionOptions, convert};
use super::{ModelEntry, ModelSource, PinnedFile, SourceFile, SourceKind, package, sha256_of};
use anyhow::{Context, Result, anyhow, bail, ensure};
use orator_base::input;
use orator_base::stage::workdir;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Maximum file size, 1 GiB.
pub(super) const MAX_BYTES: u64 = 1 << 30;
/// Terms and licences of a model that is a folder.
const LICENCE_FILE: &str = "licence.txt";
/// Maximum folder depth searched in a mirror.
const MAX_DEPTH: usize = 3;

/// Source from which the file of a model was fetched.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FetchSource {
    /// Already present in the models folder.
    Present,
    Mirror(PathBuf),
    /// Files of the mirror that are listed for this source.
    MirrorOf(ModelSource),
    /// The URL in the manifest.
    Url(String),
    /// A source in the manifest.
    Source(ModelSource),
}

impl fmt::Display for FetchSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Present => write!(f, "already present"),
            Self::Mirror(path) => write!(f, "copied from {}", path.display()),
            Self::MirrorOf(source) => write!(f, "built from files of the mirror listed for {source}"),
            Self::Url(url) => write!(f, "downloaded from {url}"),
            Self::Source(source) => write!(f, "built from {source}"),
        }
    }
}

/// A fetched file, with the licence text of its source.
struct Obtained {
    bytes: Vec<u8>,
    licence: Option<String>,
    source: FetchSource,
}

/// Fetches model files into a folder. Each package is downloaded once.
pub(super) struct Fetcher<'a> {
    /// SHA-256 and path of every file of the mirror.
    mirror_files: Vec<(String, PathBuf)>,
    /// Folder for package downloads.
    downloads: &'a Path,
    /// Path of each package by its pinned SHA-256, or why it could not be downloaded.
    packages: BTreeMap<String, Result<PathBuf, String>>,
}

impl<'a> Fetcher<'a> {
    /// Hashes all files of the mirror, regardless of their names.
    pub(crate) fn new(mirror: Option<&Path>, downloads: &'a Path) -> Result<Self> {
        let mut mirror_files = Vec::new();
        if let Some(mirror) = mirror {
            list_mirror(mirror, MAX_DEPTH, &mut mirror_files)?;
            mirror_files.sort();
        }
        Ok(Self { mirror_files, downloads, packages: BTreeMap::new() })
    }

    /// Writes the file of the model to `path`, with the licence text of its source in a file next to it, or its folder.
    /// Errors: no source has the file; the message gives the reason for each.
    pub(crate) fn get(&mut self, entry: &ModelEntry, path: &Path) -> Result<FetchSource> {
        if !entry.files.is_empty() {
            return self.get_folder(entry, path);
        }
        let without_licence = |bytes, source| Obtained { bytes, licence: None, source };
        if let Some(found) = self.in_mirror(&entry.sha256) {
            let bytes =
                input::read(found, input::MAX_DATA).with_context(|| format!("cannot read {}", found.display()))?;
            return write(entry, path, without_licence(bytes, FetchSource::Mirror(found.to_owned())));
        }
        let mut failures = String::new();
        if let Some(url) = &entry.url {
            match download(url).and_then(|bytes| check_hash(&bytes, &entry.sha256, url).map(|()| bytes)) {
                Ok(bytes) => return write(entry, path, without_licence(bytes, FetchSource::Url(url.clone()))),
                Err(error) => _ = write!(failures, "\n      {url}: {error:#}"),
            }
        }
        match self.first_of(&entry.sources, |files| build(entry, files)) {
            Ok(obtained) => return write(entry, path, obtained),
            Err(reasons) => failures += &reasons,
        }
        if failures.is_empty() {
            let steps = entry.conversion.as_deref().unwrap_or("no conversion is documented");
            let _ = write!(
                failures,
                "\n      no source to download; the file was created from {} @ {}: {} by: {steps}",
                entry.origin.repository, entry.origin.commit, entry.origin.path
            );
        }
        bail!(
            "cannot fetch the file:{failures}\n      to use a copy (sha256 {}), name its folder with --mirror DIR",
            entry.sha256
        )
    }

    /// Writes the files of a model to `folder`, from the mirror or else from its sources. Parts of a file are joined.
    /// Files that are there already are not fetched again, so a fetch that was interrupted continues.
    fn get_folder(&mut self, entry: &ModelEntry, folder: &Path) -> Result<FetchSource> {
        let in_mirror: Option<Vec<&Path>> = entry.files.iter().map(|file| self.in_mirror(&file.sha256)).collect();
        if let Some(paths) = in_mirror {
            workdir::write_file(&folder.join(LICENCE_FILE), entry.terms().as_bytes())?;
            for (path, file) in paths.iter().zip(&entry.files) {
                workdir::write_file(&folder.join(&file.path), &input::read(path, MAX_BYTES)?)?;
            }
            return Ok(FetchSource::Mirror(paths.iter().find_map(|path| path.parent()).unwrap_or(folder).to_owned()));
        }
        let mut text = entry.terms();
        for source in &entry.sources {
            if source.files.iter().all(|file| has_hash(&folder.join(file.name()), &file.sha256)) {
                continue;
            }
            let obtained = if self.has_mirrored(source) { self.mirrored(source) } else { self.files(source) };
            let (files, licence) = obtained.map_err(|error| {
                anyhow!("cannot fetch {source}: {error:#}\n      to use a copy, name its folder with --mirror DIR")
            })?;
            text += &licence.map(|text| format!("\n{}\n", text.trim_end())).unwrap_or_default();
            workdir::write_file(&folder.join(LICENCE_FILE), text.as_bytes())?;
            for (bytes, file) in files.iter().zip(&source.files) {
                workdir::write_file(&folder.join(file.name()), bytes)?;
            }
        }
        for file in &entry.files {
            let (path, parts) = (folder.join(&file.path), parts(entry, file, folder));
            if !parts.is_empty() && !has_hash(&path, &file.sha256) {
                workdir::replace(&path, |attempt| join(&parts, attempt, file))?;
            }
            parts.iter().try_for_each(|part| workdir::remove_file(part))?;
        }
        let source = entry.sources.first().with_context(|| format!("{} has no source to download", entry.id))?;
        Ok(FetchSource::Source(source.clone()))
    }

    /// Writes a file other than a model to `path`. Errors: no source has it; the message gives the reason for each.
    pub(crate) fn get_file(&mut self, file: &PinnedFile, path: &Path) -> Result<FetchSource> {
        let concatenate = |files: &[Vec<u8>]| {
            let bytes = files.concat();
            check_hash(&bytes, &file.sha256, &file.file).map(|()| bytes)
        };
        let obtained = self.first_of(&file.sources, concatenate);
        let Obtained { bytes, source, .. } =
            obtained.map_err(|failures| anyhow!("cannot fetch {}:{failures}", file.file))?;
        workdir::write_file(path, &bytes)?;
        Ok(source)
    }

    /// Result of `make` for the files of the first source that has them, with mirrored sources first. The error gives
    /// the reason for each source.
    fn first_of(
        &mut self,
        sources: &[ModelSource],
        make: impl Fn(&[Vec<u8>]) -> Result<Vec<u8>>,
    ) -> Result<Obtained, String> {
        let mut failures = String::new();
        let (mirrored, others): (Vec<_>, Vec<_>) = sources.iter().partition(|source| self.has_mirrored(source));
        let mirrored_sources = mirrored.into_iter().map(|source| (source, FetchSource::MirrorOf(source.clone())));
        let other_sources = others.into_iter().map(|source| (source, FetchSource::Source(source.clone())));
        for (source, from) in mirrored_sources.chain(other_sources) {
            let files = match from {
                FetchSource::MirrorOf(_) => self.mirrored(source),
                _ => self.files(source),
            };
            match files.and_then(|(files, licence)| Ok((make(&files)?, licence))) {
                Ok((bytes, licence)) => return Ok(Obtained { bytes, licence, source: from }),
                Err(error) if source.from == SourceKind::Address => _ = write!(failures, "\n      {error:#}"),
                Err(error) => _ = write!(failures, "\n      {source}: {error:#}"),
            }
        }
        Err(failures)
    }

    fn in_mirror(&self, sha256: &str) -> Option<&Path> {
        let found = self.mirror_files.iter().find(|(hash, _)| hash.eq_ignore_ascii_case(sha256))?;
        Some(&found.1)
    }

    fn has_mirrored(&self, source: &ModelSource) -> bool {
        let has_package = !source.sha256.is_empty() && self.in_mirror(&source.sha256).is_some();
        has_package || source.files.iter().all(|file| self.in_mirror(&file.sha256).is_some())
    }

    fn mirrored(&self, source: &ModelSource) -> Result<(Vec<Vec<u8>>, Option<String>)> {
        if let Some(package) = self.in_mirror(&source.sha256).filter(|_| !source.sha256.is_empty()) {
            return unpacked(source, package);
        }
        let read = |file: &SourceFile| {
            let path =
                self.in_mirror(&file.sha256).with_context(|| format!("the mirror does not contain {}", file.path))?;
            Ok(input::read(path, input::MAX_DATA)?)
        };
        Ok((source.files.iter().map(read).collect::<Result<_>>()?, None))
    }

    /// Files of a source, and its licence text if it has one.
    fn files(&mut self, source: &ModelSource) -> Result<(Vec<Vec<u8>>, Option<String>)> {
        if source.from == SourceKind::Address {
            let get = |file: &SourceFile| {
                let url = format!("{}{}", source.name, file.path);
                checked_part(file, download(&url).with_context(|| url.clone())?)
            };
            let licence = source.licence.as_ref().and_then(|path| download(&format!("{}{path}", source.name)).ok());
            let text = licence.map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
            return Ok((source.files.iter().map(get).collect::<Result<_>>()?, text));
        }
        let n = self.packages.len();
        let package = self.packages.entry(source.sha256.clone()).or_insert_with(|| {
            // The name contains the process id: the npm process of a killed fetch may still be running and must not
            // write here.
            let dir = self.downloads.join(format!("{}-{n}", std::process::id()));
            let created = std::fs::create_dir_all(&dir);
            let created = created.with_context(|| format!("cannot create the folder {}", dir.display()));
            let downloaded = created.and_then(|()| package::download(source, &dir)).and_then(|file| {
                let found = sha256_of(&file)?;
                ensure!(
                    found.eq_ignore_ascii_case(&source.sha256),
                    "the package has sha256 {found}, expected {}",
                    source.sha256
                );
                Ok(file)
            });
            downloaded.map_err(|error| format!("{error:#}"))
        });
        unpacked(source, package.as_ref().map_err(|error| anyhow!("{error}"))?)
    }
}

/// Adds hash and path of every file in a folder that is small enough for a model.
fn list_mirror(folder: &Path, depth: usize, mirror_files: &mut Vec<(String, PathBuf)>) -> Result<()> {
    let cannot = || format!("cannot read the folder {}", folder.display());
    for file in std::fs::read_dir(folder).with_context(cannot)? {
        let file = file.with_context(cannot)?;
        let (path, kind) = (file.path(), file.file_type()?);
        if kind.is_dir() && depth > 0 {
            list_mirror(&path, depth - 1, mirror_files)?;
        } else if path.metadata().is_ok_and(|meta| meta.is_file() && meta.len() <= MAX_BYTES) {
            mirror_files.push((sha256_of(&path)?, path));
        }
    }
    Ok(())
}

/// Files of a package that a source lists, each checked, and its licence text.
fn unpacked(source: &ModelSource, package: &Path) -> Result<(Vec<Vec<u8>>, Option<String>)> {
    let paths: Vec<&str> =
        source.files.iter().map(|file| &file.path).chain(&source.licence).map(String::as_str).collect();
    let mut members = package::members(source.from, package, &paths)?.into_iter();
    let files = source
        .files
        .iter()
        .zip(members.by_ref())
        .map(|(file, bytes)| checked_part(file, bytes))
        .collect::<Result<_>>()?;
    Ok((files, members.next().map(|bytes| String::from_utf8_lossy(&bytes).into_owned())))
}

/// The used byte range of a file, checked against its pinned hash.
fn checked_part(file: &SourceFile, bytes: Vec<u8>) -> Result<Vec<u8>> {
    let bytes = match file.range {
        None => bytes,
        Some([start, end]) => {
            let range = usize::try_from(start)?..usize::try_from(end)?;
            bytes
                .get(range)
                .with_context(|| format!("{} has {} bytes, expected at least {end}", file.path, bytes.len()))?
                .to_vec()
        }
    };
    check_hash(&bytes, &file.sha256, &file.path)?;
    Ok(bytes)
}

fn check_hash(bytes: &[u8], sha256: &str, name: &str) -> Result<()> {
    let found = format!("{:x}", Sha256::digest(bytes));
    ensure!(found.eq_ignore_ascii_case(sha256), "{name} has sha256 {found}, expected {sha256}");
    Ok(())
}

fn has_hash(path: &Path, sha256: &str) -> bool {
    sha256_of(path).is_ok_and(|found| found.eq_ignore_ascii_case(sha256))
}

/// Parts of the file of a folder (`model.bin.part1`, ...), in the order of the sources.
fn parts(entry: &ModelEntry, file: &SourceFile, folder: &Path) -> Vec<PathBuf> {
    let prefix = format!("{}.part", file.path);
    let names = entry.sources.iter().flat_map(|source| &source.files).map(SourceFile::name);
    names.filter(|name| name.starts_with(&prefix)).map(|name| folder.join(name)).collect()
}

/// Joins the parts of a file at `path`, and checks the result.
fn join(parts: &[PathBuf], path: &Path, file: &SourceFile) -> Result<()> {
    let mut joined = File::create(path)?;
    for part in parts {
        std::io::copy(&mut input::open(part)?, &mut joined)?;
    }
    ensure!(has_hash(path, &file.sha256), "the joined parts of {} have another sha256 than {}", file.path, file.sha256);
    Ok(())
}

/// Builds the file of a model from the files of a source.
fn build(entry: &ModelEntry, files: &[Vec<u8>]) -> Result<Vec<u8>> {
    let files: Vec<&[u8]> = files.iter().map(Vec::as_slice).collect();
    let bytes = match &entry.convert {
        Some(conversion) => {
            let [input] = entry.inputs.as_slice() else {
                bail!("a converted model must have 1 input, not {}", entry.inputs.len())
            };
            let named = || entry.outputs.iter().map(|port| port.name.clone()).collect();
            let outputs = if conversion.outputs.is_empty() { named() } else { conversion.outputs.clone() };
            convert(conversion.format, &files, &ConversionOptions { input: input.clone(), outputs })?
        }
        None => files.concat(),
    };
    check_hash(&bytes, &entry.sha256, &entry.file)?;
    Ok(bytes)
}

fn download(url: &str) -> Result<Vec<u8>> {
    let limits = ureq::Agent::config_builder()
        .timeout_connect(Some(Duration::from_secs(15)))
        .timeout_global(Some(Duration::from_secs(600)));
    let agent: ureq::Agent = limits.build().into();
    Ok(agent.get(url).call()?.body_mut().with_config().limit(MAX_BYTES).read_to_vec()?)
}

/// Writes the file to `path`, and its origin and licence to a text file next to it.
fn write(entry: &ModelEntry, path: &Path, obtained: Obtained) -> Result<FetchSource> {
    let Obtained { bytes, licence, source } = obtained;
    check_hash(&bytes, &entry.sha256, &entry.file)?;
    let text = licence.map(|text| format!("\n{}\n", text.trim_end())).unwrap_or_default();
    workdir::write_file(&path.with_extension("licence.txt"), (entry.terms() + &text).as_bytes())?;
    workdir::write_file(path, &bytes)?;
    Ok(source)
}
