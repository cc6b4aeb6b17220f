//! Search for motion files below the import sources. Files are classified by extension and content; each is matched
//! with the sound and transcript of the same name in its own folder or in a sibling folder (`bvh/`, `wav/`, `tsv/`).

use super::genea::{self, GeneaFolders, GeneaTake};
use crate::INFO;
use crate::config::patterns::SOUND_EXTENSIONS;
use crate::write::entry;
use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_formats::joints_description::path_of;
use orator_formats::mocap::captured::MotionKind;
use orator_formats::mocap::motion_file::stem;
use orator_formats::mocap::smplx::motion::is_smplx;
use orator_formats::npz::Npz;
use orator_formats::search::NamedFiles;
use orator_formats::{search, transcript};
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// Motion file with its sound, and the files that may be its transcript.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TakeFiles {
    pub kind: MotionKind,
    pub motion: PathBuf,
    pub sound: Option<PathBuf>,
    /// In order of preference.
    pub transcripts: Vec<PathBuf>,
    /// Data of a take in the folders of a GENEA challenge.
    pub genea: Option<GeneaTake>,
    /// Tar file and member that `motion` was unpacked from.
    pub origin: Option<PathBuf>,
}

impl TakeFiles {
    /// Motion, sound, transcripts and the interlocutor's sound.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        let interlocutor = self.genea.as_ref().and_then(|genea| genea.interlocutor.as_ref());
        std::iter::once(&self.motion).chain(&self.sound).chain(&self.transcripts).chain(interlocutor)
    }
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImportSources {
    /// Takes in the order of their paths.
    pub takes: Vec<TakeFiles>,
    /// Folders of orator datasets.
    pub datasets: Vec<PathBuf>,
    /// Tar files outside dataset folders.
    pub tars: Vec<PathBuf>,
    /// Files that look like motion but cannot be imported, with the reason.
    pub unknown: Vec<(PathBuf, String)>,
    /// Files that are neither motion nor belong to motion.
    pub passed_over: Vec<PathBuf>,
    /// Notes on the folders of GENEA challenges, a sentence each.
    pub notes: Vec<String>,
}

/// Names of sibling folders that hold sounds or transcripts, in lower case.
const SOUND_FOLDERS: &str = "wav wavs audio audios sound speech";
const TRANSCRIPT_FOLDERS: &str = "ctm tsv transcript transcripts text texts txt json words textgrid srt vtt subtitles";

/// Searches `sources` (files or folders); with `only`, files of other kinds are ignored.
///
/// # Errors
/// A source that does not exist, sources without any motion, or an invalid table of a GENEA challenge.
pub fn find(sources: &[PathBuf], only: Option<MotionKind>) -> Result<ImportSources> {
    let (mut files, mut found) = (Vec::new(), ImportSources::default());
    for source in sources {
        ensure!(source.exists(), "{} does not exist", source.display());
        walk(source, &mut files, &mut found.datasets).with_context(|| format!("cannot list {}", source.display()))?;
    }
    files.sort();
    files.dedup();
    found.datasets.sort();
    found.datasets.dedup();
    if only.is_some_and(|only| only != MotionKind::Shards) {
        found.datasets.clear();
    }
    let (mut named, mut genea) = (NamedFiles::default(), GeneaFolders::default());
    for path in files {
        match kind(&path) {
            Ok(None) => found.passed_over.push(path),
            // Tar files may contain SMPL-X motion.
            Ok(Some(MotionKind::Shards)) if only == Some(MotionKind::Smplx) => found.tars.push(path),
            Ok(Some(kind)) if only.is_some_and(|only| only != kind) => {}
            Ok(Some(MotionKind::Shards)) => found.tars.push(path),
            Ok(Some(MotionKind::Bvh)) if genea::is_of_interlocutor(&path) => found.passed_over.push(path),
            Ok(Some(kind)) => {
                let genea = if kind == MotionKind::Bvh { genea.take(&path, &mut named)? } else { None };
                found.takes.push(TakeFiles { genea, ..with_companions(kind, path, &mut named) });
            }
            Err(_) if only.is_some_and(|only| ![MotionKind::Ted, MotionKind::Smplx].contains(&only)) => {}
            Err(why) => found.unknown.push((path, why)),
        }
    }
    let used: BTreeSet<&PathBuf> = found.takes.iter().flat_map(TakeFiles::files).collect();
    let described: BTreeSet<PathBuf> = found.takes.iter().map(|take| path_of(&take.motion)).collect();
    // Files that belong to motion of another kind are left out on request.
    found.passed_over.retain(|path| only.is_none() && !used.contains(path) && !described.contains(path));
    found.notes = genea::notes(&mut found.passed_over);
    let is_empty =
        found.takes.is_empty() && found.datasets.is_empty() && found.tars.is_empty() && found.unknown.is_empty();
    ensure!(
        !is_empty,
        "nothing to import in {sources:?}{}: expected text clips with 147 values per line, .npz with `human_joints` \
         or SMPL-X rotations, .bvh or .tar shards",
        only.map(|kind| format!(" of the kind {}", kind.name())).unwrap_or_default()
    );
    Ok(found)
}

/// Adds the files below `path` to `files`; dataset folders are added to `datasets` and not entered.
fn walk(path: &Path, files: &mut Vec<PathBuf>, datasets: &mut Vec<PathBuf>) -> Result<()> {
    if !path.is_dir() {
        files.push(path.to_owned());
        return Ok(());
    }
    let mut enter = |folder: &Path| {
        let is_dataset = folder.join(INFO).is_file() && folder.join(entry::FOLDER).is_dir();
        datasets.extend(is_dataset.then(|| folder.to_owned()));
        !is_dataset
    };
    files.extend(search::files(path, &mut enter)?);
    Ok(())
}

/// Kind of a file. `None`: not a motion file; `Err`: the name suggests motion, but the file cannot be read as such.
fn kind(path: &Path) -> std::result::Result<Option<MotionKind>, String> {
    match ending(path).as_str() {
        "bvh" => Ok(Some(MotionKind::Bvh)),
        "tar" => Ok(Some(MotionKind::Shards)),
        "npz" => {
            let npz = Npz::open(path).map_err(|error| format!("{error:#}"))?;
            let names = npz.names().join(", ");
            let unknown = format!(
                "it contains {names}: expected `human_joints` [T, 43, 3] (TED Expressive), or `poses`, `pose_body` or \
                 `smplh:body_pose` (SMPL-X, SMPL-H)"
            );
            match npz.has("human_joints") {
                true => Ok(Some(MotionKind::Ted)),
                false => is_smplx(&npz).then_some(Some(MotionKind::Smplx)).ok_or(unknown),
            }
        }
        "txt" => Ok(has_147_numbers(path).then_some(MotionKind::Authors)),
        _ => Ok(None),
    }
}

fn has_147_numbers(path: &Path) -> bool {
    let Ok(file) = input::open(path) else { return false };
    let mut line = String::new();
    // A line of the text layout of Rebol et al. (2021) is under 4 kB.
    let read = BufReader::new(file.take(16 << 10)).read_line(&mut line);
    read.is_ok() && line.split_whitespace().count() == 147 && line.split_whitespace().all(|w| w.parse::<f64>().is_ok())
}

fn with_companions(kind: MotionKind, motion: PathBuf, named: &mut NamedFiles) -> TakeFiles {
    let stem = stem(&motion).to_string_lossy().into_owned();
    let mut stems = vec![stem.as_str()];
    // The sound of gt_interval_3821.txt is 3821.wav.
    stems.extend(["gt_interval_", "prediction_interval_"].iter().filter_map(|prefix| stem.strip_prefix(prefix)));
    let sound = companions(&motion, &stems, &SOUND_EXTENSIONS, SOUND_FOLDERS, named).into_iter().next();
    let transcripts = companions(&motion, &stems, &transcript::ENDINGS, TRANSCRIPT_FOLDERS, named);
    TakeFiles { kind, motion, sound, transcripts, genea: None, origin: None }
}

/// Existing files `<stem>.<ending>` in the folder of `motion`, then in its siblings in `folders` (separated by spaces).
fn companions(motion: &Path, stems: &[&str], endings: &[&str], folders: &str, named: &mut NamedFiles) -> Vec<PathBuf> {
    let Some(own_folder) = motion.parent() else { return Vec::new() };
    let mut folders_to_search = vec![own_folder.to_owned()];
    let parent =
        if own_folder.as_os_str().is_empty() { Path::new("..") } else { own_folder.parent().unwrap_or(own_folder) };
    let parent = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
    let mut siblings: Vec<PathBuf> =
        std::fs::read_dir(parent).into_iter().flatten().flatten().map(|e| e.path()).collect();
    siblings.sort();
    let is_named = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        folders.split(' ').any(|folder| folder == name)
    };
    folders_to_search.extend(siblings.into_iter().filter(is_named));
    let candidates = folders_to_search.iter().flat_map(|folder| named.find(folder, stems, endings));
    candidates.filter(|path| path != motion).collect()
}

fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}
