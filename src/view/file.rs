//! A single file shown by the viewer: GLB and VRM as they are, other motion converted to the program's avatar.

use anyhow::{Context, Result, ensure};
use orator_dataset::config::patterns::SOUND_EXTENSIONS;
use orator_formats::mocap::motion_file;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

pub struct ViewedFile {
    name: String,
    /// File that the page loads.
    pub path: PathBuf,
    /// Sound of the same name in the same folder.
    pub sound: Option<PathBuf>,
    /// Folder of a converted file, removed when the server ends.
    _folder: Option<TempDir>,
}

impl ViewedFile {
    /// Opens `path`; `program` is this program, which converts motion in a restricted process.
    ///
    /// # Errors
    /// The file does not exist, is no motion or avatar, or cannot be converted.
    pub fn open(path: &Path, program: &Path) -> Result<Self> {
        ensure!(path.is_file(), "{} is not a file", path.display());
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let has = |path: &Path, ending: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
        let stem = motion_file::stem(path).to_string_lossy();
        let sounds = SOUND_EXTENSIONS.iter().map(|ending| path.with_file_name(format!("{stem}.{ending}")));
        let sound = sounds.into_iter().find(|sound| sound.is_file());
        if has(path, "glb") || has(path, "vrm") {
            return Ok(Self { name, path: path.to_owned(), sound, _folder: None });
        }
        ensure!(
            motion_file::has_ending(path),
            "{name}: expected .glb, .vrm, .bvh, .npz, .npy or .txt; convert other files with `orator animate`"
        );
        let folder = tempfile::tempdir().context("cannot create a temporary folder")?;
        let converted = folder.path().join("motion.glb");
        let mut command = Command::new(program);
        let output = command.arg("animate").arg(path).arg("--out").arg(&converted).output();
        let output = output.context("cannot start `orator animate`")?;
        let text = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "cannot show {name}: {}", text.trim());
        Ok(Self { name, path: converted, sound, _folder: Some(folder) })
    }

    pub fn facts(&self) -> Value {
        let is_vrm = self.path.extension().is_some_and(|own| own.eq_ignore_ascii_case("vrm"));
        json!({ "name": self.name, "kind": if is_vrm { "vrm" } else { "glb" }, "audio": self.sound.is_some() })
    }
}
