//! Reads a study file on top of its preset, and writes the resolved file.

use super::layers::{self, StudyPreset};
use super::rules;
use super::study_file::{StudyFile, fill_defaults};
use crate::pages::assets::text_keys;
use anyhow::{Context, Result};
use orator_base::input;
use orator_base::stage::workdir;
use orator_dataset::config::file::{did_you_mean, line_of, rejection_message};
use orator_dataset::config::{ConfigError, Problem, SourceLocation};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

pub const EXAMPLE: &str = include_str!("example.toml");

impl StudyFile {
    /// Reads `file` on top of its preset; paths in it are relative to its folder.
    ///
    /// # Errors
    /// The file cannot be read, or [`ConfigError`] lists its problems.
    pub fn read(file: &Path) -> Result<Self> {
        let text = input::read_text(file, input::MAX_TEXT).with_context(|| {
            format!("cannot read the study file {}; `orator guide study` shows an example", file.display())
        })?;
        let file = std::path::absolute(file)?;
        resolve(&text, &file).map_err(|problems| ConfigError { file, problems }.into())
    }

    /// Writes the resolved file atomically.
    pub fn write(&self, file: &Path) -> Result<()> {
        workdir::write_file(file, toml::to_string_pretty(self)?.as_bytes())
    }
}

/// Parses and resolves the text of a study file, or returns all its problems.
pub fn resolve(text: &str, file: &Path) -> Result<StudyFile, Vec<Problem>> {
    let file_problem = |at: usize, message: String| {
        vec![Problem { key: String::new(), location: SourceLocation::Line(line_of(text, at)), message }]
    };
    let written = DeTable::parse(text).map_err(|error| {
        file_problem(
            error.span().map_or(0, |span| span.start),
            format!("not valid TOML: {}", error.message().replace('\n', ", ")),
        )
    })?;
    let spans = layers::spans(written.get_ref());
    let span = written.span();
    let preset = preset_of(written.get_ref()).map_err(|(at, message)| file_problem(at, message))?;
    let mut merged: Spanned<DeTable> =
        DeTable::parse(preset.map_or("", StudyPreset::text)).map_err(|error| file_problem(0, error.to_string()))?;
    layers::merge(written.into_inner(), merged.get_mut());
    let read = StudyFile::deserialize(toml::de::Deserializer::from(Spanned::new(span, merged.into_inner())));
    let mut study = read.map_err(|error| vec![problem_of_error(text, &error, &spans)])?;
    study.preset = None;
    fill_defaults(&mut study);
    drop_unused_texts(&mut study, &spans);
    let folder = file.parent().unwrap_or(Path::new(""));
    paths_mut(&mut study).for_each(|path| *path = folder.join(&path));
    let line_of_key = |key: &str| spans.get(key).map(|span| line_of(text, span.start));
    let problems = rules::check(&study).into_iter().map(|(key, message)| {
        let entry = || line_of_key(key.rsplit_once('.')?.0);
        let line = line_of_key(&key).or_else(entry).or_else(|| line_of_key("preset")).unwrap_or(1);
        Problem { key, location: SourceLocation::Line(line), message }
    });
    let mut problems: Vec<Problem> = problems.collect();
    problems.sort_by(|a, b| (a.location, &a.key).cmp(&(b.location, &b.key)));
    if problems.is_empty() { Ok(study) } else { Err(problems) }
}

/// Drops texts of the preset in languages that the study does not have, and of tasks that it removes. Texts that the
/// file itself contains, which are among the `spans`, are left to the rules.
fn drop_unused_texts(study: &mut StudyFile, spans: &BTreeMap<String, Range<usize>>) {
    let known = text_keys(study.task.iter().map(|task| task.name.as_str()));
    let languages = &study.languages;
    study.texts.retain(|language, texts| {
        let is_used = languages.contains(language);
        texts.retain(|key, _| is_used && known.contains(key) || spans.contains_key(&format!("texts.{language}.{key}")));
        !texts.is_empty() || spans.contains_key(&format!("texts.{language}"))
    });
}

/// Preset named by the file, or the byte offset and message of an error.
fn preset_of(written: &DeTable<'_>) -> Result<Option<StudyPreset>, (usize, String)> {
    let Some(value) = written.get("preset") else { return Ok(None) };
    let DeValue::String(name) = value.get_ref() else {
        return Err((value.span().start, "preset: expected a string, \"rebol\" or \"genea2020\"".to_owned()));
    };
    let preset = StudyPreset::ALL.into_iter().find(|preset| preset.name() == &**name);
    preset.map(Some).ok_or_else(|| {
        let known = StudyPreset::ALL.map(|preset| preset.name().to_owned());
        let message = format!("preset: unknown preset {name:?}: expected {}", known.join(" or "));
        (value.span().start, message + &did_you_mean(name, known.iter()))
    })
}

/// Converts a deserialisation error: the key at its position and what was expected.
fn problem_of_error(text: &str, error: &toml::de::Error, spans: &BTreeMap<String, Range<usize>>) -> Problem {
    let at = error.span().map_or(0, |span| span.start);
    let enclosing = spans.iter().filter(|(_, span)| span.contains(&at)).min_by_key(|(_, span)| span.len());
    let key = enclosing.map_or_else(String::new, |(key, _)| key.clone());
    let message = error.message();
    let quoted: Vec<String> = message.split('`').skip(1).step_by(2).map(str::to_owned).collect();
    let message = if message.starts_with("unknown field") {
        let (name, known) = quoted.split_first().map_or(("", &[][..]), |(name, known)| (name.as_str(), known));
        let near = did_you_mean(name, known.iter());
        let is_named = key.rsplit('.').next() == Some(name);
        let listed = format!("expected one of {}", known.join(", "));
        if is_named { format!("unknown key{near}; {listed}") } else { format!("unknown key {name}{near}; {listed}") }
    } else if message.starts_with("unknown variant") {
        rejection_message(&toml::Value::String(quoted.first().cloned().unwrap_or_default()), message)
    } else if message.starts_with("missing field") {
        format!("the key {} is missing", quoted.first().map_or("", String::as_str))
    } else {
        message.replace('`', "\"")
    };
    Problem { key, location: SourceLocation::Line(line_of(text, at)), message }
}

fn paths_mut(study: &mut StudyFile) -> impl Iterator<Item = &mut PathBuf> {
    let speakers = study.speaker.iter_mut().flat_map(|speaker| speaker.dataset.iter_mut().chain(&mut speaker.sounds));
    let conditions = study.condition.iter_mut();
    speakers.chain(conditions.flat_map(|of| of.source.path_mut().into_iter().chain(&mut of.words)))
}
