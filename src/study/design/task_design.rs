//! Design of one task over all sessions: the comparisons of its trials, their correct responses, its clip schedulers, the
//! order of its trials, and the balance of votes over its cells.

use super::clip_scheduler::{AssignedClip, ClipScheduler, SharedClips, SquareRows, stream};
use crate::file::{StudyCondition, StudyFile, StudyTask};
use crate::plan::TaskDesign;
use crate::vote::{Response, ScreenSide};
use std::collections::{BTreeMap, VecDeque};
use std::fmt;

pub(super) type ComparedConditions<'a> = Vec<&'a StudyCondition>;

/// Comparisons of a task, each of which gets an equal share of the trials. With single films the real condition is as
/// frequent as all others together, so that chance is one half.
pub(super) fn comparisons<'a>(file: &'a StudyFile, task: &StudyTask) -> Vec<ComparedConditions<'a>> {
    let all: ComparedConditions = task.conditions.iter().filter_map(|name| file.find_condition(name)).collect();
    let real = all.iter().copied().find(|condition| condition.real);
    let others = || all.iter().copied().filter(|condition| !condition.real);
    match task.design {
        TaskDesign::Turing => others().filter_map(|other| Some(vec![real?, other])).collect(),
        TaskDesign::TuringSingle => others().filter_map(|other| Some([vec![real?], vec![other]])).flatten().collect(),
        TaskDesign::Preference => {
            let pairs = all.iter().enumerate().flat_map(|(at, a)| all[at + 1..].iter().map(move |b| vec![*a, *b]));
            pairs.collect()
        }
        TaskDesign::Sliders => vec![all],
        TaskDesign::Mismatch => {
            let matched = |condition: &StudyCondition| file.find_condition(condition.source.mismatch_of()?);
            all.iter().filter_map(|condition| Some(vec![matched(condition)?, *condition])).collect()
        }
    }
}

/// Correct response to conditions shown left to right, if the design has one.
pub fn right_response(design: TaskDesign, shown: &[&StudyCondition]) -> Option<Response> {
    let side = |is_right: fn(&StudyCondition) -> bool| {
        let left = is_right(shown.first()?);
        Some(Response::Side(if left { ScreenSide::Left } else { ScreenSide::Right }))
    };
    match design {
        TaskDesign::Turing => side(|condition| condition.real),
        TaskDesign::TuringSingle => Some(Response::Real(shown.first()?.real)),
        TaskDesign::Mismatch => side(|condition| condition.source.mismatch_of().is_none()),
        TaskDesign::Preference | TaskDesign::Sliders => None,
    }
}

/// Clip of a speaker with its comparison and arrangement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct AssignedTrial {
    pub speaker: usize,
    pub assigned: AssignedClip,
}

pub struct TaskDesigner<'a> {
    pub task: &'a StudyTask,
    pub comparisons: Vec<ComparedConditions<'a>>,
    /// Screen positions of a comparison's conditions.
    pub arrangements: SquareRows,
    number: usize,
    practice: Vec<ClipScheduler>,
    training: Vec<ClipScheduler>,
    main: Vec<ClipScheduler>,
    group_rows: SquareRows,
    clip_rows: SquareRows,
}

impl<'a> TaskDesigner<'a> {
    pub fn new(file: &'a StudyFile, number: usize, clips: &[SharedClips]) -> Self {
        let task = &file.task[number];
        let comparisons = comparisons(file, task);
        let rng = |what: &str, speaker: usize| stream(file.seed, &format!("{} {what} {speaker}", task.name));
        let n_films = comparisons.first().map_or(0, Vec::len);
        let arrangements = SquareRows::new(n_films, rng("arrangements", 0));
        let schedulers = |what: &str, n_clips: &dyn Fn(&SharedClips) -> usize| -> Vec<ClipScheduler> {
            let scheduler = |(speaker, shared): (usize, &SharedClips)| {
                ClipScheduler::new(
                    n_clips(shared),
                    [comparisons.len(), arrangements.n_rows()],
                    speaker,
                    rng(what, speaker),
                )
            };
            clips.iter().enumerate().map(scheduler).collect()
        };
        let n_main = clips.iter().map(|shared| shared.main[number].len()).max().unwrap_or(0);
        Self {
            practice: schedulers("practice", &|shared| shared.practice.len()),
            training: schedulers("training", &|shared| shared.training[number].len()),
            main: schedulers("main", &|shared| shared.main[number].len()),
            group_rows: SquareRows::new(clips.len() * comparisons.len(), rng("groups", 0)),
            clip_rows: SquareRows::new(n_main, rng("clips", 0)),
            task,
            comparisons,
            arrangements,
            number,
        }
    }

    pub fn practice(&mut self, session: usize) -> Vec<AssignedTrial> {
        assign(&mut self.practice, 1, session)
    }

    pub fn training(&mut self, session: usize) -> Vec<AssignedTrial> {
        assign(&mut self.training, self.task.training, session + self.number)
    }

    /// Main trials of a session in order. One square orders the groups (speaker, comparison), another their clips.
    pub fn main(&mut self, session: usize) -> Vec<AssignedTrial> {
        let assigned = assign(&mut self.main, self.task.trials, session + self.number);
        let mut groups: BTreeMap<usize, VecDeque<AssignedTrial>> = BTreeMap::new();
        let clip_row = self.clip_rows.next_row();
        let clip_row = self.clip_rows.row(clip_row);
        for clip in clip_row {
            for trial in assigned.iter().filter(|trial| trial.assigned.clip == *clip) {
                let group = trial.speaker * self.comparisons.len() + trial.assigned.comparison;
                groups.entry(group).or_default().push_back(*trial);
            }
        }
        let first = self.group_rows.next_row();
        let turns = (0..assigned.len()).flat_map(|turn| self.group_rows.row(first + turn));
        turns.filter_map(|group| groups.get_mut(group)?.pop_front()).collect()
    }
}

/// Assigns `n` clips, the same number of each speaker; which speakers give the remainder rotates over the sessions.
pub(super) fn assign(schedulers: &mut [ClipScheduler], n: usize, session: usize) -> Vec<AssignedTrial> {
    let n_speakers = schedulers.len().max(1);
    let (each, more) = (n / n_speakers, n % n_speakers);
    let n_of = |speaker: usize| each + usize::from((speaker + session * (n_speakers - more)) % n_speakers < more);
    let chosen = schedulers.iter_mut().enumerate().map(|(speaker, scheduler)| {
        scheduler.assign(n_of(speaker)).into_iter().map(move |assigned| AssignedTrial { speaker, assigned })
    });
    chosen.flatten().collect()
}

/// Expected balance of the votes of one task, assuming that the target number of participants complete the study.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskBalance {
    pub task: String,
    /// Number of cells: combinations of a clip and a comparison.
    pub n_cells: usize,
    /// Minimum and maximum number of votes per cell.
    pub votes: [usize; 2],
    /// Minimum and maximum number of votes per cell and arrangement of its films on the screen.
    pub arranged: [usize; 2],
    cells: BTreeMap<(usize, usize, usize), Vec<usize>>,
}

impl TaskBalance {
    pub fn new(designer: &TaskDesigner, n_clips: &[usize]) -> Self {
        let of_speaker = |(speaker, n): (usize, &usize)| (0..*n).map(move |clip| (speaker, clip)).collect::<Vec<_>>();
        let clips = n_clips.iter().enumerate().flat_map(of_speaker);
        let n_comparisons = designer.comparisons.len();
        let empty = || vec![0; designer.arrangements.n_rows()];
        let cells = clips.flat_map(|(speaker, clip)| (0..n_comparisons).map(move |k| (speaker, clip, k)));
        let cells: BTreeMap<_, _> = cells.map(|cell| (cell, empty())).collect();
        let (task, n_cells) = (designer.task.name.clone(), cells.len());
        Self { task, n_cells, votes: [0; 2], arranged: [0; 2], cells }
    }

    pub fn count(&mut self, trials: &[AssignedTrial]) {
        for AssignedTrial { speaker, assigned } in trials {
            let cell = self.cells.get_mut(&(*speaker, assigned.clip, assigned.comparison));
            if let Some(votes) = cell.and_then(|cell| cell.get_mut(assigned.arrangement)) {
                *votes += 1;
            }
        }
        self.votes = min_max(self.cells.values().map(|cell| cell.iter().sum()));
        self.arranged = min_max(self.cells.values().flatten().copied());
    }
}

fn min_max(counts: impl Iterator<Item = usize>) -> [usize; 2] {
    let counts: Vec<usize> = counts.collect();
    [counts.iter().min(), counts.iter().max()].map(|count| count.copied().unwrap_or(0))
}

impl fmt::Display for TaskBalance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let range = |[min, max]: [usize; 2]| {
            if min == max { format!("{min}") } else { format!("{min} or {max}") }
        };
        let (votes, arranged) = (range(self.votes), range(self.arranged));
        write!(f, "{}: {votes} votes in each of {} cells, {arranged} in each order of films", self.task, self.n_cells)
    }
}
