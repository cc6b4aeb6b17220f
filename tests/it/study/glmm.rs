//! Mixed logistic regression of votes: equality with lme4, rejected votes, error rates and coverage.

use orator_study::power::{CrossedDesign, CrossedEffects, crossed_votes};
use orator_study::stats::cluster::votes::ClipVote;
use orator_study::stats::estimate::{ConfidenceInterval, StatisticsError, StudentEstimate};
use orator_study::stats::glmm::fit::MixedLogit;
use rayon::prelude::*;
use serde_json::Value;
use std::collections::BTreeMap;

fn votes(set: &Value) -> Vec<ClipVote> {
    let [participants, clips, scores] = ["participant", "clip", "score"]
        .map(|name| serde_json::from_value::<Vec<f64>>(set["rows"][name].clone()).unwrap());
    let rows = participants.iter().zip(&clips).zip(&scores);
    rows.map(|((p, c), s)| ClipVote { participant: *p as usize, clip: *c as usize, score: *s }).collect()
}

#[test]
fn fits_match_lme4_in_any_order_of_votes() {
    let text = include_str!("../../../fixtures/reference/study_glmm_golden.json");
    let golden: BTreeMap<String, Value> = serde_json::from_str(text).unwrap();
    for (name, set) in &golden {
        let votes = votes(set);
        let model = MixedLogit::fit(&votes).unwrap();
        let StudentEstimate { value, standard_error, .. } = model.intercept;
        let wald = StudentEstimate { degrees_of_freedom: f64::INFINITY, ..model.intercept };
        for (what, found, expected, tolerance) in [
            ("log-likelihood", model.log_likelihood, &set["log_likelihood"], 1e-4),
            ("participants", model.sd_participants, &set["sd_participants"], 1e-3),
            ("clips", model.sd_clips, &set["sd_clips"], 1e-3),
            ("estimate", value, &set["estimates"][0], 1e-4 + 1e-3 * standard_error),
            ("standard error", standard_error, &set["standard_errors"][0], 1e-3),
            ("z", wald.statistic(0.0), &set["z"][0], 0.02),
            ("p", wald.p_value(0.0), &set["p"][0], 1e-3),
        ] {
            assert!((found - expected.as_f64().unwrap()).abs() < tolerance, "{name} {what}: {found} for {expected}");
        }
        assert!(model.converged, "{name}");
        assert_eq!(model.sd_participants == 0.0 || model.sd_clips == 0.0, name == "singular", "{name}");
        let (share, interval) = model.share(0.95).unwrap();
        assert!(interval.low < share && share < interval.high, "{name}: {share} {interval:?}");
        let turned: Vec<ClipVote> = votes.iter().rev().copied().collect();
        assert!((model.log_likelihood - MixedLogit::fit(&turned).unwrap().log_likelihood).abs() < 1e-6);
    }
}

#[test]
fn votes_without_a_fit_are_rejected() {
    let vote = |participant, clip, score| ClipVote { participant, clip, score };
    let cross: Vec<ClipVote> = (0..40).map(|k| vote(k / 8, k % 8, f64::from(u8::from(k % 3 == 0)))).collect();
    let changed = |change: fn(&ClipVote) -> ClipVote| MixedLogit::fit(&cross.iter().map(change).collect::<Vec<_>>());
    let error_of = |change| changed(change).unwrap_err();
    assert!(matches!(MixedLogit::fit(&[]), Err(StatisticsError::TooFew { what: "votes", .. })));
    assert!(matches!(error_of(|v| ClipVote { score: 1.0, ..*v }), StatisticsError::NoVariation { .. }));
    let single = error_of(|v| ClipVote { participant: 3, ..*v });
    assert!(matches!(single, StatisticsError::TooFew { what: "participants", .. }));
    assert!(matches!(error_of(|v| ClipVote { clip: 3, ..*v }), StatisticsError::TooFew { what: "clips", .. }));
    assert!(matches!(error_of(|v| ClipVote { score: 0.5, ..*v }), StatisticsError::OutOfRange { .. }));
    // Participants who always answer alike, and a total of two votes: a fit or an error, no panic.
    let stubborn = changed(|v| ClipVote { score: (v.participant % 2) as f64, ..*v });
    assert!(stubborn.is_ok_and(|model| model.intercept.value.is_finite()));
    let _ = MixedLogit::fit(&[vote(0, 0, 1.0), vote(1, 1, 0.0)]);
}

/// 40 studies with wide bounds; with `ORATOR_LONG` set, 2,000 studies with narrow bounds.
#[test]
fn error_rates_and_coverage_are_nominal() {
    let is_long = std::env::var_os("ORATOR_LONG").is_some();
    let (n_studies, min, max) = if is_long { (2000, 0.03, 0.07) } else { (40, 0.0, 0.2) };
    for n_clips in if is_long { vec![40, 20] } else { vec![40] } {
        let design = CrossedDesign { n_participants: 50, n_trials: 20, n_clips };
        let effects = CrossedEffects { share: 0.5, sd_participants: 0.5, sd_clips: 0.3 };
        let one = |seed: usize| {
            let votes = crossed_votes(&design, &effects, seed as u64, 0);
            let share = votes.iter().map(|vote| vote.score).sum::<f64>() / votes.len() as f64;
            let model = MixedLogit::fit(&votes).unwrap();
            let wald = StudentEstimate { degrees_of_freedom: f64::INFINITY, ..model.intercept };
            let misses = |interval: ConfidenceInterval, truth: f64| truth < interval.low || interval.high < truth;
            [
                (share - 0.5).abs() > 1.959964 * (0.25 / votes.len() as f64).sqrt(),
                wald.p_value(0.0) < 0.05,
                model.intercept.p_value(0.0) < 0.05,
                misses(model.intercept.interval(0.95).unwrap(), 0.0),
                misses(model.share(0.95).unwrap().1, 0.5),
            ]
        };
        let found: Vec<[bool; 5]> = (0..n_studies).into_par_iter().map(one).collect();
        let rates = [0, 1, 2, 3, 4].map(|k| found.iter().filter(|of| of[k]).count() as f64 / n_studies as f64);
        let names = ["binomial test", "Wald's test", "t test", "interval of the bias", "interval of the share"];
        eprintln!("{n_studies} studies of {n_clips} clips without bias, errors of {names:?}: {rates:?}");
        let [binomial, wald, containment, misses, misses_share] = rates;
        assert!((min..max).contains(&containment) && (min..max + 0.01).contains(&wald), "{rates:?}");
        assert!(misses < max && misses_share < max && (!is_long || binomial > 0.1), "{rates:?}");
    }
}
