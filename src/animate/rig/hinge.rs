//! A joint that bends: the direction of a bone as two angles, flexion about an axis of the parent and, across it, how
//! far it leans to the side. Every direction is two such angles and back; only straight to the side the flexion is
//! not defined.

use crate::math::rotation::Rotation;
use crate::math::vec3::{Vec3, cross, scale};

/// Where a bone points, degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bend {
    /// -180..=180; 0: straight.
    pub flexion: f64,
    /// -90..=90; towards the side that the hinge calls its own (the thumb's, in a hand).
    pub side: f64,
}

/// A bone's rest direction with the axis it bends about.
#[derive(Clone, Copy, Debug)]
pub struct Hinge {
    /// Turns x along the resting bone and -z along the axis.
    rest: Rotation,
}

impl Hinge {
    /// Both unit vectors, at right angles, in the parent's axes. Flexion turns `along` about `axis`.
    pub fn new(along: Vec3, axis: Vec3) -> Self {
        let side = scale(axis, -1.0);
        Self { rest: Rotation::from_axes(along, cross(side, along), side) }
    }

    /// The angles of a bone that points along the unit vector `direction` of the parent's axes.
    pub fn bend(&self, direction: Vec3) -> Bend {
        let [x, y, z] = self.rest.inverse().turn(direction);
        Bend { flexion: (-y).atan2(x).to_degrees(), side: z.clamp(-1.0, 1.0).asin().to_degrees() }
    }

    /// The rotation with these angles: it takes the resting bone to the direction and twists nothing.
    pub fn rotation(&self, bend: Bend) -> Rotation {
        self.rest * flexed(bend.flexion) * sideways(bend.side) * self.rest.inverse()
    }

    /// The direction of the bone at rest.
    pub fn along(&self) -> Vec3 {
        self.rest.turn([1.0, 0.0, 0.0])
    }
}

/// About -z.
pub fn flexed(degrees: f64) -> Rotation {
    Rotation::about([0.0, 0.0, -1.0], degrees.to_radians())
}

/// About -y: x goes towards z.
pub fn sideways(degrees: f64) -> Rotation {
    Rotation::about([0.0, -1.0, 0.0], degrees.to_radians())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec3::{norm, sub, unit};

    #[test]
    fn every_direction_is_two_angles_and_back() {
        let elbow = Hinge::new([1.0, 0.0, 0.0], [0.0, -1.0, 0.0]);
        // The left forearm bends forward.
        let forward = elbow.rotation(Bend { flexion: 90.0, side: 0.0 }).turn([1.0, 0.0, 0.0]);
        assert!(norm(sub(forward, [0.0, 0.0, 1.0])) < 1e-12);
        let along = unit([0.7, -0.4, 0.5], 0.0).unwrap();
        let thumb = Hinge::new(along, unit(cross(along, [0.0, -0.5, -0.87]), 0.0).unwrap());
        for hinge in [elbow, thumb] {
            let rest = hinge.bend(hinge.along());
            assert!(rest.side.abs() + rest.flexion.abs() < 1e-5);
            for flexion in [-170.0, -90.0, -5.0, 0.0, 60.0, 100.0, 179.0] {
                for side in [-80.0, -20.0, 0.0, 45.0] {
                    let bend = Bend { flexion, side };
                    let again = hinge.bend(hinge.rotation(bend).turn(hinge.along()));
                    assert!((again.flexion - flexion).abs() < 1e-6 && (again.side - side).abs() < 1e-6);
                }
            }
        }
    }
}
