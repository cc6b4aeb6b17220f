//! Strengths beside those of choix (`fixtures/reference/study_bradley_terry.py`), ratings, and votes without either.

use super::bradley_terry::{BradleyTerry, participant_intervals};
use super::elo::EloSettings;
use super::votes::PairedVote;
use crate::stats::error::StatisticsError;
use serde_json::Value;

fn sets() -> Vec<(Vec<PairedVote>, Value)> {
    let text = include_str!("../../../../fixtures/reference/study_bradley_terry_golden.json");
    let sets: Vec<Value> = serde_json::from_str(text).unwrap();
    let vote = |row: &Value| {
        let at = |k: usize| row[k].as_u64().unwrap() as usize;
        PairedVote { participant: at(0), first: at(1), second: at(2), share: row[3].as_f64().unwrap() }
    };
    sets.into_iter().map(|set| (set["votes"].as_array().unwrap().iter().map(vote).collect(), set)).collect()
}

#[test]
fn strengths_are_those_of_choix() {
    for (votes, set) in sets() {
        let n = set["n_conditions"].as_u64().unwrap() as usize;
        let model = BradleyTerry::fit(&votes, n).unwrap();
        for k in 0..n {
            let (expected, variance) = (set["strengths"][k].as_f64().unwrap(), set["variances"][k].as_f64().unwrap());
            assert!((model.strengths[k] - expected).abs() < 1e-5, "{} for {expected}", model.strengths[k]);
            assert!((model.covariance[[k, k]] / variance - 1.0).abs() < 1e-4);
        }
        let fisher = model.intervals(0.95).unwrap();
        let drawn = participant_intervals(&votes, n, 0.95, 300, 1).unwrap();
        for ((wide, narrow), strength) in fisher.iter().zip(&drawn).zip(&model.strengths) {
            assert!(wide.low < *strength && *strength < wide.high && narrow.low < *strength && *strength < narrow.high);
            // Ties and weak preferences spread less than whole votes.
            assert!((0.4..1.4).contains(&((narrow.high - narrow.low) / (wide.high - wide.low))));
        }
        assert!(model.difference(0, 1).unwrap().standard_error > 0.0);
    }
}

#[test]
fn ratings_rank_as_strengths_whatever_the_order_of_votes() {
    let (votes, set) = sets().remove(1);
    let n = set["n_conditions"].as_u64().unwrap() as usize;
    let settings = EloSettings { n_orders: 20, ..EloSettings::default() };
    let ratings = settings.ratings(&votes, n, 7).unwrap();
    let turned: Vec<PairedVote> = votes.iter().rev().copied().collect();
    assert_eq!(ratings, settings.ratings(&turned, n, 7).unwrap());
    assert!((ratings.iter().sum::<f64>() / n as f64 - settings.start).abs() < 1e-9);
    let strengths = BradleyTerry::fit(&votes, n).unwrap().strengths;
    let ranked = |values: &[f64]| {
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
        order
    };
    assert_eq!(ranked(&ratings), ranked(&strengths));
    let intervals = settings.participant_intervals(&votes, n, 0.95, 100, 7).unwrap();
    assert!(intervals.iter().zip(&ratings).all(|(interval, rating)| interval.low < *rating && *rating < interval.high));
}

#[test]
fn votes_without_finite_strengths_are_refused() {
    let vote = |first, second, share| PairedVote { participant: 0, first, second, share };
    let fit = |votes: &[PairedVote], n| BradleyTerry::fit(votes, n).unwrap_err();
    assert!(matches!(fit(&[], 2), StatisticsError::TooFew { .. }));
    assert!(matches!(fit(&[vote(0, 1, 0.5)], 1), StatisticsError::TooFew { .. }));
    assert!(matches!(fit(&[vote(0, 1, 1.0); 5], 2), StatisticsError::Unconnected { .. }));
    assert!(matches!(fit(&[vote(0, 1, 0.5)], 3), StatisticsError::Unconnected { .. }));
    assert!(matches!(fit(&[vote(0, 2, 0.5)], 2), StatisticsError::OutOfRange { .. }));
    assert!(matches!(fit(&[vote(0, 1, f64::NAN)], 2), StatisticsError::OutOfRange { .. }));
    assert!(matches!(fit(&[vote(1, 1, 0.5)], 2), StatisticsError::TooFew { .. }));
    let none = EloSettings { n_orders: 0, ..EloSettings::default() };
    assert!(none.ratings(&[vote(0, 1, 0.5)], 2, 1).is_err());
    assert!(EloSettings::default().ratings(&[], 2, 1).is_err());
}
