//! Comparison of two conditions: preference steps, differences of scores on one page, or proportions of single films
//! judged real. Also medians and means of the scores of single conditions, and Bradley-Terry strengths.

use super::outcome::{BinaryVote, Numbering, differences, distinct, mean_score, name_pairs, scores};
use super::result::{PairAnalysis, ScoreAnalysis, StatisticSettings, StrengthEstimate, TestOutcome};
use super::statistic::{IntervalEstimate, StatisticMethod, StatisticOrigin, StatisticSet, TestResult, adjust};
use crate::plan::TaskDesign;
use crate::stats::bradley_terry::{self, PairedVote, elo, strength_intervals};
use crate::stats::cluster::crossed::{crossed_difference, crossed_estimate};
use crate::stats::cluster::votes::{ClipVote, participant_differences, participant_means};
use crate::stats::estimate::StatisticsError;
use crate::stats::rank::{friedman, median_interval, signed_rank};
use crate::vote::{Response, StudyVote};
use orator_base::math::order::Ordered;
use std::collections::BTreeSet;

/// Analyses all pairs of `conditions` that votes compare; differences are first less second.
pub fn pairs(
    votes: &[&StudyVote],
    numbering: &Numbering,
    conditions: &[String],
    design: TaskDesign,
    settings: &StatisticSettings,
) -> Vec<PairAnalysis> {
    let compared = name_pairs(conditions).filter_map(|names| {
        let differences = differences(votes, numbering, names);
        (!differences.is_empty()).then(|| compared_pair(names, &differences, design, settings))
    });
    family(compared.collect(), settings.level())
}

/// Analyses all pairs of conditions by how often single films of each were judged real.
pub fn single_pairs(votes: &[BinaryVote], conditions: &[&str], settings: &StatisticSettings) -> Vec<PairAnalysis> {
    let of = |name: &str| -> Vec<ClipVote> {
        votes.iter().filter(|vote| vote.condition == name).map(|vote| vote.vote).collect()
    };
    let pair = |names: [&str; 2]| {
        let [a, b] = names.map(of);
        let mut found = StatisticSet::default();
        if let Some(estimate) = found.ok_or_record(StatisticMethod::Crossed, crossed_difference(&a, &b)) {
            found.add_estimate(StatisticMethod::Crossed, &estimate, 0.0, settings.confidence);
        }
        let ranked = participant_differences(&a, &b).and_then(|means| signed_rank(&means));
        found.add_test(StatisticMethod::Wilcoxon, ranked.map(|test| test.p));
        pair_of(names, a.iter().chain(&b), mean_score(&a) - mean_score(&b), found)
    };
    family(name_pairs(conditions).map(pair).collect(), settings.level())
}

/// Adjusts the tests of all pairs as one family, and draws the conclusions from the crossed tests.
fn family(mut pairs: Vec<PairAnalysis>, level: f64) -> Vec<PairAnalysis> {
    adjust(&mut pairs.iter_mut().map(|pair| &mut pair.statistics).collect::<Vec<_>>());
    for pair in &mut pairs {
        pair.conclusion = TestOutcome::new(pair.statistics.crossed_p(), level, pair.difference, false);
    }
    pairs
}

/// Pair with its statistics, without orders and steps.
fn pair_of<'v>(
    [first, second]: [&str; 2],
    votes: impl Iterator<Item = &'v ClipVote> + Clone,
    difference: f64,
    statistics: StatisticSet,
) -> PairAnalysis {
    let [n_participants, n_clips] = distinct(votes.clone());
    PairAnalysis {
        first: first.to_owned(),
        second: second.to_owned(),
        n_votes: votes.count(),
        n_participants,
        n_clips,
        orders: None,
        steps: None,
        difference,
        statistics,
        conclusion: TestOutcome::Untested,
    }
}

/// Analyses a pair by the `differences` of votes that judged both.
fn compared_pair(
    names: [&str; 2],
    differences: &[ClipVote],
    design: TaskDesign,
    settings: &StatisticSettings,
) -> PairAnalysis {
    let mut found = StatisticSet::default();
    if let Some(estimate) = found.ok_or_record(StatisticMethod::Crossed, crossed_estimate(differences)) {
        found.add_estimate(StatisticMethod::Crossed, &estimate, 0.0, settings.confidence);
    }
    let all: Vec<f64> = differences.iter().map(|vote| vote.score).collect();
    let ranked = |values: &[f64]| signed_rank(values).map(|test| test.p);
    found.add_test(StatisticMethod::Wilcoxon, participant_means(differences).and_then(|means| ranked(&means)));
    found.add_test(StatisticMethod::WilcoxonVotes, ranked(&all));
    let count = |is_counted: &dyn Fn(f64) -> bool| all.iter().filter(|score| is_counted(**score)).count() as u64;
    let step = |step: f64| count(&|score| score == step);
    PairAnalysis {
        orders: Some([count(&|score| score > 0.0), step(0.0), count(&|score| score < 0.0)]),
        steps: (design == TaskDesign::Preference).then(|| [-2.0, -1.0, 0.0, 1.0, 2.0].map(step)),
        ..pair_of(names, differences.iter(), mean_score(differences), found)
    }
}

/// Scores of each condition, highest median first.
pub fn score_table(
    votes: &[&StudyVote],
    numbering: &Numbering,
    conditions: &[String],
    settings: &StatisticSettings,
) -> Vec<ScoreAnalysis> {
    let rows = conditions.iter().filter_map(|condition| {
        let votes = scores(votes, numbering, condition);
        let all: Vec<f64> = votes.iter().map(|vote| vote.score).collect();
        let ordered = Ordered::new(all.iter().copied());
        let mut found = StatisticSet::default();
        found.add_interval(StatisticMethod::Median, median_interval(&all, settings.confidence));
        if let Some(estimate) = found.ok_or_record(StatisticMethod::Crossed, crossed_estimate(&votes)) {
            found.add_interval(StatisticMethod::Crossed, estimate.interval(settings.confidence));
        }
        let [n_participants, n_clips] = distinct(&votes);
        Some(ScoreAnalysis {
            condition: condition.clone(),
            n_scores: all.len(),
            n_participants,
            n_clips,
            quantiles: [0.0, 0.05, 0.5, 0.95, 1.0].map(|share| ordered.quantile(share).unwrap_or_default()),
            median: ordered.median()?,
            mean: mean_score(&votes),
            statistics: found,
        })
    });
    let mut rows: Vec<ScoreAnalysis> = rows.collect();
    rows.sort_by(|a, b| b.median.total_cmp(&a.median).then(b.mean.total_cmp(&a.mean)));
    rows
}

/// Friedman's test of participants' mean scores, over participants who scored every condition.
pub fn overall(
    votes: &[&StudyVote],
    numbering: &Numbering,
    conditions: &[String],
) -> Result<TestResult, StatisticsError> {
    let columns: Vec<Vec<ClipVote>> = conditions.iter().map(|name| scores(votes, numbering, name)).collect();
    let participants: BTreeSet<usize> = columns.iter().flatten().map(|vote| vote.participant).collect();
    let mean = |votes: &Vec<ClipVote>, participant: usize| {
        let own: Vec<ClipVote> = votes.iter().filter(|vote| vote.participant == participant).copied().collect();
        (!own.is_empty()).then(|| mean_score(&own))
    };
    let block = |participant: usize| columns.iter().map(|votes| mean(votes, participant)).collect::<Option<Vec<f64>>>();
    let blocks: Vec<Vec<f64>> = participants.into_iter().filter_map(block).collect();
    let test = friedman(&blocks)?;
    let (statistic, degrees_of_freedom) = (Some(test.statistic), Some(conditions.len() as f64 - 1.0));
    Ok(TestResult { statistic, degrees_of_freedom, ..TestResult::new(StatisticMethod::Friedman, test.p) })
}

/// Maximum number of bootstrap draws of participants for the intervals.
const MAX_DRAWS: usize = 2000;

/// Strengths of the conditions, highest first, with bootstrap intervals over participants.
///
/// # Errors
/// There are fewer than two conditions, or chains of wins do not connect every condition to every other.
pub fn strengths(
    votes: &[&StudyVote],
    numbering: &Numbering,
    conditions: &[String],
    settings: &StatisticSettings,
) -> Result<Vec<StrengthEstimate>, StatisticsError> {
    let paired: Vec<PairedVote> = votes.iter().flat_map(|vote| paired(vote, numbering, conditions)).collect();
    let n = conditions.len();
    let strengths = bradley_terry::strengths(&paired, n)?;
    let n_draws = settings.n_draws.min(MAX_DRAWS);
    let intervals = match n_draws {
        0 => None,
        // If too few draws have finite strengths, strengths are reported without intervals.
        _ => strength_intervals(&paired, n, settings.confidence, n_draws, settings.seed).ok(),
    };
    let origin = StatisticOrigin::new(StatisticMethod::BradleyTerry);
    let row = |k: usize| StrengthEstimate {
        condition: conditions[k].clone(),
        log_strength: strengths[k],
        interval: intervals.as_ref().map(|all| IntervalEstimate { origin, ends: all[k] }),
        elo: elo(strengths[k]),
    };
    let mut rows: Vec<StrengthEstimate> = (0..n).map(row).collect();
    rows.sort_by(|a, b| b.log_strength.total_cmp(&a.log_strength));
    Ok(rows)
}

/// Pairwise comparisons of a vote: its preference step as a share of a win, or which of two scores is higher.
fn paired(vote: &StudyVote, numbering: &Numbering, conditions: &[String]) -> Vec<PairedVote> {
    let index = |name: &String| conditions.iter().position(|condition| condition == name);
    let Some(shown) = vote.conditions.iter().map(index).collect::<Option<Vec<usize>>>() else { return Vec::new() };
    let participant = numbering.vote(vote, 0.0).participant;
    let pair = |a: usize, b: usize, share: f64| PairedVote { participant, first: shown[a], second: shown[b], share };
    match &vote.response {
        // Steps range from -2 for the left film to 2 for the right film.
        Response::Step(step) if shown.len() == 2 => vec![pair(0, 1, (2.0 - f64::from(*step)) / 4.0)],
        Response::Scores(scores) if scores.len() == shown.len() => {
            let pairs = (0..shown.len()).flat_map(|a| (a + 1..scores.len()).map(move |b| (a, b)));
            pairs.map(|(a, b)| pair(a, b, 0.5 + 0.5 * f64::from(scores[a].cmp(&scores[b]) as i8))).collect()
        }
        _ => Vec::new(),
    }
}
