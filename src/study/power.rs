//! Number of participants for a required power, by simulated studies analysed like real ones: the crossed test against
//! chance and the crossed equivalence test; participants and clips are drawn from populations with known effects. More
//! participants cannot compensate for too few clips; the result reports when the power stays below the requirement.

use super::analyse::outcome::BinaryVote;
use super::analyse::result::{ShareAnalysis, ShareMeasure, StatisticSettings};
use super::analyse::share::{CHANCE, ShareCell, share};
use super::analyse::statistic::StatisticMethod;
use super::analyse::text::{percent, points};
use super::stats::cluster::votes::ClipVote;
use super::stats::estimate::ConfidenceInterval;
use super::stats::glmm::fit::{integrated, logistic};
use super::stats::proportion::{BinomialCount, votes_needed};
use anyhow::{Result, ensure};
use orator_base::text::counted;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};
use std::collections::BTreeMap;
use std::fmt::Write as _;

const MIN_PARTICIPANTS: usize = 5;
const MAX_PARTICIPANTS: usize = 1280;
/// Significance level of all tests.
pub const LEVEL: f64 = 0.05;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PowerQuestion {
    pub n_trials: usize,
    pub n_clips: usize,
    pub sd_participants: f64,
    pub sd_clips: f64,
    /// Required power, 0 to 1.
    pub power: f64,
    /// True proportion that the test should distinguish from chance, 0 to 1.
    pub effect: f64,
    /// Equivalence bound on either side of chance, as a proportion.
    pub bound: f64,
    pub n_simulations: usize,
    pub seed: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PowerRow {
    pub n_participants: usize,
    pub n_votes: usize,
    pub power: f64,
    /// 95 % interval of the simulated power.
    #[serde(flatten)]
    pub ends: ConfidenceInterval,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PowerCurve {
    /// True proportion.
    pub share: f64,
    /// Smallest tried number of participants with the required power; `None` if no tried number has it.
    pub n_participants: Option<usize>,
    pub rows: Vec<PowerRow>,
    /// Number of votes from the closed formula for independent votes.
    pub naive_votes: u64,
    /// Simulated power for that number of votes, rounded up to participants and limited to the range of the search.
    pub at_naive: PowerRow,
}

/// Result: the test for a difference from chance and the equivalence test.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PowerPlan {
    pub question: PowerQuestion,
    pub difference: PowerCurve,
    pub equivalence: PowerCurve,
}

/// Searches the number of participants for both tests; `on_row` is called with each number tried.
///
/// # Errors
/// A quantity of `question` is out of its range.
pub fn plan(question: &PowerQuestion, on_row: &(dyn Fn(&PowerRow) + Sync)) -> Result<PowerPlan> {
    ensure!(
        question.n_trials > 0 && question.n_clips > 1,
        "expected at least one trial per participant and at least two clips"
    );
    let (trials, clips) = (question.n_trials, question.n_clips);
    let hint = "a participant sees no clip twice; use more clips or fewer trials";
    ensure!(trials <= clips, "{trials} trials with only {clips} clips: {hint}");
    ensure!((0.1..1.0).contains(&question.power), "invalid power {}: expected 0.1 to below 1", question.power);
    ensure!(
        (0.001..=0.499).contains(&(question.effect - CHANCE).abs()),
        "invalid effect {}: expected a share other than 50 %",
        percent(question.effect)
    );
    ensure!(
        (0.001..0.5).contains(&question.bound),
        "invalid bound {}: expected 0.1 to below 50 percentage points",
        points(question.bound)
    );
    ensure!(
        (100..=100_000).contains(&question.n_simulations),
        "invalid number of simulations {}: expected 100 to 100000",
        question.n_simulations
    );
    let deviations = [question.sd_participants, question.sd_clips];
    ensure!(
        deviations.iter().all(|sd| (0.0..=5.0).contains(sd)),
        "invalid standard deviations {deviations:?}: expected 0 to 5 log odds"
    );
    let z = |share: f64| Normal::standard().inverse_cdf(share);
    let naive = ((z(1.0 - LEVEL / 2.0) + z(question.power)) / (question.effect - CHANCE)).powi(2) / 4.0;
    let found = |analysis: &ShareAnalysis| {
        analysis.statistics.test(StatisticMethod::Crossed).is_some_and(|test| test.p < LEVEL)
    };
    let equivalent = |analysis: &ShareAnalysis| {
        analysis.statistics.equivalence(StatisticMethod::Crossed).is_some_and(|test| test.passes)
    };
    Ok(PowerPlan {
        question: question.clone(),
        difference: curve(question, question.effect, naive.ceil() as u64, &found, on_row),
        equivalence: curve(question, CHANCE, votes_needed(question.bound, question.power)?, &equivalent, on_row),
    })
}

/// Power for `n_participants`: proportion of simulated studies for whose analysis `holds` returns true.
pub fn power(
    question: &PowerQuestion,
    n_participants: usize,
    share_of_all: f64,
    holds: &(dyn Fn(&ShareAnalysis) -> bool + Sync),
) -> PowerRow {
    let design = CrossedDesign { n_participants, n_trials: question.n_trials, n_clips: question.n_clips };
    let effects =
        CrossedEffects { share: share_of_all, sd_participants: question.sd_participants, sd_clips: question.sd_clips };
    let settings =
        StatisticSettings { bound: question.bound, n_draws: 0, with_models: false, ..StatisticSettings::default() };
    let stream = |k: usize| ((n_participants as u64) << 32) + k as u64;
    let one = |k: &usize| holds(&simulated(&design, &effects, &settings, question.seed, stream(*k)));
    let n_found = (0..question.n_simulations).into_par_iter().filter(one).count() as u64;
    let count = BinomialCount::new(n_found, question.n_simulations as u64);
    let all = ConfidenceInterval { low: 0.0, high: 1.0 };
    PowerRow {
        n_participants,
        n_votes: n_participants * question.n_trials,
        power: n_found as f64 / question.n_simulations as f64,
        ends: count.and_then(|count| count.wilson(0.95)).unwrap_or(all),
    }
}

pub fn simulated(
    design: &CrossedDesign,
    effects: &CrossedEffects,
    settings: &StatisticSettings,
    seed: u64,
    stream: u64,
) -> ShareAnalysis {
    let votes = crossed_votes(design, effects, seed, stream).into_iter();
    let votes = votes.map(|vote| BinaryVote { vote, speaker: "", condition: "", sides: None }).collect();
    share(&ShareCell { measure: ShareMeasure::GeneratedChosen, speaker: None, condition: None, votes }, settings)
}

/// Doubles the number of participants until the power is reached, then bisects to within 5 %.
fn curve(
    question: &PowerQuestion,
    share: f64,
    naive_votes: u64,
    holds: &(dyn Fn(&ShareAnalysis) -> bool + Sync),
    on_row: &(dyn Fn(&PowerRow) + Sync),
) -> PowerCurve {
    let mut rows: BTreeMap<usize, PowerRow> = BTreeMap::new();
    let mut at = |n: usize| -> PowerRow {
        *rows.entry(n).or_insert_with(|| {
            let row = power(question, n, share, holds);
            on_row(&row);
            row
        })
    };
    let (mut low, mut high) = (0, MIN_PARTICIPANTS);
    while at(high).power < question.power && high < MAX_PARTICIPANTS {
        (low, high) = (high, 2 * high);
    }
    let is_reached = at(high).power >= question.power;
    while is_reached && high - low > (high / 20).max(1) {
        let middle = low + (high - low) / 2;
        if at(middle).power >= question.power { high = middle } else { low = middle }
    }
    let naive = (naive_votes as usize).div_ceil(question.n_trials).clamp(2, MAX_PARTICIPANTS);
    let at_naive = at(naive);
    PowerCurve {
        share,
        n_participants: is_reached.then_some(high),
        rows: rows.into_values().collect(),
        naive_votes,
        at_naive,
    }
}

pub fn text(plan: &PowerPlan) -> String {
    let question = &plan.question;
    let mut text = format!(
        "{} per participant, {}; standard deviations of log odds: participants {:.2}, clips {:.2}\n\
         {} simulated studies per row, tests at 5 % with crossed participants and clips\n",
        counted(question.n_trials, "vote"),
        counted(question.n_clips, "clip"),
        question.sd_participants,
        question.sd_clips,
        question.n_simulations
    );
    let curves = [
        (
            &plan.difference,
            format!("probability that a true share of {} is found to differ from 50 %", percent(question.effect)),
        ),
        (
            &plan.equivalence,
            format!(
                "probability that a true share of 50 % is found equivalent within \u{b1}{} percentage points",
                points(question.bound)
            ),
        ),
    ];
    for (curve, title) in curves {
        let _ = writeln!(text, "\n{title}\n  participants    votes    power    95 % interval");
        for row in &curve.rows {
            let mark = if Some(row.n_participants) == curve.n_participants { "  <- sufficient" } else { "" };
            let PowerRow { n_participants, n_votes, .. } = row;
            let [power, low, high] = [row.power, row.ends.low, row.ends.high].map(percent);
            let _ = writeln!(text, "  {n_participants:>12} {n_votes:>8} {power:>8}    {low} to {high}{mark}");
        }
        text += &match curve.n_participants {
            Some(n) => format!("  {n} participants for a power of {}\n", percent(question.power)),
            None => format!(
                "  not reached with {MAX_PARTICIPANTS} participants: {} clips are too few; use more clips\n",
                question.n_clips
            ),
        };
        let (n, PowerRow { n_participants, power, .. }) = (curve.naive_votes, curve.at_naive);
        let needed = format!("{n} votes ({n_participants} participants), with an actual power of {}", percent(power));
        let _ = writeln!(text, "  the formula for independent votes requires {needed}");
    }
    text
}

/// Assignment of clips to participants. Each participant votes on `n_trials` consecutive clips (cyclically), so that
/// clips receive nearly equal numbers of votes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct CrossedDesign {
    pub n_participants: usize,
    pub n_trials: usize,
    pub n_clips: usize,
}

/// Distribution from which participants and clips are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CrossedEffects {
    /// Proportion of successes over all participants and clips, 0 to 1.
    pub share: f64,
    /// Standard deviation of the participants' random intercepts, log odds.
    pub sd_participants: f64,
    /// Standard deviation of the clips' random intercepts, log odds.
    pub sd_clips: f64,
}

impl CrossedEffects {
    /// Fixed intercept (log odds at effects of 0) that gives the marginal proportion `share`, by bisection.
    pub fn log_odds(&self) -> f64 {
        let sd = self.sd_participants.hypot(self.sd_clips);
        let (mut low, mut high) = (-50.0, 50.0);
        for _ in 0..80 {
            let middle = (low + high) / 2.0;
            if integrated(middle, sd).0 < self.share { low = middle } else { high = middle }
        }
        (low + high) / 2.0
    }
}

/// Votes of one simulated study; each `stream` of the seed is an independent study.
pub fn crossed_votes(design: &CrossedDesign, effects: &CrossedEffects, seed: u64, stream: u64) -> Vec<ClipVote> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    let mut draw =
        |n: usize, sd: f64| -> Vec<f64> { (0..n).map(|_| sd * rng.sample::<f64, _>(StandardNormal)).collect() };
    let participants = draw(design.n_participants, effects.sd_participants);
    let clips = draw(design.n_clips, effects.sd_clips);
    let mean = effects.log_odds();
    let assignments =
        (0..design.n_participants).flat_map(|participant| (0..design.n_trials).map(move |trial| (participant, trial)));
    let mut vote = |(participant, trial): (usize, usize)| {
        let clip = (participant * design.n_trials + trial) % design.n_clips.max(1);
        let is_success = rng.random::<f64>() < logistic(mean + participants[participant] + clips[clip]);
        ClipVote { participant, clip, score: f64::from(u8::from(is_success)) }
    };
    assignments.map(&mut vote).collect()
}
