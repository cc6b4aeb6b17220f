//! Tests of `orator_pipeline::extract::block_match`.

use orator_pipeline::extract::block_match::{edge_correlation, missing, moved};
use orator_pipeline::extract::thumbnail::Thumbnail;

fn scene(seed: usize, shift: usize, light: f64) -> Thumbnail {
    Thumbnail::new(super::thumbnail::scene(seed, shift, light))
}

#[test]
fn light_is_ignored_and_camera_movement_is_detected() {
    let a = scene(1, 0, 1.0);
    assert!(missing(&a, &[&scene(1, 0, 0.4)], 0.75) == 0.0 && edge_correlation(&a, &scene(1, 0, 0.4)) > 0.99);
    assert!(missing(&a, &[&scene(1, 6, 1.0)], 0.75) < 0.3 && moved(&a, &scene(1, 6, 1.0)) > 0.7);
    assert_eq!(moved(&a, &scene(1, 0, 0.7)), 0.0);
}

#[test]
fn another_scene_is_missing_and_a_flat_one_too() {
    let (a, b) = (scene(1, 0, 1.0), scene(2, 0, 1.0));
    assert!(missing(&a, &[&b], 0.75) > 0.9 && edge_correlation(&a, &b) < 0.2 && moved(&a, &b) < 0.1);
    let black = scene(1, 0, 0.0);
    assert!(missing(&a, &[&black], 0.75) == 1.0 && missing(&black, &[&a], 0.75) == 1.0);
    assert_eq!((edge_correlation(&a, &black), moved(&black, &a)), (0.0, 0.0));
}
