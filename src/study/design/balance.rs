//! How equally votes are spread over what a task compares.

use super::task_design::{DealtTrial, TaskDesigner};
use std::collections::BTreeMap;
use std::fmt;

/// Votes of one task, once every wanted participant has answered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskBalance {
    pub task: String,
    /// Clips by compared conditions.
    pub n_cells: usize,
    /// Fewest and most votes of a cell.
    pub votes: [usize; 2],
    /// Fewest and most votes of a cell with its films in one arrangement on the screen.
    pub arranged: [usize; 2],
    cells: BTreeMap<(usize, usize, usize), Vec<usize>>,
}

impl TaskBalance {
    /// Balance without votes.
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

    pub fn count(&mut self, trials: &[DealtTrial]) {
        for DealtTrial { speaker, dealt } in trials {
            let cell = self.cells.get_mut(&(*speaker, dealt.clip, dealt.comparison));
            if let Some(votes) = cell.and_then(|cell| cell.get_mut(dealt.arrangement)) {
                *votes += 1;
            }
        }
        self.votes = extent(self.cells.values().map(|cell| cell.iter().sum()));
        self.arranged = extent(self.cells.values().flatten().copied());
    }
}

fn extent(counts: impl Iterator<Item = usize>) -> [usize; 2] {
    let counts: Vec<usize> = counts.collect();
    [counts.iter().min(), counts.iter().max()].map(|count| count.copied().unwrap_or(0))
}

impl fmt::Display for TaskBalance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let range = |[least, most]: [usize; 2]| {
            if least == most { format!("{least}") } else { format!("{least} or {most}") }
        };
        let (votes, arranged) = (range(self.votes), range(self.arranged));
        write!(f, "{}: {votes} votes of each of {} cells, {arranged} in each order of films", self.task, self.n_cells)
    }
}
