//! Simulated studies with known truth: how often intervals cover it and tests err. 40 studies with wide bounds;
//! `ORATOR_LONG` makes them 2,000 with narrow ones.

use super::fit::MixedLogit;
use crate::simulate::{CrossedDesign, CrossedEffects, crossed_votes};
use crate::stats::cluster::crossed::crossed_estimate;
use crate::stats::estimate::{ConfidenceInterval, StudentEstimate};
use crate::stats::proportion::BinomialCount;
use rayon::prelude::*;

/// Shares of studies in which a test finds a bias or an interval covers the truth.
const MEASURES: [&str; 6] = [
    "Wald's test finds a bias",
    "the t test of containment finds a bias",
    "the binomial test finds a bias",
    "the crossed t test finds a bias",
    "the 95 % interval covers the bias",
    "the 95 % interval covers the share",
];

fn rates(n_studies: usize, n_clips: usize) -> [f64; 6] {
    let design = CrossedDesign { n_participants: 50, n_trials: 20, n_clips };
    let effects = CrossedEffects { share: 0.5, sd_participants: 0.5, sd_clips: 0.3 };
    let one = |seed: usize| {
        let votes = crossed_votes(&design, &effects, seed as u64, 0);
        let model = MixedLogit::fit(&votes).unwrap();
        let wald = StudentEstimate { degrees_of_freedom: f64::INFINITY, ..model.intercept };
        let successes = votes.iter().filter(|vote| vote.score == 1.0).count() as u64;
        let naive = BinomialCount::new(successes, votes.len() as u64).unwrap();
        let z = (naive.share() - 0.5) / (0.25 / votes.len() as f64).sqrt();
        let covers = |interval: ConfidenceInterval, truth: f64| interval.low <= truth && truth <= interval.high;
        [
            wald.p_value(0.0) < 0.05,
            model.intercept.p_value(0.0) < 0.05,
            z.abs() > 1.959964,
            crossed_estimate(&votes).unwrap().p_value(0.5) < 0.05,
            covers(model.intercept.interval(0.95).unwrap(), 0.0),
            covers(model.share(0.95).unwrap().1, 0.5),
        ]
    };
    let found: Vec<[bool; 6]> = (0..n_studies).into_par_iter().map(one).collect();
    std::array::from_fn(|k| found.iter().filter(|of_study| of_study[k]).count() as f64 / n_studies as f64)
}

#[test]
fn tests_err_as_often_as_they_say_and_intervals_cover() {
    let is_long = std::env::var_os("ORATOR_LONG").is_some();
    let n_studies = if is_long { 2000 } else { 40 };
    for n_clips in if is_long { vec![40, 20] } else { vec![40] } {
        let rates = rates(n_studies, n_clips);
        for (name, rate) in MEASURES.iter().zip(rates) {
            eprintln!("{n_studies} studies of {n_clips} clips without bias: {name} in {:.2} %", 100.0 * rate);
        }
        let [wald, containment, naive, _, covers, covers_share] = rates;
        let (least, most) = if is_long { (0.03, 0.07) } else { (0.0, 0.2) };
        assert!((least..most).contains(&containment), "containment");
        assert!((least..most + 0.01).contains(&wald), "{wald}");
        assert!(1.0 - covers < most && 1.0 - covers_share < most, "{covers} {covers_share}");
        assert!(!is_long || naive > 0.1, "the binomial test errs in {naive}");
    }
}
