//! Tests of `orator_pipeline::extract::shots`.

use super::thumbnail::scene;
use orator_base::types::image::Image;
use orator_base::types::time::FrameRate;
use orator_pipeline::extract::shots::ShotFinder;

fn scores(frames: &[Option<Image>]) -> Vec<f64> {
    let mut finder = ShotFinder::new(FrameRate::new(15, 1));
    for frame in frames {
        finder.push(frame.clone());
    }
    finder.finish()
}

fn shot_starts(scores: &[f64]) -> Vec<usize> {
    (0..scores.len()).filter(|n| scores[*n] >= 0.2).collect()
}

fn static_scene(seed: usize, n: usize) -> Vec<Option<Image>> {
    vec![Some(scene(seed, 0, 1.0)); n]
}

#[test]
fn a_cut_begins_a_shot_at_its_first_frame() {
    let found = scores(&[static_scene(1, 3), static_scene(900, 4), static_scene(5_000, 7)].concat());
    assert_eq!(shot_starts(&found), [3, 7]);
    assert!(found[3] > 0.8 && found[4] == 0.0, "{found:?}");
}

#[test]
fn repeated_frames_do_not_hide_a_cut() {
    let [a, b] = [1, 900].map(|seed| static_scene(seed, 1).remove(0));
    assert_eq!(shot_starts(&scores(&[a.clone(), None, a, None, b.clone(), None, b, None])), [4]);
}

#[test]
fn short_videos_have_one_shot() {
    assert_eq!(scores(&[]), [0.0; 0]);
    assert_eq!(scores(&static_scene(1, 1)), [0.0]);
    assert_eq!(scores(&static_scene(1, 2)), [0.0; 2]);
    assert_eq!(scores(&[None, None]), [0.0; 2]);
}
