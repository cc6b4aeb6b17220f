//! Analysis of a study: exclusions, every task with and without them, registration status, notes.

use super::exclusion::exclude;
use super::registration::{Registration, judge};
use super::result::{StatisticSettings, StudyAnalysis, TaskAnalysis};
use super::task::task;
use super::text::counted;
use super::votes::read::VotesRead;
use crate::file::{HypothesisKind, StudyHypothesis};
use crate::preregistration::RegisteredHypothesis;
use crate::vote::StudyVote;
use anyhow::{Result, ensure};

/// Analyses the votes of the study `title`, read from `source`.
///
/// # Errors
/// There is no vote of the main phase, the exclusion rules exclude all of them, or a task has votes of several designs.
pub fn analyse(
    [title, source]: [&str; 2],
    read: &VotesRead,
    registration: Option<&Registration>,
    settings: &StatisticSettings,
) -> Result<StudyAnalysis> {
    let (included, mut exclusions) = exclude(read, registration.map(|registration| &registration.exclusion));
    exclusions.registered = registration.is_some_and(|registration| registration.seal.is_some());
    ensure!(exclusions.n_votes > 0, "{source} has no votes of the main phase: collect answers first");
    ensure!(
        !included.is_empty(),
        "{source}: the exclusion rules exclude all {} votes: relax [exclusion] or collect more",
        exclusions.n_votes
    );
    let hypotheses = registration.map(|registration| &registration.hypotheses[..]).unwrap_or_default();
    let mut tasks = tasks(&included, hypotheses, settings)?;
    let judged = judge(&mut tasks, hypotheses, settings.level());
    let without_exclusions = match exclusions.any_excluded() {
        true => self::tasks(&exclude(read, None).0, &[], settings)?,
        false => Vec::new(),
    };
    let mut analysis = StudyAnalysis {
        version: 1,
        title: title.to_owned(),
        source: source.to_owned(),
        seal: registration.and_then(|registration| registration.seal.clone()),
        settings: settings.clone(),
        rejected: read.rejected.clone(),
        exclusions,
        hypotheses: judged,
        tasks,
        without_exclusions,
        notes: Vec::new(),
    };
    analysis.notes = registration.map(|registration| registration.notes.clone()).unwrap_or_default();
    let more = notes(&analysis, read, registration);
    analysis.notes.extend(more);
    Ok(analysis)
}

/// Analyses the tasks in the order of their first votes.
fn tasks(
    votes: &[&StudyVote],
    hypotheses: &[RegisteredHypothesis],
    settings: &StatisticSettings,
) -> Result<Vec<TaskAnalysis>> {
    let mut names: Vec<&str> = Vec::new();
    for vote in votes {
        if !names.contains(&vote.task.as_str()) {
            names.push(&vote.task);
        }
    }
    let one = |name: &str| {
        let own: Vec<&StudyVote> = votes.iter().copied().filter(|vote| vote.task == name).collect();
        let equivalence = |claim: &&StudyHypothesis| claim.task == name && claim.kind == HypothesisKind::Equivalence;
        let mut claims = hypotheses.iter().map(|hypothesis| &hypothesis.claim);
        let bound = claims.find(equivalence).and_then(|claim| claim.points);
        let bound = bound.map_or(settings.bound, |points| points / 100.0);
        task(name, &own, &StatisticSettings { bound, ..settings.clone() })
    };
    names.into_iter().map(one).collect()
}

/// Notes that a reader must know in addition to the statistics.
fn notes(analysis: &StudyAnalysis, read: &VotesRead, registration: Option<&Registration>) -> Vec<String> {
    let mut notes = Vec::new();
    if !read.rejected.is_empty() {
        let rows = counted(read.rejected.len(), "invalid row");
        notes.push(format!("The source contains {rows}, which the analysis ignores; see the list of rejected rows."));
    }
    if registration.is_none() {
        notes.push(
            "The votes are not from a sealed study: nothing was registered in advance, and all statistics are \
            exploratory."
                .to_owned(),
        );
    }
    for rule in analysis.exclusions.rules.iter().filter(|rule| rule.unknown.is_some()) {
        notes.push(format!(
            "The exclusion rule \"{}\" could not be applied: {}.",
            rule.rule,
            rule.unknown.clone().unwrap_or_default()
        ));
    }
    for hypothesis in registration.map(|registration| &registration.hypotheses[..]).unwrap_or_default() {
        let about = &hypothesis.claim.task;
        if !analysis.tasks.iter().any(|task| task.task == *about) {
            notes.push(format!("A hypothesis concerns the task {about}, which has no votes."));
        }
    }
    for task in &analysis.tasks {
        if task.n_clips < 10 || task.n_participants < 10 {
            notes.push(format!(
                "{}: with {} and {}, the crossed statistics are imprecise; at least 20 of each are recommended.",
                task.task,
                counted(task.n_participants, "participant"),
                counted(task.n_clips, "clip")
            ));
        }
        notes.extend(task.missing.iter().map(|missing| format!("{}: {missing}.", task.task)));
    }
    notes
}
