//! Fits beside those of lme4 (`fixtures/reference/study_glmm.R`), and votes that have none.

use super::fit::MixedLogit;
use crate::stats::cluster::votes::ClipVote;
use crate::stats::estimate::{StatisticsError, StudentEstimate};
use serde_json::Value;
use std::collections::BTreeMap;

fn votes(set: &Value) -> Vec<ClipVote> {
    let [participants, clips, scores] = ["participant", "clip", "score"]
        .map(|name| serde_json::from_value::<Vec<f64>>(set["rows"][name].clone()).unwrap());
    let rows = participants.iter().zip(&clips).zip(&scores);
    rows.map(|((p, c), s)| ClipVote { participant: *p as usize, clip: *c as usize, score: *s }).collect()
}

#[test]
fn fits_are_those_of_lme4_whatever_the_order_of_votes() {
    let text = include_str!("../../../../fixtures/reference/study_glmm_golden.json");
    let golden: BTreeMap<String, Value> = serde_json::from_str(text).unwrap();
    for (name, set) in &golden {
        let votes = votes(set);
        let model = MixedLogit::fit(&votes).unwrap();
        let StudentEstimate { value, standard_error, .. } = model.intercept;
        let wald = StudentEstimate { degrees_of_freedom: f64::INFINITY, ..model.intercept };
        for (what, found, expected, most) in [
            ("log-likelihood", model.log_likelihood, &set["log_likelihood"], 1e-4),
            ("participants", model.sd_participants, &set["sd_participants"], 1e-3),
            ("clips", model.sd_clips, &set["sd_clips"], 1e-3),
            ("estimate", value, &set["estimates"][0], 1e-4 + 1e-3 * standard_error),
            ("standard error", standard_error, &set["standard_errors"][0], 1e-3),
            ("z", wald.statistic(0.0), &set["z"][0], 0.02),
            ("p", wald.p_value(0.0), &set["p"][0], 1e-3),
        ] {
            assert!((found - expected.as_f64().unwrap()).abs() < most, "{name} {what}: {found} for {expected}");
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
fn votes_without_a_fit_are_refused() {
    let vote = |participant, clip, score| ClipVote { participant, clip, score };
    let cross: Vec<ClipVote> = (0..40).map(|k| vote(k / 8, k % 8, f64::from(u8::from(k % 3 == 0)))).collect();
    let changed = |change: fn(&ClipVote) -> ClipVote| MixedLogit::fit(&cross.iter().map(change).collect::<Vec<_>>());
    let refused = |change| changed(change).unwrap_err();
    assert!(matches!(MixedLogit::fit(&[]), Err(StatisticsError::TooFew { what: "votes", .. })));
    assert!(matches!(refused(|v| ClipVote { score: 1.0, ..*v }), StatisticsError::NoSpread { .. }));
    let alone = refused(|v| ClipVote { participant: 3, ..*v });
    assert!(matches!(alone, StatisticsError::TooFew { what: "participants", .. }));
    assert!(matches!(refused(|v| ClipVote { clip: 3, ..*v }), StatisticsError::TooFew { what: "clips", .. }));
    assert!(matches!(refused(|v| ClipVote { score: 0.5, ..*v }), StatisticsError::OutOfRange { .. }));
    // Participants who always say the same, and two votes in all: a fit or a reason, no panic.
    let stubborn = changed(|v| ClipVote { score: (v.participant % 2) as f64, ..*v });
    assert!(stubborn.is_ok_and(|model| model.intercept.value.is_finite()));
    let _ = MixedLogit::fit(&[vote(0, 0, 1.0), vote(1, 1, 0.0)]);
}
