//! Folders of the GENEA challenges: `Training_data/Motion` and `Test_data/Motion` (2020), `trn/bvh` (2022) and
//! `trn/main-agent/bvh` (2023; also `val`, `tst`), with a table `*metadata.csv` of speakers and fingers in each split.

use super::find::TakeFiles;
use crate::{Split, file_name};
use anyhow::{Context, Result, bail, ensure};
use orator_base::input;
use orator_base::text::{counted, first_three};
use orator_formats::search::NamedFiles;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Names of the split folders, in lower case.
const SPLITS: [(&str, Split); 5] = [
    ("trn", Split::Train),
    ("val", Split::Validation),
    ("tst", Split::Test),
    ("training_data", Split::Train),
    ("test_data", Split::Test),
];
const MAIN_AGENT: &str = "main-agent";
const INTERLOCUTOR: &str = "interloctr";

/// What a challenge states about a take of the main agent.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct GeneaTake {
    pub split: Split,
    /// `None`: the challenge has no table of speakers (2020), or it does not list the take.
    pub speaker: Option<GeneaSpeaker>,
    /// Table that should list the take, but does not.
    pub missing_from: Option<PathBuf>,
    /// Audio of the interlocutor.
    pub interlocutor: Option<PathBuf>,
}

/// Row of `metadata.csv`; the ids are those of the challenge's actors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct GeneaSpeaker {
    pub id: u32,
    pub has_fingers: bool,
    pub interlocutor_id: Option<u32>,
}

/// Speakers by the names of their takes.
type SpeakerTable = BTreeMap<String, GeneaSpeaker>;

/// Location of a file in the folders of a challenge.
struct GeneaLocation {
    split_folder: PathBuf,
    split: Split,
    is_interlocutor: bool,
}

/// Takes and other files of the challenges' folders.
#[derive(Default)]
pub struct GeneaFolders {
    speakers: BTreeMap<PathBuf, Option<(PathBuf, SpeakerTable)>>,
}

fn lower_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

fn locate(file: &Path) -> Option<GeneaLocation> {
    let file = file.canonicalize().or_else(|_| std::path::absolute(file)).ok()?;
    let mut folder = file.parent()?.parent()?;
    let person = lower_name(folder);
    if person == MAIN_AGENT || person == INTERLOCUTOR {
        folder = folder.parent()?;
    }
    let name = lower_name(folder);
    let (_, split) = SPLITS.into_iter().find(|(known, _)| *known == name)?;
    Some(GeneaLocation { split_folder: folder.to_owned(), split, is_interlocutor: person == INTERLOCUTOR })
}

/// Whether the file belongs to an interlocutor.
pub fn is_of_interlocutor(file: &Path) -> bool {
    locate(file).is_some_and(|location| location.is_interlocutor)
}

impl GeneaFolders {
    /// Data of the motion file `motion`; `None`: it is not in the folder of a challenge.
    ///
    /// # Errors
    /// A table of speakers without a needed column, or with an invalid row.
    pub fn take(&mut self, motion: &Path, named: &mut NamedFiles) -> Result<Option<GeneaTake>> {
        let is_motion = |folder: &Path| matches!(lower_name(folder).as_str(), "bvh" | "motion");
        let Some(location) = locate(motion).filter(|_| motion.parent().is_some_and(is_motion)) else { return Ok(None) };
        let folder = location.split_folder;
        if !self.speakers.contains_key(&folder) {
            self.speakers.insert(folder.clone(), read_table(&folder)?);
        }
        let stem = motion.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let prefix = stem.strip_suffix(&format!("_{MAIN_AGENT}")).unwrap_or(&stem);
        let table = self.speakers.get(&folder).and_then(Option::as_ref);
        let speaker = table.and_then(|(_, speakers)| speakers.get(prefix).copied());
        let missing_from = table.filter(|_| speaker.is_none()).map(|(path, _)| path.clone());
        let wav = folder.join(INTERLOCUTOR).join("wav");
        let interlocutor = named.find(&wav, &[&format!("{prefix}_{INTERLOCUTOR}")], &["wav"]).into_iter().next();
        Ok(Some(GeneaTake { split: location.split, speaker, missing_from, interlocutor }))
    }
}

/// The table of a split folder with its speakers by the prefix of their files' names; `None`: there is no table.
fn read_table(folder: &Path) -> Result<Option<(PathBuf, SpeakerTable)>> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let Some(path) = entries.filter(|path| is_table(path)).min() else { return Ok(None) };
    let text = input::read_text(&path, input::MAX_TEXT).with_context(|| format!("cannot read {}", path.display()))?;
    let speakers = parse_table(&text).with_context(|| path.display().to_string())?;
    Ok(Some((path, speakers)))
}

fn is_table(path: &Path) -> bool {
    lower_name(path).ends_with("metadata.csv")
}

/// Parses rows of name, fingers, id (2022, without header), or a table with a header (2023).
fn parse_table(text: &str) -> Result<SpeakerTable> {
    let rows = text.trim_start_matches('\u{feff}').lines().enumerate();
    let rows =
        rows.map(|(n, line)| (n + 1, line.split(',').map(|cell| cell.trim().trim_matches('"')).collect::<Vec<_>>()));
    let mut rows = rows.filter(|(_, cells)| cells.iter().any(|cell| !cell.is_empty())).peekable();
    let (_, first) = rows.peek().context("the table of speakers is empty")?;
    let (columns, width) = match first.iter().any(|cell| fingers(cell).is_some()) {
        true => ([Some(0), Some(2), Some(1), None], 3),
        false => {
            let header = rows.next().map(|(_, cells)| cells).unwrap_or_default();
            let column = |names: [&str; 2]| header.iter().position(|cell| names.contains(cell));
            let needed = |names: [&str; 2]| {
                let missing = || format!("there is no column `{}`: the columns are {}", names[0], header.join(", "));
                column(names).with_context(missing).map(Some)
            };
            let fingers = needed(["main-agent_has_fingers", "fingers"])?;
            let [name, id] = [needed(["prefix", "fname"])?, needed(["main-agent_id", "userid"])?];
            ([name, id, fingers, column(["interloctr_id"; 2])], header.len())
        }
    };
    let mut speakers = BTreeMap::new();
    for (line, cells) in rows {
        let n = cells.len();
        ensure!(n == width, "line {line}: {}, expected {width}", counted(n, "cell"));
        let [name, id, has_fingers, interlocutor] = columns.map(|column| column.and_then(|at| cells.get(at)).copied());
        let number = |id: &str| {
            id.parse::<u32>().with_context(|| format!("line {line}: the speaker is {id:?}, expected a number"))
        };
        let (name, has_fingers) = (name.unwrap_or_default(), has_fingers.unwrap_or_default());
        let Some(has_fingers) = fingers(has_fingers) else {
            bail!("line {line}: the fingers are {has_fingers:?}, expected finger_incl or finger_excl")
        };
        let interlocutor_id = interlocutor.filter(|id| !id.is_empty()).map(number).transpose()?;
        let speaker = GeneaSpeaker { id: number(id.unwrap_or_default())?, has_fingers, interlocutor_id };
        ensure!(speakers.insert(name.to_owned(), speaker).is_none(), "line {line}: {name} is listed twice");
    }
    Ok(speakers)
}

/// Whether fingers were captured: `finger_incl` in the files, `fingers_incl` in the description of 2023.
fn fingers(cell: &str) -> Option<bool> {
    match cell {
        "finger_incl" | "fingers_incl" => Some(true),
        "finger_excl" | "fingers_excl" => Some(false),
        _ => None,
    }
}

/// Retains the takes of the speaker `id`. Returns a note on the others.
///
/// # Errors
/// No take has this speaker; the message lists those that there are.
pub fn filter_speaker(takes: &mut Vec<TakeFiles>, id: u32) -> Result<Option<String>> {
    let speaker = |take: &TakeFiles| Some(take.genea.as_ref()?.speaker?.id);
    let ids: BTreeSet<u32> = takes.iter().filter_map(speaker).collect();
    let listed = ids.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
    let found = if listed.is_empty() { "no take has a speaker in a metadata.csv".to_owned() } else { listed };
    ensure!(ids.contains(&id), "no take of speaker {id}; the speakers of the sources: {found}");
    let n_before = takes.len();
    takes.retain(|take| speaker(take) == Some(id));
    let n = n_before - takes.len();
    Ok((n > 0).then(|| format!("passed over {} of other speakers than {id}", counted(n, "take"))))
}

/// Removes the files of challenges' folders from `passed_over`. Returns a note per kind.
pub fn notes(passed_over: &mut Vec<PathBuf>) -> Vec<String> {
    let (mut inputs, mut interlocutors) = (BTreeSet::new(), 0);
    passed_over.retain(|path| {
        let is_split = |folder: &Path| SPLITS.iter().any(|(name, _)| *name == lower_name(folder));
        if is_table(path) && path.parent().is_some_and(is_split) {
            return false;
        }
        let Some(location) = locate(path) else { return true };
        let is_input = matches!(path.extension().and_then(OsStr::to_str), Some("wav" | "tsv" | "json" | "txt"));
        match location.is_interlocutor {
            true => interlocutors += usize::from(!is_audio(path)),
            false if is_input => {
                let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                inputs.insert((file_name(&location.split_folder), stem));
            }
            false => return true,
        }
        false
    });
    let mut notes = Vec::new();
    let splits: BTreeSet<String> = inputs.iter().map(|(split, _)| split.clone()).collect();
    for split in splits {
        let stems: Vec<String> = inputs.iter().filter(|(own, _)| *own == split).map(|(_, stem)| stem.clone()).collect();
        let n = counted(stems.len(), "recording");
        notes.push(format!("passed over {n} of {split} without motion: {}", first_three(&stems)));
    }
    if interlocutors > 0 {
        let n = counted(interlocutors, "file");
        notes.push(format!("passed over {n} of interlocutors ({INTERLOCUTOR}/): only their audio is imported"));
    }
    notes
}

fn is_audio(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("wav"))
}
