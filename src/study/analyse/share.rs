//! Share of successes against chance, by every method from the naive to the crossed one.

use super::figure::FigureMethod;
use super::figures::FigureSet;
use super::model::fitted;
use super::outcome::BinaryVote;
use super::result::{Conclusion, FigureSettings, ShareAnalysis, ShareMeasure};
use crate::stats::cluster::bootstrap::CrossedBootstrap;
use crate::stats::cluster::crossed::crossed_estimate;
use crate::stats::cluster::participants::participant_estimate;
use crate::stats::cluster::votes::ClipVote;
use crate::stats::equivalence::Equivalence;
use crate::stats::permutation::crossed_flip::crossed_sign_flip;
use crate::stats::permutation::sides::{SideBlock, side_test};
use crate::stats::proportion::BinomialCount;
use std::collections::{BTreeMap, BTreeSet};

/// Share where nothing is known.
pub const CHANCE: f64 = 0.5;

/// Votes that a share is of.
#[derive(Clone, Debug)]
pub struct ShareCell<'v> {
    pub measure: ShareMeasure,
    pub speaker: Option<String>,
    pub condition: Option<String>,
    pub votes: Vec<BinaryVote<'v>>,
}

/// Analysis of a cell. Films taken for real have intervals alone: half of them is no expectation.
pub fn share(cell: &ShareCell, settings: &FigureSettings) -> ShareAnalysis {
    let votes: Vec<ClipVote> = cell.votes.iter().map(|vote| vote.vote).collect();
    let n_successes = votes.iter().filter(|vote| vote.score == 1.0).count() as u64;
    let numbers = |of: fn(&ClipVote) -> usize| votes.iter().map(of).collect::<BTreeSet<_>>().len();
    let mut found = FigureSet::default();
    add_clustered(&mut found, cell, &votes, settings);
    add_naive(&mut found, n_successes, votes.len() as u64, settings);
    found.clamp(0.0, 1.0);
    let has_expectation = cell.measure != ShareMeasure::TakenForReal;
    if !has_expectation {
        (found.tests, found.equivalence) = (Vec::new(), Vec::new());
    }
    let mut analysis = ShareAnalysis {
        measure: cell.measure,
        speaker: cell.speaker.clone(),
        condition: cell.condition.clone(),
        n_votes: votes.len() as u64,
        n_successes,
        n_participants: numbers(|vote| vote.participant),
        n_clips: numbers(|vote| vote.clip),
        share: n_successes as f64 / votes.len().max(1) as f64,
        figures: found,
        model: None,
        conclusion: Conclusion::Untested,
    };
    if settings.with_models && has_expectation {
        analysis.model = fitted(&votes, &mut analysis.figures, settings.confidence);
    }
    conclude(&mut analysis, settings.level());
    analysis
}

/// Methods that know participants and clips.
fn add_clustered(found: &mut FigureSet, cell: &ShareCell, votes: &[ClipVote], settings: &FigureSettings) {
    let confidence = settings.confidence;
    if let Some(estimate) = found.known(FigureMethod::Crossed, crossed_estimate(votes)) {
        found.add_estimate(FigureMethod::Crossed, &estimate, CHANCE, confidence);
        let equivalence = Equivalence::of_estimate(&estimate, CHANCE, settings.bound);
        found.add_equivalence(FigureMethod::Crossed, equivalence);
        if settings.n_draws > 0 {
            let draws = CrossedBootstrap::new(&[votes], settings.n_draws, settings.seed);
            let rescaled = draws.and_then(|draws| draws.estimate(|means| means[0]).rescaled(estimate.standard_error));
            found.add_interval(FigureMethod::CrossedBootstrap, rescaled.and_then(|draws| draws.interval(confidence)));
            let flips = crossed_sign_flip(votes, CHANCE, settings.n_draws, settings.seed);
            found.add_test(FigureMethod::SignFlip, flips.map(|flips| flips.p));
        }
    }
    if let Some(blocks) = side_blocks(&cell.votes) {
        found.add_test(FigureMethod::Sides, side_test(&blocks).map(|test| test.p));
    }
    if let Some(estimate) = found.known(FigureMethod::Participants, participant_estimate(votes)) {
        found.add_estimate(FigureMethod::Participants, &estimate, CHANCE, confidence);
    }
}

/// Methods that take votes for independent.
fn add_naive(found: &mut FigureSet, n_successes: u64, n_votes: u64, settings: &FigureSettings) {
    let Some(count) = found.known(FigureMethod::Binomial, BinomialCount::new(n_successes, n_votes)) else { return };
    found.add_interval(FigureMethod::Wilson, count.wilson(settings.confidence));
    found.add_test(FigureMethod::Binomial, count.test(CHANCE));
    found.add_equivalence(FigureMethod::Binomial, Equivalence::of_count(&count, CHANCE, settings.bound));
}

/// Draws the conclusion from the crossed test, adjusted where it is one of several, and the crossed equivalence.
pub fn conclude(analysis: &mut ShareAnalysis, level: f64) {
    let p = analysis.figures.test(FigureMethod::Crossed).map(|test| test.adjusted_p.unwrap_or(test.p));
    let is_equivalent = analysis.figures.equivalence(FigureMethod::Crossed).is_some_and(|test| test.passes);
    analysis.conclusion = Conclusion::new(p, level, analysis.share - CHANCE, is_equivalent);
}

/// Trials of each participant by sides; none where the sides are not known, as in tables that say only what was right.
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
