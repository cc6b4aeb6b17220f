//! Triangle mesh of a distance field by surface nets (Gibson 1998): one vertex in each cell that the surface crosses,
//! and one quad around each grid edge that it crosses. Vertices are then projected onto the surface and relaxed along
//! it. Normals are the gradient of the field.

use orator_base::math::vec3::{Vec3, add, cross, dot, norm, scale, sub, unit};
use rayon::prelude::*;
use std::collections::HashSet;

/// Width in cells of the blocks that are skipped where the surface is far away.
const BLOCK: usize = 4;
/// Maximum distance that projection moves a vertex, as a fraction of a cell.
const MAX_STEP: f64 = 0.9;
/// Step of the gradient's finite differences, as a fraction of a cell.
const GRADIENT_STEP: f64 = 0.02;
/// Number of relaxation rounds, in which vertices move towards the mean of their neighbours.
const RELAXATION_ROUNDS: usize = 3;

/// Triangle mesh, counter-clockwise from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    pub points: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

/// Field values at the corners of the cells.
struct FieldGrid {
    low: Vec3,
    cell: f64,
    /// Number of corners along x, y, z.
    n: [usize; 3],
    values: Vec<f32>,
}

impl Surface {
    /// Surface of `field` inside the box `bounds`, with cells of `cell` cm.
    pub fn from_field(field: &(dyn Fn(Vec3) -> f64 + Sync), bounds: [Vec3; 2], cell: f64) -> Self {
        Self::on_grid(&FieldGrid::sample(field, bounds, cell), &|at| at, field, cell)
    }

    /// Surface of `field` inside the box `bounds`, with cells of `cell` cm at `focus` that grow with the distance from
    /// it (twice as large at about 1.7 `even` cm).
    pub fn focused(
        field: &(dyn Fn(Vec3) -> f64 + Sync),
        bounds: [Vec3; 2],
        cell: f64,
        (focus, even): (Vec3, f64),
    ) -> Self {
        // The grid has uniform cells in a warped space: a point at distance `even` sinh(r / even) is at distance r.
        let space = |at: Vec3| {
            let far = norm(at) / even;
            add(focus, scale(at, if far > 1e-9 { far.sinh() / far } else { 1.0 }))
        };
        let [low, high] = bounds.map(|corner| sub(corner, focus).map(|v| even * (v / even).asinh() / cell));
        // Rounding to full cells makes the grid of a symmetric box symmetric.
        let bounds = [low.map(|v| v.floor() * cell), high.map(|v| v.ceil() * cell)];
        let steepest = bounds.map(|corner| norm(corner) / even).into_iter().fold(0.0, f64::max).cosh();
        let grid = FieldGrid::sample(&|at| field(space(at)) / steepest, bounds, cell);
        Self::on_grid(&grid, &space, field, cell)
    }

    fn on_grid(
        grid: &FieldGrid,
        space: &dyn Fn(Vec3) -> Vec3,
        field: &(dyn Fn(Vec3) -> f64 + Sync),
        cell: f64,
    ) -> Self {
        let mut surface = Self::default();
        let mut vertex_of = vec![u32::MAX; grid.values.len()];
        for (z, y, x) in ndarray::indices((grid.n[2] - 1, grid.n[1] - 1, grid.n[0] - 1)) {
            if let Some(point) = grid.vertex([x, y, z]) {
                vertex_of[grid.index([x, y, z])] = surface.points.len() as u32;
                surface.points.push(space(point));
            }
        }
        let mut quads = Vec::new();
        grid.quads(|corners, inwards| {
            let [a, b, c, d] = corners.map(|corner| vertex_of[corner]);
            quads.push(if inwards { [d, c, b, a] } else { [a, b, c, d] });
        });
        let halves = |&[a, b, c, d]: &[u32; 4]| [[[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]];
        let apart = |i: u32, j: u32| norm(sub(surface.points[i as usize], surface.points[j as usize]));
        let shorter = |quad: &[u32; 4]| halves(quad)[usize::from(apart(quad[0], quad[2]) > apart(quad[1], quad[3]))];
        surface.triangles = quads.iter().flat_map(shorter).collect();
        surface.relax(field, cell);
        // Selects the diagonal of each quad whose triangles face outwards more.
        let split = |quad: &[u32; 4]| {
            let outwards = halves(quad).map(|pair| surface.facing(pair[0]).min(surface.facing(pair[1])));
            halves(quad)[usize::from(outwards[0] < outwards[1])]
        };
        surface.triangles = quads.iter().flat_map(split).collect();
        surface
    }

    /// Cosine between a triangle's normal and the mean of its vertex normals; 0 for a degenerate triangle.
    fn facing(&self, triangle: [u32; 3]) -> f64 {
        let [a, b, c] = triangle.map(|v| self.points[v as usize]);
        let mean = triangle.iter().fold([0.0; 3], |sum, &v| add(sum, self.normals[v as usize]));
        let [normal, mean] = [cross(sub(b, a), sub(c, a)), mean].map(|v| unit(v, 1e-12).unwrap_or([0.0; 3]));
        dot(normal, mean)
    }

    /// Projects the vertices onto the surface and distributes them evenly.
    fn relax(&mut self, field: &(dyn Fn(Vec3) -> f64 + Sync), cell: f64) {
        let near = self.neighbours();
        for round in 0..=RELAXATION_ROUNDS {
            let points = &self.points;
            let relaxed = |(n, &point): (usize, &Vec3)| {
                let sum = near[n].iter().fold([0.0; 3], |sum, &other| add(sum, points[other as usize]));
                let middle = scale(sum, 1.0 / near[n].len().max(1) as f64);
                let from = if round == 0 { point } else { scale(add(point, middle), 0.5) };
                project_onto(field, from, cell, if round == 0 { 3 } else { 1 })
            };
            let moved: Vec<(Vec3, Vec3)> = points.par_iter().enumerate().map(relaxed).collect();
            (self.points, self.normals) = moved.into_iter().unzip();
        }
    }

    /// Replaces the normals by the gradient of another field, with differences over `width` cm.
    #[must_use]
    pub fn with_normals_of(mut self, field: &(dyn Fn(Vec3) -> f64 + Sync), width: f64) -> Self {
        let normals = self
            .points
            .iter()
            .zip(&self.normals)
            .map(|(&at, &own)| unit(gradient(field, at, width / 2.0), 1e-9).unwrap_or(own));
        self.normals = normals.collect();
        self
    }

    /// Number of leading triangles that form closed surfaces: no open edge, no vertex shared with later ones.
    pub fn n_closed(&self) -> usize {
        let edges = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]];
        let all: HashSet<[u32; 2]> = self.triangles.iter().flat_map(|triangle| edges(*triangle)).collect();
        let is_open = |triangle: &[u32; 3]| edges(*triangle).iter().any(|[a, b]| !all.contains(&[*b, *a]));
        let mut n = self.triangles.iter().position(is_open).unwrap_or(self.triangles.len());
        loop {
            let lowest = self.triangles[n..].iter().flatten().min().copied().unwrap_or(u32::MAX);
            let has_later = |triangle: &[u32; 3]| triangle.iter().any(|vertex| *vertex >= lowest);
            match self.triangles[..n].iter().position(has_later) {
                Some(fewer) => n = fewer,
                None => return n,
            }
        }
    }

    /// Neighbours of each vertex along edges, sorted.
    pub fn neighbours(&self) -> Vec<Vec<u32>> {
        let mut all = vec![Vec::new(); self.points.len()];
        for &[a, b, c] in &self.triangles {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                all[from as usize].push(to);
                all[to as usize].push(from);
            }
        }
        all.iter_mut().for_each(|near| {
            near.sort_unstable();
            near.dedup();
        });
        all
    }
}

/// Projects `point` onto the surface; returns the position and the outward normal there.
fn project_onto(field: &(dyn Fn(Vec3) -> f64 + Sync), point: Vec3, cell: f64, steps: usize) -> (Vec3, Vec3) {
    let mut at = point;
    for _ in 0..steps {
        let slope = gradient(field, at, GRADIENT_STEP * cell);
        let steep = dot(slope, slope);
        let next = sub(at, scale(slope, field(at) / steep.max(0.05)));
        if norm(sub(next, point)) < MAX_STEP * cell {
            at = next;
        }
    }
    (at, unit(gradient(field, at, GRADIENT_STEP * cell), 1e-9).unwrap_or([0.0, 1.0, 0.0]))
}

/// Gradient of the field by central differences with step `step`.
fn gradient(field: &(dyn Fn(Vec3) -> f64 + Sync), at: Vec3, step: f64) -> Vec3 {
    std::array::from_fn(|k| {
        let mut shift = [0.0; 3];
        shift[k] = step;
        (field(add(at, shift)) - field(sub(at, shift))) / (2.0 * step)
    })
}

impl FieldGrid {
    fn sample(field: &(dyn Fn(Vec3) -> f64 + Sync), [low, high]: [Vec3; 2], cell: f64) -> Self {
        let low = low.map(|v| v - 1.5 * cell);
        let n = [0, 1, 2].map(|k| (((high[k] + 1.5 * cell - low[k]) / cell).ceil().max(1.0) as usize) + 1);
        let layer = n[0] * n[1];
        let mut values = vec![f32::INFINITY; layer * n[2]];
        let place = |[x, y, z]: [usize; 3]| [x, y, z].map(|v| v as f64 * cell);
        values.par_chunks_mut(layer * BLOCK).enumerate().for_each(|(slab, values)| {
            for y0 in (0..n[1]).step_by(BLOCK) {
                for x0 in (0..n[0]).step_by(BLOCK) {
                    let half = (BLOCK - 1) as f64 / 2.0 * cell;
                    let first = place([x0, y0, slab * BLOCK]);
                    let middle = field([0, 1, 2].map(|k| low[k] + first[k] + half));
                    // This relies on gradients not much larger than 1.
                    let far = (middle.abs() > 1.4 * half * 3f64.sqrt() + cell).then_some(middle as f32);
                    for z in 0..values.len() / layer {
                        for y in y0..(y0 + BLOCK).min(n[1]) {
                            for x in x0..(x0 + BLOCK).min(n[0]) {
                                let at = place([x, y, slab * BLOCK + z]);
                                let value = far.unwrap_or_else(|| field([0, 1, 2].map(|k| low[k] + at[k])) as f32);
                                values[z * layer + y * n[0] + x] = value;
                            }
                        }
                    }
                }
            }
        });
        Self { low, cell, n, values }
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.n[1] + y) * self.n[0] + x
    }

    /// Mean of the points where the surface crosses the edges of a cell.
    fn vertex(&self, cell: [usize; 3]) -> Option<Vec3> {
        let corner = |bits: usize| [0, 1, 2].map(|k| cell[k] + (bits >> k & 1));
        let values: [f32; 8] = std::array::from_fn(|bits| self.values[self.index(corner(bits))]);
        let (mut sum, mut n) = ([0.0; 3], 0.0);
        for bits in 0..8 {
            for axis in 0..3 {
                let other = bits | 1 << axis;
                let (a, b) = (f64::from(values[bits]), f64::from(values[other]));
                if other != bits && (a < 0.0) != (b < 0.0) {
                    let mut at = corner(bits).map(|v| v as f64);
                    at[axis] += a / (a - b);
                    (sum, n) = (add(sum, at), n + 1.0);
                }
            }
        }
        (n > 0.0).then(|| add(self.low, scale(sum, self.cell / n)))
    }

    /// Calls `each` for every grid edge that crosses the surface, with the four cells around it (by index) and whether
    /// the surface faces against the axis.
    fn quads(&self, mut each: impl FnMut([usize; 4], bool)) {
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let step = |k: usize| [1, self.n[0], self.n[0] * self.n[1]][k];
            for (z, y, x) in ndarray::indices((self.n[2], self.n[1], self.n[0])) {
                let at = [x, y, z];
                if at[axis] + 1 >= self.n[axis] || at[u] == 0 || at[v] == 0 {
                    continue;
                }
                let here = self.index(at);
                let inside = self.values[here] < 0.0;
                if inside != (self.values[here + step(axis)] < 0.0) {
                    let cells = [here - step(u) - step(v), here - step(v), here, here - step(u)];
                    each(cells, !inside);
                }
            }
        }
    }
}
