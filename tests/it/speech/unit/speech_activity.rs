//! Tests of `orator_pipeline::speech::speech_activity`.

use orator_base::types::time::FrameRate;
use orator_pipeline::speech::speech_activity::{is_speech, ranges_of, shares_of};

const FPS: FrameRate = FrameRate::new(15, 1);

/// Probabilities of segments given as (probability, number of windows).
fn segments(segments: &[(f32, usize)]) -> Vec<f32> {
    segments.iter().flat_map(|(probability, n)| vec![*probability; *n]).collect()
}

fn n_speech(of: &[(f32, usize)]) -> usize {
    is_speech(&segments(of)).into_iter().filter(|speech| *speech).count()
}

#[test]
fn speech_segments_have_hysteresis_and_a_least_length() {
    assert_eq!(n_speech(&[(0.1, 20), (0.9, 20), (0.1, 20)]), 20);
    // Between the two thresholds speech continues but does not start.
    assert_eq!(n_speech(&[(0.4, 20), (0.9, 10), (0.4, 20), (0.1, 20)]), 30);
    // 0.1 s of silence is bridged, longer silence is not.
    assert_eq!(n_speech(&[(0.9, 10), (0.0, 3), (0.9, 10)]), 23);
    assert_eq!(n_speech(&[(0.9, 10), (0.0, 4), (0.9, 10)]), 20);
    // Claps are too short to be speech.
    assert_eq!(n_speech(&[(0.9, 4), (0.0, 10), (0.9, 6), (0.0, 10), (0.9, 3)]), 0);
    assert_eq!(is_speech(&[]), [false; 0]);
}

#[test]
fn ranges_are_in_seconds() {
    // Windows of 32 ms; the claps are too short to be speech.
    let speech = is_speech(&segments(&[(0.0, 100), (0.9, 100), (0.0, 50), (0.9, 4), (0.0, 50), (0.9, 25)]));
    assert_eq!(ranges_of(&speech), [3.2..6.4, 9.728..10.528]);
    assert!(ranges_of(&[false; 9]).is_empty() && ranges_of(&[]).is_empty());
}

#[test]
fn shares_cover_the_seconds_around_a_frame() {
    // 10 s of speech, 10 s without; 31.25 windows per second.
    let speech = is_speech(&segments(&[(0.9, 312), (0.0, 313)]));
    let shares = shares_of(&speech, FPS, 310);
    assert_eq!((shares[0], shares[60], shares[220]), (1.0, 1.0, 0.0));
    assert!((shares[150] - 0.5).abs() < 0.02 && shares[130] > 0.8 && shares[170] < 0.2, "{}", shares[150]);
    // The audio ends after 20 s.
    assert!(!shares[299].is_nan() && shares[301].is_nan());
    assert!(shares_of(&[], FPS, 3).iter().all(|share| share.is_nan()));
    // One-second pauses between sentences leave a share of more than half.
    let sentences = segments(&[(0.9, 60), (0.0, 31)]).repeat(8);
    let shares = shares_of(&is_speech(&sentences), FPS, 340);
    assert!(shares[..320].iter().all(|share| *share >= 0.5), "{shares:?}");
}
