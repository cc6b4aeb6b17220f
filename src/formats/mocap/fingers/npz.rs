//! Captured fingers in `.npz` files: joint positions of TED speakers (`human_joints` [T,43,3]), and SMPL-X joint
//! rotations (`poses` [T,165], BEAT2), which are put on a hand of mean bones.

use super::take::{FingerTake, Fingers, Size};
use crate::npz::Npz;
use anyhow::{Result, bail};
use ndarray::ArrayD;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::hand_bones::BONES;
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::Side;
use std::path::Path;

/// Roots of the fingers in both sources' order: index, middle, LITTLE, RING, thumb.
const ROOTS: [usize; 5] = [5, 9, 17, 13, 1];

/// Reads both hands of a file. Errors: neither kind, other shapes.
pub fn read(path: &Path) -> Result<Vec<FingerTake>> {
    let mut npz = Npz::open(path)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    if npz.has("human_joints") {
        Ok(ted(&npz.numbers("human_joints", &[None, Some(43), Some(3)])?, &name))
    } else if npz.has("poses") {
        Ok(smplx(&npz.numbers("poses", &[None, Some(165)])?, &name))
    } else {
        bail!(
            "{} holds no fingers: expected `human_joints` [T,43,3] or SMPL-X `poses` [T,165]; it has: {}",
            path.display(),
            npz.names().join(", ")
        )
    }
}

/// Three joints a finger, no tips; left wrist 6, fingers from 8, right 7 and 23. The skeleton is a regressor's: its
/// palm is three times its first phalanges, so the palm gives the size.
fn ted(joints: &ArrayD<f64>, name: &str) -> Vec<FingerTake> {
    let point = |t: usize, j: usize| Some(std::array::from_fn(|k| joints[[t, j, k]]));
    let hand = |t: usize, wrist: usize, first: usize| {
        let mut fingers: Fingers = [None; N_HAND];
        fingers[0] = point(t, wrist);
        for (finger, root) in ROOTS.into_iter().enumerate() {
            (0..3).for_each(|k| fingers[root + k] = point(t, first + 3 * finger + k));
        }
        fingers
    };
    let frames = |wrist, first| (0..joints.shape()[0]).map(|t| hand(t, wrist, first)).collect();
    let take = |side, wrist, first| FingerTake::whole(name, side, frames(wrist, first), Size::Palm);
    vec![take(Side::Left, 6, 8), take(Side::Right, 7, 23)]
}

/// Degrees by which the fingers of the rest hand fan out, in the order thumb to little, towards the thumb. SMPL-X has
/// the little finger spread most at rest; motion brings it back.
const REST_FAN: [f64; 5] = [45.0, 8.0, 0.0, -12.0, -26.0];
/// Directions of the knuckles on the palm, degrees towards the thumb.
const REST_PALM: [f64; 5] = [48.0, 15.0, 1.0, -12.0, -25.0];

/// Joints 25..40 are the left hand's, 40..55 the right's, as axis-angle vectors in the axes of the T-pose (left
/// fingers along +x, palms down, thumbs towards +z). The rest hand, which the file does not hold, is ASSUMED: flat and
/// straight, mean bones, thumb 45 degrees forward and somewhat down. The rotations are taken as they are (no mean hand
/// added): the middle and last joints of the fingers then bend from 0 on and never backwards.
fn smplx(poses: &ArrayD<f64>, name: &str) -> Vec<FingerTake> {
    let turn = |t: usize, joint: usize| {
        let v: Vec3 = std::array::from_fn(|k| poses[[t, 3 * joint + k]]);
        vec3::unit(v, 1e-9).map_or(Rotation::IDENTITY, |axis| Rotation::about(axis, vec3::norm(v)))
    };
    let hand = |t: usize, first: usize, left: bool| {
        let mirror = |[x, y, z]: Vec3| if left { [x, y, z] } else { [-x, y, z] };
        let mut fingers: Fingers = [Some([0.0; 3]); N_HAND];
        for (finger, root) in ROOTS.into_iter().enumerate() {
            let row = root / 4;
            let down = if row == 0 { -0.25 } else { 0.0 };
            let flat = |degrees: f64, down: f64| {
                let (sin, cos) = degrees.to_radians().sin_cos();
                mirror(vec3::unit([cos, down, sin], 1e-9).unwrap_or_default())
            };
            let along = flat(REST_FAN[row], 0.4 * down);
            let mut at = vec3::scale(flat(REST_PALM[row], 1.5 * down), BONES[row][0]);
            let mut turned = Rotation::IDENTITY;
            fingers[root] = Some(at);
            for k in 0..3 {
                turned = turned * turn(t, first + 3 * finger + k);
                at = vec3::add(at, vec3::scale(turned.turn(along), BONES[row][k + 1]));
                fingers[root + k + 1] = Some(at);
            }
        }
        fingers
    };
    let frames = |first, side| (0..poses.shape()[0]).map(|t| hand(t, first, side == Side::Left)).collect();
    let take = |side, first| FingerTake::whole(name, side, frames(first, side), Size::Phalanx);
    vec![take(Side::Left, 25), take(Side::Right, 40)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array3;
    use ndarray_npy::NpzWriter;

    fn file(name: &str, array: &ArrayD<f32>) -> (tempfile::TempDir, std::path::PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npz");
        let mut npz = NpzWriter::new(std::fs::File::create(&path).unwrap());
        npz.add_array(name, array).unwrap();
        npz.finish().unwrap();
        (dir, path)
    }

    /// Positive of a right hand whose fingers bend the way fingers bend.
    fn bends_to_the_palm(hand: &[Vec3; N_HAND]) -> f64 {
        let palm = vec3::cross(vec3::sub(hand[5], hand[0]), vec3::sub(hand[17], hand[0]));
        vec3::dot(palm, vec3::sub(hand[12], hand[9])).signum()
    }

    #[test]
    fn smplx_fingers_bend_to_the_palm_of_their_side() {
        let mut poses = ArrayD::<f32>::zeros(vec![2, 165]);
        for joint in 25..55 {
            let side = if joint < 40 { -1.0 } else { 1.0 };
            (0..2).for_each(|t| poses[[t, 3 * joint + 2]] = side * 0.5);
        }
        let (_dir, path) = file("poses", &poses);
        let takes = read(&path).unwrap();
        let hands: Vec<_> = takes.iter().map(|t| t.truths().unwrap()[0].hand).collect();
        for hand in &hands {
            assert!(bends_to_the_palm(hand) > 0.0);
            assert!((vec3::norm(vec3::sub(hand[10], hand[9])) - 0.048).abs() < 1e-6);
        }
        assert!((0..N_HAND).all(|j| vec3::norm(vec3::sub(hands[0][j], hands[1][j])) < 1e-6), "mirror images");
    }

    #[test]
    fn ted_joints_find_their_places_and_tips_are_unknown() {
        let joints = Array3::from_shape_fn((2, 43, 3), |(_, j, k)| (j * (k + 1)) as f32).into_dyn();
        let (_dir, path) = file("human_joints", &joints);
        let takes = read(&path).unwrap();
        assert_eq!(takes[0].frames[0][17], Some([14.0, 28.0, 42.0]));
        assert_eq!(takes[1].frames[1][1], Some([35.0, 70.0, 105.0]));
        assert!([4, 8, 12, 16, 20].iter().all(|&j| takes[0].frames[0][j].is_none()));
        let (_dir, path) = file("other", &joints);
        assert!(format!("{:#}", read(&path).unwrap_err()).contains("other"));
    }
}
