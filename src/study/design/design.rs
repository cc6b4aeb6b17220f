//! Designs a study from its file and its clips.

use super::clip_scheduler::{ClipNeeds, ClipScheduler, SharedClips, SquareRows, stream};
use super::designer::{Designer, numbers};
use super::task_design::{TaskBalance, TaskDesigner};
use crate::file::StudyFile;
use crate::plan::{FilmContent, PlannedTask, StudyPlan};
use anyhow::Result;
use rand::seq::SliceRandom;
use std::collections::BTreeMap;

const VERSION: u32 = 1;

#[derive(Clone, Debug, PartialEq)]
pub struct DesignedStudy {
    pub plan: StudyPlan,
    pub balance: Vec<TaskBalance>,
}

/// Designs the sessions of a study. `clips` holds names `speaker/clip` by speaker, best first, each with motion for
/// every condition; the same number is used of every speaker. `film` returns the opaque name of the film with the given
/// content. Its `motion_of` is the clip itself, except in mismatched films whose other clip is drawn per participant; a
/// fixed one is determined by `film`.
///
/// # Errors
/// A speaker has too few clips, or `film` fails.
pub fn design(
    file: &StudyFile,
    clips: &BTreeMap<String, Vec<String>>,
    film: &mut dyn FnMut(FilmContent) -> Result<String>,
) -> Result<DesignedStudy> {
    let needs = ClipNeeds::of(file);
    needs.check(file, clips)?;
    let of_speaker = |name: &String| clips.get(name).map_or(&[][..], Vec::as_slice);
    let n_clips = file.speaker.iter().map(|speaker| of_speaker(&speaker.name).len()).min().unwrap_or(0);
    let shared = file.speaker.iter().map(|speaker| {
        let mut clips = of_speaker(&speaker.name)[..n_clips].to_vec();
        clips.shuffle(&mut stream(file.seed, &format!("clips of {}", speaker.name)));
        SharedClips::new(&needs, clips)
    });
    let shared: Vec<SharedClips> = shared.collect();
    let tasks: Vec<TaskDesigner> = (0..file.task.len()).map(|at| TaskDesigner::new(file, at, &shared)).collect();
    let n_main = |at: usize| shared.iter().map(|shared| shared.main[at].len()).collect::<Vec<usize>>();
    let balance = tasks.iter().enumerate().map(|(at, task)| TaskBalance::new(task, &n_main(at))).collect();
    let scheduler = |(at, shared): (usize, &SharedClips)| {
        ClipScheduler::new(shared.checks.len(), [1, 1], 0, stream(file.seed, &format!("checks {at}")))
    };
    let check_schedulers = shared.iter().enumerate().map(scheduler).collect();
    let mut rng = stream(file.seed, "numbers");
    let check_numbers = shared.iter().map(|shared| shared.checks.iter().map(|_| numbers(&mut rng)).collect()).collect();
    let task_rows = SquareRows::new(file.task.len(), stream(file.seed, "tasks"));
    let rng = stream(file.seed, "checks");
    let mut designer = Designer { file, shared, tasks, balance, check_schedulers, check_numbers, task_rows, rng, film };
    let sessions = (0..file.n_sessions()).map(|session| designer.session(session)).collect::<Result<_>>()?;
    let sound_check = designer.sound_check()?;
    let planned = |at: usize| {
        let task = &file.task[at];
        let (name, scale) = (task.name.clone(), task.scale.clone());
        PlannedTask { name, design: task.design, replay: task.replay, scale }
    };
    let tasks = (0..file.task.len()).map(planned).collect();
    let plan = StudyPlan { version: VERSION, seed: file.seed, tasks, sound_check, sessions };
    Ok(DesignedStudy { plan, balance: designer.balance })
}
