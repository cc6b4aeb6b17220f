//! Simple solids as meshes, for furniture and held objects: boxes, cylinders, and tiled walls and floors.

use orator_avatar::render::Mesh;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, any_across, cross, norm, scale, sub, unit};

/// Linear RGB reflectance, 0..1.
pub type Colour = [f32; 3];

/// Number of corners of a cylinder's circumference.
const N_CORNERS: usize = 20;

/// Solids collected in one mesh.
#[derive(Clone, Debug, Default)]
pub struct Solids {
    pub mesh: Mesh,
}

impl Solids {
    pub fn new(gloss: f32) -> Self {
        Self { mesh: Mesh { gloss, ..Mesh::default() } }
    }

    fn vertex(&mut self, at: Vec3, normal: Vec3, colour: Colour) -> u32 {
        let mesh = &mut self.mesh;
        mesh.points.push(at.map(|v| v as f32));
        mesh.normals.push(normal.map(|v| v as f32));
        mesh.colours.push(colour);
        mesh.labels.push(0);
        mesh.points.len() as u32 - 1
    }

    /// Adds a tiled parallelogram: a corner and its two sides, counter-clockwise seen from outside.
    pub fn tiles(
        &mut self,
        corner: Vec3,
        [a, b]: [Vec3; 2],
        [n_a, n_b]: [usize; 2],
        colour: impl Fn(usize, usize) -> Colour,
    ) {
        let normal = unit(cross(a, b), 0.0).unwrap_or([0.0, 1.0, 0.0]);
        for i in 0..n_a {
            for k in 0..n_b {
                let at = |i: usize, k: usize| {
                    let along = scale(a, i as f64 / n_a as f64);
                    add(corner, add(along, scale(b, k as f64 / n_b as f64)))
                };
                let corners = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
                let [p, q, r, s] = corners.map(|at| self.vertex(at, normal, colour(i, k)));
                self.mesh.triangles.extend([[p, q, r], [p, r, s]]);
            }
        }
    }

    /// Adds a box with rotated axes: its centre, size and rotation.
    pub fn block(&mut self, middle: Vec3, size: Vec3, turn: Rotation, colour: Colour) {
        let axes = turn.axes();
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let side = |k: usize| scale(axes[(axis + k) % 3], size[(axis + k) % 3]);
                let (mut a, mut b) = (side(1), side(2));
                if sign < 0.0 {
                    std::mem::swap(&mut a, &mut b);
                }
                let out = scale(axes[axis], sign * size[axis] / 2.0);
                let corner = sub(add(middle, out), scale(add(a, b), 0.5));
                self.tiles(corner, [a, b], [1, 1], |_, _| colour);
            }
        }
    }

    /// Adds an axis-aligned box between two opposite corners.
    pub fn between(&mut self, low: Vec3, high: Vec3, colour: Colour) {
        self.block(scale(add(low, high), 0.5), sub(high, low), Rotation::IDENTITY, colour);
    }

    /// Adds a cylinder or truncated cone with closed ends.
    pub fn cylinder(&mut self, ends: [Vec3; 2], radii: [f64; 2], colour: Colour) {
        let along = unit(sub(ends[1], ends[0]), 0.0).unwrap_or([0.0, 1.0, 0.0]);
        let x = any_across(along);
        let y = cross(along, x);
        let slope = (radii[0] - radii[1]) / norm(sub(ends[1], ends[0])).max(1e-9);
        let out = |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / N_CORNERS as f64).sin_cos();
            add(scale(x, cos), scale(y, sin))
        };
        for end in 0..2 {
            let normal = scale(along, if end == 0 { -1.0 } else { 1.0 });
            let middle = self.vertex(ends[end], normal, colour);
            let rim: Vec<u32> = (0..N_CORNERS)
                .map(|k| self.vertex(add(ends[end], scale(out(k), radii[end])), normal, colour))
                .collect();
            for k in 0..N_CORNERS {
                let (a, b) = (rim[k], rim[(k + 1) % N_CORNERS]);
                self.mesh.triangles.push(if end == 0 { [middle, b, a] } else { [middle, a, b] });
            }
        }
        let sides: Vec<[u32; 2]> = (0..N_CORNERS)
            .map(|k| {
                let normal = unit(add(out(k), scale(along, slope)), 0.0).unwrap_or(along);
                [0, 1].map(|end| self.vertex(add(ends[end], scale(out(k), radii[end])), normal, colour))
            })
            .collect();
        for k in 0..N_CORNERS {
            let ([a, b], [c, d]) = (sides[k], sides[(k + 1) % N_CORNERS]);
            self.mesh.triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
}

/// The mesh, rotated and then translated.
pub fn placed(mesh: &Mesh, turn: Rotation, shift: Vec3) -> Mesh {
    let turned = |a: &[f32; 3]| turn.turn(a.map(f64::from));
    Mesh {
        points: mesh.points.iter().map(|at| add(turned(at), shift).map(|v| v as f32)).collect(),
        normals: mesh.normals.iter().map(|normal| turned(normal).map(|v| v as f32)).collect(),
        ..mesh.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::math::vec3::dot;

    #[test]
    fn solids_are_closed_and_face_outwards() {
        let mut solids = Solids::new(0.0);
        solids.between([-1.0, -2.0, -3.0], [1.0, 2.0, 3.0], [0.5; 3]);
        let volume = |mesh: &Mesh| {
            let six = |triangle: &[u32; 3]| {
                let [a, b, c] = triangle.map(|v| mesh.points[v as usize].map(f64::from));
                dot(a, cross(b, c))
            };
            mesh.triangles.iter().map(six).sum::<f64>() / 6.0
        };
        assert!((volume(&solids.mesh) - 48.0).abs() < 1e-6);
        let mut round = Solids::new(0.0);
        round.cylinder([[1.0, 2.0, 3.0], [1.0, 2.0, 7.0]], [2.0, 2.0], [0.5; 3]);
        let full = std::f64::consts::PI * 16.0;
        assert!((volume(&round.mesh) / full - 1.0).abs() < 0.03, "{}", volume(&round.mesh));
        for mesh in [&solids.mesh, &round.mesh] {
            for &[a, b, c] in &mesh.triangles {
                let at = |v: u32| mesh.points[v as usize].map(f64::from);
                let out = cross(sub(at(b), at(a)), sub(at(c), at(a)));
                assert!(dot(out, mesh.normals[a as usize].map(f64::from)) > 0.0);
            }
        }
    }
}
