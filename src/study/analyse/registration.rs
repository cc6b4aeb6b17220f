//! What was written down before the data were seen: read from a sealed study, marked in the figures, and what became of
//! each hypothesis.

use super::figure::FigureMethod;
use super::figures::FigureSet;
use super::result::{JudgedClaim, JudgedHypothesis, PairAnalysis, ShareAnalysis, TaskAnalysis};
use super::verdict::scope;
use crate::file::{AnalysisSettings, ExclusionRules, HypothesisKind, StudyHypothesis};
use crate::folder::StudyFolder;
use crate::preregistration::{Preregistration, RegisteredHypothesis};
use crate::seal::StudySeal;
use anyhow::Result;

/// What was fixed before the data were seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Registration {
    pub title: String,
    /// Hash over the sealed study; none where its files are not as they were sealed.
    pub seal: Option<String>,
    /// What a reader must know about it.
    pub notes: Vec<String>,
    pub hypotheses: Vec<RegisteredHypothesis>,
    pub exclusion: ExclusionRules,
    pub settings: AnalysisSettings,
}

impl Registration {
    /// Registration of a study's folder. A seal that does not hold is noted, with the files that differ, and then nothing
    /// counts as registered: the hypotheses may have been written after the data were seen.
    ///
    /// # Errors
    /// No pre-registration, or one that is damaged.
    pub fn of_folder(folder: &StudyFolder) -> Result<Self> {
        let registered = Preregistration::read(&folder.preregistration())?;
        let broken = match StudySeal::read(folder) {
            Ok(seal) => match seal.compare(folder)? {
                broken if broken.is_whole() => Ok(seal.seal),
                broken => Err(format!("files of the study are not as they were sealed ({broken})")),
            },
            Err(error) => Err(format!("{error:#}")),
        };
        let (seal, notes) = match broken {
            Ok(seal) => (Some(seal), Vec::new()),
            Err(why) => (None, vec![format!("The seal does not hold, so nothing counts as registered: {why}.")]),
        };
        Ok(Self {
            title: registered.title,
            hypotheses: if seal.is_some() { registered.hypotheses } else { Vec::new() },
            seal,
            notes,
            exclusion: registered.exclusion,
            settings: registered.analysis,
        })
    }
}

/// Takes the mark of exploration from the figures that judge one of the hypotheses: the crossed ones.
pub fn register(tasks: &mut [TaskAnalysis], hypotheses: &[RegisteredHypothesis]) {
    for claim in hypotheses.iter().map(|hypothesis| &hypothesis.claim) {
        for task in tasks.iter_mut().filter(|task| task.task == claim.task) {
            let has_conditions = has_conditions(task);
            let shares = task.shares.iter_mut().filter(|share| is_about(share, claim, has_conditions));
            match claim.kind {
                HypothesisKind::DiffersFromChance | HypothesisKind::GreaterThanChance => {
                    shares.for_each(|share| share.figures.register(FigureMethod::Crossed));
                }
                HypothesisKind::Equivalence => {
                    shares.for_each(|share| share.figures.register_equivalence(FigureMethod::Crossed));
                }
                HypothesisKind::Differs => {
                    let pairs = task.pairs.iter_mut().filter(|pair| compares(pair, &claim.conditions));
                    pairs.for_each(|pair| pair.figures.register(FigureMethod::Crossed));
                }
            }
        }
    }
}

/// What became of each hypothesis, by the figures that were registered for it, at the error of the first kind `level`.
pub fn judged(tasks: &[TaskAnalysis], hypotheses: &[RegisteredHypothesis], level: f64) -> Vec<JudgedHypothesis> {
    let judge = |hypothesis: &RegisteredHypothesis| {
        let claim = &hypothesis.claim;
        let found = tasks.iter().find(|task| task.task == claim.task);
        let claims = found.map(|task| claims(task, claim, level)).unwrap_or_default();
        JudgedHypothesis {
            task: claim.task.clone(),
            claim: words(claim),
            statistic: hypothesis.statistic.clone(),
            claims,
        }
    };
    hypotheses.iter().map(judge).collect()
}

fn claims(task: &TaskAnalysis, claim: &StudyHypothesis, level: f64) -> Vec<JudgedClaim> {
    let tested = |scope: String, figures: &FigureSet, is_right_way: bool| {
        let test = figures.test(FigureMethod::Crossed);
        let p = test.map(|test| test.adjusted_p.unwrap_or(test.p));
        JudgedClaim { scope, p, holds: p.map(|p| p < level && is_right_way) }
    };
    let has_conditions = has_conditions(task);
    let shares = task.shares.iter().filter(|share| is_about(share, claim, has_conditions));
    match claim.kind {
        HypothesisKind::DiffersFromChance => shares.map(|share| tested(scope(share), &share.figures, true)).collect(),
        HypothesisKind::GreaterThanChance => {
            shares.map(|share| tested(scope(share), &share.figures, share.right_share() > 0.5)).collect()
        }
        HypothesisKind::Equivalence => shares
            .map(|share| {
                let test = share.figures.equivalence(FigureMethod::Crossed);
                JudgedClaim { scope: scope(share), p: test.map(|test| test.p), holds: test.map(|test| test.passes) }
            })
            .collect(),
        HypothesisKind::Differs => {
            let pairs = task.pairs.iter().filter(|pair| compares(pair, &claim.conditions));
            pairs.map(|pair| tested(format!("{} and {}", pair.first, pair.second), &pair.figures, true)).collect()
        }
    }
}

/// A hypothesis in words.
fn words(claim: &StudyHypothesis) -> String {
    let who = if claim.per_speaker { ", each speaker by itself" } else { "" };
    let which = match &claim.conditions[..] {
        [] => String::new(),
        names => format!(" ({})", names.join(", ")),
    };
    let what = match claim.kind {
        HypothesisKind::DiffersFromChance => "the share of right responses differs from 50 %".to_owned(),
        HypothesisKind::GreaterThanChance => "the share of right responses is above 50 %".to_owned(),
        HypothesisKind::Equivalence => {
            format!("the share of right responses lies within {} points of 50 %", claim.points.unwrap_or_default())
        }
        HypothesisKind::Differs => "conditions differ".to_owned(),
    };
    format!("{what}{which}{who}")
}

/// Whether films of several conditions are judged by themselves.
fn has_conditions(task: &TaskAnalysis) -> bool {
    task.shares.iter().any(|share| share.condition.is_some())
}

fn is_about(share: &ShareAnalysis, hypothesis: &StudyHypothesis, has_conditions: bool) -> bool {
    let is_condition = match &share.condition {
        Some(condition) => hypothesis.conditions.contains(condition),
        None => hypothesis.conditions.is_empty() || !has_conditions,
    };
    is_condition && share.speaker.is_some() == hypothesis.per_speaker
}

fn compares(pair: &PairAnalysis, conditions: &[String]) -> bool {
    conditions.is_empty() || conditions.contains(&pair.first) && conditions.contains(&pair.second)
}
