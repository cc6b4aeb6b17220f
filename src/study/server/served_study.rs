//! Content that the server serves: sessions and films of the plan, and the texts of the page.

use crate::file::StudyFile;
use crate::folder::{StudyFolder, read_json};
use crate::pages::page_texts::page_texts;
use crate::plan::{PlannedTask, StudyPlan, TaskDesign, Trial, TrialPhase};
use crate::store::participants::Quota;
use anyhow::{Context, Result, ensure};
use orator_base::stage::fingerprint::hash_file;
use orator_media::ffmpeg::probe::probe;
use serde_json::json;
use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

/// Tolerance for an answer before the nominal end of its films, milliseconds: players round durations.
const END_TOLERANCE_MS: f64 = 250.0;
/// Time limit for the first answer in addition to twice the length of its films, milliseconds: it includes reading the
/// task's instructions and loading the films. Consent and the sound check precede the start of a session.
const UNANSWERED_MS: i64 = 300_000;

/// Path and duration of a served film.
#[derive(Clone, Debug, PartialEq)]
pub struct ServedFilm {
    pub path: PathBuf,
    secs: f64,
}

/// Served study.
#[derive(Debug)]
pub struct ServedStudy {
    pub title: String,
    pub languages: Vec<String>,
    pub plan: StudyPlan,
    /// BLAKE3 hash of the plan file.
    pub plan_hash: String,
    pub quota: Quota,
    /// Whether starting requires the participant ID of a recruiting site.
    pub requires_id: bool,
    /// URL to which a participant returns at the end.
    pub return_url: Option<String>,
    /// Texts and tasks in the form that the page reads.
    pub page: serde_json::Value,
    /// Films by opaque name.
    films: HashMap<String, ServedFilm>,
}

impl ServedStudy {
    /// Reads the study in `folder`. `abandoned_secs`: time without an answer after which a session may be reassigned.
    ///
    /// # Errors
    /// A file is missing or unreadable, or the plan refers to a task or film that does not exist.
    pub fn open(folder: &StudyFolder, abandoned_secs: f64) -> Result<Self> {
        let file = StudyFile::read(&folder.study_file())?;
        let plan: StudyPlan = read_json(&folder.plan())?;
        let plan_hash = hash_file(&folder.plan())?;
        let trials = || plan.sessions.iter().flat_map(|session| &session.trials);
        let is_known = |trial: &Trial| trial.task < plan.tasks.len() && !trial.films.is_empty();
        ensure!(
            trials().all(is_known),
            "{}: a trial has no films or refers to an unknown task",
            folder.plan().display()
        );
        let sound_check = Some(&plan.sound_check).filter(|film| !film.is_empty());
        let names: BTreeSet<&String> = trials().flat_map(|trial| &trial.films).chain(sound_check).collect();
        let films = names.into_iter().map(|name| Ok((name.clone(), open_film(&folder.film(name), name)?)));
        let films = films.collect::<Result<_>>()?;
        let quota = Quota {
            n_sessions: u32::try_from(plan.sessions.len()).context("too many sessions")?,
            target: u32::try_from(file.participants).context("too many participants")?,
            excluded_from: file.exclusion.failed_checks,
            abandoned_ms: (1000.0 * abandoned_secs) as i64,
            unanswered_ms: UNANSWERED_MS,
        };
        let page = json!({
            "title": file.title,
            "languages": file.languages,
            "texts": page_texts(&file.languages, &file.texts),
            "tasks": plan.tasks,
            "has_checks": trials().any(|trial| trial.phase == TrialPhase::AttentionCheck),
            "n_trials": plan.sessions.first().map_or(0, |session| session.trials.len()),
            "sound_check": sound_check,
        });
        let (title, languages, return_url) = (file.title, file.languages, file.return_url);
        let requires_id = file.require_id;
        let mut study = Self { title, languages, plan, plan_hash, quota, requires_id, return_url, page, films };
        let first_trials = study.plan.sessions.iter().filter_map(|session| session.trials.first());
        let first_ms = first_trials.map(|trial| study.min_ms(trial)).max().unwrap_or(0);
        study.quota.unanswered_ms += 2 * first_ms;
        Ok(study)
    }

    /// Film with this opaque name; no other file can be requested.
    pub fn film(&self, name: &str) -> Option<&ServedFilm> {
        self.films.get(name)
    }

    /// Number of films.
    pub fn n_films(&self) -> usize {
        self.films.len()
    }

    /// Trials of a session in order; empty for an unknown session.
    pub fn trials(&self, session: u32) -> &[Trial] {
        self.plan.sessions.get(session as usize).map_or(&[], |session| &session.trials)
    }

    /// Task of a trial. Panics if the trial is not from the plan.
    pub fn task(&self, trial: &Trial) -> &PlannedTask {
        &self.plan.tasks[trial.task]
    }

    /// Minimum time to watch the films of a trial, milliseconds: up to two films play together; those of sliders, and
    /// more than two, play one after another.
    pub fn min_ms(&self, trial: &Trial) -> i64 {
        let is_rated = self.task(trial).design == TaskDesign::Sliders && trial.phase != TrialPhase::AttentionCheck;
        let secs = trial.films.iter().filter_map(|film| self.film(film)).map(|film| film.secs);
        let secs = if is_rated || trial.films.len() > 2 { secs.sum() } else { secs.fold(0.0, f64::max) };
        (1000.0 * secs - END_TOLERANCE_MS).max(0.0) as i64
    }
}

fn open_film(path: &Path, name: &str) -> Result<ServedFilm> {
    let is_opaque = name.len() == 16 && name.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
    ensure!(is_opaque, "invalid film name {name:?} in the plan: expected 16 hexadecimal digits");
    let secs = probe(path)?.duration_secs.with_context(|| format!("{} does not state its duration", path.display()))?;
    Ok(ServedFilm { path: path.to_owned(), secs })
}
