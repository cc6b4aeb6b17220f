//! Registration: read from a sealed study, marked in the statistics, with the outcome of each hypothesis.

use super::conclusions::scope;
use super::result::{JudgedClaim, JudgedHypothesis, PairAnalysis, ShareAnalysis, TaskAnalysis};
use super::statistic::{StatisticMethod, StatisticSet};
use crate::file::{AnalysisSettings, ExclusionRules, HypothesisKind, StudyHypothesis};
use crate::folder::StudyFolder;
use crate::preregistration::{Preregistration, RegisteredHypothesis};
use crate::seal::StudySeal;
use anyhow::Result;

/// Specification fixed before the data were seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Registration {
    pub title: String,
    /// Combined hash of the sealed study; `None` if the seal is broken.
    pub seal: Option<String>,
    pub notes: Vec<String>,
    pub hypotheses: Vec<RegisteredHypothesis>,
    pub exclusion: ExclusionRules,
    pub settings: AnalysisSettings,
}

impl Registration {
    /// Reads the registration of a study folder. If the seal is broken, a note names the files that differ, and
    /// nothing counts as registered: the hypotheses may have been written after the data were seen.
    pub fn of_folder(folder: &StudyFolder) -> Result<Self> {
        let registered = Preregistration::read(&folder.preregistration())?;
        let mismatch = match StudySeal::read(folder) {
            Ok(seal) => match seal.compare(folder)? {
                mismatch if mismatch.is_empty() => Ok(seal.seal),
                mismatch => Err(format!("files were modified after sealing ({mismatch})")),
            },
            Err(error) => Err(format!("{error:#}")),
        };
        let (seal, notes) = match mismatch {
            Ok(seal) => (Some(seal), Vec::new()),
            Err(reason) => (None, vec![format!("The seal is broken, so nothing counts as registered: {reason}.")]),
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

/// Outcome of each hypothesis at significance level `level`, from the crossed statistics registered for it. These
/// statistics are no longer marked as exploratory.
pub fn judge(tasks: &mut [TaskAnalysis], hypotheses: &[RegisteredHypothesis], level: f64) -> Vec<JudgedHypothesis> {
    let mut one = |RegisteredHypothesis { claim, statistic }: &RegisteredHypothesis| {
        let found = tasks.iter_mut().find(|task| task.task == claim.task);
        JudgedHypothesis {
            task: claim.task.clone(),
            claim: describe_claim(claim),
            statistic: statistic.clone(),
            claims: found.map(|task| judged_claims(task, claim, level)).unwrap_or_default(),
        }
    };
    hypotheses.iter().map(&mut one).collect()
}

fn judged_claims(task: &mut TaskAnalysis, claim: &StudyHypothesis, level: f64) -> Vec<JudgedClaim> {
    let tested = |scope: String, statistics: &mut StatisticSet, is_right_way: bool| {
        statistics.register(StatisticMethod::Crossed);
        let p = statistics.crossed_p();
        JudgedClaim { scope, p, holds: p.map(|p| p < level && is_right_way) }
    };
    if claim.kind == HypothesisKind::Differs {
        let is_about = |pair: &&mut PairAnalysis| {
            let names = &claim.conditions;
            names.is_empty() || names.contains(&pair.first) && names.contains(&pair.second)
        };
        let pairs = task.pairs.iter_mut().filter(is_about);
        return pairs
            .map(|pair| tested(format!("{} and {}", pair.first, pair.second), &mut pair.statistics, true))
            .collect();
    }
    let has_conditions = task.shares.iter().any(|share| share.condition.is_some());
    let judged = |share: &mut ShareAnalysis| {
        let (scope, is_above) = (scope(share), share.right_share() > 0.5);
        if claim.kind != HypothesisKind::Equivalence {
            let is_right_way = is_above || claim.kind == HypothesisKind::DiffersFromChance;
            return tested(scope, &mut share.statistics, is_right_way);
        }
        share.statistics.register_equivalence(StatisticMethod::Crossed);
        let test = share.statistics.equivalence(StatisticMethod::Crossed);
        JudgedClaim { scope, p: test.map(|test| test.p), holds: test.map(|test| test.passes) }
    };
    task.shares.iter_mut().filter(|share| is_about(share, claim, has_conditions)).map(judged).collect()
}

fn describe_claim(claim: &StudyHypothesis) -> String {
    let speakers = match (claim.per_speaker, claim.kind) {
        // Differences between conditions are estimated over all speakers only.
        (true, HypothesisKind::Differs) => ", all speakers combined",
        (true, _) => ", each speaker separately",
        (false, _) => "",
    };
    let conditions = match &claim.conditions[..] {
        [] => String::new(),
        names => format!(" ({})", names.join(", ")),
    };
    let statement = match claim.kind {
        HypothesisKind::DiffersFromChance => "the share of correct responses differs from 50 %".to_owned(),
        HypothesisKind::GreaterThanChance => "the share of correct responses is above 50 %".to_owned(),
        HypothesisKind::Equivalence => {
            format!(
                "the share of correct responses lies within {} percentage points of 50 %",
                claim.points.unwrap_or_default()
            )
        }
        HypothesisKind::Differs => "conditions differ".to_owned(),
    };
    format!("{statement}{conditions}{speakers}")
}

fn is_about(share: &ShareAnalysis, hypothesis: &StudyHypothesis, has_conditions: bool) -> bool {
    let is_condition = match &share.condition {
        Some(condition) => hypothesis.conditions.contains(condition),
        None => hypothesis.conditions.is_empty() || !has_conditions,
    };
    is_condition && share.speaker.is_some() == hypothesis.per_speaker
}
