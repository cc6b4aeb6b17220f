//! Proportion of successes compared with chance, by every method from the naive to the crossed one.

use super::outcome::{BinaryVote, distinct};
use super::result::{ModelEstimate, ShareAnalysis, ShareMeasure, StatisticSettings, TestOutcome};
use super::statistic::{StatisticMethod, StatisticSet, TestResult};
use crate::stats::cluster::crossed::crossed_estimate;
use crate::stats::cluster::sides::{SideBlock, side_p};
use crate::stats::cluster::votes::{ClipVote, participant_estimate, participant_sd};
use crate::stats::glmm::fit::MixedLogit;
use crate::stats::proportion::{BinomialCount, Equivalence};
use std::collections::BTreeMap;

pub const CHANCE: f64 = 0.5;

#[derive(Clone, Debug)]
pub struct ShareCell<'v> {
    pub measure: ShareMeasure,
    pub speaker: Option<String>,
    pub condition: Option<String>,
    pub votes: Vec<BinaryVote<'v>>,
}

/// Analyses a cell. The proportion of films judged real gets intervals only, because it has no chance level.
pub fn share(cell: &ShareCell, settings: &StatisticSettings) -> ShareAnalysis {
    let votes: Vec<ClipVote> = cell.votes.iter().map(|vote| vote.vote).collect();
    let n_successes = votes.iter().filter(|vote| vote.score == 1.0).count() as u64;
    let [n_participants, n_clips] = distinct(&votes);
    let mut found = StatisticSet::default();
    add_clustered(&mut found, cell, &votes, settings);
    add_naive(&mut found, n_successes, votes.len() as u64, settings);
    found.clamp(0.0, 1.0);
    let has_expectation = cell.measure != ShareMeasure::JudgedReal;
    if !has_expectation {
        (found.tests, found.equivalence) = (Vec::new(), Vec::new());
    }
    let mut analysis = ShareAnalysis {
        measure: cell.measure,
        speaker: cell.speaker.clone(),
        condition: cell.condition.clone(),
        n_votes: votes.len() as u64,
        n_successes,
        n_participants,
        n_clips,
        share: n_successes as f64 / votes.len().max(1) as f64,
        participant_sd: participant_sd(&votes),
        statistics: found,
        model: None,
        conclusion: TestOutcome::Untested,
    };
    if settings.with_models && has_expectation {
        analysis.model = mixed_model(&votes, &mut analysis.statistics, settings.confidence);
    }
    conclude(&mut analysis, settings.level());
    analysis
}

fn add_clustered(found: &mut StatisticSet, cell: &ShareCell, votes: &[ClipVote], settings: &StatisticSettings) {
    let confidence = settings.confidence;
    if let Some(estimate) = found.ok_or_record(StatisticMethod::Crossed, crossed_estimate(votes)) {
        found.add_estimate(StatisticMethod::Crossed, &estimate, CHANCE, confidence);
        let equivalence = Equivalence::of_estimate(&estimate, CHANCE, settings.bound);
        found.add_equivalence(StatisticMethod::Crossed, equivalence);
    }
    if let Some(blocks) = side_blocks(&cell.votes) {
        found.add_test(StatisticMethod::Sides, side_p(&blocks));
    }
    if let Some(estimate) = found.ok_or_record(StatisticMethod::Participants, participant_estimate(votes)) {
        found.add_estimate(StatisticMethod::Participants, &estimate, CHANCE, confidence);
    }
}

fn add_naive(found: &mut StatisticSet, n_successes: u64, n_votes: u64, settings: &StatisticSettings) {
    let Some(count) = found.ok_or_record(StatisticMethod::Binomial, BinomialCount::new(n_successes, n_votes)) else {
        return;
    };
    found.add_interval(StatisticMethod::Wilson, count.wilson(settings.confidence));
    found.add_test(StatisticMethod::Binomial, count.test(CHANCE));
    found.add_equivalence(StatisticMethod::Binomial, Equivalence::of_count(&count, CHANCE, settings.bound));
}

/// Draws the conclusion from the crossed test, adjusted if it belongs to a family, and the crossed equivalence test.
pub fn conclude(analysis: &mut ShareAnalysis, level: f64) {
    let is_equivalent = analysis.statistics.equivalence(StatisticMethod::Crossed).is_some_and(|test| test.passes);
    analysis.conclusion =
        TestOutcome::new(analysis.statistics.crossed_p(), level, analysis.share - CHANCE, is_equivalent);
}

/// Trials of each participant by side; `None` if sides are unknown, as in tables that report correctness only.
fn side_blocks(votes: &[BinaryVote]) -> Option<Vec<SideBlock>> {
    let mut blocks: BTreeMap<usize, SideBlock> = BTreeMap::new();
    let mut seen = [false; 2];
    for vote in votes {
        let [is_left, chose_left] = vote.sides?;
        seen[usize::from(is_left)] = true;
        blocks.entry(vote.vote.participant).or_default().push(is_left, chose_left);
    }
    (seen == [true; 2]).then(|| blocks.into_values().collect())
}

/// Fits a mixed logistic model with crossed random intercepts to votes with scores 0 and 1. The interval is that of the
/// marginal proportion; the test compares the intercept with 0, with min(participants, clips) - 1 degrees of freedom.
pub fn mixed_model(votes: &[ClipVote], found: &mut StatisticSet, confidence: f64) -> Option<ModelEstimate> {
    let model = found.ok_or_record(StatisticMethod::MixedModel, MixedLogit::fit(votes))?;
    let (share, interval) = found.ok_or_record(StatisticMethod::MixedModel, model.share(confidence))?;
    if !model.converged {
        found
            .missing
            .push(format!("{}: the likelihood maximisation did not converge", StatisticMethod::MixedModel.name()));
        return None;
    }
    found.add_interval(StatisticMethod::MixedModel, Ok(interval));
    found.tests.push(TestResult::of_estimate(StatisticMethod::MixedModel, &model.intercept, 0.0));
    Some(ModelEstimate {
        exploratory: true,
        share,
        log_odds: model.intercept.value,
        standard_error: model.intercept.standard_error,
        sd_participants: model.sd_participants,
        sd_clips: model.sd_clips,
    })
}
