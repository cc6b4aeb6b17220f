//! Two conditions that the same votes judged: preferences in steps, scores of one page. Scores of conditions by
//! themselves are medians and means.

use super::figure::{FigureMethod, TestFigure};
use super::figures::{FigureSet, adjust};
use super::outcome::{Numbering, differences, scores};
use super::result::{Conclusion, FigureSettings, PairAnalysis, ScoreAnalysis};
use crate::plan::TaskDesign;
use crate::stats::cluster::crossed::crossed_estimate;
use crate::stats::cluster::participants::participant_means;
use crate::stats::cluster::votes::ClipVote;
use crate::stats::error::StatisticsError;
use crate::stats::median::median_estimate;
use crate::stats::permutation::crossed_flip::crossed_sign_flip;
use crate::stats::rank::{ZeroDifferences, friedman, signed_rank};
use crate::vote::StudyVote;
use orator_base::math::order::Ordered;
use std::collections::BTreeSet;

/// Draws of sign flips for one of many pairs.
const MOST_PAIR_DRAWS: usize = 2000;

/// All pairs of `conditions` that votes compared, the first named less the second, with Holm's adjustment.
pub fn pairs(
    votes: &[&StudyVote],
    numbering: &Numbering,
    conditions: &[String],
    design: TaskDesign,
    settings: &FigureSettings,
) -> Vec<PairAnalysis> {
    let names = conditions.iter().enumerate().flat_map(|(k, a)| conditions[k + 1..].iter().map(move |b| [a, b]));
    let compared = names.filter_map(|[a, b]| {
        let differences = differences(votes, numbering, a, b);
        (!differences.is_empty()).then(|| pair([a, b], &differences, design, settings))
    });
    let mut found: Vec<PairAnalysis> = compared.collect();
    adjust(&mut found.iter_mut().map(|pair| &mut pair.figures).collect::<Vec<_>>());
    found.iter_mut().for_each(|pair| conclude(pair, settings.level()));
    found
}

/// Draws the conclusion from the crossed test, adjusted where it is one of several.
pub fn conclude(pair: &mut PairAnalysis, level: f64) {
    let p = pair.figures.test(FigureMethod::Crossed).map(|test| test.adjusted_p.unwrap_or(test.p));
    pair.conclusion = Conclusion::new(p, level, pair.difference, false);
}

/// Analysis of the `differences` of a pair.
fn pair(
    [first, second]: [&String; 2],
    differences: &[ClipVote],
    design: TaskDesign,
    settings: &FigureSettings,
) -> PairAnalysis {
    let mut found = FigureSet::default();
    if let Some(estimate) = found.known(FigureMethod::Crossed, crossed_estimate(differences)) {
        found.add_estimate(FigureMethod::Crossed, &estimate, 0.0, settings.confidence);
        if settings.n_draws > 0 {
            let n_draws = settings.n_draws.min(MOST_PAIR_DRAWS);
            let flips = crossed_sign_flip(differences, 0.0, n_draws, settings.seed);
            found.add_test(FigureMethod::SignFlip, flips.map(|flips| flips.p));
        }
    }
    let all: Vec<f64> = differences.iter().map(|vote| vote.score).collect();
    let means = participant_means(differences);
    let ranked = |values: &[f64]| signed_rank(values, ZeroDifferences::Wilcox).map(|test| test.p);
    found.add_test(FigureMethod::Wilcoxon, means.and_then(|means| ranked(&means)));
    found.add_test(FigureMethod::WilcoxonVotes, ranked(&all));
    let numbers = |of: fn(&ClipVote) -> usize| differences.iter().map(of).collect::<BTreeSet<_>>().len();
    let count = |is_counted: fn(f64) -> bool| all.iter().filter(|score| is_counted(**score)).count() as u64;
    let step = |step: i8| all.iter().filter(|score| **score == f64::from(step)).count() as u64;
    PairAnalysis {
        first: first.clone(),
        second: second.clone(),
        n_votes: all.len(),
        n_participants: numbers(|vote| vote.participant),
        n_clips: numbers(|vote| vote.clip),
        orders: Some([count(|score| score > 0.0), count(|score| score == 0.0), count(|score| score < 0.0)]),
        steps: (design == TaskDesign::Preference).then(|| [-2, -1, 0, 1, 2].map(step)),
        difference: all.iter().sum::<f64>() / all.len() as f64,
        figures: found,
        conclusion: Conclusion::Untested,
    }
}

/// Scores of each condition, the highest median first.
pub fn score_table(
    votes: &[&StudyVote],
    numbering: &Numbering,
    conditions: &[String],
    settings: &FigureSettings,
) -> Vec<ScoreAnalysis> {
    let rows = conditions.iter().filter_map(|condition| {
        let votes = scores(votes, numbering, condition);
        let all: Vec<f64> = votes.iter().map(|vote| vote.score).collect();
        let ordered = Ordered::new(all.iter().copied());
        let mut found = FigureSet::default();
        let median = median_estimate(&all, settings.confidence).map(|estimate| estimate.interval);
        found.add_interval(FigureMethod::Median, median);
        if let Some(estimate) = found.known(FigureMethod::Crossed, crossed_estimate(&votes)) {
            found.add_interval(FigureMethod::Crossed, estimate.interval(settings.confidence));
        }
        let numbers = |of: fn(&ClipVote) -> usize| votes.iter().map(of).collect::<BTreeSet<_>>().len();
        Some(ScoreAnalysis {
            condition: condition.clone(),
            n_scores: all.len(),
            n_participants: numbers(|vote| vote.participant),
            n_clips: numbers(|vote| vote.clip),
            quantiles: [0.0, 0.05, 0.5, 0.95, 1.0].map(|share| ordered.quantile(share).unwrap_or_default()),
            median: ordered.median()?,
            mean: all.iter().sum::<f64>() / all.len() as f64,
            figures: found,
        })
    });
    let mut rows: Vec<ScoreAnalysis> = rows.collect();
    rows.sort_by(|a, b| b.median.total_cmp(&a.median).then(b.mean.total_cmp(&a.mean)));
    rows
}

/// Friedman's test of participants' mean scores, over those who scored every condition.
pub fn overall(
    votes: &[&StudyVote],
    numbering: &Numbering,
    conditions: &[String],
) -> Result<TestFigure, StatisticsError> {
    let of_condition = |condition: &String| -> Vec<ClipVote> { scores(votes, numbering, condition) };
    let columns: Vec<Vec<ClipVote>> = conditions.iter().map(of_condition).collect();
    let participants: BTreeSet<usize> = columns.iter().flatten().map(|vote| vote.participant).collect();
    let mean = |votes: &Vec<ClipVote>, participant: usize| {
        let own: Vec<f64> =
            votes.iter().filter(|vote| vote.participant == participant).map(|vote| vote.score).collect();
        (!own.is_empty()).then(|| own.iter().sum::<f64>() / own.len() as f64)
    };
    let block = |participant: usize| columns.iter().map(|votes| mean(votes, participant)).collect::<Option<Vec<f64>>>();
    let blocks: Vec<Vec<f64>> = participants.into_iter().filter_map(block).collect();
    let test = friedman(&blocks)?;
    let degrees_of_freedom = Some(conditions.len() as f64 - 1.0);
    Ok(TestFigure {
        statistic: Some(test.statistic),
        degrees_of_freedom,
        ..TestFigure::new(FigureMethod::Friedman, test.p)
    })
}
