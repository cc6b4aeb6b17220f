//! Number of clips per speaker that a design needs so that no clip is repeated in a session, and their allocation to
//! purposes.

use crate::file::{ClipReuse, StudyFile};
use anyhow::{Result, ensure};
use std::collections::BTreeMap;

/// Number of clips needed of each speaker, by purpose.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClipNeeds {
    pub reuse: ClipReuse,
    /// Clips for the sound check and the practice trial.
    pub practice: usize,
    pub checks: usize,
    pub training: Vec<usize>,
    pub main: Vec<usize>,
}

impl ClipNeeds {
    /// Minimum numbers for a study file; trials are divided evenly among its speakers.
    pub fn of(file: &StudyFile) -> Self {
        let share = |n: usize| n.div_ceil(file.speaker.len().max(1));
        Self {
            reuse: file.clips.reuse,
            practice: 1,
            checks: share(file.attention_checks),
            training: file.task.iter().map(|task| share(task.training)).collect(),
            main: file.task.iter().map(|task| share(task.trials)).collect(),
        }
    }

    /// Total number of clips that each speaker needs.
    pub fn total(&self) -> usize {
        let of_tasks = |needs: &[usize]| match self.reuse {
            ClipReuse::Never => needs.iter().sum::<usize>(),
            ClipReuse::OtherTasks => needs.iter().copied().max().unwrap_or(0),
        };
        self.practice + self.checks + of_tasks(&self.training) + of_tasks(&self.main)
    }

    /// Checks that each speaker has enough clips.
    ///
    /// # Errors
    /// Speakers have too few clips; the error names them, the number needed and remedies.
    pub fn check(&self, file: &StudyFile, clips: &BTreeMap<String, Vec<String>>) -> Result<()> {
        let n_clips = |name: &String| clips.get(name).map_or(0, Vec::len);
        let few = file.speaker.iter().filter(|speaker| n_clips(&speaker.name) < self.total());
        let few: Vec<String> = few.map(|speaker| format!("{} has {}", speaker.name, n_clips(&speaker.name))).collect();
        let tasks = file.task.iter().zip(self.main.iter().zip(&self.training));
        let tasks = tasks.map(|(task, (main, training))| format!("{main} + {training} for {}", task.name));
        let tasks: Vec<String> = tasks.collect();
        let remedy = match (self.reuse, Self { reuse: ClipReuse::OtherTasks, ..self.clone() }.total()) {
            (ClipReuse::Never, fewer) if fewer < self.total() => {
                format!(", or reuse = \"other-tasks\" in [clips], which needs {fewer}")
            }
            _ => String::new(),
        };
        ensure!(
            few.is_empty(),
            "{} clips per speaker are needed so that no clip is repeated in a session (trials and training: {}; \
             attention checks: {}; practice: {}), but {}: use more recordings, shorter clips (seconds in [clips]), \
             fewer trials{remedy}",
            self.total(),
            tasks.join(", "),
            self.checks,
            self.practice,
            few.join(", ")
        );
        Ok(())
    }
}

/// Names of one speaker's clips, by purpose.
#[derive(Clone, Debug)]
pub struct SharedClips {
    pub practice: Vec<String>,
    pub checks: Vec<String>,
    pub training: Vec<Vec<String>>,
    pub main: Vec<Vec<String>>,
}

impl SharedClips {
    /// Allocates `clips`, which must be at least as many as needed; surplus clips go to the main trials in proportion to
    /// their number.
    pub fn new(needs: &ClipNeeds, mut clips: Vec<String>) -> Self {
        let n_surplus = clips.len().saturating_sub(needs.total());
        let mut take = |n: usize| clips.drain(..n.min(clips.len())).collect::<Vec<String>>();
        let (practice, checks) = (take(needs.practice), take(needs.checks));
        let n_tasks = needs.main.len();
        match needs.reuse {
            ClipReuse::Never => {
                let training = needs.training.iter().map(|n| take(*n)).collect();
                let total: usize = needs.main.iter().sum::<usize>().max(1);
                // Rounding the cumulative share of each task makes the shares add up to all surplus clips.
                let mut n_before = 0;
                let main = needs.main.iter().map(|n| {
                    let given = n_surplus * n_before / total;
                    n_before += n;
                    take(n + n_surplus * n_before / total - given)
                });
                Self { practice, checks, training, main: main.collect() }
            }
            ClipReuse::OtherTasks => {
                let training = take(needs.training.iter().copied().max().unwrap_or(0));
                let main = take(usize::MAX);
                Self { practice, checks, training: vec![training; n_tasks], main: vec![main; n_tasks] }
            }
        }
    }
}
