//! Unit tests of `orator_study::stats::bradley_terry`.

use orator_study::stats::bradley_terry::{PairedVote, elo, strength_intervals, strengths};
use orator_study::stats::estimate::StatisticsError;
use serde_json::Value;

/// Votes with the strengths computed by choix (`fixtures/reference/study_bradley_terry.py`).
fn sets() -> Vec<(Vec<PairedVote>, Vec<f64>)> {
    let text = include_str!("../../../../fixtures/reference/study_bradley_terry_golden.json");
    let sets: Vec<Value> = serde_json::from_str(text).unwrap();
    let vote = |row: &Value| {
        let at = |k: usize| row[k].as_u64().unwrap() as usize;
        PairedVote { participant: at(0), first: at(1), second: at(2), share: row[3].as_f64().unwrap() }
    };
    let votes = |set: &Value| set["votes"].as_array().unwrap().iter().map(vote).collect();
    sets.iter().map(|set| (votes(set), serde_json::from_value(set["strengths"].clone()).unwrap())).collect()
}

#[test]
fn strengths_match_choix() {
    for (votes, expected) in sets() {
        let n = expected.len();
        let found = strengths(&votes, n).unwrap();
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?} for {expected:?}");
        let intervals = strength_intervals(&votes, n, 0.95, 300, 1).unwrap();
        assert!(intervals.iter().zip(&found).all(|(interval, at)| interval.low < *at && *at < interval.high));
    }
    assert_eq!(elo(0.0), 1000.0);
    assert!((elo(10f64.ln()) - 1400.0).abs() < 1e-9 && (elo(0.1f64.ln()) - 600.0).abs() < 1e-9);
}

#[test]
fn votes_without_finite_strengths_are_rejected() {
    let vote = |first, second, share| PairedVote { participant: 0, first, second, share };
    let fit = |votes: &[PairedVote], n| strengths(votes, n).unwrap_err();
    assert!(matches!(fit(&[], 2), StatisticsError::TooFew { .. }));
    assert!(matches!(fit(&[vote(0, 1, 0.5)], 1), StatisticsError::TooFew { .. }));
    assert!(matches!(fit(&[vote(0, 1, 1.0); 5], 2), StatisticsError::Unconnected { .. }));
    assert!(matches!(fit(&[vote(0, 1, 0.5)], 3), StatisticsError::Unconnected { .. }));
    assert!(matches!(fit(&[vote(0, 2, 0.5)], 2), StatisticsError::OutOfRange { .. }));
    assert!(matches!(fit(&[vote(0, 1, f64::NAN)], 2), StatisticsError::OutOfRange { .. }));
    assert!(matches!(fit(&[vote(1, 1, 0.5)], 2), StatisticsError::TooFew { .. }));
}
