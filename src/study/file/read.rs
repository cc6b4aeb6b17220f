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
pub(super) fn resolve(text: &str, file: &Path) -> Result<StudyFile, Vec<Problem>> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::{ConditionSource, FilmLayout, HypothesisKind, MismatchedClip, TaskOrder};

    const SMALLEST: &str = "title = \"t\"\npreset = \"rebol\"\n[[speaker]]\nname = \"ellen\"\ndataset = \"data\"\n\
                            [[condition]]\nname = \"model\"\nkind = \"checkpoint\"\ncheckpoint = \"models/{speaker}\"\n";

    fn read(text: &str) -> StudyFile {
        resolve(text, Path::new("/s/study.toml")).unwrap()
    }

    fn problems(text: &str) -> Vec<String> {
        let found = resolve(text, Path::new("/s/study.toml")).err().unwrap_or_default();
        found.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn a_minimal_file_takes_all_settings_from_its_preset() {
        let file = read(SMALLEST);
        assert_eq!((file.participants, file.n_sessions(), file.task_order), (100, 150, TaskOrder::Written));
        assert_eq!((file.practice, file.training_first, file.exclusion.reloaded), (false, true, true));
        assert_eq!(file.clips.mismatched, MismatchedClip::PerParticipant);
        assert_eq!(file.drawn_conditions(), BTreeMap::from([("mismatched", "model")]));
        let tasks: Vec<_> = file.task.iter().map(|task| (task.trials, task.training, task.replay)).collect();
        assert_eq!(tasks, [(20, 3, false), (10, 3, false)]);
        assert_eq!((file.films.layout, file.films.layout.size()), (FilmLayout::SideBySide, [1000, 360]));
        assert_eq!(file.task[0].conditions, ["real", "model"]);
        assert_eq!(file.task[1].conditions, ["mismatched", "model"]);
        assert_eq!(file.find_condition("mismatched").unwrap().source, ConditionSource::Mismatched("model".into()));
        assert_eq!(
            file.find_condition("model").unwrap().source,
            ConditionSource::Checkpoint("/s/models/{speaker}".into())
        );
        assert_eq!(file.speaker[0].dataset.as_deref(), Some(Path::new("/s/data")));
        let model = |keys: &str| read(&format!("{SMALLEST}{keys}")).find_condition("model").unwrap().clone();
        let (plain, set) = (model(""), model("words = \"glove.safetensors\"\ncarry_state = true\n"));
        assert_eq!((plain.words, plain.carry_state), (None, false));
        assert_eq!((set.words, set.carry_state), (Some("/s/glove.safetensors".into()), true));
        let kinds: Vec<_> = file.hypothesis.iter().map(|hypothesis| hypothesis.kind).collect();
        use HypothesisKind::{DiffersFromChance, Equivalence, GreaterThanChance};
        assert_eq!(kinds, [DiffersFromChance, Equivalence, GreaterThanChance]);
    }

    #[test]
    fn both_tasks_of_the_preset_ask_which_gestures_are_more_natural() {
        let wording = "feels as a more natural representation of gestures for the presented speech fragment";
        let file = read(&format!("languages = [\"en\", \"ar\"]\n{SMALLEST}"));
        assert_eq!(file.texts.keys().collect::<Vec<_>>(), ["ar", "en"], "the texts of other languages are dropped");
        for task in ["real-or-generated", "matched-or-mismatched"] {
            assert!(file.texts["en"][&format!("question.{task}")].contains(wording));
            let keys = ["question", "title", "instructions"].map(|part| format!("{part}.{task}"));
            assert!(file.texts.values().all(|texts| keys.iter().all(|key| texts.contains_key(key))));
        }
        let removed = "[[task]]\nname = \"matched-or-mismatched\"\ntrials = 0\n";
        let own = "[texts.en]\n\"question.real-or-generated\" = \"Which?\"\n";
        let file = read(&format!("{SMALLEST}{removed}{own}"));
        let texts = &file.texts["en"];
        assert_eq!((texts.len(), texts["question.real-or-generated"].as_str()), (3, "Which?"));
        let wrong = problems(&format!("{SMALLEST}{removed}[texts.en]\n\"title.matched-or-mismatched\" = \"Which?\"\n"));
        assert!(wrong[0].contains("texts.en.title.matched-or-mismatched: unknown text of the page"), "{wrong:?}");
        assert!(problems(&format!("{SMALLEST}[texts.de]\n"))[0].contains("\"de\" is not in languages"));
    }

    #[test]
    fn a_file_is_merged_onto_its_preset_by_name() {
        let text = format!(
            "participants = 7\nattention_checks = 1\n{SMALLEST}[[task]]\nname = \"matched-or-mismatched\"\n\
                            trials = 0\n[[task]]\nname = \"real-or-generated\"\ntrials = 5\n[exclusion]\nstalled_secs = 9\n"
        );
        let file = read(&text);
        assert_eq!((file.participants, file.task.len(), file.task[0].trials, file.task[0].training), (7, 1, 5, 3));
        assert_eq!(read(&format!("spare = 0.25\n{SMALLEST}")).n_sessions(), 125, "the former name of a key");
        assert_eq!((file.exclusion.stalled_secs, file.exclusion.unfocused_secs), (Some(9.0), Some(5.0)));
    }

    #[test]
    fn the_challenge_preset_mismatches_natural_motion_in_audio_tasks() {
        let file = read(&SMALLEST.replace("rebol", "genea2020"));
        assert_eq!((file.films.layout, file.films.layout.size()), (FilmLayout::Separate, [800, 600]));
        assert_eq!(file.task[0].conditions, ["natural", "model"]);
        assert_eq!(file.task[1].conditions, ["natural", "mismatched", "model"]);
        assert_eq!((file.task[0].sound, file.task[1].sound, file.exclusion.failed_checks), (false, true, Some(2)));
    }

    #[test]
    fn the_example_is_valid_and_resolved_files_round_trip() {
        let file = read(EXAMPLE);
        assert_eq!(file.hypothesis[0].points, Some(10.0));
        let dir = tempfile::tempdir().unwrap();
        let dropped = format!("{SMALLEST}[[task]]\nname = \"matched-or-mismatched\"\ntrials = 0\n");
        let bare = SMALLEST.replace("preset = \"rebol\"", "participants = 3")
            + "[exclusion]\nincomplete = false\n[[condition]]\nname = \"real\"\nkind = \"natural\"\n\
                   [[task]]\nname = \"single\"\ndesign = \"turing-single\"\ntrials = 9\n";
        let set = read(&format!("{SMALLEST}words = \"glove.safetensors\"\ncarry_state = true\n"));
        let genea = read(&SMALLEST.replace("rebol", "genea2020"));
        for file in [file, read(SMALLEST), set, genea, read(&dropped), read(&bare)] {
            let path = dir.path().join("study.toml");
            file.write(&path).unwrap();
            assert_eq!(StudyFile::read(&path).unwrap(), file);
            // Files of studies built before the key existed stay equal.
            let has_layout = std::fs::read_to_string(&path).unwrap().contains("[films]");
            assert_eq!(has_layout, file.films.layout == FilmLayout::SideBySide);
        }
    }

    #[test]
    fn each_problem_states_line_key_and_remedy() {
        let one = |text: &str| problems(&format!("{SMALLEST}{text}"));
        assert!(
            one("[clips]\nsecond = 3\n")[0].starts_with("line 11: clips.second: unknown key (did you mean seconds?)")
        );
        assert!(one("[[task]]\nname = \"x\"\ntrials = 3\n")[0].ends_with("the key design is missing"));
        assert_eq!(
            one("[texts.en]\n\"study.titel\" = \"Hi\"\n"),
            ["line 11: texts.en.study.titel: unknown text of the page (did you mean study.title?)"]
        );
        let wrong = one("[[task]]\nname = \"x\"\ndesign = \"sliders\"\ntrials = 3\nscale = \"appropriate\"\n\
                         [films]\nlayout = \"separate\"\n");
        assert_eq!(
            wrong,
            ["line 14: task[x].scale: \"appropriate\": expected human-likeness or appropriateness \
                            (did you mean appropriateness?)"]
        );
        assert_eq!(
            one("[[task]]\nname = \"x\"\ndesign = \"turing-single\"\ntrials = 3\n"),
            ["line 2: films.layout: a side-by-side film shows two avatars, which does not fit the task x: expected \
              \"separate\", or only tasks of the designs turing, preference and mismatch"]
        );
        assert!(
            one("[films]\nlayout = \"beside\"\n")[0].starts_with("line 11: films.layout: unknown value \"beside\"")
        );
        let wrong = one("[[task]]\nname = \"x\"\ndesign = \"turin\"\ntrials = 3\n");
        assert!(wrong[0].starts_with("line 12: task[x].design: unknown value \"turin\""), "{wrong:?}");
        assert!(wrong[0].ends_with("(did you mean turing?)"), "{wrong:?}");
        assert_eq!(
            one("[[condition]]\nname = \"b\"\nkind = \"files\"\n"),
            ["line 6: condition[model]: condition b: missing key files: expected for example files = \
                 \"other/{clip}.bvh\""]
        );
        assert_eq!(
            one("[[condition]]\nname = \"b\"\nkind = \"natural\"\ncarry_state = true\n"),
            ["line 6: condition[model]: condition b: the keys words and carry_state apply to the kind checkpoint; \
              remove them"]
        );
        assert_eq!(
            one("[[hypothesis]]\ntask = \"real-or-generated\"\nkind = \"differs\"\n[[hypothesis]]\n\
                 task = \"real-or-fake\"\nkind = \"equivalence\"\n"),
            [
                "line 12: hypothesis[0].kind: does not fit the task real-or-generated: expected differs-from-chance, \
                 greater-than-chance or equivalence",
                "line 14: hypothesis[1].task: unknown task \"real-or-fake\": expected one of real-or-generated, \
                 matched-or-mismatched",
            ]
        );
        assert!(problems("title = \"t\"\npreset = \"rebel\"\n")[0].ends_with("(did you mean rebol?)"));
        assert!(problems("title = \"t\"\n")[0].ends_with("the key participants is missing"));
        assert!(problems("title = 3\nparticipants = 4\n")[0].starts_with("line 1: title: invalid type"));
        assert!(problems("[x")[0].starts_with("line 1: not valid TOML"));
        let bare = problems("title = \"\"\npreset = \"rebol\"\nseed = 3\n").join("\n");
        for expected in ["title: expected a title", "no speakers", "condition[mismatched].of: expected the name"] {
            assert!(bare.contains(expected), "{expected}: {bare}");
        }
    }

    proptest::proptest! {
        #![proptest_config(proptest::test_runner::Config::with_cases(128))]
        #[test]
        fn no_text_panics(
            text in "(\\[?\\[?(task|speaker|clips|texts|condition|preset|[a-z]{1,4})[\\].=]?[a-z_]{0,6} ?=? ?[\"0-9a-z.\\[\\]{}-]{0,8}\n){0,8}|.{0,60}",
        ) {
            let _ = resolve(&text, Path::new("study.toml"));
        }
    }
}
