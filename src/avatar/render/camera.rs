//! Pinhole camera without distortion, in world axes (cm, y up).

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, across, cross, sub, unit};

/// Minimum depth that is projected, cm; surfaces are clipped there.
pub const NEAR_CM: f64 = 5.0;

/// Camera with axes x right, y down, z forward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PinholeCamera {
    /// Width and height of the image, px.
    pub size: [usize; 2],
    /// Focal length, px; the principal point is the centre of the image.
    pub focal_px: f64,
    /// Position in the world, cm.
    pub position: Vec3,
    /// Rotation from world axes to camera axes.
    pub axes: Rotation,
}

impl PinholeCamera {
    /// Camera at `position` that looks at `target` (both in world axes, cm), rolled clockwise by `roll` radians about
    /// its optical axis. If it looks straight up or down, the world's z axis is up in the image.
    pub fn looking_at(size: [usize; 2], focal_px: f64, position: Vec3, target: Vec3, roll: f64) -> Self {
        let away = unit(sub(target, position), 1e-9).unwrap_or([0.0, 0.0, -1.0]);
        let down = [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0]].into_iter().find_map(|down| unit(across(down, away), 1e-3));
        let down = down.unwrap_or([0.0, -1.0, 0.0]);
        let rolled = Rotation::about(away, roll).turn(down);
        let axes = Rotation::from_axes(cross(rolled, away), rolled, away).inverse();
        Self { size, focal_px, position, axes }
    }

    /// A world point in camera axes, cm.
    pub fn to_camera_axes(&self, point: Vec3) -> Vec3 {
        self.axes.turn(sub(point, self.position))
    }

    /// Pixel of a point in camera axes; the centre of the top left pixel is (0, 0). Points nearer than `NEAR_CM` are
    /// projected as if at that depth.
    pub fn pixel(&self, [x, y, z]: Vec3) -> [f64; 2] {
        let [cx, cy] = self.size.map(|n| (n as f64 - 1.0) / 2.0);
        let per_cm = self.focal_px / z.max(NEAR_CM);
        [cx + per_cm * x, cy + per_cm * y]
    }
}
