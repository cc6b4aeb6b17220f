//! Rotations in space as unit quaternions: between directions and frames, swing and twist, Euler angles in any order,
//! exponential maps. Right-handed; angles are in radians unless a name says degrees.

use super::vec3::{Vec3, add, any_across, cross, dot, norm, scale};
use std::ops::Mul;

/// A rotation: the unit quaternion `w + xi + yj + zk`. `a * b` rotates by `b` first, then by `a`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    pub w: f64,
    pub v: Vec3,
}

impl Rotation {
    pub const IDENTITY: Self = Self { w: 1.0, v: [0.0; 3] };

    /// Rotation by `angle` about the unit vector `axis`.
    pub fn about(axis: Vec3, angle: f64) -> Self {
        let (sin, cos) = (angle / 2.0).sin_cos();
        Self { w: cos, v: scale(axis, sin) }
    }

    /// Smallest rotation from the unit vector `from` to the unit vector `to`. For opposite vectors, where the axis is
    /// ambiguous, one perpendicular axis is chosen deterministically.
    pub fn between(from: Vec3, to: Vec3) -> Self {
        let cos = dot(from, to);
        let axis = cross(from, to);
        let sin = norm(axis);
        if sin < 1e-9 {
            return if cos > 0.0 { Self::IDENTITY } else { Self::about(any_across(from), std::f64::consts::PI) };
        }
        Self::about(scale(axis, 1.0 / sin), sin.atan2(cos))
    }

    /// Rotation that maps the axes x, y, z to the orthonormal right-handed `x`, `y`, `z`.
    pub fn from_axes(x: Vec3, y: Vec3, z: Vec3) -> Self {
        // Shepperd's method: the largest of the four components is computed first, to avoid division by small numbers.
        let trace = x[0] + y[1] + z[2];
        let q = if trace > x[0].max(y[1]).max(z[2]) {
            let s = (1.0 + trace).sqrt() * 2.0;
            Self { w: s / 4.0, v: [(y[2] - z[1]) / s, (z[0] - x[2]) / s, (x[1] - y[0]) / s] }
        } else if x[0] > y[1].max(z[2]) {
            let s = (1.0 + x[0] - y[1] - z[2]).sqrt() * 2.0;
            Self { w: (y[2] - z[1]) / s, v: [s / 4.0, (x[1] + y[0]) / s, (z[0] + x[2]) / s] }
        } else if y[1] > z[2] {
            let s = (1.0 + y[1] - x[0] - z[2]).sqrt() * 2.0;
            Self { w: (z[0] - x[2]) / s, v: [(x[1] + y[0]) / s, s / 4.0, (y[2] + z[1]) / s] }
        } else {
            let s = (1.0 + z[2] - x[0] - y[1]).sqrt() * 2.0;
            Self { w: (x[1] - y[0]) / s, v: [(z[0] + x[2]) / s, (y[2] + z[1]) / s, s / 4.0] }
        };
        q.normalised()
    }

    /// Rotation that maps the perpendicular unit vectors `from.0`, `from.1` to `to.0`, `to.1`.
    pub fn between_frames(from: (Vec3, Vec3), to: (Vec3, Vec3)) -> Self {
        let axes = |(a, b): (Vec3, Vec3)| Self::from_axes(a, b, cross(a, b));
        axes(to) * axes(from).inverse()
    }

    /// Images of the axes x, y, z.
    pub fn axes(self) -> [Vec3; 3] {
        [self.turn([1.0, 0.0, 0.0]), self.turn([0.0, 1.0, 0.0]), self.turn([0.0, 0.0, 1.0])]
    }

    /// Rotates the vector `a`.
    pub fn turn(self, a: Vec3) -> Vec3 {
        let t = scale(cross(self.v, a), 2.0);
        add(add(a, scale(t, self.w)), cross(self.v, t))
    }

    pub fn inverse(self) -> Self {
        Self { w: self.w, v: scale(self.v, -1.0) }
    }

    /// Rotation reflected in the plane x = 0.
    pub fn mirrored(self) -> Self {
        Self { w: self.w, v: [self.v[0], -self.v[1], -self.v[2]] }
    }

    /// Angle of the rotation, 0..=pi.
    pub fn angle(self) -> f64 {
        2.0 * norm(self.v).atan2(self.w.abs())
    }

    /// Decomposes `self = swing * twist`: the swing, whose axis is perpendicular to the unit vector `axis`, and the
    /// angle of the twist about `axis`, -pi..=pi. For a half turn about a perpendicular axis the undefined twist is 0.
    pub fn swing_twist(self, axis: Vec3) -> (Self, f64) {
        let along = dot(self.v, axis);
        if along.hypot(self.w) < 1e-12 {
            return (self, 0.0);
        }
        let mut angle = 2.0 * along.atan2(self.w);
        if angle > std::f64::consts::PI {
            angle -= std::f64::consts::TAU;
        } else if angle < -std::f64::consts::PI {
            angle += std::f64::consts::TAU;
        }
        (self * Self::about(axis, angle).inverse(), angle)
    }

    /// Spherical linear interpolation from `self` to `to` along the shortest path; `t` is 0..=1.
    pub fn slerp(self, to: Self, t: f64) -> Self {
        let turn = self.inverse() * to;
        let turn = if turn.w < 0.0 { turn.opposite() } else { turn };
        let sin = norm(turn.v);
        if sin < 1e-12 {
            return self;
        }
        (self * Self::about(scale(turn.v, 1.0 / sin), 2.0 * sin.atan2(turn.w) * t)).normalised()
    }

    /// Cubic interpolation between the second and third of four rotations evenly spaced in time; `t` is 0..=1. A
    /// Catmull-Rom spline through the quaternions, normalised; its derivative is continuous across successive segments.
    pub fn cubic(near: [Self; 4], t: f64) -> Self {
        let turned = |to: Self, from: Self| if to.w * from.w + dot(to.v, from.v) < 0.0 { to.opposite() } else { to };
        let [before, from, to, after] = near;
        let to = turned(to, from);
        let (before, after) = (turned(before, from), turned(after, to));
        let (t2, t3) = (t * t, t * t * t);
        let shares =
            [-t / 2.0 + t2 - t3 / 2.0, 1.0 - 2.5 * t2 + 1.5 * t3, t / 2.0 + 2.0 * t2 - 1.5 * t3, (t3 - t2) / 2.0];
        let quaternions = [before, from, to, after];
        let sum = quaternions.iter().zip(shares).fold(Self { w: 0.0, v: [0.0; 3] }, |sum, (q, share)| Self {
            w: sum.w + share * q.w,
            v: add(sum.v, scale(q.v, share)),
        });
        if sum.w.hypot(norm(sum.v)) > 1e-9 { sum.normalised() } else { from }
    }

    /// Other unit quaternion of the same rotation.
    fn opposite(self) -> Self {
        Self { w: -self.w, v: scale(self.v, -1.0) }
    }

    /// Degrees about Z, X and Y with `self = Rz * Rx * Ry` (BVH's `Zrotation Xrotation Yrotation`); x is in -90..=90.
    pub fn euler_zxy_degrees(self) -> Vec3 {
        self.euler([2, 0, 1]).map(f64::to_degrees)
    }

    /// Angles about three different axes (0 x, 1 y, 2 z) such that `self` is the product of the rotations about them
    /// in this order; the middle angle is in -pi/2..=pi/2.
    pub fn euler(self, order: [usize; 3]) -> Vec3 {
        let [i, j, k] = order;
        // +1 for a cyclic permutation of x, y, z.
        let sign = if (i + 1) % 3 == j { 1.0 } else { -1.0 };
        let columns = self.axes();
        let matrix = |row: usize, column: usize| columns[column][row];
        let (along, across) = (matrix(j, k), matrix(k, k));
        let cos = along.hypot(across);
        let middle = (sign * matrix(i, k)).atan2(cos);
        if cos > 1e-9 {
            [(-sign * along).atan2(across), middle, (-sign * matrix(i, j)).atan2(matrix(i, i))]
        } else {
            [(sign * matrix(k, j)).atan2(matrix(j, j)), middle, 0.0]
        }
    }

    /// Product of rotations by `angles` about three axes (0 x, 1 y, 2 z), the inverse of [`Self::euler`].
    pub fn from_euler(order: [usize; 3], angles: Vec3) -> Self {
        order.into_iter().zip(angles).fold(Self::IDENTITY, |product, (axis, angle)| {
            let mut about = [0.0; 3];
            about[axis] = 1.0;
            product * Self::about(about, angle)
        })
    }

    /// Exponential map: axis times angle, of length 0..=pi.
    pub fn rotation_vector(self) -> Vec3 {
        let q = if self.w < 0.0 { self.opposite() } else { self };
        let sin = norm(q.v);
        // sin(a / 2) equals a / 2 to the last digit for such small angles.
        scale(q.v, if sin < 1e-9 { 2.0 } else { 2.0 * sin.atan2(q.w) / sin })
    }

    /// Rotation whose axis times angle is `vector`, of any length.
    pub fn from_rotation_vector(vector: Vec3) -> Self {
        let angle = norm(vector);
        if angle < 1e-12 {
            Self { w: 1.0, v: scale(vector, 0.5) }
        } else {
            Self::about(scale(vector, 1.0 / angle), angle)
        }
    }

    fn normalised(self) -> Self {
        let length = self.w.hypot(norm(self.v));
        Self { w: self.w / length, v: scale(self.v, 1.0 / length) }
    }
}

impl Mul for Rotation {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self {
            w: self.w * b.w - dot(self.v, b.v),
            v: add(add(scale(b.v, self.w), scale(self.v, b.w)), cross(self.v, b.v)),
        }
    }
}
