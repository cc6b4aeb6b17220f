//! Tests of `orator_study::stimuli::condition_motion`.

use orator_study::stimuli::condition_motion::mismatched_clips;
use orator_study::stimuli::cut::StudyClip;

#[test]
fn mismatched_clips_differ_and_come_from_other_segments_if_possible() {
    let clip = |segment: usize| StudyClip {
        name: String::new(),
        segment,
        frames: 0..9,
        cut_db: 0.0,
        hidden_share: 0.0,
        strokes_per_minute: None,
    };
    let of = |segments: &[usize]| mismatched_clips(&segments.iter().map(|segment| clip(*segment)).collect::<Vec<_>>());
    assert_eq!(of(&[0, 0, 1, 1]), [2, 3, 0, 1]);
    assert_eq!(of(&[0, 0, 0]), [1, 2, 0]);
    let segments = [0, 0, 0, 1, 2, 2];
    let others = of(&segments);
    assert!((0..6).all(|at| others[at] != at && others.contains(&at)));
    assert!((0..6).all(|at| segments[at] != segments[others[at]]), "{others:?}");
}
