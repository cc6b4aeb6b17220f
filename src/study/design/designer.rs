//! Builds sessions in turn: task blocks with practice, training and main trials, attention checks among these.

use super::clip_scheduler::{ClipScheduler, SharedClips, SquareRows, stream};
use super::task_design::{AssignedTrial, TaskBalance, TaskDesigner, assign, right_response};
use crate::file::{FilmLayout, StudyCondition, StudyFile, StudyTask, TaskOrder};
use crate::plan::{FilmContent, FilmSound, PlannedSession, Trial, TrialPhase};
use crate::vote::Response;
use anyhow::{Context, Result, ensure};
use rand::Rng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

pub(super) struct Designer<'a> {
    pub file: &'a StudyFile,
    /// Allocated clips, by speaker.
    pub shared: Vec<SharedClips>,
    pub tasks: Vec<TaskDesigner<'a>>,
    pub balance: Vec<TaskBalance>,
    /// Schedulers of the attention checks' clips, by speaker.
    pub check_schedulers: Vec<ClipScheduler>,
    /// Numbers shown, by speaker, check clip and variant.
    pub check_numbers: Vec<Vec<Vec<u16>>>,
    pub task_rows: SquareRows,
    pub rng: ChaCha8Rng,
    pub film: &'a mut dyn FnMut(FilmContent) -> Result<String>,
}

/// Names of a clip, of its speaker, and of the clip whose motion mismatched conditions show; unless the design draws
/// that, the clip itself.
type NamedClip = [String; 3];

impl Designer<'_> {
    /// Builds the session with this index; sessions must be built in ascending order.
    pub(super) fn session(&mut self, session: usize) -> Result<PlannedSession> {
        let order = match self.file.task_order {
            TaskOrder::Balanced => {
                let row = self.task_rows.next_row();
                self.task_rows.row(row).to_vec()
            }
            TaskOrder::Written => (0..self.tasks.len()).collect(),
        };
        let n_main = self.file.task.iter().map(|task| task.trials).sum();
        let check_positions = check_positions(n_main, self.file.attention_checks, &mut self.rng);
        let mut checks = assign(&mut self.check_schedulers, check_positions.len(), session);
        checks.shuffle(&mut self.rng);
        let (mut trials, mut n_before) = (Vec::new(), 0);
        if let Some(at) = order.first().copied().filter(|_| self.file.practice) {
            for trial in self.tasks[at].practice(session) {
                let clip = self.shared[trial.speaker].practice.get(trial.assigned.clip);
                let clip = self.clip(at, trial.speaker, clip, None)?;
                trials.push(self.trial(at, TrialPhase::Practice, clip, trial)?);
            }
        }
        if self.file.training_first {
            for at in &order {
                trials.extend(self.training(*at, session)?);
            }
        }
        for at in order {
            if !self.file.training_first {
                trials.extend(self.training(at, session)?);
            }
            let main = self.tasks[at].main(session);
            if session < self.file.participants {
                self.balance[at].count(&main);
            }
            for trial in main {
                if check_positions.contains(&n_before)
                    && let Some(check) = checks.pop()
                {
                    trials.push(self.check(at, check)?);
                }
                let clip = self.shared[trial.speaker].main[at].get(trial.assigned.clip);
                let clip = self.clip(at, trial.speaker, clip, Some(session))?;
                trials.push(self.trial(at, TrialPhase::Main, clip, trial)?);
                n_before += 1;
            }
        }
        Ok(PlannedSession { trials })
    }

    fn training(&mut self, at: usize, session: usize) -> Result<Vec<Trial>> {
        let assigned = self.tasks[at].training(session);
        let trial = |trial: AssignedTrial| {
            let clip = self.shared[trial.speaker].training[at].get(trial.assigned.clip);
            let clip = self.clip(at, trial.speaker, clip, Some(session))?;
            self.trial(at, TrialPhase::Training, clip, trial)
        };
        assigned.into_iter().map(trial).collect()
    }

    /// Names of a clip shown in a task. The clip of mismatched motion is drawn for the session, or without one for all
    /// sessions alike, so that practice and attention checks need few films.
    fn clip(&self, at: usize, speaker: usize, clip: Option<&String>, session: Option<usize>) -> Result<NamedClip> {
        let clip = clip.context("the design assigns a clip that does not exist")?;
        let (task, name) = (self.tasks[at].task, &self.file.speaker[speaker].name);
        let drawn = self.file.drawn_conditions();
        if !task.conditions.iter().any(|condition| drawn.contains_key(condition.as_str())) {
            return Ok([clip.clone(), name.clone(), clip.clone()]);
        }
        let of_task = self.shared[speaker].training[at].iter().chain(&self.shared[speaker].main[at]);
        let others: Vec<&String> = of_task.filter(|other| *other != clip).collect();
        ensure!(
            !others.is_empty(),
            "the task {} has one clip of the speaker {name}, but its mismatched condition needs at least 2: use more \
             trials, or mismatched = \"fixed\" in [clips]",
            task.name
        );
        let of_session = session.map_or(String::new(), |session| session.to_string());
        let mut rng = stream(self.file.seed, &format!("{} mismatched {clip} {of_session}", task.name));
        Ok([clip.clone(), name.clone(), others[rng.random_range(0..others.len())].clone()])
    }

    fn trial(&mut self, at: usize, phase: TrialPhase, clip: NamedClip, trial: AssignedTrial) -> Result<Trial> {
        let task = &self.tasks[at];
        let comparison = &task.comparisons[trial.assigned.comparison];
        let row = task.arrangements.row(trial.assigned.arrangement);
        let shown: Vec<&StudyCondition> = row.iter().map(|index| comparison[*index]).collect();
        let (design, sound) = (task.task.design, film_sound(task.task));
        let shows_feedback = phase == TrialPhase::Training && task.task.feedback;
        let expected = if shows_feedback { right_response(design, &shown) } else { None };
        let shown = shown.iter().map(|condition| (condition.name.clone(), None)).collect();
        Ok(Trial { task: at, phase, films: self.films(&clip, shown, sound)?, expected })
    }

    /// Attention check that looks like a trial of the task until one of its films shows a number.
    fn check(&mut self, at: usize, check: AssignedTrial) -> Result<Trial> {
        let variant = self.rng.random_range(0..N_VARIANTS);
        let number = self.check_numbers[check.speaker][check.assigned.clip][variant];
        let task = &self.tasks[at];
        let comparison = &task.comparisons[variant % task.comparisons.len()];
        let numbered = variant / task.comparisons.len() % comparison.len();
        let row = task.arrangements.row(self.rng.random_range(0..task.arrangements.n_rows()));
        let shown = |index: &usize| (comparison[*index].name.clone(), (*index == numbered).then_some(number));
        let shown = row.iter().map(shown).collect();
        let sound = film_sound(task.task);
        let clip = self.shared[check.speaker].checks.get(check.assigned.clip);
        let clip = self.clip(at, check.speaker, clip, None)?;
        let films = self.films(&clip, shown, sound)?;
        Ok(Trial { task: at, phase: TrialPhase::AttentionCheck, films, expected: Some(Response::Number(number)) })
    }

    /// Film with tones for the sound check; its clip occurs in no trial other than practice.
    pub(super) fn sound_check(&mut self) -> Result<String> {
        let comparison = self.tasks.first().and_then(|task| task.comparisons.first());
        let condition =
            comparison.and_then(|comparison| comparison.first()).context("the study compares no conditions")?;
        let n_avatars = if self.file.films.layout == FilmLayout::SideBySide { 2 } else { 1 };
        let shown = vec![(condition.name.clone(), None); n_avatars];
        let clip = self.clip(0, 0, self.shared.first().and_then(|shared| shared.practice.first()), None)?;
        self.films(&clip, shown, FilmSound::Tones).map(|films| films.concat())
    }

    /// Names of the films of a clip, one per condition with its number, if any; one for both of a side-by-side film.
    fn films(&mut self, clip: &NamedClip, shown: Vec<(String, Option<u16>)>, sound: FilmSound) -> Result<Vec<String>> {
        let drawn = self.file.drawn_conditions();
        let content = |(condition, number): (String, Option<u16>)| {
            let [clip, speaker, other] = clip.clone();
            let motion_of = if drawn.contains_key(condition.as_str()) { other } else { clip.clone() };
            FilmContent { motion_of, clip, speaker, condition, number, sound, right: None }
        };
        let mut contents: Vec<FilmContent> = shown.into_iter().map(content).collect();
        if self.file.films.layout == FilmLayout::SideBySide {
            contents = contents.into_iter().reduce(FilmContent::with_right).into_iter().collect();
        }
        contents.into_iter().map(|content| (self.film)(content)).collect()
    }
}

fn film_sound(task: &StudyTask) -> FilmSound {
    if task.sound { FilmSound::Speech } else { FilmSound::Silence }
}

/// Variants per check clip, each with its own number, so that a number passed on helps few participants.
pub(super) const N_VARIANTS: usize = 4;

/// Indices of the main trials before which attention checks are inserted, ascending: spread evenly over the session,
/// none before the third trial, none adjacent.
pub(super) fn check_positions(n_main: usize, n_checks: usize, rng: &mut ChaCha8Rng) -> Vec<usize> {
    let n_checks = n_checks.min(n_main.saturating_sub(2));
    let boundary = |at: usize| 2 + (n_main - 2) * at / n_checks;
    (0..n_checks).map(|at| rng.random_range(boundary(at)..boundary(at + 1))).collect()
}

/// Distinct two-digit numbers, drawn uniformly.
pub(super) fn numbers(rng: &mut ChaCha8Rng) -> Vec<u16> {
    let mut all: Vec<u16> = (10..=99).collect();
    all.shuffle(rng);
    all.truncate(N_VARIANTS);
    all
}
