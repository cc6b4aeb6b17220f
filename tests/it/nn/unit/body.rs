//! Unit tests of `orator_nn::lifter::body`.

use orator_base::motion::upper_body::BodyPoints;
use orator_nn::lifter::body::BodyLifter;
use orator_nn::params::Params;

#[test]
fn every_frame_has_a_pose_unless_nothing_is_visible() -> anyhow::Result<()> {
    let mut params = Params::new(1);
    let lifter = BodyLifter::new(&mut params, &BodyLifter::config(16, &[3, 3, 3]))?;
    let seen: BodyPoints = std::array::from_fn(|j| Some([j as f32 * 10.0, (j * j) as f32]));
    let mut frames = vec![seen; 300];
    frames[100..200].fill([None; 9]);
    let poses = lifter.poses(&frames, &[], 1.0)?;
    assert_eq!(poses.len(), 300);
    for (t, pose) in poses.iter().enumerate() {
        assert_eq!(pose.is_none(), (113..187).contains(&t), "frame {t}");
    }
    assert!(lifter.poses(&[], &[], 2.0)?.is_empty());
    Ok(())
}
