//! Small surfaces defined by points: grids of rows, and tubes along a line.

use super::surface::Surface;
use orator_base::math::vec3::{Vec3, add, cross, scale, sub, unit};

impl Surface {
    /// Surface over a grid of points in rows of equal length. The direction along a row, the direction from row to row
    /// and the outward normal are right-handed.
    pub fn net(rows: &[Vec<Vec3>]) -> Self {
        let width = rows.first().map_or(0, Vec::len);
        let mut triangles = Vec::new();
        for row in 1..rows.len() {
            for column in 1..width {
                let [a, b] = [(row - 1) * width + column - 1, row * width + column - 1].map(|v| v as u32);
                triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
            }
        }
        let points = rows.concat();
        Self { normals: face_normals(&points, &triangles), points, triangles }
    }

    /// Tube along a line, closed into a ring or open at the ends.
    pub fn tube(line: &[Vec3], closed: bool, radius: f64, sides: usize) -> Self {
        let n = line.len();
        let mut rows = Vec::with_capacity(n + 1);
        for k in 0..n + usize::from(closed) {
            let (before, after) =
                if closed { ((k + n - 1) % n, (k + 1) % n) } else { (k.max(1) - 1, (k + 1).min(n - 1)) };
            let along = unit(sub(line[after], line[before]), 1e-9).unwrap_or([0.0, 0.0, 1.0]);
            let up = if along[1].abs() > 0.9 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
            let across = unit(cross(up, along), 1e-9).unwrap_or([1.0, 0.0, 0.0]);
            let up = cross(along, across);
            let around = (0..=sides).map(|side| {
                let (sin, cos) = (side as f64 / sides as f64 * std::f64::consts::TAU).sin_cos();
                add(line[k % n], add(scale(across, radius * cos), scale(up, radius * sin)))
            });
            rows.push(around.collect());
        }
        Self::net(&rows)
    }

    /// Mirror image in x.
    #[must_use]
    pub fn mirrored(mut self) -> Self {
        self.points.iter_mut().chain(&mut self.normals).for_each(|at| at[0] = -at[0]);
        self.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        self
    }

    /// Appends another surface.
    pub fn extend(&mut self, other: Self) {
        let first = self.points.len() as u32;
        self.points.extend(other.points);
        self.normals.extend(other.normals);
        self.triangles.extend(other.triangles.into_iter().map(|triangle| triangle.map(|v| v + first)));
    }
}

/// Vertex normals: the area-weighted mean of the adjacent triangles' normals.
fn face_normals(points: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![[0.0; 3]; points.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| points[v as usize]);
        let normal = cross(sub(b, a), sub(c, a));
        triangle.iter().for_each(|&v| sums[v as usize] = add(sums[v as usize], normal));
    }
    sums.into_iter().map(|sum| unit(sum, 1e-12).unwrap_or([0.0, 0.0, 1.0])).collect()
}
