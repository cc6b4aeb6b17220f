//! What a small study before the real one says of how much participants and clips differ.

use super::analyse::figures::FigureSet;
use super::analyse::model::fitted;
use super::analyse::outcome::{Numbering, binary, measure};
use super::plan::{TaskDesign, TrialPhase};
use super::stats::cluster::votes::ClipVote;
use super::vote::StudyVote;
use anyhow::{Result, bail, ensure};
use serde::Serialize;
use std::collections::BTreeSet;

/// Mixed logistic regression of a pilot's votes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PilotModel {
    pub n_participants: usize,
    pub n_clips: usize,
    /// Share over all participants and clips.
    pub share: f64,
    /// Standard deviations of participants and of clips, log odds.
    pub sd_participants: f64,
    pub sd_clips: f64,
}

impl PilotModel {
    /// Model of the votes of the main phase in a task judged against chance.
    ///
    /// # Errors
    /// No vote of the task, votes that say nothing about participants and clips.
    pub fn of_votes(votes: &[StudyVote], task: &str, design: TaskDesign) -> Result<Self> {
        let is_own = |vote: &&StudyVote| vote.task == task && vote.design == design && vote.phase == TrialPhase::Main;
        let own: Vec<&StudyVote> = votes.iter().filter(is_own).collect();
        let tasks: BTreeSet<&str> = votes.iter().map(|vote| vote.task.as_str()).collect();
        let tasks = tasks.into_iter().collect::<Vec<_>>().join(", ");
        ensure!(!own.is_empty(), "the pilot has no vote of the task {task}; its tasks are {tasks}");
        let Some(measure) = measure(design) else { bail!("the task {task} is not judged against chance") };
        let own: Vec<ClipVote> =
            binary(&own, &Numbering::new(&own), measure).into_iter().map(|vote| vote.vote).collect();
        let mut found = FigureSet::default();
        let Some(model) = fitted(&own, &mut found, 0.95) else {
            bail!("the pilot's votes do not say how much participants and clips differ: {}", found.missing.join("; "))
        };
        let n = |of: fn(&ClipVote) -> usize| own.iter().map(of).collect::<BTreeSet<_>>().len();
        Ok(Self {
            n_participants: n(|vote| vote.participant),
            n_clips: n(|vote| vote.clip),
            share: model.share,
            sd_participants: model.sd_participants,
            sd_clips: model.sd_clips,
        })
    }
}
