//! Unit tests of `orator_formats::bvh::skeleton`.

use orator_base::types::time::FrameRate;
use orator_formats::bvh::read::{Bvh, Positions};
use orator_formats::bvh::skeleton::BvhSkeleton;

const TEXT: &str = include_str!("../../../../fixtures/reference/bvh_take.bvh");

#[test]
fn file_rewritten_with_its_own_skeleton_is_unchanged() {
    let bvh = Bvh::parse(TEXT).unwrap();
    let skeleton = BvhSkeleton::of(&bvh);
    skeleton.check().unwrap();
    let frames: Vec<&[f64]> = bvh.frames().collect();
    let fps = FrameRate::new((1.0 / bvh.frame_secs).round() as u32, 1);
    let back = Bvh::parse(&skeleton.to_bvh(fps, frames.iter().copied())).unwrap();
    assert_eq!(BvhSkeleton::of(&back), skeleton);
    for (t, frame) in bvh.positions(Positions::Add).into_iter().enumerate() {
        for ((a, b), c) in frame.iter().zip(&back.positions(Positions::Add)[t]).zip(skeleton.positions(frames[t])) {
            assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-3 && (a[k] - c[k]).abs() < 1e-9), "{a:?} {b:?} {c:?}");
        }
    }
    let stored: BvhSkeleton = serde_json::from_str(&serde_json::to_string(&skeleton).unwrap()).unwrap();
    assert_eq!(stored, skeleton);
}
