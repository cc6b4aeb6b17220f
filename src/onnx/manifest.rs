//! `manifest.toml`: the known models, built in and from the models folder. `entry` describes one model, `check`
//! validates descriptions, `model` opens the files.

use super::{ModelEntry, ModelRole, PinnedFile};
use anyhow::{Context, Result, ensure};
use orator_base::input;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// File name in the models folder.
pub const MANIFEST_FILE: &str = "manifest.toml";

const BUILTIN: &str = include_str!("../../models/manifest.toml");

/// All known models, in file order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    #[serde(default, rename = "model", skip_serializing_if = "Vec::is_empty")]
    pub models: Vec<ModelEntry>,
    /// The ONNX Runtime library, for machines without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub runtime: Option<PinnedFile>,
    /// Word vectors in their published form.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub words: Option<PinnedFile>,
    /// Descriptions without a file: templates for registering other models.
    #[serde(default, rename = "layout", skip_serializing_if = "Vec::is_empty")]
    pub layouts: Vec<ModelEntry>,
}

impl Manifest {
    pub fn builtin() -> Result<Self> {
        Self::parse(BUILTIN).context("built-in model manifest")
    }

    /// The built-in manifest, overridden by `manifest.toml` in `dir` if it exists.
    pub fn load(dir: &Path) -> Result<Self> {
        let mut manifest = Self::builtin()?;
        let path = dir.join(MANIFEST_FILE);
        match input::read_text(&path, input::MAX_TEXT) {
            Ok(text) => {
                let own = Self::parse(&text).with_context(|| path.display().to_string())?;
                manifest.runtime = own.runtime.or(manifest.runtime);
                manifest.words = own.words.or(manifest.words);
                own.models.into_iter().for_each(|entry| replace_or_push(&mut manifest.models, entry));
                own.layouts.into_iter().for_each(|entry| replace_or_push(&mut manifest.layouts, entry));
            }
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            Err(error) => return Err(error).with_context(|| format!("cannot read {}", path.display())),
        }
        Ok(manifest)
    }

    /// Parses a manifest and checks every entry.
    pub fn parse(text: &str) -> Result<Self> {
        let manifest: Self = toml::from_str(text).context("not a model manifest")?;
        for (idx, entry) in manifest.models.iter().enumerate() {
            entry.check_file().and_then(|()| entry.check()).with_context(|| format!("model {:?}", entry.id))?;
            let known = manifest.models[..idx].iter().any(|other| other.id == entry.id);
            ensure!(!known, "duplicate model id {:?}", entry.id);
        }
        manifest.runtime.iter().chain(&manifest.words).try_for_each(PinnedFile::check)?;
        for entry in &manifest.layouts {
            entry.check().with_context(|| format!("layout {:?}", entry.id))?;
        }
        Ok(manifest)
    }

    pub fn get(&self, id: &str) -> Result<&ModelEntry> {
        self.models.iter().find(|entry| entry.id == id).with_context(|| {
            let known: Vec<_> = self.models.iter().map(|entry| entry.id.as_str()).collect();
            format!("unknown model {id:?}: expected one of {}; `orator models add` registers others", known.join(", "))
        })
    }

    /// The layout or model with this id.
    pub fn like(&self, id: &str) -> Result<&ModelEntry> {
        self.layouts.iter().find(|entry| entry.id == id).map_or_else(|| self.get(id), Ok)
    }

    /// The model with this id, which must have this role.
    pub fn get_as(&self, id: &str, role: ModelRole) -> Result<&ModelEntry> {
        let entry = self.get(id)?;
        ensure!(entry.role == role, "the model {id:?} has the role {:?}, expected {role:?}", entry.role);
        Ok(entry)
    }
}

/// Replaces the entry with the same id, or appends `entry`.
fn replace_or_push(entries: &mut Vec<ModelEntry>, entry: ModelEntry) {
    match entries.iter_mut().find(|known| known.id == entry.id) {
        Some(known) => *known = entry,
        None => entries.push(entry),
    }
}
