//! Pinhole camera in front of the figure.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add};

/// Camera aimed at a point slightly below the figure's neck.
#[derive(Clone, Copy, Debug)]
pub struct DemoCamera {
    pub width: usize,
    pub height: usize,
    /// Focal length, px.
    pub focal_px: f64,
    /// Rotation from world axes to camera axes (x right, y down, z away).
    axes: Rotation,
    /// Target point in world coordinates, and its distance, metres.
    target: Vec3,
    distance: f64,
}

impl DemoCamera {
    /// Creates a camera with a yaw to the figure's left and a downward pitch in radians; `distance` in metres.
    pub fn new([width, height]: [usize; 2], yaw: f64, pitch: f64, distance: f64) -> Self {
        let axes = Rotation::about([1.0, 0.0, 0.0], pitch) * Rotation::about([0.0, 1.0, 0.0], yaw);
        let focal_px = 1.4 * width.min(height * 4 / 3) as f64;
        Self { width, height, focal_px, axes, target: [0.0, 0.1, 0.0], distance }
    }

    /// Transforms a world point to camera coordinates, metres.
    pub fn to_camera(&self, point: Vec3) -> Vec3 {
        let turned = self.axes.turn(orator_base::math::vec3::sub(point, self.target));
        add(turned, [0.0, 0.0, self.distance])
    }

    /// Projects a point in camera coordinates to px; the centre of the top left pixel is 0, 0.
    pub fn pixel(&self, [x, y, z]: Vec3) -> [f64; 2] {
        let centre = [(self.width as f64 - 1.0) / 2.0, (self.height as f64 - 1.0) / 2.0];
        [centre[0] + self.focal_px * x / z, centre[1] + self.focal_px * y / z]
    }

    /// Size in px of a length in metres at depth `z`.
    pub fn px(&self, metres: f64, z: f64) -> f64 {
        self.focal_px * metres / z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seen_from_above_nearer_points_are_lower_in_the_picture() {
        let camera = DemoCamera::new([640, 480], 0.0, 0.1, 2.0);
        let [x, y] = camera.pixel(camera.to_camera([0.0, 0.1, 0.0]));
        assert!((x - 319.5).abs() < 1e-9 && (y - 239.5).abs() < 1e-9);
        let near = camera.pixel(camera.to_camera([0.0, 0.1, -0.3]));
        let left = camera.pixel(camera.to_camera([0.2, 0.1, 0.0]));
        assert!(near[1] > y + 5.0 && left[0] > x + 50.0);
    }
}
