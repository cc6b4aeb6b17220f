//! The folder of models: what is there, getting what is missing, registering other models, checking all. Every file is
//! pinned by its SHA-256; a server or mirror with other bytes is refused.

use super::{MANIFEST_FILE, Manifest, Model, ModelEntry, ModelError, ModelOrigin, Runtime, sha256_of};
use crate::stage::progress::Progress;
use crate::stage::workdir;
use anyhow::{Context, Result, bail, ensure};
use serde::Serialize;
use std::fmt;
use std::path::{Path, PathBuf};

/// Most bytes of a model file, 1 GiB.
const MAX_BYTES: u64 = 1 << 30;

/// A folder of model files with the manifest that describes them.
#[derive(Clone, Debug)]
pub struct ModelStore {
    dir: PathBuf,
    manifest: Manifest,
}

/// Whether a model's file is there with the bytes of its description.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum ModelState {
    /// There, with the pinned bytes.
    #[serde(rename = "present")]
    Present,
    /// There, with other bytes.
    #[serde(rename = "wrong hash")]
    WrongHash,
    /// Not there, or not readable.
    #[serde(rename = "missing")]
    Missing,
}

/// Where `ModelStore::fetch` had a file from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FetchSource {
    /// The folder of models had it.
    Present,
    /// A file of the mirror.
    Mirror(PathBuf),
    /// The address of the manifest.
    Url(String),
}

impl fmt::Display for ModelState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Present => "present",
            Self::WrongHash => "wrong hash",
            Self::Missing => "missing",
        })
    }
}

impl fmt::Display for FetchSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Present => write!(f, "there already"),
            Self::Mirror(path) => write!(f, "copied from {}", path.display()),
            Self::Url(url) => write!(f, "downloaded from {url}"),
        }
    }
}

impl ModelStore {
    /// Reads the manifest of the folder `dir`, which need not exist: the built-in models are known then.
    ///
    /// # Errors
    /// A manifest that is not sound.
    pub fn open(dir: &Path) -> Result<Self> {
        let dir = std::path::absolute(dir)?;
        Ok(Self { manifest: Manifest::load(&dir)?, dir })
    }

    /// The folder, absolute.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// All models known.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The models of those ids; all where none is named.
    ///
    /// # Errors
    /// An id the manifest does not have.
    pub fn entries(&self, ids: &[String]) -> Result<Vec<&ModelEntry>> {
        if ids.is_empty() {
            return Ok(self.manifest.models.iter().collect());
        }
        ids.iter().map(|id| self.manifest.get(id)).collect()
    }

    /// Whether the file of a model is there with the right bytes; its names and shapes are not looked at.
    pub fn state(&self, entry: &ModelEntry) -> ModelState {
        match sha256_of(&self.path(entry)) {
            Ok(found) if found.eq_ignore_ascii_case(&entry.sha256) => ModelState::Present,
            Ok(_) => ModelState::WrongHash,
            Err(_) => ModelState::Missing,
        }
    }

    /// The file of a model, whether it is there or not.
    pub fn path(&self, entry: &ModelEntry) -> PathBuf {
        self.dir.join(&entry.file)
    }

    /// Opens the file of a model: right bytes, right names and shapes.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn check(&self, runtime: &Runtime, entry: &ModelEntry) -> Result<Model, ModelError> {
        Model::open(runtime, entry, &self.dir)
    }

    /// Gets each model that is not there with the right bytes: from the folder `mirror`, whose files may have any name,
    /// else from its address. The answers stand in the order of `entries`; one that fails does not stop the others.
    ///
    /// # Errors
    /// A mirror that cannot be read.
    pub fn fetch(
        &self,
        entries: &[&ModelEntry],
        mirror: Option<&Path>,
        progress: &dyn Progress,
    ) -> Result<Vec<Result<FetchSource>>> {
        let offered = mirror.map(offered).transpose()?.unwrap_or_default();
        let task = progress.begin("models", entries.len() as u64);
        let fetched = entries.iter().map(|entry| {
            task.detail(&entry.id);
            let source = match self.state(entry) {
                ModelState::Present => Ok(FetchSource::Present),
                _ => get(entry, &self.path(entry), &offered),
            };
            task.advance(1);
            source
        });
        Ok(fetched.collect())
    }

    /// Registers the ONNX file `file`, which is fed and read like the model or layout `like`: copies it into the folder
    /// and writes its description into the folder's manifest. Without `id` it is called as its file.
    ///
    /// # Errors
    /// Other inputs or outputs than `like` has, an id or a file name that is taken.
    pub fn add(
        &mut self,
        runtime: &Runtime,
        file: &Path,
        like: &str,
        id: Option<&str>,
        licence: &str,
    ) -> Result<ModelEntry> {
        let entry = described(file, self.manifest.like(like)?, id, licence)?;
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Model::open(runtime, &entry, folder).with_context(|| format!("{} is not like that", file.display()))?;
        let manifest = self.dir.join(MANIFEST_FILE);
        let written = match std::fs::read_to_string(&manifest) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(error).with_context(|| format!("cannot read {}", manifest.display())),
        };
        let own = Manifest { models: vec![entry.clone()], ..Manifest::default() };
        let text = format!("{}\n{}", written.trim_end(), toml::to_string(&own)?).trim_start().to_owned();
        Manifest::parse(&text).with_context(|| format!("{} cannot hold it; another id: --id", manifest.display()))?;
        let path = self.path(&entry);
        match self.state(&entry) {
            ModelState::Present => {}
            ModelState::WrongHash => {
                bail!("{} is there already with other bytes: rename one of the two", path.display())
            }
            ModelState::Missing => copy(file, &path)?,
        }
        workdir::write_file(&manifest, text.as_bytes())?;
        self.manifest = Manifest::load(&self.dir)?;
        Ok(entry)
    }
}

/// Hash and path of every file of a folder that may be a model.
fn offered(mirror: &Path) -> Result<Vec<(String, PathBuf)>> {
    let cannot = || format!("cannot read the folder {}", mirror.display());
    let mut offered = Vec::new();
    for file in std::fs::read_dir(mirror).with_context(cannot)? {
        let file = file.with_context(cannot)?;
        if file.metadata().is_ok_and(|meta| meta.is_file() && meta.len() <= MAX_BYTES) {
            offered.push((sha256_of(&file.path())?, file.path()));
        }
    }
    offered.sort();
    Ok(offered)
}

/// Writes a model's file to `path`, from the mirror or its address.
fn get(entry: &ModelEntry, path: &Path, offered: &[(String, PathBuf)]) -> Result<FetchSource> {
    if let Some((_, found)) = offered.iter().find(|(hash, _)| hash.eq_ignore_ascii_case(&entry.sha256)) {
        copy(found, path)?;
        return Ok(FetchSource::Mirror(found.clone()));
    }
    let Some(url) = &entry.url else {
        let steps = entry.conversion.as_deref().unwrap_or("no conversion is written down");
        bail!(
            "no address serves these bytes. They were made from {} @ {} : {} by: {steps}. A folder that has the file \
             (sha256 {}): --mirror DIR",
            entry.origin.repository,
            entry.origin.commit,
            entry.origin.path,
            entry.sha256
        )
    };
    let download =
        || -> Result<Vec<u8>> { Ok(ureq::get(url).call()?.body_mut().with_config().limit(MAX_BYTES).read_to_vec()?) };
    let bytes = download().with_context(|| format!("cannot download {url}"))?;
    workdir::replace(path, |attempt| {
        std::fs::write(attempt, &bytes)?;
        let found = sha256_of(attempt)?;
        ensure!(found.eq_ignore_ascii_case(&entry.sha256), "{url} serves sha256 {found}, expected {}", entry.sha256);
        Ok(())
    })?;
    Ok(FetchSource::Url(url.clone()))
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    workdir::replace(to, |attempt| {
        std::io::copy(&mut std::fs::File::open(from)?, &mut std::fs::File::create(attempt)?)?;
        Ok(())
    })
}

/// The description of a new file that is fed and read like a known one.
fn described(file: &Path, like: &ModelEntry, id: Option<&str>, licence: &str) -> Result<ModelEntry> {
    let name =
        file.file_name().and_then(|name| name.to_str()).with_context(|| format!("{} is no file", file.display()))?;
    let bytes = std::fs::metadata(file).with_context(|| format!("cannot read {}", file.display()))?.len();
    let stem = name.strip_suffix(".onnx").unwrap_or(name);
    Ok(ModelEntry {
        id: id.unwrap_or(stem).to_owned(),
        about: format!("Registered by hand, like {}.", like.id),
        file: name.to_owned(),
        sha256: sha256_of(file)?,
        bytes,
        url: None,
        conversion: Some("none: registered as it was".to_owned()),
        origin: ModelOrigin {
            repository: "registered by hand".to_owned(),
            commit: "none".to_owned(),
            path: name.to_owned(),
            licence: licence.to_owned(),
            note: String::new(),
        },
        ..like.clone()
    })
}
