//! The folder of models: what is there, getting what is missing, registering other models, checking all. Every file is
//! pinned by its SHA-256; a source with other bytes is refused.

use super::fetch::{FetchSource, Fetcher};
use super::{MANIFEST_FILE, Manifest, Model, ModelEntry, ModelError, ModelOrigin, ModelRole, Runtime, sha256_of};
use anyhow::{Context, Result, bail};
use orator_base::input;
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir;
use serde::Serialize;
use std::ffi::OsStr;
use std::fmt;
use std::path::{Path, PathBuf};

/// In the place of a model's id: the first of its role, in the order of the manifest, whose file is there.
pub const AUTO: &str = "auto";
/// Folder of downloads under way, inside the folder of models.
const DOWNLOADS: &str = ".downloads";

/// A folder of model files with the manifest that describes them.
#[derive(Clone, Debug)]
pub struct ModelStore {
    dir: PathBuf,
    manifest: Manifest,
}

/// Whether a model's file is there with the bytes of its description.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelState {
    /// There, with the pinned bytes.
    Present,
    /// There, with other bytes.
    #[serde(rename = "wrong hash")]
    WrongHash,
    /// Not there, or not readable.
    Missing,
}

/// A model to fetch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// The model of this id.
    Id(String),
    /// One of this role: the one that is there, else the first that can be had, in the order of the manifest.
    Role(ModelRole),
}

/// A model that was looked for.
#[derive(Debug)]
pub struct Fetched<'a> {
    /// The model.
    pub entry: &'a ModelEntry,
    /// Where it was had from, or why it could not be had.
    pub source: Result<FetchSource>,
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

impl ModelStore {
    /// Reads the manifest of the folder `dir`, which need not exist: the built-in models are known then. Errors: a
    /// manifest that is not sound.
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

    /// The models of those ids; all where none is named. Errors: an id the manifest does not have.
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

    /// Opens the file of a model: right bytes, right names and shapes. Errors: what is wrong with it.
    pub fn check(&self, runtime: &Runtime, entry: &ModelEntry) -> Result<Model, ModelError> {
        Model::open(runtime, entry, &self.dir)
    }

    /// The model of that id and role. `auto` is the first of the role, in the order of the manifest, whose file is
    /// there; where none is, the first. Errors: an id the manifest does not have, or of another role.
    pub fn choose(&self, id: &str, role: ModelRole) -> Result<&ModelEntry> {
        if id != AUTO {
            return self.manifest.get_as(id, role);
        }
        let mut of_role = self.of_role(role);
        let there = self.of_role(role).find(|entry| self.path(entry).is_file());
        there.or_else(|| of_role.next()).with_context(|| format!("the manifest has no {role:?} model"))
    }

    fn of_role(&self, role: ModelRole) -> impl Iterator<Item = &ModelEntry> {
        self.manifest.models.iter().filter(move |entry| entry.role == role)
    }

    /// Gets each model that is not there with the right bytes: from the folder `mirror`, whose files may have any name
    /// and may be what the model is made of, else from its sources. One that fails does not stop the others. Errors: a
    /// mirror that cannot be read, a folder that cannot be written, another fetch into the same folder.
    pub fn fetch(&self, wanted: &[Wanted], mirror: Option<&Path>, progress: &dyn Progress) -> Result<Vec<Fetched<'_>>> {
        self.with_downloads(|downloads| self.fetch_with(Fetcher::new(mirror, downloads)?, wanted, progress))
    }

    fn fetch_with(&self, mut fetcher: Fetcher, wanted: &[Wanted], progress: &dyn Progress) -> Result<Vec<Fetched<'_>>> {
        let task = progress.begin("models", wanted.len() as u64);
        let mut fetched = Vec::new();
        for one in wanted {
            let (known, candidates): (Vec<_>, Vec<_>) = match one {
                Wanted::Id(id) => (vec![self.manifest.get(id)?], vec![self.manifest.get(id)?]),
                Wanted::Role(role) => (self.of_role(*role).collect(), self.candidates(*role).collect()),
            };
            if let Some(entry) = known.into_iter().find(|entry| self.state(entry) == ModelState::Present) {
                fetched.push(Fetched { entry, source: Ok(FetchSource::Present) });
                continue;
            }
            for entry in candidates {
                task.detail(&entry.id);
                let source = fetcher.get(entry, &self.path(entry));
                let is_had = source.is_ok();
                fetched.push(Fetched { entry, source });
                if is_had {
                    break;
                }
            }
            task.advance(1);
        }
        Ok(fetched)
    }

    /// Puts the ONNX Runtime library of the manifest into the folder `lib` of the models, where `Runtime::load` finds
    /// it. A file of the mirror serves as well. Errors: no place that has it.
    pub fn fetch_runtime(&self, mirror: Option<&Path>, progress: &dyn Progress) -> Result<FetchSource> {
        let runtime = self.manifest.runtime.as_ref().context("the manifest names no ONNX Runtime")?;
        let _task = progress.begin("ONNX Runtime", 0);
        let path = self.dir.join("lib").join(&runtime.file);
        self.with_downloads(|downloads| Fetcher::new(mirror, downloads)?.get_file(runtime, &path))
    }

    /// Gets the word vectors of the manifest, and gives what `convert` makes of the file as it is published. Errors: no
    /// place that has it; an error of `convert`.
    pub fn fetch_words<T>(
        &self,
        mirror: Option<&Path>,
        progress: &dyn Progress,
        convert: impl FnOnce(&Path, &FetchSource) -> Result<T>,
    ) -> Result<T> {
        let words = self.manifest.words.as_ref().context("the manifest names no word vectors")?;
        let _task = progress.begin("word vectors", 0);
        self.with_downloads(|downloads| {
            let file = downloads.join(&words.file);
            let source = Fetcher::new(mirror, downloads)?.get_file(words, &file)?;
            convert(&file, &source)
        })
    }

    /// Removes the downloads of a fetch that was killed. Errors: they cannot be removed, or belong to a fetch under way.
    pub fn sweep(&self) -> Result<()> {
        if self.dir.join(DOWNLOADS).exists() { self.with_downloads(|_| Ok(())) } else { Ok(()) }
    }

    /// Runs `fetch` with an empty path for downloads, while no other fetch writes into the folder.
    fn with_downloads<T>(&self, fetch: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
        let _lock = workdir::lock(&self.dir)?;
        let downloads = self.dir.join(DOWNLOADS);
        // What lies there already could be read as configuration.
        workdir::remove(&downloads).with_context(|| format!("cannot remove {}", downloads.display()))?;
        let fetched = fetch(&downloads);
        let _ = std::fs::remove_dir_all(&downloads);
        fetched
    }

    /// What `fetch` may get for `wanted`: every model that is asked for by its id or is a candidate for a role, and is
    /// not there. Errors: an id the manifest does not have.
    pub fn missing(&self, wanted: &[Wanted]) -> Result<Vec<&ModelEntry>> {
        let is_there = |entry: &&ModelEntry| self.state(entry) == ModelState::Present;
        let mut missing = Vec::new();
        for one in wanted {
            match one {
                Wanted::Id(id) => missing.extend(Some(self.manifest.get(id)?).filter(|entry| !is_there(entry))),
                Wanted::Role(role) if self.of_role(*role).any(|entry| is_there(&entry)) => {}
                Wanted::Role(role) => missing.extend(self.candidates(*role)),
            }
        }
        Ok(missing)
    }

    /// Models of a role that can be had, the best first.
    pub fn candidates(&self, role: ModelRole) -> impl Iterator<Item = &ModelEntry> {
        self.of_role(role).filter(|entry| entry.is_served())
    }

    /// Registers the ONNX file `file`, which is fed and read like the model or layout `like`: copies it into the folder
    /// and writes its description into the folder's manifest. Without `id` it is called as its file. Errors: other
    /// inputs or outputs than `like` has, an id or a file name that is taken.
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
        let written = match input::read_text(&manifest, input::MOST_TEXT) {
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
            ModelState::Missing => workdir::replace(&path, |attempt| {
                std::io::copy(&mut input::open(file)?, &mut std::fs::File::create(attempt)?)?;
                Ok(())
            })?,
        }
        workdir::write_file(&manifest, text.as_bytes())?;
        self.manifest = Manifest::load(&self.dir)?;
        Ok(entry)
    }
}

/// The description of a new file that is fed and read like a known one.
fn described(file: &Path, like: &ModelEntry, id: Option<&str>, licence: &str) -> Result<ModelEntry> {
    let name = file.file_name().and_then(OsStr::to_str).with_context(|| format!("{} is no file", file.display()))?;
    let bytes = std::fs::metadata(file).with_context(|| format!("cannot read {}", file.display()))?.len();
    let stem = name.strip_suffix(".onnx").unwrap_or(name);
    Ok(ModelEntry {
        id: id.unwrap_or(stem).to_owned(),
        about: format!("Registered by hand, like {}.", like.id),
        file: name.to_owned(),
        sha256: sha256_of(file)?,
        bytes,
        url: None,
        sources: Vec::new(),
        convert: None,
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
