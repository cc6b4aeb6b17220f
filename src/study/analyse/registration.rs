//! Marks of what was written down before the data were seen: the figures that a registered hypothesis is judged by.

use super::figure::FigureMethod;
use super::result::{PairAnalysis, ShareAnalysis, TaskAnalysis};
use crate::study::file::{HypothesisKind, StudyHypothesis};

/// Takes the mark of exploration from the figures that judge one of the hypotheses: the crossed ones.
pub fn register(tasks: &mut [TaskAnalysis], hypotheses: &[StudyHypothesis]) {
    for hypothesis in hypotheses {
        for task in tasks.iter_mut().filter(|task| task.task == hypothesis.task) {
            let has_conditions = task.shares.iter().any(|share| share.condition.is_some());
            let shares = task.shares.iter_mut().filter(|share| is_about(share, hypothesis, has_conditions));
            match hypothesis.kind {
                HypothesisKind::DiffersFromChance | HypothesisKind::GreaterThanChance => {
                    shares.for_each(|share| share.figures.register(FigureMethod::Crossed));
                }
                HypothesisKind::Equivalence => {
                    shares.for_each(|share| share.figures.register_equivalence(FigureMethod::Crossed));
                }
                HypothesisKind::Differs => {
                    let pairs = task.pairs.iter_mut().filter(|pair| compares(pair, &hypothesis.conditions));
                    pairs.for_each(|pair| pair.figures.register(FigureMethod::Crossed));
                }
            }
        }
    }
}

fn is_about(share: &ShareAnalysis, hypothesis: &StudyHypothesis, has_conditions: bool) -> bool {
    let is_condition = match &share.condition {
        Some(condition) => hypothesis.conditions.is_empty() || hypothesis.conditions.contains(condition),
        None => hypothesis.conditions.is_empty() || !has_conditions,
    };
    is_condition && share.speaker.is_some() == hypothesis.per_speaker
}

fn compares(pair: &PairAnalysis, conditions: &[String]) -> bool {
    conditions.is_empty() || conditions.contains(&pair.first) && conditions.contains(&pair.second)
}
