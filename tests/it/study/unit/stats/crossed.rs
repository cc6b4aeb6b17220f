//! Tests of `orator_study::stats::cluster::crossed`.

use orator_study::stats::cluster::crossed::{crossed_difference, crossed_estimate};
use orator_study::stats::cluster::votes::ClipVote;
use orator_study::stats::estimate::StatisticsError;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::Range;

/// Score with participant, clip and residual effects; `n` selects an independent set of effects.
fn score(n: usize, participant: usize, clip: usize) -> f64 {
    let random = |kind: u64, number: usize| {
        ChaCha8Rng::seed_from_u64(n as u64 * 1_000_000 + kind * 10_000 + number as u64).random::<f64>()
    };
    random(0, participant) + 0.7 * random(1, clip) + random(2, 100 * participant + clip)
}

fn crossed(n: usize, participants: usize, clips: Range<usize>) -> Vec<ClipVote> {
    let votes = (0..participants).flat_map(|participant| clips.clone().map(move |clip| (participant, clip)));
    votes.map(|(participant, clip)| ClipVote { participant, clip, score: score(n, participant, clip) }).collect()
}

/// In a full crossing the variance is that of the two-way analysis of variance: (mean square of participants + of
/// clips - residual) / votes.
#[test]
fn full_crossing_gives_the_analysis_of_variance() {
    let (n_p, n_c) = (9, 7);
    let votes = crossed(1, n_p, 0..n_c);
    let mean = |is_kept: &dyn Fn(&ClipVote) -> bool| {
        let scores: Vec<f64> = votes.iter().filter(|vote| is_kept(vote)).map(|vote| vote.score).collect();
        scores.iter().sum::<f64>() / scores.len() as f64
    };
    let grand = mean(&|_| true);
    let squares = |n: usize, of: &dyn Fn(usize) -> f64| (0..n).map(|k| (of(k) - grand).powi(2)).sum::<f64>();
    let of_participants = squares(n_p, &|p| mean(&|vote| vote.participant == p)) * n_c as f64;
    let of_clips = squares(n_c, &|c| mean(&|vote| vote.clip == c)) * n_p as f64;
    let all: f64 = votes.iter().map(|vote| (vote.score - grand).powi(2)).sum();
    let rest = all - of_participants - of_clips;
    let (p, c) = (n_p as f64, n_c as f64);
    let squares = [of_participants / (p - 1.0), of_clips / (c - 1.0), rest / ((p - 1.0) * (c - 1.0))];
    let expected = (squares[0] + squares[1] - squares[2]) / (p * c);
    let estimate = crossed_estimate(&votes).unwrap();
    assert!((estimate.standard_error.powi(2) / expected - 1.0).abs() < 1e-9, "{estimate:?} {expected}");
    assert!((estimate.value - grand).abs() < 1e-12);
}

/// The mean estimated variance equals the variance of the means, over 400 simulated studies.
#[test]
fn variance_is_unbiased() {
    for differ in [false, true] {
        let studies: Vec<(f64, f64)> = (0..400)
            .map(|n| {
                let votes = crossed(31 * n, 12, 0..10);
                let other: Vec<ClipVote> = crossed(31 * n + 7000, 12, 6..14);
                let estimate =
                    if differ { crossed_difference(&votes, &other) } else { crossed_estimate(&votes) }.unwrap();
                (estimate.value, estimate.standard_error.powi(2))
            })
            .collect();
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| studies.iter().map(of).sum::<f64>() / 400.0;
        let centre = mean(&|study| study.0);
        let ratio = mean(&|study| study.1) / mean(&|study| (study.0 - centre).powi(2));
        assert!((ratio - 1.0).abs() < 0.15, "{differ} {ratio}");
    }
}

#[test]
fn votes_on_both_cells_cancel_what_they_share() {
    let votes = crossed(3, 12, 0..10);
    let mut better = votes.clone();
    better.iter_mut().for_each(|vote| vote.score += if (vote.participant + vote.clip) % 2 == 0 { 0.3 } else { 0.1 });
    let (alone, difference) = (crossed_estimate(&votes).unwrap(), crossed_difference(&better, &votes).unwrap());
    assert!((difference.value - 0.2).abs() < 1e-12 && difference.standard_error < alone.standard_error / 5.0);
    let same = crossed_difference(&votes, &votes);
    assert!(matches!(same, Err(StatisticsError::NoVariation { .. })), "{same:?}");
}

#[test]
fn two_participants_and_clips_are_needed() {
    let what = |result| match result {
        Err(StatisticsError::TooFew { what, .. }) => what,
        _ => "",
    };
    assert_eq!(what(crossed_estimate(&crossed(1, 1, 0..9))), "participants");
    assert_eq!(what(crossed_estimate(&crossed(1, 9, 0..1))), "clips");
    assert_eq!(what(crossed_estimate(&[])), "votes");
    // Every vote shares a participant or a clip with the first.
    let star = [(0, 0), (0, 1), (1, 0)].map(|(participant, clip)| ClipVote { participant, clip, score: clip as f64 });
    assert!(crossed_estimate(&star[..2]).is_err() && crossed_estimate(&star).is_ok());
    let same = crossed(1, 5, 0..5).into_iter().map(|vote| ClipVote { score: 0.3, ..vote }).collect::<Vec<_>>();
    assert!(matches!(crossed_estimate(&same), Err(StatisticsError::NoVariation { .. })));
    assert_eq!(what(crossed_difference(&crossed(1, 9, 0..9), &crossed(1, 9, 0..1))), "clips");
    let wrong = [ClipVote { participant: 0, clip: 0, score: f64::NAN }];
    assert!(matches!(crossed_estimate(&wrong), Err(StatisticsError::NotFinite { .. })));
}
