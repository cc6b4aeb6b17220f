//! Shadow map of the key light, read with percentage-closer filtering.

use super::light::{Light, dot};

/// Minimum depth bias against self-shadowing, cm; the width of a texel is added.
const BIAS_CM: f32 = 0.35;
/// Ambient occlusion samples around a point: directions on two rings, and the radii of the rings.
const OCCLUSION_OFFSETS: [[f32; 2]; 12] = [
    [1.0, 0.0],
    [0.0, 1.0],
    [-1.0, 0.0],
    [0.0, -1.0],
    [0.924, 0.383],
    [0.383, 0.924],
    [-0.383, 0.924],
    [-0.924, 0.383],
    [-0.924, -0.383],
    [-0.383, -0.924],
    [0.383, -0.924],
    [0.924, -0.383],
];
const OCCLUSION_RADII_CM: [f32; 2] = [2.0, 4.5];
/// Minimum and maximum distance of occluders, cm, and the share of ambient light blocked if they cover all samples.
const OCCLUSION_BIAS_CM: f32 = 0.8;
const OCCLUSION_RANGE_CM: f32 = 22.0;
const OCCLUSION_STRENGTH: f32 = 0.9;
/// Empty texels around the shadow casters.
const MARGIN: usize = 4;
/// Width of the cells that mark non-empty parts of the map, texels.
const CELL: usize = 16;

/// Distance from the key light to the first surface, on a plane perpendicular to the light.
#[derive(Clone, Debug)]
pub struct ShadowMap {
    n: usize,
    /// Position of texel (0, 0) perpendicular to the light, cm.
    origin: [f32; 2],
    texels_per_cm: f32,
    bias: f32,
    /// Depth along the light, cm; infinite where there is no caster. Shape: [n, n]
    depths: Vec<f32>,
    /// Minimum and maximum depth in the 4 x 4 texels that start at each texel.
    ends: [Vec<f32>; 2],
    /// Whether a cell contains a caster.
    cells: Vec<bool>,
    is_empty: bool,
}

impl ShadowMap {
    /// An empty map of `n` x `n` texels.
    pub fn new(n: usize) -> Self {
        let n_cells = n.div_ceil(CELL);
        let (depths, cells) = (vec![f32::INFINITY; n * n], vec![false; n_cells * n_cells]);
        let ends = [0, 1].map(|_| vec![f32::INFINITY; n * n]);
        Self { n, origin: [0.0; 2], texels_per_cm: 1.0, bias: BIAS_CM, depths, ends, cells, is_empty: true }
    }

    /// A world point in light axes, cm: two coordinates perpendicular to the light, then the depth along it.
    #[inline(always)]
    pub fn light_space(axes: &[[f32; 3]; 3], point: [f32; 3]) -> [f32; 3] {
        [dot(axes[0], point), dot(axes[1], point), dot(axes[2], point)]
    }

    /// Renders the casters, given as points in light axes and triangles. With `only_far_sides`, triangles that face the
    /// light are skipped: closed meshes then cast the same shadow without shading themselves, one-sided walls none.
    pub fn cast<'a>(
        &mut self,
        parts: impl Iterator<Item = (&'a [[f32; 3]], &'a [[u32; 3]])> + Clone,
        only_far_sides: bool,
    ) {
        self.depths.fill(f32::INFINITY);
        self.cells.fill(false);
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for point in parts.clone().flat_map(|part| part.0) {
            for k in 0..2 {
                low[k] = low[k].min(point[k]);
                high[k] = high[k].max(point[k]);
            }
        }
        let extent = (high[0] - low[0]).max(high[1] - low[1]).max(1.0);
        self.is_empty = !extent.is_finite();
        if self.is_empty {
            return;
        }
        self.texels_per_cm = (self.n - 2 * MARGIN - 1) as f32 / extent;
        self.bias = BIAS_CM + 1.0 / self.texels_per_cm;
        self.origin = low.map(|v| v - MARGIN as f32 / self.texels_per_cm);
        let mut flat = Vec::new();
        for (points, triangles) in parts {
            flat.clear();
            flat.extend(points.iter().map(|point| {
                let at = self.texel(*point);
                (at, [at[0].max(0.0) as i32, at[1].max(0.0) as i32])
            }));
            for triangle in triangles {
                let [a, b, c] = [0, 1, 2].map(|n: usize| &flat[triangle[n] as usize]);
                let corners = [a.0, b.0, c.0];
                let area = area(&corners);
                let towards_light = if only_far_sides { -area } else { area };
                // Edge-on triangles and those with NaN are skipped too.
                if towards_light.is_nan() || towards_light <= 1e-9 {
                    continue;
                }
                // Range of texels whose centres (at integer coordinates) are inside.
                let ends = |k: usize| {
                    let (low, high) = (a.1[k].min(b.1[k]).min(c.1[k]), a.1[k].max(b.1[k]).max(c.1[k]));
                    [low as usize + 1, (high as usize + 1).min(self.n)]
                };
                let (columns, rows) = (ends(0), ends(1));
                if columns[0] < columns[1] && rows[0] < rows[1] {
                    self.fill(corners, area, columns, rows);
                }
            }
        }
        self.update_cells();
        self.update_ends();
    }

    fn texel(&self, [x, y, depth]: [f32; 3]) -> [f32; 3] {
        [(x - self.origin[0]) * self.texels_per_cm, (y - self.origin[1]) * self.texels_per_cm, depth]
    }

    fn fill(&mut self, [a, b, c]: [[f32; 3]; 3], area: f32, columns: [usize; 2], rows: [usize; 2]) {
        let per_area = 1.0 / area;
        let [to_b, to_c] = [b, c].map(|corner| [corner[0] - a[0], corner[1] - a[1], corner[2] - a[2]]);
        for y in rows[0]..rows[1] {
            let dy = y as f32 - a[1];
            for x in columns[0]..columns[1] {
                let dx = x as f32 - a[0];
                let share_b = (dx * to_c[1] - dy * to_c[0]) * per_area;
                let share_c = (dy * to_b[0] - dx * to_b[1]) * per_area;
                if share_b >= -1e-4 && share_c >= -1e-4 && share_b + share_c <= 1.0002 {
                    let depth = a[2] + share_b * to_b[2] + share_c * to_c[2];
                    let texel = &mut self.depths[y * self.n + x];
                    *texel = if depth < *texel { depth } else { *texel };
                }
            }
        }
    }

    fn update_cells(&mut self) {
        let n_cells = self.n.div_ceil(CELL);
        for (y, row) in self.depths.chunks_exact(self.n).enumerate() {
            for (cell, texels) in row.chunks(CELL).enumerate() {
                if texels.iter().any(|depth| *depth < f32::INFINITY) {
                    self.cells[y / CELL * n_cells + cell] = true;
                }
            }
        }
    }

    fn update_ends(&mut self) {
        let [nearest, furthest] = &mut self.ends;
        let [rows, texels] = [self.n, 1];
        let mut along = vec![f32::INFINITY; self.depths.len()];
        fold_four(&self.depths, texels, &mut along, |a, b| if a < b { a } else { b });
        fold_four(&along, rows, nearest, |a, b| if a < b { a } else { b });
        fold_four(&self.depths, texels, &mut along, |a, b| if a > b { a } else { b });
        fold_four(&along, rows, furthest, |a, b| if a > b { a } else { b });
    }

    /// Whether a caster may shade points between `low` and `high`, cm perpendicular to the light.
    pub fn may_shade(&self, low: [f32; 2], high: [f32; 2]) -> bool {
        if self.is_empty {
            return false;
        }
        let ends = |k: usize| {
            let [from, to] = [low[k], high[k]].map(|v| (v - self.origin[k]) * self.texels_per_cm);
            let around = MARGIN as f32 + OCCLUSION_RADII_CM[1] * self.texels_per_cm;
            let first = (from - around).max(0.0) as usize / CELL;
            // A negative end gives an empty range.
            let last = if to < -around { 0 } else { (to + around) as usize / CELL + 1 };
            (first, last.min(self.n.div_ceil(CELL)))
        };
        let (columns, rows) = (ends(0), ends(1));
        (rows.0..rows.1).any(|y| (columns.0..columns.1).any(|x| self.cells[y * self.n.div_ceil(CELL) + x]))
    }

    /// Fraction of ambient light at a point in light axes, 0..1: reduced by nearby occluders towards the light within
    /// `OCCLUSION_RADII_CM`. This separates a hand visually from the chest and the desk.
    pub fn open_share(&self, point: [f32; 3]) -> f32 {
        if self.is_empty {
            return 1.0;
        }
        let last = (self.n - 1) as f32;
        let mut hidden = 0.0;
        for (radius, offsets) in OCCLUSION_RADII_CM.into_iter().zip([&OCCLUSION_OFFSETS[..4], &OCCLUSION_OFFSETS[4..]])
        {
            for offset in offsets {
                let [x, y, depth] =
                    self.texel([point[0] + radius * offset[0], point[1] + radius * offset[1], point[2]]);
                if x >= 0.0 && y >= 0.0 && x <= last && y <= last {
                    let behind = depth - self.depths[y as i32 as usize * self.n + x as i32 as usize];
                    if behind > OCCLUSION_BIAS_CM + 1.2 * radius && behind < OCCLUSION_RANGE_CM {
                        hidden += 1.0 - behind * (1.0 / OCCLUSION_RANGE_CM);
                    }
                }
            }
        }
        1.0 - hidden * (OCCLUSION_STRENGTH / OCCLUSION_OFFSETS.len() as f32)
    }

    /// Shadow query of a point in light axes, for `lit`: position in texels (twice) and biased depth, cm.
    #[inline(always)]
    pub fn query(&self, point: [f32; 3]) -> [f32; 3] {
        let [x, y, depth] = self.texel(point);
        [x, y, depth - self.bias]
    }

    /// Fraction of the key light at a shadow query, 0..1, filtered over 4 x 4 texels with a tent kernel.
    #[inline(always)]
    pub fn lit(&self, [x, y, depth]: [f32; 3]) -> f32 {
        let furthest = (self.n - 3) as f32;
        // The condition is also false for NaN.
        if self.is_empty || !(x > 1.0 && y > 1.0 && x < furthest && y < furthest) {
            return 1.0;
        }
        let (column, row) = (floor(x), floor(y));
        let start = (row - 1) * self.n + column - 1;
        if depth < self.ends[0][start] {
            return 1.0;
        }
        if depth >= self.ends[1][start] {
            return 0.0;
        }
        self.partly_lit([x - column as f32, y - row as f32], [column, row], depth)
    }

    /// Fraction of the key light where only some of the texels are shadowed.
    #[inline(never)]
    fn partly_lit(&self, [right, low]: [f32; 2], [column, row]: [usize; 2], depth: f32) -> f32 {
        let across = [1.0 - right, 1.0, 1.0, right];
        let down = [1.0 - low, 1.0, 1.0, low];
        let mut lit = [0.0f32; 4];
        for (k, share) in down.into_iter().enumerate() {
            let start = (row - 1 + k) * self.n + column - 1;
            let Some(texels) = self.depths[start..].first_chunk::<4>() else { continue };
            let mut weights = [0.0f32; 4];
            for n in 0..4 {
                weights[n] = if depth < texels[n] { share } else { 0.0 };
            }
            for n in 0..4 {
                lit[n] += weights[n];
            }
        }
        for n in 0..4 {
            lit[n] *= across[n];
        }
        (lit[0] + lit[1] + lit[2] + lit[3]) * (1.0 / 9.0)
    }
}

/// Folds four values that are `step` apart.
#[inline(always)]
fn fold_four(from: &[f32], step: usize, to: &mut [f32], fold: impl Fn(f32, f32) -> f32) {
    let n = from.len() - 3 * step;
    let [a, b, c, d] = [0, 1, 2, 3].map(|k| &from[k * step..][..n]);
    for (at, to) in to[..n].iter_mut().enumerate() {
        *to = fold(fold(a[at], b[at]), fold(c[at], d[at]));
    }
}

/// Integer part of a number from 1 to 2^22; for an integer, the result may be one less, which the filter tolerates.
#[inline(always)]
fn floor(v: f32) -> usize {
    // In the sum with 2^23 the lowest mantissa bits hold the rounded number.
    ((v - 0.5 + (1 << 23) as f32).to_bits() & 0x7f_ffff) as usize
}

/// Twice the signed area of a triangle projected along the light; positive if it faces the light.
fn area([a, b, c]: &[[f32; 3]; 3]) -> f32 {
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}

/// Offset of shadow queries along the normal, cm, which prevents self-shadowing of curved surfaces.
pub const NORMAL_OFFSET_CM: f32 = 0.5;

/// The point, in light axes, at which a surface queries its shadow.
#[inline(always)]
pub fn query_point(light: &Light, axes: &[[f32; 3]; 3], point: [f32; 3], normal: [f32; 3]) -> [f32; 3] {
    // The offset grows at grazing angles.
    let by = NORMAL_OFFSET_CM * (1.5 - dot(normal, light.to_key).abs());
    ShadowMap::light_space(axes, [point[0] + by * normal[0], point[1] + by * normal[1], point[2] + by * normal[2]])
}
