//! Fits beside those of lme4 (`fixtures/reference/study_glmm.R`), and votes that have none.

use super::fit::MixedLogit;
use crate::stats::cluster::votes::ClipVote;
use crate::stats::error::StatisticsError;
use ndarray::{Array2, array};
use serde_json::Value;

const GOLDEN: &str = include_str!("../../../../fixtures/reference/study_glmm_golden.json");

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn votes(set: &Value) -> Vec<ClipVote> {
    let [participants, clips, scores] = ["participant", "clip", "score"].map(|name| numbers(&set["rows"][name]));
    let rows = participants.iter().zip(&clips).zip(&scores);
    rows.map(|((p, c), s)| ClipVote { participant: *p as usize, clip: *c as usize, score: *s }).collect()
}

fn design(set: &Value) -> Array2<f64> {
    let n = set["rows"]["score"].as_array().unwrap().len();
    if set["rows"]["age"].is_null() {
        return Array2::ones((n, 1));
    }
    let (condition, age) = (numbers(&set["rows"]["condition"]), numbers(&set["rows"]["age"]));
    Array2::from_shape_fn((n, 3), |(row, column)| [1.0, condition[row], age[row]][column])
}

#[test]
fn fits_are_those_of_lme4() {
    let golden: Value = serde_json::from_str(GOLDEN).unwrap();
    for (name, set) in golden.as_object().unwrap() {
        let model = MixedLogit::fit(&votes(set), &design(set)).unwrap();
        let near = |what: &str, found: f64, expected: f64, most: f64| {
            assert!((found - expected).abs() < most, "{name} {what}: {found} for {expected}");
        };
        near("log-likelihood", model.log_likelihood, set["log_likelihood"].as_f64().unwrap(), 1e-4);
        near("participants", model.sd_participants, set["sd_participants"].as_f64().unwrap(), 1e-3);
        near("clips", model.sd_clips, set["sd_clips"].as_f64().unwrap(), 1e-3);
        for (k, (estimate, error)) in model.estimates.iter().zip(&model.standard_errors).enumerate() {
            near("estimate", *estimate, numbers(&set["estimates"])[k], 1e-4 + 1e-3 * error);
            near("standard error", *error, numbers(&set["standard_errors"])[k], 1e-3);
            let wald = model.wald(k).unwrap();
            near("z", wald.statistic(0.0), numbers(&set["z"])[k], 0.02);
            near("p", wald.p_value(0.0), numbers(&set["p"])[k], 1e-3);
        }
        assert!(model.converged, "{name}");
        assert_eq!(model.is_singular(), name == "singular", "{name}");
        let share = model.marginal_share(&design(set).row(0).to_vec(), 0.95).unwrap();
        assert!(share.interval.low < share.share && share.share < share.interval.high, "{name}: {share:?}");
    }
}

#[test]
fn the_order_of_votes_and_the_unit_of_a_covariate_change_nothing() {
    let golden: Value = serde_json::from_str(GOLDEN).unwrap();
    let (votes, design) = (votes(&golden["covariates"]), design(&golden["covariates"]));
    let model = MixedLogit::fit(&votes, &design).unwrap();
    let turned: Vec<ClipVote> = votes.iter().rev().copied().collect();
    let swapped = design.slice(ndarray::s![..;-1, ..]).to_owned() * array![1.0, 1.0, 1e6];
    let other = MixedLogit::fit(&turned, &swapped).unwrap();
    assert!((model.log_likelihood - other.log_likelihood).abs() < 1e-6);
    assert!((model.estimates[2] / other.estimates[2] / 1e6 - 1.0).abs() < 1e-3);
}

#[test]
fn votes_without_a_fit_are_refused() {
    let vote = |participant, clip, score| ClipVote { participant, clip, score };
    let cross: Vec<ClipVote> = (0..40).map(|k| vote(k / 8, k % 8, f64::from(u8::from(k % 3 == 0)))).collect();
    let fit = |votes: &[ClipVote], design: &Array2<f64>| MixedLogit::fit(votes, design).unwrap_err();
    let same: Vec<ClipVote> = cross.iter().map(|v| ClipVote { score: 1.0, ..*v }).collect();
    let alone: Vec<ClipVote> = cross.iter().map(|v| ClipVote { participant: 3, ..*v }).collect();
    let one_clip: Vec<ClipVote> = cross.iter().map(|v| ClipVote { clip: 3, ..*v }).collect();
    let rating: Vec<ClipVote> = cross.iter().map(|v| ClipVote { score: 0.5, ..*v }).collect();
    let ones = Array2::ones((40, 1));
    let beside = |f: &dyn Fn(usize) -> f64| Array2::from_shape_fn((40, 2), |(k, c)| if c == 0 { 1.0 } else { f(k) });
    assert!(matches!(fit(&[], &Array2::ones((0, 1))), StatisticsError::TooFew { what: "votes", .. }));
    assert!(matches!(fit(&same, &ones), StatisticsError::NoSpread { .. }));
    assert!(matches!(fit(&alone, &ones), StatisticsError::TooFew { what: "participants", .. }));
    assert!(matches!(fit(&one_clip, &ones), StatisticsError::TooFew { what: "clips", .. }));
    assert!(matches!(fit(&rating, &ones), StatisticsError::OutOfRange { .. }));
    assert!(matches!(fit(&cross, &Array2::ones((39, 1))), StatisticsError::TooFew { .. }));
    assert!(matches!(fit(&cross, &Array2::ones((41, 1))), StatisticsError::OutOfRange { .. }));
    assert!(matches!(fit(&cross, &beside(&|_| f64::NAN)), StatisticsError::NotFinite { .. }));
    assert!(matches!(fit(&cross, &beside(&|_| 2.0)), StatisticsError::Dependent { .. }));
    assert!(matches!(fit(&cross, &beside(&|_| 0.0)), StatisticsError::Dependent { .. }));
    assert!(matches!(fit(&cross, &beside(&|k| cross[k].score)), StatisticsError::Separated));
    // Participants who always say the same, and two votes in all: a fit or a reason, no panic.
    let stubborn: Vec<ClipVote> = cross.iter().map(|v| ClipVote { score: (v.participant % 2) as f64, ..*v }).collect();
    assert!(MixedLogit::of_share(&stubborn).is_ok_and(|model| model.estimates[0].is_finite()));
    let _ = MixedLogit::of_share(&[vote(0, 0, 1.0), vote(1, 1, 0.0)]);
}
