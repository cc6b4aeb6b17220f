//! Rules for study files beyond their types. Each violation gives a key and what was expected.

use super::condition::{ConditionSource, StudyCondition};
use super::study_file::{FilmLayout, HypothesisKind, StudyFile, StudyHypothesis, StudyTask};
use crate::pages::assets::text_keys;
use crate::plan::TaskDesign;
use orator_dataset::config::file::did_you_mean;
use std::collections::BTreeSet;

/// Violated rules: the key, what was expected and how to fix it.
pub(super) fn check(file: &StudyFile) -> Vec<(String, String)> {
    let mut rules = StudyRules { file, problems: Vec::new() };
    rules.general();
    rules.speakers();
    rules.names("condition", file.condition.iter().map(|condition| condition.name.as_str()));
    file.condition.iter().for_each(|condition| rules.condition(condition));
    rules.names("task", file.task.iter().map(|task| task.name.as_str()));
    file.task.iter().for_each(|task| rules.task(task));
    file.hypothesis.iter().enumerate().for_each(|(at, hypothesis)| rules.hypothesis(at, hypothesis));
    rules.problems
}

struct StudyRules<'a> {
    file: &'a StudyFile,
    problems: Vec<(String, String)>,
}

impl StudyRules<'_> {
    fn report(&mut self, key: impl Into<String>, message: impl Into<String>) {
        self.problems.push((key.into(), message.into()));
    }

    fn within(&mut self, key: impl Into<String>, value: f64, low: f64, high: f64, unit: &str) {
        if !(low..=high).contains(&value) {
            let message = format!("{value} is out of range: expected {low} to {high} {unit}");
            self.report(key, message.trim_end());
        }
    }

    fn names<'n>(&mut self, list: &str, names: impl Iterator<Item = &'n str>) {
        let mut known = BTreeSet::new();
        for name in names {
            let key = format!("{list}[{name}].name");
            if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_') {
                self.report(key, format!("{name:?}: expected letters, digits, - and _"));
            } else if !known.insert(name.to_ascii_lowercase()) {
                self.report(key, format!("{name:?} is used twice: expected unique names"));
            }
        }
    }

    fn general(&mut self) {
        let file = self.file;
        if file.title.trim().is_empty() {
            self.report("title", "expected a title; it is shown to participants");
        }
        self.within("participants", file.participants as f64, 1.0, 10_000.0, "participants");
        self.within("extra_session_ratio", file.extra_session_ratio, 0.0, 5.0, "extra sessions per participant");
        self.within("seed", file.seed as f64, 0.0, i64::MAX as f64, "");
        self.within("clips.seconds", file.clips.seconds, 1.0, 120.0, "seconds");
        self.within("clips.stroke_rate_groups", file.clips.stroke_rate_groups as f64, 1.0, 10.0, "classes");
        let rules = &file.exclusion;
        self.within("exclusion.stalled_secs", rules.stalled_secs.unwrap_or(0.0), 0.0, 600.0, "seconds");
        self.within("exclusion.unfocused_secs", rules.unfocused_secs.unwrap_or(0.0), 0.0, 600.0, "seconds");
        if rules.failed_checks == Some(0) {
            self.report(
                "exclusion.failed_checks",
                "0 would exclude all participants: expected 1 or more, or remove the key",
            );
        }
        self.within("analysis.alpha", file.analysis.alpha, 0.0001, 0.5, "");
        self.within("analysis.resamples", file.analysis.resamples as f64, 100.0, 1e7, "samples");
        if file.return_url.as_ref().is_some_and(|address| !address.starts_with("https://")) {
            self.report("return_url", "expected a URL that starts with https://");
        }
        let is_code = |code: &str| {
            let plain = code.chars().all(|c| c.is_ascii_alphanumeric() || c == '-');
            plain && (2..=3).contains(&code.split('-').next().unwrap_or_default().len())
        };
        if file.languages.is_empty() {
            self.report("languages", "expected at least one language, like [\"en\"]");
        }
        for language in file.languages.iter().filter(|language| !is_code(language)) {
            self.report(
                "languages",
                format!("{language:?} is not a language code: expected one like \"en\" or \"pt-BR\""),
            );
        }
        for language in file.texts.keys().filter(|language| !file.languages.contains(language)) {
            self.report(format!("texts.{language}"), format!("{language:?} is not in languages: add it there"));
        }
        let known = text_keys(file.task.iter().map(|task| task.name.as_str()));
        let keys = file.texts.iter().flat_map(|(language, texts)| texts.keys().map(move |key| (language, key)));
        for (language, key) in keys.filter(|(_, key)| !known.contains(key)) {
            let message = format!("unknown text of the page{}", did_you_mean(key, known.iter()));
            self.report(format!("texts.{language}.{key}"), message);
        }
        if file.task.is_empty() {
            self.report("task", "no tasks: expected a [[task]] table or a preset");
        }
        let trials: usize = file.task.iter().map(|task| task.trials).sum();
        // At least two trials precede the first check, one separates two checks, and one follows the last.
        let max_checks = trials.saturating_sub(2) / 2;
        if file.attention_checks > max_checks && trials > 0 {
            let message = format!("{} checks in {trials} trials: expected at most {max_checks}", file.attention_checks);
            self.report(
                "attention_checks",
                message + ", because checks are not adjacent and follow the first two trials",
            );
        }
    }

    fn speakers(&mut self) {
        let file = self.file;
        if file.speaker.is_empty() {
            self.report("speaker", "no speakers: expected a [[speaker]] table with a name and a dataset or sounds");
        }
        self.names("speaker", file.speaker.iter().map(|speaker| speaker.name.as_str()));
        for speaker in &file.speaker {
            let key = |key: &str| format!("speaker[{}].{key}", speaker.name);
            match (&speaker.dataset, &speaker.sounds) {
                (None, None) => {
                    self.report(key("dataset"), "expected dataset = \"FOLDER\" or sounds = \"FOLDER/*.wav\"");
                }
                (Some(_), Some(_)) => self.report(key("sounds"), "dataset and sounds are both given: remove one"),
                _ => {}
            }
            let needs = |condition: &&StudyCondition| {
                matches!(condition.source, ConditionSource::Natural | ConditionSource::MeanPose)
            };
            if let (None, Some(condition)) = (&speaker.dataset, file.condition.iter().find(needs)) {
                let message = format!("the condition {} needs motion: expected dataset = \"FOLDER\"", condition.name);
                self.report(key("dataset"), message + ", or remove the condition");
            }
            if speaker.dataset.is_none() && file.clips.stroke_rate_groups > 1 {
                let message =
                    "clips.stroke_rate_groups needs motion: expected dataset = \"FOLDER\", or remove that key";
                self.report(key("dataset"), message);
            }
            if speaker.clips == Some(0) {
                self.report(key("clips"), "expected 1 or more; without the key, the number that the design needs");
            }
        }
    }

    /// Whether a condition with this name exists; reports a problem otherwise.
    fn is_condition(&mut self, key: &str, name: &str) -> bool {
        let known: Vec<String> = self.file.condition.iter().map(|condition| condition.name.clone()).collect();
        let is_known = known.iter().any(|other| other == name);
        if !is_known {
            let near = did_you_mean(name, known.iter());
            self.report(key, format!("unknown condition {name:?}{near}: expected one of {}", known.join(", ")));
        }
        is_known
    }

    fn condition(&mut self, condition: &StudyCondition) {
        let key = format!("condition[{}].of", condition.name);
        match &condition.source {
            ConditionSource::Mismatched(of) if of.is_empty() => {
                self.report(
                    key,
                    "expected the name of the condition whose motion is mismatched, like of = \"generated\"",
                );
            }
            ConditionSource::Mismatched(of) => {
                let chained = self.file.find_condition(of).is_some_and(|other| other.source.mismatch_of().is_some());
                if self.is_condition(&key, of) && chained {
                    self.report(
                        key,
                        format!("{of} is itself a mismatched condition: expected a condition of another kind"),
                    );
                }
            }
            ConditionSource::Checkpoint(_) | ConditionSource::Files(_) => {}
            ConditionSource::Natural | ConditionSource::MeanPose => {}
        }
        if condition.real && condition.source.mismatch_of().is_some() {
            self.report(
                format!("condition[{}].real", condition.name),
                "a mismatched condition cannot be the real one: remove the key",
            );
        }
    }

    fn task(&mut self, task: &StudyTask) {
        let key = |key: &str| format!("task[{}].{key}", task.name);
        self.within(key("trials"), task.trials as f64, 1.0, 500.0, "trials");
        self.within(key("training"), task.training as f64, 0.0, 50.0, "trials");
        let (conditions_key, names) = (key("conditions"), &task.conditions);
        let n_unknown = names.iter().filter(|name| !self.is_condition(&conditions_key, name)).count();
        if n_unknown > 0 {
            return;
        }
        if names.iter().collect::<BTreeSet<_>>().len() < names.len() {
            return self.report(conditions_key, "a condition is listed twice: remove one");
        }
        let found: Vec<&StudyCondition> = names.iter().filter_map(|name| self.file.find_condition(name)).collect();
        let n_real = found.iter().filter(|condition| condition.real).count();
        let has = |name: &str| names.iter().any(|other| other == name);
        let is_mismatched = |condition: &&StudyCondition| condition.source.mismatch_of().is_some();
        let has_pairs = found.iter().all(|condition| match condition.source.mismatch_of() {
            Some(of) => has(of),
            None => found.iter().any(|other| other.source.mismatch_of() == Some(&condition.name)),
        });
        match task.design {
            _ if names.len() < 2 => {
                self.report(conditions_key, "expected at least two conditions to compare: add [[condition]] tables");
            }
            TaskDesign::Turing | TaskDesign::TuringSingle if n_real != 1 => {
                let message =
                    format!("{n_real} real conditions: expected exactly one, of kind natural or with real = true");
                self.report(conditions_key, message);
            }
            TaskDesign::Mismatch if !has_pairs => {
                self.report(
                    conditions_key,
                    "expected pairs of a mismatched condition and the condition in its key `of`",
                );
            }
            TaskDesign::Sliders if names.len() > 16 => {
                self.report(conditions_key, format!("{} conditions on one page: expected at most 16", names.len()));
            }
            TaskDesign::Sliders if !task.sound && found.iter().any(is_mismatched) => {
                self.report(
                    conditions_key,
                    "a mismatched condition has no meaning without sound: remove it or set sound = true",
                );
            }
            _ => {}
        }
        let scales = ["human-likeness", "appropriateness"];
        match task.design {
            TaskDesign::Sliders if !scales.contains(&task.scale.as_str()) => {
                let near = did_you_mean(&task.scale, scales.map(str::to_owned).iter());
                self.report(key("scale"), format!("{:?}: expected {}{near}", task.scale, scales.join(" or ")));
            }
            TaskDesign::Sliders => {}
            _ if !task.scale.is_empty() => {
                self.report(key("scale"), "only the design sliders has a scale: remove the key");
            }
            _ => {}
        }
        if task.feedback && matches!(task.design, TaskDesign::Preference | TaskDesign::Sliders) {
            self.report(key("feedback"), "this design has no correct response to show: remove the key");
        }
        let shows_two = matches!(task.design, TaskDesign::Turing | TaskDesign::Preference | TaskDesign::Mismatch);
        if self.file.films.layout == FilmLayout::SideBySide && !shows_two {
            let message = format!("a side-by-side film shows two avatars, which does not fit the task {}", task.name);
            self.report(
                "films.layout",
                message + ": expected \"separate\", or only tasks of the designs turing, preference and mismatch",
            );
        }
        if task.design == TaskDesign::Mismatch && !task.sound {
            self.report(key("sound"), "the design mismatch requires sound: remove the key");
        }
    }

    fn hypothesis(&mut self, at: usize, hypothesis: &StudyHypothesis) {
        let key = |key: &str| format!("hypothesis[{at}].{key}");
        let known: Vec<String> = self.file.task.iter().map(|task| task.name.clone()).collect();
        let Some(task) = self.file.task.iter().find(|task| task.name == hypothesis.task) else {
            let near = did_you_mean(&hypothesis.task, known.iter());
            let message = format!("unknown task {:?}{near}: expected one of {}", hypothesis.task, known.join(", "));
            return self.report(key("task"), message);
        };
        let fits = match hypothesis.kind {
            HypothesisKind::Differs => !matches!(task.design, TaskDesign::Turing | TaskDesign::Mismatch),
            _ => !matches!(task.design, TaskDesign::Preference | TaskDesign::Sliders),
        };
        if !fits {
            let others = match hypothesis.kind {
                HypothesisKind::Differs => "differs-from-chance, greater-than-chance or equivalence",
                _ => "differs, because this design has no chance level",
            };
            self.report(key("kind"), format!("does not fit the task {}: expected {others}", task.name));
        }
        match hypothesis.points {
            None if hypothesis.kind == HypothesisKind::Equivalence => {
                self.report(
                    key("points"),
                    "missing: equivalence requires a bound in percentage points, like points = 10.0",
                );
            }
            Some(_) if hypothesis.kind != HypothesisKind::Equivalence => {
                self.report(key("points"), "only the kind equivalence has a bound: remove the key");
            }
            Some(points) => self.within(key("points"), points, 0.1, 49.0, "percentage points"),
            None => {}
        }
        let names = &hypothesis.conditions;
        if !names.is_empty() && (names.len() != 2 || names[0] == names[1]) {
            self.report(
                key("conditions"),
                "expected two different conditions, or an empty list for all pairs of the task",
            );
        }
        for name in names.iter().filter(|name| !task.conditions.contains(name)) {
            let message = format!("{name:?} is not a condition of the task {}", task.name);
            self.report(key("conditions"), format!("{message}: expected one of {}", task.conditions.join(", ")));
        }
    }
}
