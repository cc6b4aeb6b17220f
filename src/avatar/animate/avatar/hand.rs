//! Shape of a hand in the stance, built on the rig's own bones: a palm over the metacarpals, five fingers that blend
//! with the palm but not with each other, and the wrist inside the sleeve.

use super::field::{Form, RoundCone, bounding_box, smooth_union};
use super::stance::{Stance, finger_joints};
use crate::animate::rig::rig::Rig;
use orator_base::math::vec3::{Vec3, add, cross, norm, scale, sub, unit};

/// Mean length of the four metacarpals of the reference hand, cm.
const METACARPAL_CM: f64 = 7.5;
/// Length of the reference hand's middle finger from the knuckle to the tip joint, cm.
const MIDDLE_CM: f64 = 9.8;
/// Radius of each finger at its knuckle (thumb to little finger), cm, and factors for its joints from knuckle to tip.
const FINGER_RADII: [f64; 5] = [1.10, 0.88, 0.90, 0.85, 0.76];
const TAPER: [f64; 4] = [1.0, 0.90, 0.80, 0.66];
const THUMB_TAPER: [f64; 4] = [1.10, 1.0, 0.93, 0.74];
/// Maximum radius of a finger relative to the distance between neighbouring knuckles.
const MAX_RADIUS_RATIO: f64 = 0.47;

/// Shape of one hand.
pub struct HandForm {
    palm: Form,
    fingers: [Form; 5],
    /// Size of the hand relative to the reference hand.
    pub scale: f64,
}

impl HandForm {
    pub fn new(rig: &Rig, stance: &Stance, side: usize) -> Self {
        let arm = &rig.arms[side];
        let fingers: [[usize; 4]; 5] = std::array::from_fn(|finger| finger_joints(rig, side, finger));
        let wrist = stance.positions[arm.hand];
        let knuckle = |finger: usize| stance.positions[fingers[finger][0]];
        let metacarpals = (1..5).map(|f| norm(sub(knuckle(f), wrist))).sum::<f64>() / 4.0;
        let middle: f64 =
            fingers[2].windows(2).map(|bone| norm(sub(stance.positions[bone[1]], stance.positions[bone[0]]))).sum();
        let size = (metacarpals + middle) / (METACARPAL_CM + MIDDLE_CM);
        let along = unit(sub(scale(add(knuckle(2), knuckle(3)), 0.5), wrist), 1e-6).unwrap_or([arm.sign, 0.0, 0.0]);
        let to_thumb = sub(knuckle(1), knuckle(4));
        let back = unit(scale(cross(along, to_thumb), -arm.sign), 1e-6).unwrap_or([0.0, 1.0, 0.0]);
        let cm = |v: f64| v * size;
        let inwards = |at: Vec3, depth: f64| add(at, scale(back, -cm(depth)));
        let mix = |a: Vec3, b: Vec3, share: f64| add(a, scale(sub(b, a), share));

        let radius: [f64; 5] = std::array::from_fn(|finger| {
            let neighbours = [finger.saturating_sub(1).max(1), (finger + 1).min(4)];
            let room = neighbours
                .into_iter()
                .filter(|&n| finger > 0 && n != finger)
                .map(|n| norm(sub(knuckle(n), knuckle(finger))));
            room.fold(cm(FINGER_RADII[finger]), |r, gap| r.min(MAX_RADIUS_RATIO * gap))
        });
        let mut palm = Form::default();
        for (finger, radius) in radius.iter().enumerate().skip(1) {
            let end = inwards(knuckle(finger), 0.12);
            let start = mix(inwards(wrist, 0.1), end, 0.16);
            palm = palm.with(RoundCone::new([start, end], [cm(1.25), radius * 1.08]), cm(0.9));
        }
        let thumb = fingers[0].map(|joint| stance.positions[joint]);
        // Thenar and hypothenar eminences, and the web between thumb and index finger.
        let thumb_ball = [inwards(mix(wrist, thumb[0], 0.7), 0.2), mix(thumb[0], thumb[1], 0.7)];
        let little_ball = [0.3, 0.8].map(|share| inwards(mix(wrist, knuckle(4), share), 0.42));
        palm = palm
            .with(RoundCone::new(thumb_ball, [cm(1.3), cm(1.15)]), cm(1.5))
            .with(RoundCone::new(little_ball, [cm(1.1), cm(0.85)]), cm(1.2));
        for (on_thumb, on_index) in [(0.1, 0.35), (0.4, 0.55), (0.7, 0.75)] {
            let web = [mix(thumb[0], thumb[1], on_thumb), inwards(mix(wrist, knuckle(1), on_index), 0.2)];
            palm = palm.with(RoundCone::new(web, [cm(0.85), cm(0.85)]), cm(1.6));
        }
        // The wrist is wider than it is thick and reaches into the sleeve.
        let elbow = stance.positions[arm.forearm];
        let stub = [mix(wrist, elbow, 0.30), mix(wrist, elbow, -0.03)];
        palm = palm.with(RoundCone::new(stub, [cm(2.5), cm(2.4)]).flattened(back, 0.76), cm(2.0));

        let fingers = std::array::from_fn(|finger| {
            let positions = fingers[finger].map(|joint| stance.positions[joint]);
            let shares = if finger == 0 { THUMB_TAPER } else { TAPER };
            (0..3).fold(Form::default(), |form, k| {
                // The tip joint is below the nail.
                let end = if k == 2 { mix(positions[3], positions[2], 0.12) } else { positions[k + 1] };
                let radii = [radius[finger] * shares[k], radius[finger] * shares[k + 1]];
                form.with(RoundCone::new([positions[k], end], radii), cm(0.25))
            })
        });
        Self { palm, fingers, scale: size }
    }

    /// Signed distance to the palm with the thumb and the wrist.
    pub fn palm(&self, at: Vec3) -> f64 {
        smooth_union(self.palm.distance(at), self.fingers[0].distance(at), 1.2 * self.scale)
    }

    /// Signed distance to one of the four fingers other than the thumb.
    pub fn finger(&self, finger: usize, at: Vec3) -> f64 {
        self.fingers[finger].distance(at)
    }

    /// Signed distance to the complete hand with fingers blended into the palm; its gradient gives the normals.
    pub fn blended(&self, at: Vec3) -> f64 {
        let palm = self.palm(at);
        (1..5).fold(palm, |d, finger| d.min(smooth_union(palm, self.finger(finger, at), 0.6 * self.scale)))
    }

    /// Corners of the bounding box of the palm with the thumb, or of a finger.
    pub fn bounds(&self, finger: Option<usize>) -> [Vec3; 2] {
        match finger {
            Some(finger) => self.fingers[finger].bounds(),
            None => bounding_box([self.palm.bounds(), self.fingers[0].bounds()].into_iter()),
        }
    }
}
