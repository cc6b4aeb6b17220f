//! Clips of one speaker shared out: each to one purpose, so that none comes twice in a session.

use super::clip_needs::ClipNeeds;
use crate::file::ClipReuse;

/// Clips of one speaker by purpose.
#[derive(Clone, Debug)]
pub struct SharedClips {
    pub practice: Vec<String>,
    pub checks: Vec<String>,
    /// By task.
    pub training: Vec<Vec<String>>,
    /// By task.
    pub main: Vec<Vec<String>>,
}

impl SharedClips {
    /// Shares out `clips`, at least as many as needed; what is left over goes to the trials in proportion.
    pub fn new(needs: &ClipNeeds, mut clips: Vec<String>) -> Self {
        let n_spare = clips.len().saturating_sub(needs.total());
        let mut take = |n: usize| clips.drain(..n.min(clips.len())).collect::<Vec<String>>();
        let (practice, checks) = (take(needs.practice), take(needs.checks));
        let n_tasks = needs.main.len();
        match needs.reuse {
            ClipReuse::Never => {
                let training = needs.training.iter().map(|n| take(*n)).collect();
                let total: usize = needs.main.iter().sum::<usize>().max(1);
                // Spare clips up to the end of each task's share: the shares add up to all.
                let mut n_before = 0;
                let main = needs.main.iter().map(|n| {
                    let given = n_spare * n_before / total;
                    n_before += n;
                    take(n + n_spare * n_before / total - given)
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
