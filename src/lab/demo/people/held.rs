//! Objects held in a hand, in the axes of the left hand at rest (cm: x along the fingers, y out of the back of the
//! hand, z towards the thumb), mirrored for the right hand.

use super::body::FingerShape;
use super::solid;
use super::solid::Solids;
use orator_avatar::animate::rig::rig::Rig;
use orator_avatar::render::Mesh;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::Vec3;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// An object held in a hand.
#[derive(Clone, Debug)]
pub struct HeldObject {
    /// 0: left, 1: right.
    pub side: usize,
    pub grip: FingerShape,
    /// In the hand's axes, cm.
    mesh: Mesh,
}

impl HeldObject {
    /// Samples a pen, cup, phone or sheet for a hand of the given size (1: `Build::ADULT`).
    pub fn sample(hand: f64, rng: &mut ChaCha8Rng) -> Self {
        let side = usize::from(rng.random_bool(0.5));
        let sign = [1.0, -1.0][side];
        let at = |[x, y, z]: Vec3| [sign * hand * x, hand * y, hand * z];
        let colour: [f32; 3] = std::array::from_fn(|_| rng.random_range(0.03..0.7));
        let mut solids = Solids::new(0.6);
        let grip = match rng.random_range(0..4) {
            0 => {
                solids.cylinder([at([13.6, -7.0, 2.4]), at([4.0, -0.6, 5.6])], [0.42, 0.42], colour);
                solids.cylinder([at([14.4, -7.5, 2.2]), at([13.6, -7.0, 2.4])], [0.1, 0.4], [0.1; 3]);
                FingerShape::HELD
            }
            1 => {
                solids.cylinder([at([9.3, -4.9, -4.5]), at([9.3, -4.9, 5.5])], [2.8, 3.2], colour);
                FingerShape::CUP
            }
            2 => {
                let black = [0.015, 0.015, 0.018];
                solids.block(at([9.6, -2.6, 2.4]), [7.2, 0.8, 14.6], Rotation::IDENTITY, black);
                solids.block(at([9.6, -3.05, 2.4]), [6.6, 0.1, 13.6], Rotation::IDENTITY, [0.25, 0.3, 0.4]);
                FingerShape::HELD
            }
            _ => {
                let tilt = Rotation::about([0.0, 0.0, 1.0], -sign * 0.25);
                solids.block(at([17.0, -4.6, 6.5]), [21.0, 0.06, 29.7], tilt, [0.82, 0.82, 0.8]);
                FingerShape::HELD
            }
        };
        Self { side, grip, mesh: solids.mesh }
    }

    /// Mesh of the object in the hand of a pose, world cm.
    pub fn posed(&self, rig: &Rig, root: Vec3, local: &[Rotation]) -> Mesh {
        let hand = rig.arms[self.side].hand;
        let (turns, positions) = (rig.skeleton.world(local), rig.skeleton.positions(root, local));
        solid::placed(&self.mesh, turns[hand], positions[hand])
    }
}
