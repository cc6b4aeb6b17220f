//! One person followed through foreign keypoints.

use orator_base::types::pose2d::Keypoint;
use orator_formats::keypoints::FoundPerson;
use orator_pipeline::keypoints::follow::follow;

/// A body with one point in each of two corners of a square.
fn at(x: f32, size: f32) -> FoundPerson {
    let mut person = FoundPerson::default();
    person.body[0] = Keypoint { x, y: 10.0, score: 0.9 };
    person.body[5] = Keypoint { x: x + size, y: 10.0 + size, score: 0.9 };
    person
}

#[test]
fn the_larger_person_is_followed_in_any_order_and_through_a_gap() {
    let frames: Vec<Vec<FoundPerson>> = (0..30)
        .map(|t| {
            let (speaker, guest) = (at(100.0 + t as f32, 100.0), at(300.0 - t as f32, 60.0));
            match t {
                10..14 => vec![guest],
                t if t % 2 == 0 => vec![speaker, guest],
                _ => vec![guest, speaker],
            }
        })
        .collect();
    let followed = follow(&frames, 400.0, 15);
    for (t, chosen) in followed.chosen.iter().enumerate() {
        let expected = if (10..14).contains(&t) { None } else { Some(t % 2) };
        assert_eq!(*chosen, expected, "frame {t}");
    }
    assert!(followed.identity.iter().all(|number| *number == 0) && followed.n_persons[0] == 2);
    // Absent for longer than the gap: the guest is followed in between, and each of the three is another identity.
    let followed = follow(&frames, 400.0, 3);
    assert_eq!((followed.chosen[12], followed.identity[9], followed.identity[29]), (Some(0), 0, 2));
}

#[test]
fn a_jump_is_another_identity_and_empty_frames_have_none() {
    let frames: Vec<Vec<FoundPerson>> = (0..20).map(|t| vec![at(if t < 10 { 0.0 } else { 500.0 }, 80.0)]).collect();
    let followed = follow(&frames, 600.0, 15);
    assert_eq!((followed.identity[9], followed.identity[10], followed.chosen[10]), (0, 1, Some(0)));
    let nobody = follow(&[Vec::new(), vec![FoundPerson::default()]], 600.0, 15);
    assert_eq!((nobody.chosen, nobody.identity), (vec![None; 2], vec![0; 2]));
}
