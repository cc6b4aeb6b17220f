//! Report on a newly written dataset: its size, and problems to fix.

use super::video::LiftedVideo;
use anyhow::{Context, Result};
use orator_base::stage::Report;
use orator_base::stage::ledger::WordCount;
use orator_base::text::counted;
use orator_dataset::config::{self, SplitUnit};
use orator_dataset::info::DatasetInfo;
use orator_dataset::leakage::Leakage;
use orator_dataset::split::{Split, SplitRule};
use orator_dataset::stats::DatasetStats;
use orator_dataset::{INFO, LEAKAGE};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

/// Largest number of videos whose notes on words are listed.
const MAX_NOTED: usize = 5;
/// Largest number of persons, and of videos of each, that are named.
const MAX_PERSONS: usize = 6;
const MAX_FILES: usize = 3;

/// Persons that the videos of one speaker appear to show.
#[derive(Debug, Serialize)]
pub struct SeveralPersons {
    /// File names of the videos of each person.
    pub videos: Vec<Vec<String>>,
}

impl SeveralPersons {
    /// Warning with what to do.
    fn warning(&self) -> String {
        let file_list = |files: &Vec<String>| {
            let more = files.len().saturating_sub(MAX_FILES);
            let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
            format!("{}{rest}", files[..files.len().min(MAX_FILES)].join(", "))
        };
        let persons: Vec<String> = self.videos.iter().take(MAX_PERSONS).map(file_list).collect();
        format!(
            "the videos appear to show {} ({}): `orator report` shows their faces. Leave out videos of another person \
             with `exclude`; if all show one person, set `same_person = true` under [[speaker]]",
            counted(self.videos.len(), "person"),
            persons.join(" | ")
        )
    }
}

pub struct DatasetOutcome<'a> {
    pub settings: &'a config::DatasetConfig,
    pub rule: &'a SplitRule,
    pub videos: &'a [LiftedVideo],
    pub stats: &'a DatasetStats,
    pub n_failed: usize,
    pub n_left_out: usize,
    pub n_reused: usize,
    pub several_persons: Option<SeveralPersons>,
}

impl DatasetOutcome<'_> {
    /// Report of the stage on the dataset in `out`.
    pub fn report(&self, out: &Path) -> Result<Report> {
        let info: DatasetInfo = serde_json::from_slice(&std::fs::read(out.join(INFO))?).context(INFO)?;
        let leakage: Leakage = serde_json::from_slice(&std::fs::read(out.join(LEAKAGE))?).context(LEAKAGE)?;
        let warnings = self.warnings(&info, &leakage);
        let part = |split: Split| {
            let info = info.splits.get(split.name()).cloned().unwrap_or_default();
            format!("{} {:.1} s in {}", split.name(), info.secs, counted(info.samples, "interval"))
        };
        let n_windows: usize = self.stats.windows.strided.values().sum();
        let mut line = format!("{}; {} of 64 frames", Split::ALL.map(part).join(", "), counted(n_windows, "window"));
        let SplitRule { unit, why, guard_secs } = self.rule;
        let splits = match unit {
            SplitUnit::Time => format!("; split by time, {guard_secs:.1} s apart ({why})"),
            SplitUnit::Video | SplitUnit::Auto => format!("; split by video ({why})"),
        };
        line += &splits;
        if self.n_reused > 0 {
            let _ = write!(line, "; {} reused unchanged", counted(self.n_reused, "video"));
        }
        if let Some(WordCount { n_words, n_accepted, .. }) = self.stats.footage.words {
            let _ = write!(line, "; {n_accepted} of {n_words} words in samples");
        }
        line.extend(warnings.iter().map(|warning| format!("; warning: {warning}")));
        let secs: BTreeMap<_, _> = info.splits.iter().map(|(name, split)| (name, split.secs)).collect();
        let DatasetStats { windows, footage, .. } = self.stats;
        let facts = serde_json::json!({ "secs": secs, "windows": windows, "footage": footage, "warnings": warnings,
            "split_rule": self.rule, "several_persons": self.several_persons });
        Ok(Report { line, facts: facts.as_object().cloned().unwrap_or_default() })
    }

    /// Warnings, each with what to do.
    fn warnings(&self, info: &DatasetInfo, leakage: &Leakage) -> Vec<String> {
        let Self { videos, stats, n_failed, n_left_out, .. } = *self;
        let mut warnings: Vec<String> = self.several_persons.iter().map(SeveralPersons::warning).collect();
        // The longest video is proposed for training; each of the others is proposed once.
        let mut by_length: Vec<&LiftedVideo> =
            videos.iter().filter(|video| video.ledger.accepted_secs() > 0.0).collect();
        by_length.sort_by(|a, b| b.ledger.accepted_secs().total_cmp(&a.ledger.accepted_secs()));
        let mut others = by_length.iter().skip(1);
        let shares =
            [(Split::Train, 1.0), (Split::Validation, self.settings.validation), (Split::Test, self.settings.test)];
        for (split, _) in shares.into_iter().filter(|(split, share)| *share > 0.0 && windows(stats, *split) == 0) {
            let name = split.name();
            let file = match split {
                Split::Train => by_length.first(),
                _ => others.next(),
            };
            let remedy = info.empty_split_fix();
            warnings.push(match file {
                _ if self.rule.unit == SplitUnit::Time => format!("no sample in the {name} split: {remedy}"),
                Some(video) => format!(
                    "no video in the {name} split: {remedy}, or set `{name} = [{:?}]` under [[speaker]]",
                    video.file
                ),
                None => format!("no video in the {name} split: {remedy}"),
            });
        }
        for leak in &leakage.leaks {
            let (a, b) =
                (format!("{} ({})", leak.a, leak.a_split.name()), format!("{} ({})", leak.b, leak.b_split.name()));
            warnings.push(format!("{a} and {b} share {:.1} s of audio: assign both to one split", leak.secs));
        }
        if n_failed > 0 {
            let videos = counted(n_failed, "video");
            warnings.push(format!("{videos} left out because an earlier stage failed: see `orator status --why`"));
        }
        if n_left_out > 0 {
            let videos = counted(n_left_out, "video");
            warnings.push(format!("{videos} left out as duplicates of other videos (see ledger.jsonl)"));
        }
        let noted = self.videos.iter().filter_map(|video| {
            let notes = video.transcript_stats(std::iter::empty())?.notes;
            (!notes.is_empty()).then(|| format!("{}: {}", video.file, notes.join("; ")))
        });
        let noted: Vec<String> = noted.collect();
        let n_others = noted.len().saturating_sub(MAX_NOTED);
        warnings.extend(noted.into_iter().take(MAX_NOTED));
        if n_others > 0 {
            warnings.push(format!("transcript notes on {} more are in ledger.jsonl", counted(n_others, "video")));
        }
        warnings
    }
}

fn windows(stats: &DatasetStats, split: Split) -> usize {
    stats.windows.strided.get(split.name()).copied().unwrap_or(0)
}
