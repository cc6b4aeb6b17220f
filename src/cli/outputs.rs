//! The output files of verbs that write motion.

use anyhow::{Result, bail, ensure};
use orator_avatar::animate::export::file::ExportFormat;
use orator_formats::joints_description as description;
use orator_formats::mocap::motion_file;
use std::path::{Path, PathBuf};

/// Files to write, with their formats.
pub type OutputFiles = Vec<(PathBuf, ExportFormat)>;

/// Formats of the output files `out`. `input` names the files for which `is_read` holds; `hint` is appended to the
/// error about a folder.
///
/// # Errors
/// A file is listed twice, is a folder, is one that the verb reads, or has an unknown extension.
pub fn outputs(out: &[PathBuf], is_read: impl Fn(&Path) -> bool, input: &str, hint: &str) -> Result<OutputFiles> {
    for (n, path) in out.iter().enumerate() {
        ensure!(!is_read(path), "output {} is {input}; choose another path", path.display());
        ensure!(!out[..n].contains(path), "output {} is listed twice", path.display());
        let joints =
            out.iter().find(|joints| description::is_description(path) && description::path_of(joints) == **path);
        if let Some(joints) = joints {
            bail!(
                "output {} is reserved for the frame rate of {}; choose another path",
                path.display(),
                joints.display()
            );
        }
        ensure!(!path.is_dir(), "output {} is a folder, expected a file{hint}", path.display());
    }
    out.iter().map(|path| Ok((path.clone(), ExportFormat::from_path(path)?))).collect()
}

/// File name of a variant: `motion.bvh` becomes `motion-2.bvh`.
pub fn variant_path(path: &Path, variant: usize) -> PathBuf {
    let mut name = motion_file::stem(path).to_os_string();
    name.push(format!("-{variant}"));
    if motion_file::is_smplx_name(path) {
        name.push(".smplx");
    }
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// Whether two paths refer to the same file.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    a == b || a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b))
}

/// Paths of the files, for display.
pub fn names(outputs: &OutputFiles) -> Vec<String> {
    outputs.iter().map(|(path, _)| path.display().to_string()).collect()
}

/// The file to suggest next: first a film, then a file for an animation program; `None` if both were written or are
/// files that the verb reads.
pub fn next_output(outputs: &OutputFiles, is_read: impl Fn(&Path) -> bool) -> Option<PathBuf> {
    let first = &outputs.first()?.0;
    let stem = motion_file::stem(first).to_string_lossy();
    let kinds = [(ExportFormat::Mp4, "mp4"), (ExportFormat::Bvh, "bvh")].into_iter();
    let missing = kinds.filter(|&(format, _)| outputs.iter().all(|&(_, written)| written != format));
    missing.map(|(_, ending)| first.with_file_name(format!("{stem}.{ending}"))).find(|path| !is_read(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_is_not_suggested_as_output() {
        let outputs = vec![(PathBuf::from("a.glb"), ExportFormat::from_path(Path::new("a.glb")).unwrap())];
        let next = |read: &[&str]| next_output(&outputs, |path| read.iter().any(|one| Path::new(one) == path));
        assert_eq!(next(&["a.npy"]), Some("a.mp4".into()));
        assert_eq!(next(&["a.mp4"]), Some("a.bvh".into()));
        assert_eq!(next(&["a.bvh", "a.mp4"]), None);
        assert_eq!(variant_path(Path::new("d/a.smplx.npz"), 2), Path::new("d/a-2.smplx.npz"));
        assert_eq!(variant_path(Path::new("d/a.b.npz"), 2), Path::new("d/a.b-2.npz"));
    }
}
