//! Matching of files by name: ground truth, prediction and sound of each clip. No file is opened here.

use anyhow::{Context, Result, bail, ensure};
use orator_base::text::composed;
use orator_dataset::config::patterns::{self, SOUND_EXTENSIONS, VIDEO_EXTENSIONS};
use orator_formats::mocap::motion_file;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Prefixes of ground-truth files; the rest of the stem is the name of the clip.
const TRUTH: [&str; 7] = ["gt_interval_", "ground_truth_", "truth_", "real_", "gt_", "true_", "natural_"];
const PREDICTION: [&str; 8] =
    ["prediction_interval_", "prediction_", "predicted_", "generated_", "pred_", "made_", "output_", "synthetic_"];

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilePair {
    pub name: String,
    pub truth: PathBuf,
    pub prediction: PathBuf,
    pub sound: Option<PathBuf>,
}

/// Pairs sorted by name, and a note for each file without a partner.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FilePairs {
    pub pairs: Vec<FilePair>,
    pub notes: Vec<String>,
}

/// Pairs ground truth and predictions: two files, or two folders, which may be the same folder (`gt_interval_7.txt`
/// matches `prediction_interval_7.txt`). `audio` is the sound of the only pair, or a folder of sounds.
///
/// # Errors
/// A path that does not exist; a file given with a folder; two files for one clip; no pair.
pub fn find(truth: &Path, prediction: &Path, audio: Option<&Path>) -> Result<FilePairs> {
    for path in [Some(truth), Some(prediction), audio].into_iter().flatten() {
        ensure!(path.exists(), "{} does not exist", path.display());
    }
    let mut found = match (truth.is_dir(), prediction.is_dir()) {
        (false, false) => {
            ensure!(
                !is_same_file(truth, prediction),
                "{} is given as truth and as prediction: give two different motions",
                truth.display()
            );
            let pair =
                FilePair { name: key(truth), truth: truth.to_owned(), prediction: prediction.to_owned(), sound: None };
            FilePairs { pairs: vec![pair], notes: Vec::new() }
        }
        (true, true) => folders(truth, prediction)?,
        (is_folder, _) => {
            let (folder, file) = if is_folder { (truth, prediction) } else { (prediction, truth) };
            bail!("{} is a folder and {} is a file: give two files or two folders", folder.display(), file.display())
        }
    };
    match audio {
        None => {}
        Some(audio) if audio.is_dir() => by_name(&mut found, audio)?,
        Some(audio) => {
            ensure!(
                found.pairs.len() == 1,
                "{} is one audio file for {} clips: give a folder with an audio file for each clip",
                audio.display(),
                found.pairs.len()
            );
            found.pairs.iter_mut().for_each(|pair| pair.sound = Some(audio.to_owned()));
        }
    }
    Ok(found)
}

fn is_same_file(a: &Path, b: &Path) -> bool {
    a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b))
}

fn folders(truth: &Path, prediction: &Path) -> Result<FilePairs> {
    let is_same_folder = is_same_file(truth, prediction);
    let side = |folder: &Path, own: &[&str]| -> Result<BTreeMap<String, PathBuf>> {
        let files = files(folder, &motion_file::ENDINGS)?;
        let files =
            files.into_iter().filter(|file| !is_same_folder || own.iter().any(|start| stem(file).starts_with(start)));
        by_key(files)
    };
    let (truths, mut predictions) = (side(truth, &TRUTH)?, side(prediction, &PREDICTION)?);
    let mut found = FilePairs::default();
    for (name, truth) in truths {
        match predictions.remove(&name) {
            Some(prediction) => found.pairs.push(FilePair { name, truth, prediction, sound: None }),
            None => found.notes.push(format!("{} has no prediction of the same name: left out", file_name_of(&truth))),
        }
    }
    found.notes.extend(
        predictions.values().map(|path| format!("{} has no truth of the same name: left out", file_name_of(path))),
    );
    ensure!(
        !found.pairs.is_empty(),
        "no motion file in {} has the name of one in {}{}: expected for example {}",
        truth.display(),
        prediction.display(),
        match found.notes.len() {
            0 => " (there are no motion files)".to_owned(),
            n => format!(" ({n} without a partner: {}, ...)", found.notes[0]),
        },
        if is_same_folder { "gt_interval_7.txt and prediction_interval_7.txt" } else { "a.npy in both" }
    );
    Ok(found)
}

fn by_name(found: &mut FilePairs, audio: &Path) -> Result<()> {
    let mut sounds = by_key(files(audio, &[&SOUND_EXTENSIONS[..], &VIDEO_EXTENSIONS].concat())?)?;
    for pair in &mut found.pairs {
        pair.sound = sounds.remove(&pair.name);
        if pair.sound.is_none() {
            found
                .notes
                .push(format!("{} has no audio of the same name: left out of metrics that need audio", pair.name));
        }
    }
    ensure!(
        found.pairs.iter().any(|pair| pair.sound.is_some()),
        "no audio file in {} has the name of a clip: expected for example {}.wav",
        audio.display(),
        found.pairs.first().map_or("", |pair| pair.name.as_str())
    );
    Ok(())
}

/// Files of a folder with one of these extensions, sorted by name, without hidden files.
fn files(folder: &Path, endings: &[&str]) -> Result<Vec<PathBuf>> {
    let paths = patterns::list(folder).with_context(|| format!("cannot list {}", folder.display()))?;
    let is_one =
        |path: &PathBuf| path.is_file() && !stem(path).starts_with('.') && patterns::has_extension(path, endings);
    Ok(paths.into_iter().filter(is_one).collect())
}

fn by_key(files: impl IntoIterator<Item = PathBuf>) -> Result<BTreeMap<String, PathBuf>> {
    let mut named = BTreeMap::new();
    for file in files {
        if let Some(other) = named.insert(key(&file), file.clone()) {
            bail!("{} and {} are both clip {}: remove one of them", other.display(), file.display(), key(&file));
        }
    }
    Ok(named)
}

/// Clip name of a file: its stem, with composed letters and without the prefix for ground truth or prediction.
fn key(path: &Path) -> String {
    let stem = composed(&stem(path));
    let start = TRUTH.iter().chain(&PREDICTION).find(|start| stem.starts_with(**start) && stem.len() > start.len());
    start.map_or(stem.as_str(), |start| &stem[start.len()..]).to_owned()
}

fn stem(path: &Path) -> String {
    motion_file::stem(path).to_string_lossy().into_owned()
}

fn file_name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
