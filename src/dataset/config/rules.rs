//! Validation of settings: the ranges stated in the sections, and rules that are not ranges.

use super::auto::AUTO;
use super::file::{Problem, SourceLocation};
use super::sections::{ENGLISH_MODEL, KeyRanges, MULTILINGUAL_MODEL};
use super::{DatasetConfig, ExtractConfig, GanConfig, LiftConfig, ModelsConfig, Pose2dConfig, SegmentConfig};
use super::{Seq2seqConfig, Settings, TranscribeConfig, WorkConfig};
use orator_base::stage::artifacts::StageName;
use std::collections::{BTreeMap, BTreeSet};
use toml::{Table, Value};

/// Minimum, maximum and unit of every number, by key.
pub fn ranges() -> impl Iterator<Item = (String, (f64, f64, &'static str))> {
    let sections = [
        ("work", WorkConfig::RANGES),
        ("models", ModelsConfig::RANGES),
        (StageName::Extract.as_str(), ExtractConfig::RANGES),
        (StageName::Pose2d.as_str(), Pose2dConfig::RANGES),
        (StageName::Segment.as_str(), SegmentConfig::RANGES),
        (StageName::Lift.as_str(), LiftConfig::RANGES),
        (StageName::Transcribe.as_str(), TranscribeConfig::RANGES),
        ("dataset", DatasetConfig::RANGES),
        ("gan", GanConfig::RANGES),
        ("seq2seq", Seq2seqConfig::RANGES),
    ];
    let of_section = |(section, keys): (&'static str, KeyRanges)| {
        keys.iter().map(move |(key, range)| (format!("{section}.{key}"), *range))
    };
    sections.into_iter().flat_map(of_section)
}

/// Checks all settings; returns a problem for each invalid value.
pub fn check(settings: &Settings, locations: &BTreeMap<String, SourceLocation>) -> Vec<Problem> {
    let mut rules = Rules { locations, problems: Vec::new() };
    // This cannot fail: settings are numbers, strings and paths, which TOML can represent.
    let values = Table::try_from(settings).unwrap_or_default();
    for (key, (low, high, unit)) in ranges() {
        let value = key.split_once('.').and_then(|(section, name)| values.get(section)?.get(name));
        let value = match value {
            Some(Value::Integer(value)) => *value as f64,
            Some(Value::Float(value)) => *value,
            // A recipe chooses the value.
            Some(Value::String(text)) if text == AUTO => continue,
            _ => f64::NAN,
        };
        if !(low..=high).contains(&value) {
            let message = format!("{value} is out of range: expected {low} to {high} {unit}");
            rules.problem(&key, message.trim_end().to_owned());
        }
    }
    if settings.dataset.validation + settings.dataset.test > 0.95 {
        rules.problem("dataset.test", "validation and test leave less than 5 % for training".to_owned());
    }
    rules.transcription(settings);
    rules.speakers(settings);
    rules.problems
}

struct Rules<'a> {
    locations: &'a BTreeMap<String, SourceLocation>,
    problems: Vec<Problem>,
}

impl Rules<'_> {
    fn problem(&mut self, key: &str, message: String) {
        let location = self.locations.get(key).copied().unwrap_or(SourceLocation::Line(1));
        self.problems.push(Problem { key: key.to_owned(), location, message });
    }

    fn transcription(&mut self, settings: &Settings) {
        let TranscribeConfig { model, language } = &settings.transcribe;
        let is_code = |code: &str| (2..=3).contains(&code.len()) && code.chars().all(|c| c.is_ascii_lowercase());
        if !language.is_empty() && !is_code(language) {
            let message = format!("invalid language {language:?}: expected a code like \"en\", or \"\" to detect it");
            self.problem("transcribe.language", message);
        } else if model == ENGLISH_MODEL && !["", "en"].contains(&language.as_str()) {
            let message = format!("{model} recognises English only: use {MULTILINGUAL_MODEL}");
            self.problem("transcribe.language", message);
        }
        if model.is_empty() {
            self.problem("transcribe.model", format!("no model: expected {AUTO:?} or a folder in models.dir"));
        }
        for (at, speaker) in settings.speaker.iter().enumerate() {
            if speaker.transcripts.len() > 1 && speaker.transcripts.iter().any(|entry| entry == AUTO) {
                let message = format!("{AUTO:?} cannot be combined with files: keep one of them");
                self.problem(&format!("speaker[{at}].transcripts"), message);
            }
        }
    }

    fn speakers(&mut self, settings: &Settings) {
        let mut seen = BTreeSet::new();
        for (at, speaker) in settings.speaker.iter().enumerate() {
            let key = format!("speaker[{at}].name");
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
            if speaker.name.is_empty() || !speaker.name.chars().all(plain) {
                let message = "expected letters, digits, - and _ (the name is used for folders)";
                self.problem(&key, format!("{:?}: {message}", speaker.name));
            } else if !seen.insert(speaker.name.to_ascii_lowercase()) {
                self.problem(&key, format!("{:?} is used by two speakers: rename one", speaker.name));
            }
            if speaker.fps != 0.0 && !(1.0..=1000.0).contains(&speaker.fps) {
                let message = format!("invalid frame rate {}: expected 1 to 1000 frames per second", speaker.fps);
                self.problem(&format!("speaker[{at}].fps"), message);
            }
            if !speaker.size.is_empty() && speaker.image_size().is_none() {
                let message =
                    format!("invalid size {:?}: expected width and height in pixels, like \"1280x720\"", speaker.size);
                self.problem(&format!("speaker[{at}].size"), message);
            }
            // If neither key is given, the parser has already reported the missing key.
            let is_written = |name: &str| self.locations.contains_key(&format!("speaker[{at}].{name}"));
            let is_empty = speaker.videos.is_empty() && speaker.keypoints.is_empty();
            if is_empty && (is_written("videos") || is_written("keypoints")) {
                self.problem(&format!("speaker[{at}].videos"), "no video is listed".to_owned());
            }
        }
    }
}
