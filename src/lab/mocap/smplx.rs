//! SMPL-X joint rotations in `.npz` files (BEAT2, EMAGE): `poses` [T, 165], axis-angle in radians, converted to the
//! finger joints of both hands by forward kinematics of an assumed rest hand.

use anyhow::Result;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{self, Vec3};
use orator_base::motion::hand_bones::BONES;
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::Side;
use orator_formats::npz::Npz;
use std::path::Path;

/// Numbers per frame: 55 joints with an axis-angle vector each.
const N_NUMBERS: usize = 165;
/// Base joints of the fingers in file order: index, middle, LITTLE, RING, thumb.
const ROOTS: [usize; 5] = [5, 9, 17, 13, 1];
/// Directions of the fingers of the rest hand, degrees towards the thumb; thumb to little finger.
const REST_FAN: [f64; 5] = [45.0, 8.0, 0.0, -12.0, -26.0];
/// Directions of the knuckles from the wrist, degrees towards the thumb; thumb to little finger.
const REST_PALM: [f64; 5] = [48.0, 15.0, 1.0, -12.0, -25.0];

/// Joints of one hand in a frame: wrist, then thumb to little finger, each base to tip; the unit is that of the
/// reference hand's bones.
pub type HandFrame = [Vec3; N_HAND];

/// Whether the file contains SMPL-X rotations.
pub fn is_smplx(path: &Path) -> Result<bool> {
    Ok(Npz::open(path)?.has("poses"))
}

/// Frames of the left hand (joints 25..40) and the right hand (40..55), in the axes of the T-pose: left fingers along
/// +x, palms down, thumbs towards +z. The file does not contain the rest hand, which is ASSUMED to be flat and
/// straight with mean bone lengths, the thumb 45 degrees forward and slightly down; no mean hand pose is added to the
/// rotations.
///
/// # Errors
///
/// The file has no `poses` of that shape.
pub fn hands(path: &Path) -> Result<[(Side, Vec<HandFrame>); 2]> {
    let poses = Npz::open(path)?.numbers("poses", &[None, Some(N_NUMBERS)])?;
    let rotation = |t: usize, joint: usize| {
        let v: Vec3 = std::array::from_fn(|k| poses[[t, 3 * joint + k]]);
        vec3::unit(v, 1e-9).map_or(Rotation::IDENTITY, |axis| Rotation::about(axis, vec3::norm(v)))
    };
    let frames = |first: usize, side: Side| {
        (0..poses.shape()[0]).map(|t| hand(side, |finger, k| rotation(t, first + 3 * finger + k))).collect()
    };
    Ok([(25, Side::Left), (40, Side::Right)].map(|(first, side)| (side, frames(first, side))))
}

/// Joints of the rest hand in the axes of the T-pose, relative to the wrist.
pub fn rest_hand(side: Side) -> HandFrame {
    hand(side, |_, _| Rotation::IDENTITY)
}

/// Computes one hand from its joint rotations, given by finger (in file order) and joint.
fn hand(side: Side, rotation: impl Fn(usize, usize) -> Rotation) -> HandFrame {
    let mut joints: HandFrame = [[0.0; 3]; N_HAND];
    for (finger, root) in ROOTS.into_iter().enumerate() {
        let row = root / 4;
        let down = if row == 0 { -0.25 } else { 0.0 };
        let bone_direction = direction(side, REST_FAN[row], 0.4 * down);
        let mut at = vec3::scale(direction(side, REST_PALM[row], 1.5 * down), BONES[row][0]);
        let mut global_rotation = Rotation::IDENTITY;
        joints[root] = at;
        for k in 0..3 {
            global_rotation = global_rotation * rotation(finger, k);
            at = vec3::add(at, vec3::scale(global_rotation.turn(bone_direction), BONES[row][k + 1]));
            joints[root + k + 1] = at;
        }
    }
    joints
}

/// Unit vector `degrees` from the middle finger towards the thumb, lowered by `down`; mirrored for the right hand.
fn direction(side: Side, degrees: f64, down: f64) -> Vec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let [x, y, z] = vec3::unit([cos, down, sin], 1e-9).unwrap_or_default();
    if side == Side::Left { [x, y, z] } else { [-x, y, z] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;

    #[test]
    fn fingers_bend_towards_the_palm() {
        let mut poses = Array2::<f32>::zeros((2, N_NUMBERS));
        for joint in 25..55 {
            let side = if joint < 40 { -1.0 } else { 1.0 };
            (0..2).for_each(|t| poses[[t, 3 * joint + 2]] = side * 0.5);
        }
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npz");
        orator_formats::npz::write(&path, |npz| npz.add_array("poses", &poses)).unwrap();
        assert!(is_smplx(&path).unwrap());
        let [(_, left), (_, right)] = hands(&path).unwrap();
        for (a, b) in left[0].iter().zip(&right[0]) {
            let [x, y, z] = vec3::sub(*a, [-b[0], b[1], b[2]]);
            assert!(x.abs().max(y.abs()).max(z.abs()) < 1e-6, "mirror images");
        }
        assert!(left[0][12][1] < left[0][9][1], "the palms face down");
        assert!((vec3::norm(vec3::sub(left[0][10], left[0][9])) - BONES[2][1]).abs() < 1e-9);
    }
}
