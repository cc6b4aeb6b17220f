//! Hinge joint: the direction of a bone as two angles, flexion about an axis of the parent and sideways bend. Every
//! direction has such angles; only at 90 degrees sideways is the flexion undefined.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, cross, scale};

/// Direction of a bone, degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bend {
    /// Flexion, -180..=180; 0 is straight.
    pub flexion: f64,
    /// Sideways bend, -90..=90, positive towards the hinge's own side (in a hand, towards the thumb).
    pub side: f64,
}

/// Rest direction of a bone with its flexion axis.
#[derive(Clone, Copy, Debug)]
pub struct Hinge {
    /// Rotation from x to the bone at rest and from -z to the flexion axis.
    rest: Rotation,
}

impl Hinge {
    /// Creates a hinge from two perpendicular unit vectors in the parent's axes; flexion rotates `along` about `axis`.
    pub fn new(along: Vec3, axis: Vec3) -> Self {
        let side = scale(axis, -1.0);
        Self { rest: Rotation::from_axes(along, cross(side, along), side) }
    }

    /// Angles of a bone with direction `direction`, a unit vector in the parent's axes.
    pub fn bend(&self, direction: Vec3) -> Bend {
        let [x, y, z] = self.rest.inverse().turn(direction);
        Bend { flexion: (-y).atan2(x).to_degrees(), side: z.clamp(-1.0, 1.0).asin().to_degrees() }
    }

    /// Rotation with these angles and without twist.
    pub fn rotation(&self, bend: Bend) -> Rotation {
        self.rest * flexed(bend.flexion) * side_bend(bend.side) * self.rest.inverse()
    }

    /// Direction of the bone at rest.
    pub fn along(&self) -> Vec3 {
        self.rest.turn([1.0, 0.0, 0.0])
    }
}

/// Rotation about -z.
pub fn flexed(degrees: f64) -> Rotation {
    Rotation::about([0.0, 0.0, -1.0], degrees.to_radians())
}

/// Rotation about -y, from x towards z.
pub fn side_bend(degrees: f64) -> Rotation {
    Rotation::about([0.0, -1.0, 0.0], degrees.to_radians())
}
