//! Score maps of a lifter.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3;
use orator_base::motion::hand_bones::{PHALANX, relaxed};
use orator_base::motion::view::hand::HandPoints;
use orator_base::types::pose2d::N_HAND;
use orator_nn::lifter::score_maps::{Crop, MAP_SIZE, N_MAPS, assembled, canonical, score_maps};

#[test]
fn a_hand_comes_back_from_its_own_frame() {
    let turn = Rotation::about([0.6, 0.0, 0.8], 1.2);
    let hand = relaxed().map(|p| turn.turn(p));
    let (own, axes) = canonical(&hand).unwrap();
    assert!(own[9][0].abs() + own[9][2].abs() + own[17][2].abs() < 1e-12 && own[17][0] > 0.0);
    let back = assembled(&own, &axes);
    assert!((0..N_HAND).all(|j| vec3::norm(vec3::sub(vec3::scale(back[j], PHALANX), hand[j])) < 1e-12));
    assert!(canonical(&[[0.0; 3]; N_HAND]).is_none());
}

#[test]
fn maps_are_the_means_of_the_large_gaussians() {
    let mut seen: HandPoints = [None; N_HAND];
    (seen[9], seen[4], seen[20]) = (Some([100.0, 50.0]), Some([140.0, 80.0]), Some([60.0, 50.0]));
    let crop = Crop::around(&seen).unwrap();
    assert!((crop.side - 100.0).abs() < 1e-9);
    let mut maps = vec![9.0; N_MAPS];
    score_maps(&seen, crop, &mut maps);
    let (cx, cy) = (40.0 / 100.0 * 256.0 + 128.0, 30.0 / 100.0 * 256.0 + 128.0);
    let mean = |px: usize, py: usize| {
        let score = |x: usize, y: usize| (-((x as f64 - cx).powi(2) + (y as f64 - cy).powi(2)) / 625.0).exp();
        (0..64).map(|k| score(8 * px + k % 8, 8 * py + k / 8)).sum::<f64>() / 64.0
    };
    for (px, py) in [(28, 25), (26, 27), (0, 0)] {
        assert!((f64::from(maps[(py * MAP_SIZE + px) * N_HAND + 4]) - mean(px, py)).abs() < 1e-6);
    }
    assert!((0..MAP_SIZE * MAP_SIZE).all(|k| maps[k * N_HAND] == 0.0), "a point not seen has an empty map");
    assert!(Crop::around(&[Some([3.0, 3.0]); N_HAND]).is_none());
}
