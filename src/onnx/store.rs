//! The models folder: listing, fetching, registering and checking models. Every file is pinned by its SHA-256; a
//! source with other bytes is rejected.

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

/// Value instead of a model id that selects the first model of its role, in manifest order, whose file exists.
pub const AUTO: &str = "auto";
/// Folder for downloads in progress, inside the models folder.
const DOWNLOADS: &str = ".downloads";

/// A folder of model files with their manifest.
#[derive(Clone, Debug)]
pub struct ModelStore {
    dir: PathBuf,
    manifest: Manifest,
}

/// State of a model's file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelState {
    /// Present, with the pinned hash.
    Present,
    /// Present, with another hash.
    #[serde(rename = "hash mismatch")]
    HashMismatch,
    /// Missing or unreadable.
    Missing,
}

/// A model to fetch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ModelRequest {
    /// The model with this id.
    Id(String),
    /// One model of this role: one that is present, or else the first that can be downloaded, in manifest order.
    Role(ModelRole),
}

/// Result of fetching a model.
#[derive(Debug)]
pub struct Fetched<'a> {
    /// The model.
    pub entry: &'a ModelEntry,
    /// The source it was fetched from, or why it could not be fetched.
    pub source: Result<FetchSource>,
}

impl fmt::Display for ModelState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Present => "present",
            Self::HashMismatch => "hash mismatch",
            Self::Missing => "missing",
        })
    }
}

impl ModelStore {
    /// Reads the manifest of the folder `dir`; without it, only the built-in models are known.
    ///
    /// # Errors
    ///
    /// The manifest is invalid.
    pub fn open(dir: &Path) -> Result<Self> {
        let dir = std::path::absolute(dir)?;
        Ok(Self { manifest: Manifest::load(&dir)?, dir })
    }

    /// Absolute path of the folder.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// All known models.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The models with these ids, or all models if `ids` is empty.
    ///
    /// # Errors
    ///
    /// An id that is not in the manifest.
    pub fn entries(&self, ids: &[String]) -> Result<Vec<&ModelEntry>> {
        if ids.is_empty() {
            return Ok(self.manifest.models.iter().collect());
        }
        ids.iter().map(|id| self.manifest.get(id)).collect()
    }

    /// State of the file of a model by its hash; names and shapes are not checked.
    pub fn state(&self, entry: &ModelEntry) -> ModelState {
        if !entry.files.is_empty() {
            return match self.check_folder(entry) {
                Ok(()) => ModelState::Present,
                Err(ModelError::HashMismatch { .. }) => ModelState::HashMismatch,
                Err(_) => ModelState::Missing,
            };
        }
        match sha256_of(&self.path(entry)) {
            Ok(found) if found.eq_ignore_ascii_case(&entry.sha256) => ModelState::Present,
            Ok(_) => ModelState::HashMismatch,
            Err(_) => ModelState::Missing,
        }
    }

    /// Path of the file of a model, which may be missing.
    pub fn path(&self, entry: &ModelEntry) -> PathBuf {
        self.dir.join(&entry.file)
    }

    /// Opens the file of a model after checking its hash, names and shapes.
    pub fn check(&self, runtime: &Runtime, entry: &ModelEntry) -> Result<Model, ModelError> {
        Model::open(runtime, entry, &self.dir)
    }

    /// Checks the hashes of the files of a model that is a folder.
    pub fn check_folder(&self, entry: &ModelEntry) -> Result<(), ModelError> {
        for file in &entry.files {
            let (id, path) = (entry.id.clone(), self.path(entry).join(&file.path));
            match sha256_of(&path) {
                Ok(found) if found.eq_ignore_ascii_case(&file.sha256) => {}
                Ok(found) => {
                    return Err(ModelError::HashMismatch { id, path, expected: file.sha256.clone(), found });
                }
                Err(_) if !path.exists() => return Err(ModelError::Missing { id, path }),
                Err(error) => return Err(ModelError::Unreadable { id, path, error: format!("{error:#}") }),
            }
        }
        Ok(())
    }

    /// Folder of the speech recogniser `id`: a model of the manifest, or else a folder with a Whisper network, in the
    /// models folder or by its path, which is not checked.
    ///
    /// # Errors
    ///
    /// It is missing, or its files differ from the manifest (`ModelError`); the message names the command that fetches
    /// it.
    pub fn recogniser(&self, id: &str) -> Result<PathBuf> {
        let known = || self.with_role(ModelRole::Recogniser);
        let Some(entry) = known().find(|entry| entry.id == id) else {
            let own = [self.dir.join(id), PathBuf::from(id)].into_iter().find(|folder| folder.is_dir());
            let ids: Vec<&str> = known().map(|entry| entry.id.as_str()).collect();
            return own.with_context(|| {
                format!(
                    "no speech recogniser {id:?}: expected {}, or a folder with a Whisper network, by its path or in {}",
                    ids.join(", "),
                    self.dir.display()
                )
            });
        };
        let fetch = || format!("speech recognition needs a model: fetch it with `orator models fetch {}`", entry.id);
        self.check_folder(entry).with_context(fetch)?;
        Ok(self.path(entry))
    }

    /// The model with this id and role. `auto` selects the first model of the role, in manifest order, whose file
    /// exists, or else the first.
    ///
    /// # Errors
    ///
    /// The id is not in the manifest or has another role.
    pub fn choose(&self, id: &str, role: ModelRole) -> Result<&ModelEntry> {
        if id != AUTO {
            return self.manifest.get_as(id, role);
        }
        let mut with_role = self.with_role(role);
        let present = self.with_role(role).find(|entry| self.path(entry).is_file());
        present
            .or_else(|| with_role.next())
            .with_context(|| format!("the manifest has no model with the role {role:?}"))
    }

    fn with_role(&self, role: ModelRole) -> impl Iterator<Item = &ModelEntry> {
        self.manifest.models.iter().filter(move |entry| entry.role == role)
    }

    /// Fetches each model that is not present with the pinned hash: from the folder `mirror`, whose files may have
    /// any name and may be inputs of a conversion, or else from its sources. A failure does not stop the other
    /// models.
    ///
    /// # Errors
    ///
    /// The mirror cannot be read, the folder cannot be written, or another fetch is using it.
    pub fn fetch(
        &self,
        requests: &[ModelRequest],
        mirror: Option<&Path>,
        progress: &dyn Progress,
    ) -> Result<Vec<Fetched<'_>>> {
        self.with_downloads(|downloads| self.fetch_with(Fetcher::new(mirror, downloads)?, requests, progress))
    }

    fn fetch_with(
        &self,
        mut fetcher: Fetcher,
        requests: &[ModelRequest],
        progress: &dyn Progress,
    ) -> Result<Vec<Fetched<'_>>> {
        let task = progress.begin("models", requests.len() as u64);
        let mut fetched = Vec::new();
        for one in requests {
            let (known, candidates): (Vec<_>, Vec<_>) = match one {
                ModelRequest::Id(id) => (vec![self.manifest.get(id)?], vec![self.manifest.get(id)?]),
                ModelRequest::Role(role) => (self.with_role(*role).collect(), self.candidates(*role).collect()),
            };
            if let Some(entry) = known.into_iter().find(|entry| self.state(entry) == ModelState::Present) {
                fetched.push(Fetched { entry, source: Ok(FetchSource::Present) });
                continue;
            }
            for entry in candidates {
                task.detail(&entry.id);
                let source = fetcher.get(entry, &self.path(entry));
                let is_fetched = source.is_ok();
                fetched.push(Fetched { entry, source });
                if is_fetched {
                    break;
                }
            }
            task.advance(1);
        }
        Ok(fetched)
    }

    /// Fetches the ONNX Runtime library of the manifest into the folder `lib` of the models, where `Runtime::load`
    /// finds it, from the mirror or its sources.
    ///
    /// # Errors
    ///
    /// No source has it.
    pub fn fetch_runtime(&self, mirror: Option<&Path>, progress: &dyn Progress) -> Result<FetchSource> {
        let runtime = self.manifest.runtime.as_ref().context("the manifest has no entry for ONNX Runtime")?;
        let _task = progress.begin("ONNX Runtime", 0);
        let path = self.dir.join("lib").join(&runtime.file);
        self.with_downloads(|downloads| Fetcher::new(mirror, downloads)?.get_file(runtime, &path))
    }

    /// Fetches the published word vectors of the manifest and returns the result of `convert` for that file.
    ///
    /// # Errors
    ///
    /// No source has it, or `convert` fails.
    pub fn fetch_words<T>(
        &self,
        mirror: Option<&Path>,
        progress: &dyn Progress,
        convert: impl FnOnce(&Path, &FetchSource) -> Result<T>,
    ) -> Result<T> {
        let words = self.manifest.words.as_ref().context("the manifest has no entry for word vectors")?;
        let _task = progress.begin("word vectors", 0);
        self.with_downloads(|downloads| {
            let file = downloads.join(&words.file);
            let source = Fetcher::new(mirror, downloads)?.get_file(words, &file)?;
            convert(&file, &source)
        })
    }

    /// Removes downloads left by a fetch that was killed.
    ///
    /// # Errors
    ///
    /// They cannot be removed, or belong to a running fetch.
    pub fn sweep(&self) -> Result<()> {
        if self.dir.join(DOWNLOADS).exists() { self.with_downloads(|_| Ok(())) } else { Ok(()) }
    }

    /// Runs `fetch` with an unused path for downloads, under a lock against other fetches into the folder.
    fn with_downloads<T>(&self, fetch: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
        let _lock = workdir::lock(&self.dir)?;
        let downloads = self.dir.join(DOWNLOADS);
        // Files left there could be read as configuration.
        workdir::remove(&downloads).with_context(|| format!("cannot remove {}", downloads.display()))?;
        let fetched = fetch(&downloads);
        let _ = std::fs::remove_dir_all(&downloads);
        fetched
    }

    /// Models that `fetch` may download for `requests`: each missing model that is named by id, and all candidates of a
    /// role without a present model.
    ///
    /// # Errors
    ///
    /// An id that is not in the manifest.
    pub fn missing(&self, requests: &[ModelRequest]) -> Result<Vec<&ModelEntry>> {
        let is_present = |entry: &&ModelEntry| self.state(entry) == ModelState::Present;
        let mut missing = Vec::new();
        for one in requests {
            match one {
                ModelRequest::Id(id) => missing.extend(Some(self.manifest.get(id)?).filter(|entry| !is_present(entry))),
                ModelRequest::Role(role) if self.with_role(*role).any(|entry| is_present(&entry)) => {}
                ModelRequest::Role(role) => missing.extend(self.candidates(*role)),
            }
        }
        Ok(missing)
    }

    /// Models of a role that can be downloaded, best first.
    pub fn candidates(&self, role: ModelRole) -> impl Iterator<Item = &ModelEntry> {
        self.with_role(role).filter(|entry| entry.is_served())
    }

    /// Registers the ONNX file `file`, with the preprocessing and decoding of the model or layout `like`: copies it
    /// into the folder and adds its description to the folder's manifest. The default `id` is the file name without
    /// `.onnx`.
    ///
    /// # Errors
    ///
    /// The inputs or outputs differ from those of `like`, or the id or file name is taken.
    pub fn add(
        &mut self,
        runtime: &Runtime,
        file: &Path,
        like: &str,
        id: Option<&str>,
        licence: &str,
    ) -> Result<ModelEntry> {
        let entry = describe_like(file, self.manifest.like(like)?, id, licence)?;
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Model::open(runtime, &entry, folder).with_context(|| format!("{} does not match {like:?}", file.display()))?;
        let manifest = self.dir.join(MANIFEST_FILE);
        let written = match input::read_text(&manifest, input::MAX_TEXT) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(error).with_context(|| format!("cannot read {}", manifest.display())),
        };
        let own = Manifest { models: vec![entry.clone()], ..Manifest::default() };
        let text = format!("{}\n{}", written.trim_end(), toml::to_string(&own)?).trim_start().to_owned();
        Manifest::parse(&text)
            .with_context(|| format!("cannot add it to {}; choose another id with --id", manifest.display()))?;
        let path = self.path(&entry);
        match self.state(&entry) {
            ModelState::Present => {}
            ModelState::HashMismatch => {
                bail!("{} already exists with different content: rename one of the two files", path.display())
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

/// Description of a new file with the preprocessing and decoding of a known model.
fn describe_like(file: &Path, like: &ModelEntry, id: Option<&str>, licence: &str) -> Result<ModelEntry> {
    let name =
        file.file_name().and_then(OsStr::to_str).with_context(|| format!("invalid file name {}", file.display()))?;
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
