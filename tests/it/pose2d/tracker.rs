//! Tracking of persons in successive frames.

use orator_base::types::pose2d::PersonBox;
use orator_pipeline::pose2d::liveness::Movement;
use orator_pipeline::pose2d::talker::TalkerPath;
use orator_pipeline::pose2d::tracker::{Candidate, PersonTrack, TrackerStep};

fn at(x: f32, width: f32, score: f32) -> Candidate {
    Candidate { person: PersonBox { x, y: 0.0, width, height: 100.0, score }, ..Candidate::default() }
}

fn moving(candidate: Candidate, max_change: f32) -> Candidate {
    Candidate { movement: Movement { n: 3, max_change }, ..candidate }
}

fn tracker_step(image_width: usize, body_visible: bool) -> TrackerStep {
    TrackerStep { image_width, follow: Some(0.3), body_visible }
}

#[test]
fn the_first_choice_is_followed_past_a_better_one() {
    let mut followed = PersonTrack::default();
    followed.update(&[at(0.0, 100.0, 0.9), at(100.0, 110.0, 0.9)], tracker_step(300, false));
    assert_eq!((followed.person().x, followed.n_persons), (100.0, 2));
    followed.update(&[at(0.0, 250.0, 0.9), at(120.0, 110.0, 0.5)], tracker_step(300, true));
    assert!((followed.person().x - 106.0).abs() < 1e-4 && followed.person().score == 0.5);
    followed.update(&[at(130.0, 110.0, 0.5)], TrackerStep { follow: None, ..tracker_step(300, true) });
    assert!((followed.person().x - 106.0).abs() < 1e-4 && followed.identity() == 0);
}

#[test]
fn the_followed_person_is_not_replaced_by_a_larger_one() {
    let mut followed = PersonTrack::default();
    for step in 0..30 {
        let grown = step as f32;
        let mut found = [at(40.0 + 0.5 * grown, 130.0 - grown, 0.9), at(180.0 - grown, 110.0 + 2.0 * grown, 0.95)];
        if step % 2 == 1 {
            found.reverse();
        }
        followed.update(&found, tracker_step(340, true));
        let PersonBox { x, width, score, .. } = followed.person();
        assert!(x + width / 2.0 < 120.0 && score == 0.9, "step {step}: the box has gone to {x} + {width}");
    }
    // A new tracker would choose the other person by now.
    let mut fresh = PersonTrack::default();
    fresh.update(&[at(54.5, 101.0, 0.9), at(151.0, 168.0, 0.95)], tracker_step(340, true));
    assert_eq!((fresh.person().x, fresh.n_persons, followed.identity()), (151.0, 2, 0));
}

#[test]
fn a_missing_speaker_is_retained_while_the_body_is_visible() {
    let mut followed = PersonTrack::default();
    followed.update(&[at(100.0, 100.0, 0.9)], tracker_step(300, false));
    for _ in 0..5 {
        followed.update(&[], tracker_step(300, true));
    }
    assert_eq!((followed.person().x, followed.n_persons, followed.identity()), (100.0, 0, 0));
    followed.update(&[at(0.0, 30.0, 0.9)], tracker_step(300, true));
    assert_eq!((followed.person().x, followed.identity()), (0.0, 1));
    followed.update(&[], tracker_step(300, false));
    followed.update(&[], tracker_step(300, false));
    assert_eq!(followed.bbox, None);
}

#[test]
fn a_printed_person_is_replaced_by_a_living_one() {
    let (large, small) = (at(80.0, 200.0, 0.9), at(0.0, 60.0, 0.8));
    let mut followed = PersonTrack::default();
    followed.update(&[large, small], tracker_step(300, false));
    assert_eq!(followed.person().x, 80.0);
    // A motionless person still shows sensor noise; a box without any is a printed or on-screen picture.
    followed.update(&[moving(large, 5.0), moving(small, 30.0)], tracker_step(300, true));
    assert_eq!((followed.person().x, followed.identity()), (80.0, 0));
    followed.update(&[moving(large, 1.0), moving(small, 30.0)], tracker_step(300, true));
    assert_eq!((followed.person().x, followed.identity(), followed.n_persons), (0.0, 1, 1));
}

#[test]
fn the_active_speaker_is_preferred_to_larger_or_more_similar_persons() {
    let speaking = |candidate: Candidate| Candidate { speaks: true, appearance_distance: Some(90.0), ..candidate };
    let (large, small) = (Candidate { appearance_distance: Some(1.0), ..at(80.0, 200.0, 0.9) }, at(0.0, 30.0, 0.5));
    let mut followed = PersonTrack::default();
    followed.update(&[large, speaking(small)], tracker_step(300, false));
    followed.update(&[large, speaking(moving(small, 1.0))], tracker_step(300, true));
    assert_eq!((followed.person().x, followed.identity(), followed.n_persons), (0.0, 0, 1));
    let mut late = PersonTrack::default();
    late.update(&[large, small], tracker_step(300, false));
    late.update(&[large, speaking(small)], tracker_step(300, true));
    assert_eq!((late.person().x, late.identity()), (0.0, 1));
}

#[test]
fn the_reference_picture_decides() {
    let with_distance = |candidate: Candidate, appearance_distance: f32| Candidate {
        appearance_distance: Some(appearance_distance),
        ..candidate
    };
    let mut followed = PersonTrack::default();
    followed.update(
        &[with_distance(at(80.0, 120.0, 0.9), 40.0), with_distance(at(0.0, 60.0, 0.8), 4.0)],
        tracker_step(300, false),
    );
    assert_eq!(followed.person().x, 0.0);
    let mut late = PersonTrack::default();
    late.update(&[with_distance(at(80.0, 120.0, 0.9), 40.0)], tracker_step(300, false));
    late.update(
        &[with_distance(at(80.0, 120.0, 0.9), 40.0), with_distance(at(0.0, 60.0, 0.8), 4.0)],
        tracker_step(300, true),
    );
    assert_eq!((late.person().x, late.identity()), (0.0, 1));
}

fn person_at(x: f32) -> PersonBox {
    PersonBox { x, y: 0.0, width: 100.0, height: 200.0, score: 0.9 }
}

#[test]
fn a_path_matches_the_nearest_person_within_its_frames() {
    let mut path = TalkerPath::default();
    assert_eq!((path.find(0, [person_at(0.0)].into_iter()), path.last()), (None, None));
    path.push(30, person_at(0.0));
    path.push(60, person_at(80.0));
    path.push(65, person_at(160.0));
    let find = |idx: usize| path.find(idx, [person_at(-300.0), person_at(150.0), person_at(10.0)].into_iter());
    assert_eq!([14, 15, 30, 44, 65, 80, 81].map(find), [None, Some(2), Some(2), Some(2), Some(1), Some(1), None]);
    assert_eq!(path.find(30, [person_at(90.0)].into_iter()), None);
    assert_eq!(path.find(30, std::iter::empty()), None);
    assert_eq!(path.last(), Some(&person_at(160.0)));
}
