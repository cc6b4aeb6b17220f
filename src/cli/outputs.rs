//! The files that verbs of motion write.

use anyhow::{Result, bail, ensure};
use orator_avatar::animate::export::file::ExportFormat;
use orator_formats::joints_description as description;
use std::path::{Path, PathBuf};

/// Files to write, with their formats.
pub type OutputFiles = Vec<(PathBuf, ExportFormat)>;

/// The formats of the files `out`, of which none may be asked for twice, a folder, or what the verb reads (`is_read`,
/// called `input` in the error); `hint` ends the error on a folder.
pub fn outputs(out: &[PathBuf], is_read: impl Fn(&Path) -> bool, input: &str, hint: &str) -> Result<OutputFiles> {
    for (n, path) in out.iter().enumerate() {
        ensure!(!is_read(path), "{} is {input}; write to another file", path.display());
        ensure!(!out[..n].contains(path), "{} is asked for twice", path.display());
        let joints =
            out.iter().find(|joints| description::is_description(path) && description::path_of(joints) == **path);
        if let Some(joints) = joints {
            bail!("{} is where the rate of {} is written; write to another file", path.display(), joints.display());
        }
        ensure!(!path.is_dir(), "{} is a folder; name a file in it{hint}", path.display());
    }
    out.iter().map(|path| Ok((path.clone(), ExportFormat::from_path(path)?))).collect()
}

/// A file's name for a take: `motion.bvh` becomes `motion-2.bvh`.
pub fn of_take(path: &Path, take: usize) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_os_string();
    name.push(format!("-{take}"));
    if let Some(ending) = path.extension() {
        name.push(".");
        name.push(ending);
    }
    path.with_file_name(name)
}

/// Whether two paths lead to one file.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    a == b || a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b))
}

/// The files' names.
pub fn names(outputs: &OutputFiles) -> Vec<String> {
    outputs.iter().map(|(path, _)| path.display().to_string()).collect()
}

/// The file to write next: the first as a film, or for an animation program; none when both are there.
pub fn next_output(outputs: &OutputFiles) -> Option<PathBuf> {
    let kinds = [(ExportFormat::Mp4, "mp4"), (ExportFormat::Bvh, "bvh")];
    let missing = kinds.into_iter().find(|&(format, _)| outputs.iter().all(|&(_, written)| written != format));
    Some(outputs.first()?.0.with_extension(missing?.1))
}
