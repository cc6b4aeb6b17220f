//! Tests of `orator_study::stats::cluster::votes`.

use orator_study::stats::cluster::votes::{
    ClipVote, participant_differences, participant_estimate, participant_means, participant_sd,
};
use orator_study::stats::estimate::StatisticsError;

fn votes(scores: &[(usize, usize, f64)]) -> Vec<ClipVote> {
    scores.iter().map(|&(participant, clip, score)| ClipVote { participant, clip, score }).collect()
}

#[test]
fn each_participant_counts_once() {
    let many = votes(&[(7, 0, 1.0), (7, 1, 1.0), (7, 2, 0.0), (7, 3, 0.0), (2, 0, 1.0), (9, 1, 0.0)]);
    assert_eq!(participant_means(&many), Ok(vec![1.0, 0.5, 0.0]));
    let estimate = participant_estimate(&many).unwrap();
    assert_eq!((estimate.value, estimate.degrees_of_freedom), (0.5, 2.0));
    assert_eq!((participant_sd(&many), participant_sd(&many[..4])), (Some(0.5), None));
    assert!((estimate.standard_error - (0.25f64 / 3.0).sqrt()).abs() < 1e-15);
    let other = votes(&[(7, 5, 1.0), (9, 5, 1.0), (11, 5, 1.0)]);
    assert_eq!(participant_differences(&other, &many), Ok(vec![0.5, 1.0]));
}

#[test]
fn one_participant_has_no_estimate() {
    assert!(matches!(participant_estimate(&votes(&[(1, 0, 1.0)])), Err(StatisticsError::TooFew { .. })));
    assert!(participant_estimate(&[]).is_err() && participant_means(&votes(&[(1, 0, f64::NAN)])).is_err());
    let right = votes(&[(1, 0, 1.0), (2, 0, 1.0)]);
    assert!(matches!(participant_estimate(&right), Err(StatisticsError::NoVariation { .. })));
}
