//! Tar files of motion, as those of Seamless Interaction: WebDataset members `KEY.npz`, `KEY.wav`, `KEY.json` and
//! `KEY.mp4`. All but the videos are unpacked for the duration of the import and found as the files of a folder are.

use super::find::{self, ImportSources, TakeFiles};
use crate::config::patterns::SOUND_EXTENSIONS;
use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_formats::mocap::captured::MotionKind;
use orator_formats::transcript;
use std::fs::{self, File};
use std::io;
use std::path::Path;

/// Replaces the tar files of `sources` that hold `.npz` files by the takes in them, unpacked into folders below `into`.
/// The other tar files stay, unless `only` excludes them.
///
/// # Errors
/// Folders that cannot be listed. A tar file that cannot be unpacked becomes an unknown file, with the error.
pub fn unpack_motion(sources: &mut ImportSources, only: Option<MotionKind>, into: &Path) -> Result<()> {
    for (tar, n) in std::mem::take(&mut sources.tars).into_iter().zip(0..) {
        let folder = into.join(format!("{n}"));
        match unpack(&tar, &folder) {
            Ok(0) => sources.tars.extend((only != Some(MotionKind::Smplx)).then_some(tar)),
            Ok(_) => {
                let found = find::find(&[folder], None)?;
                let origin = |file: &Path| Some(tar.join(file.file_name().unwrap_or_default()));
                let takes = found.takes.into_iter().filter(|take| only.is_none_or(|only| only == take.kind));
                sources.takes.extend(takes.map(|take| TakeFiles { origin: origin(&take.motion), ..take }));
                sources.unknown.extend(found.unknown.into_iter().filter_map(|(file, why)| Some((origin(&file)?, why))));
            }
            Err(error) => sources.unknown.push((tar, format!("{error:#}"))),
        }
    }
    Ok(())
}

/// Unpacks motion, sounds and transcripts into `folder`, and returns the number of `.npz` files. Without any, nothing
/// is written.
fn unpack(tar: &Path, folder: &Path) -> Result<usize> {
    let reading = || format!("cannot read {} as a tar file", tar.display());
    let is = |name: &str, endings: &[&str]| {
        endings.iter().any(|ending| name.to_ascii_lowercase().ends_with(&format!(".{ending}")))
    };
    let mut n_motions = 0;
    let mut archive = tar::Archive::new(input::open(tar).with_context(reading)?);
    for entry in archive.entries_with_seek().with_context(reading)? {
        n_motions += usize::from(is(&crate::file_name(&entry.with_context(reading)?.path()?), &["npz"]));
    }
    if n_motions == 0 {
        return Ok(0);
    }
    fs::create_dir_all(folder)?;
    let mut archive = tar::Archive::new(input::open(tar).with_context(reading)?);
    for entry in archive.entries_with_seek().with_context(reading)? {
        let mut entry = entry.with_context(reading)?;
        let name = crate::file_name(&entry.path()?);
        let is_wanted = is(&name, &["npz"]) || is(&name, &SOUND_EXTENSIONS) || is(&name, &transcript::ENDINGS);
        if !entry.header().entry_type().is_file() || !is_wanted {
            continue;
        }
        let path = folder.join(&name);
        ensure!(!path.exists(), "{}: it contains two files named {name}", tar.display());
        let n_bytes =
            io::copy(&mut entry, &mut File::create_new(&path)?).with_context(|| format!("cannot unpack {name}"))?;
        ensure!(n_bytes == entry.size(), "{}: {name} is truncated", reading());
    }
    Ok(n_motions)
}
