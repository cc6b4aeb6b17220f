//! Clips of a design: the number per speaker that it needs so that no clip is repeated in a session, their allocation
//! to purposes, and the scheduler of one speaker's clips for one task, which assigns clips to sessions, each with a
//! comparison and a screen arrangement. Latin squares in which every item occurs equally often in every position and
//! after every other item (Williams 1949), and the random streams of a design.

use crate::file::{ClipReuse, StudyFile};
use anyhow::{Result, ensure};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

/// Random stream of one purpose: a change to the draws of one purpose does not affect the others.
pub(super) fn stream(seed: u64, purpose: &str) -> ChaCha8Rng {
    ChaCha8Rng::from_seed(*blake3::hash(format!("{seed} {purpose}").as_bytes()).as_bytes())
}

/// Clip with the comparison and the arrangement in which it is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct AssignedClip {
    pub clip: usize,
    pub comparison: usize,
    /// Row of the Latin square of screen positions.
    pub arrangement: usize,
}

/// Scheduler that stays balanced after any number of assigned clips: counts of clips differ by at most one, and so do the
/// counts of (clip, comparison) and of (clip, comparison, arrangement).
pub struct ClipScheduler {
    order: Vec<usize>,
    n_comparisons: usize,
    n_arrangements: usize,
    /// Offset of this scheduler's comparisons and arrangements, so that parallel schedulers do not all show the same.
    offset: usize,
    n_assigned: usize,
    rng: ChaCha8Rng,
}

impl ClipScheduler {
    /// Scheduler of `n_clips` clips; `offset` is that of the comparisons and arrangements.
    pub fn new(n_clips: usize, [n_comparisons, n_arrangements]: [usize; 2], offset: usize, rng: ChaCha8Rng) -> Self {
        let (order, n_comparisons, n_arrangements) =
            ((0..n_clips).collect(), n_comparisons.max(1), n_arrangements.max(1));
        Self { order, n_comparisons, n_arrangements, offset, n_assigned: 0, rng }
    }

    /// Assigns `n` different clips for one session, at most as many as there are.
    pub fn assign(&mut self, n: usize) -> Vec<AssignedClip> {
        let mut chosen: Vec<AssignedClip> = Vec::new();
        let n_clips = self.order.len();
        let (n_comparisons, n_arrangements) = (self.n_comparisons, self.n_arrangements);
        // Consecutive clips cycle through the comparisons. The cycle shifts by one every `n_turns` clips, where each
        // clip would otherwise meet the same comparisons again.
        let n_turns = lcm(n_clips.max(1), n_comparisons);
        for _ in 0..n.min(n_clips) {
            let at = self.n_assigned % (n_clips * n_comparisons * n_arrangements);
            if at == 0 {
                // Every combination was assigned equally often, so the order is reshuffled. Clips of this session go
                // last, so that none is assigned twice in one session.
                self.order.shuffle(&mut self.rng);
                self.order.sort_by_key(|clip| chosen.iter().any(|assigned| assigned.clip == *clip));
            }
            let (slot, visit) = (at % n_clips, at / n_clips);
            let turn = (at + at / n_turns) % n_comparisons;
            let comparison = (turn + self.offset) % n_comparisons;
            let arrangement = (visit / n_comparisons + slot / n_comparisons + turn + self.offset) % n_arrangements;
            chosen.push(AssignedClip { clip: self.order[slot], comparison, arrangement });
            self.n_assigned += 1;
        }
        chosen
    }
}

fn lcm(a: usize, b: usize) -> usize {
    let (mut x, mut y) = (a, b);
    while y != 0 {
        (x, y) = (y, x % y);
    }
    a / x * b
}

/// Rows of a carry-over-balanced Latin square of `n` items: `n` rows, or twice as many for an odd `n`.
pub fn williams(n: usize) -> Vec<Vec<usize>> {
    // First row 0, 1, n - 1, 2, n - 2, ...: the differences of neighbours are all distinct modulo n.
    let first: Vec<usize> =
        (0..n).map(|position| if position % 2 == 1 { position / 2 + 1 } else { (n - position / 2) % n }).collect();
    let mut rows: Vec<Vec<usize>> = (0..n).map(|shift| first.iter().map(|item| (item + shift) % n).collect()).collect();
    if n % 2 == 1 && n > 1 {
        let mirrored: Vec<Vec<usize>> = rows.iter().map(|row| row.iter().rev().copied().collect()).collect();
        rows.extend(mirrored);
    }
    rows
}

/// Rows of a square, one per session in random order; every row is used once before any repeats.
pub struct SquareRows {
    square: Vec<Vec<usize>>,
    order: Vec<usize>,
    n_assigned: usize,
    rng: ChaCha8Rng,
}

impl SquareRows {
    pub fn new(n: usize, rng: ChaCha8Rng) -> Self {
        let square = williams(n);
        Self { order: (0..square.len()).collect(), square, n_assigned: 0, rng }
    }

    pub fn n_rows(&self) -> usize {
        self.square.len()
    }

    pub fn next_row(&mut self) -> usize {
        let n_rows = self.square.len().max(1);
        if self.n_assigned.is_multiple_of(n_rows) {
            self.order.shuffle(&mut self.rng);
        }
        self.n_assigned += 1;
        self.order.get((self.n_assigned - 1) % n_rows).copied().unwrap_or(0)
    }

    /// Row with this index, modulo the number of rows.
    pub fn row(&self, number: usize) -> &[usize] {
        self.square.get(number % self.square.len().max(1)).map_or(&[], Vec::as_slice)
    }
}

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
    /// Allocates `clips`, at least as many as needed; surplus ones go to the main trials in proportion to their number.
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
