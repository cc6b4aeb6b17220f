//! Meshes as a camera and a light see them: vertices in the picture with the light they send.

use super::camera::{NEAR_CM, PinholeCamera};
use super::light::{Light, direction, dot};
use super::mesh::Mesh;
use super::samples::{FlatTriangle, PARTS, PixelBounds};
use super::shadow::{self, ShadowMap};

/// Furthest point that is drawn, cm.
const FAR_CM: f32 = 1e6;
/// Furthest corner from the picture's, parts of a pixel: products of two are whole numbers in f64.
const FURTHEST: f32 = (1 << 23) as f32;
/// Light that reaches the inner side of a surface, which is mostly the inside of clothes.
const INNER_LIGHT: f32 = 0.45;

/// Light of its own, light of the key where that reaches it (linear RGB), and the point in the light's axes where to ask
/// whether it does; the fourth numbers fill up registers.
pub type Radiance = [[f32; 4]; 3];

/// One triangle of `Surfaces`.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceTriangle {
    pub vertices: [u32; 3],
    pub mesh: u16,
    pub label: u16,
    /// Whether its inner side is seen.
    pub is_inner: bool,
}

/// Vertices and triangles of all meshes of a picture.
#[derive(Clone, Debug, Default)]
pub struct Surfaces {
    /// In camera axes, cm.
    seen: Vec<[f32; 3]>,
    corners: Vec<[i32; 2]>,
    nearness: Vec<f32>,
    radiance: Vec<Radiance>,
    /// In the light's axes, cm.
    light_points: Vec<[f32; 3]>,
    /// First vertex of each mesh, in `light_points`.
    starts: Vec<usize>,
    pub triangles: Vec<SurfaceTriangle>,
}

impl Surfaces {
    /// Takes over the meshes of a picture in place of those before.
    pub fn set(&mut self, camera: &PinholeCamera, meshes: &[&Mesh], light: &Light) {
        self.clear();
        let rows = camera.axes.inverse().axes().map(|axis| axis.map(|v| v as f32));
        let eye = camera.position.map(|v| v as f32);
        let middle = camera.size.map(|n| (n as f32 - 1.0) / 2.0 * PARTS as f32);
        let lens = Lens { middle, parts: camera.focal_px as f32 * PARTS as f32 };
        let axes = light.axes();
        for (number, mesh) in meshes.iter().enumerate() {
            let start = self.seen.len();
            self.starts.push(start);
            for ((point, normal), colour) in mesh.points.iter().zip(&mesh.normals).zip(&mesh.colours) {
                let from_eye: [f32; 3] = std::array::from_fn(|k| point[k] - eye[k]);
                let seen = rows.map(|row| dot(row, from_eye));
                let normal = direction(*normal);
                let to_viewer = direction(from_eye.map(|v| -v));
                let [own, key] = light.on(normal, to_viewer, *colour, mesh.gloss);
                let asking = shadow::asking_point(light, &axes, *point, normal);
                let (corner, nearness) = lens.project(seen);
                self.seen.push(seen);
                self.corners.push(corner);
                self.nearness.push(nearness);
                self.radiance.push([own, key, asking].map(|[a, b, c]| [a, b, c, 0.0]));
                self.light_points.push(ShadowMap::seen(&axes, *point));
            }
            for triangle in &mesh.triangles {
                let label = mesh.labels.get(triangle[0] as usize).copied().unwrap_or(0);
                let vertices = triangle.map(|v| v + start as u32);
                let depths = vertices.map(|v| self.seen[v as usize][2]);
                let triangle = SurfaceTriangle { vertices, mesh: number as u16, label, is_inner: false };
                if depths.iter().all(|z| (NEAR_CM as f32..FAR_CM).contains(z)) {
                    self.push(triangle);
                } else if depths.iter().all(|z| z.abs() < FAR_CM) && depths.iter().any(|z| *z > NEAR_CM as f32) {
                    self.push_cut(triangle, &lens);
                }
            }
        }
    }

    fn clear(&mut self) {
        self.seen.clear();
        self.corners.clear();
        self.nearness.clear();
        self.radiance.clear();
        self.light_points.clear();
        self.starts.clear();
        self.triangles.clear();
    }

    fn push(&mut self, triangle: SurfaceTriangle) {
        let area = self.flat(&triangle).area();
        if area != 0 {
            self.triangles.push(SurfaceTriangle { is_inner: area > 0, ..triangle });
        }
    }

    /// The part of a triangle beyond the nearest depth, as one or two triangles with vertices of their own.
    fn push_cut(&mut self, triangle: SurfaceTriangle, lens: &Lens) {
        let near = NEAR_CM as f32;
        let mut kept: [u32; 4] = [0; 4];
        let mut n_kept = 0;
        for side in 0..3 {
            let [from, to] = [side, (side + 1) % 3].map(|n| triangle.vertices[n] as usize);
            let [from_z, to_z] = [from, to].map(|v| self.seen[v][2]);
            if from_z >= near {
                kept[n_kept] = from as u32;
                n_kept += 1;
            }
            if (from_z >= near) != (to_z >= near) {
                let share = (near - from_z) / (to_z - from_z);
                let between = |a: f32, b: f32| a + share * (b - a);
                let [a, b] = [self.seen[from], self.seen[to]];
                let seen = [between(a[0], b[0]), between(a[1], b[1]), near];
                let [a, b] = [self.radiance[from], self.radiance[to]];
                let radiance = std::array::from_fn(|n| std::array::from_fn(|k| between(a[n][k], b[n][k])));
                let (corner, nearness) = lens.project(seen);
                kept[n_kept] = self.seen.len() as u32;
                n_kept += 1;
                self.seen.push(seen);
                self.corners.push(corner);
                self.nearness.push(nearness);
                self.radiance.push(radiance);
                // Shadows are cast by the whole triangle.
                self.light_points.push(self.light_points[from]);
            }
        }
        for n in 2..n_kept {
            self.push(SurfaceTriangle { vertices: [kept[0], kept[n - 1], kept[n]], ..triangle });
        }
    }

    /// A triangle in the picture.
    #[inline(always)]
    pub fn flat(&self, triangle: &SurfaceTriangle) -> FlatTriangle {
        let [a, b, c] = triangle.vertices.map(|v| v as usize);
        FlatTriangle {
            corners: [self.corners[a], self.corners[b], self.corners[c]],
            nearness: [self.nearness[a], self.nearness[b], self.nearness[c]],
        }
    }

    /// Points in the light's axes and triangles of each mesh.
    pub fn casters<'a>(
        &'a self,
        meshes: &'a [&Mesh],
    ) -> impl Iterator<Item = (&'a [[f32; 3]], &'a [[u32; 3]])> + Clone {
        let parts = meshes.iter().zip(&self.starts);
        parts.map(|(mesh, &start)| (&self.light_points[start..start + mesh.points.len()], &mesh.triangles[..]))
    }

    /// Pixels that may show a triangle.
    pub fn bounds(&self, size: [usize; 2]) -> PixelBounds {
        let (mut low, mut high) = ([i32::MAX; 2], [i32::MIN; 2]);
        for vertex in self.triangles.iter().flat_map(|triangle| triangle.vertices) {
            let corner = self.corners[vertex as usize];
            for k in 0..2 {
                low[k] = low[k].min(corner[k]);
                high[k] = high[k].max(corner[k]);
            }
        }
        if low[0] > high[0] {
            return PixelBounds::default();
        }
        let pixel = |v: i32, k: usize| v.div_euclid(PARTS).clamp(0, size[k] as i32) as usize;
        PixelBounds {
            from: [0, 1].map(|k| pixel(low[k] - PARTS, k)),
            to: [0, 1].map(|k| pixel(high[k] + 2 * PARTS, k)),
        }
    }

    /// What a triangle sends from the middle of a pixel, or from its point next to that.
    #[inline(always)]
    pub fn radiance_at(&self, triangle: &SurfaceTriangle, x: usize, y: usize) -> Radiance {
        let [a, b, c] = triangle.vertices.map(|v| v as usize);
        let middle = [x as i32 * PARTS, y as i32 * PARTS];
        let from = |v: usize| {
            let corner = self.corners[v];
            [(corner[0] - middle[0]) as f32, (corner[1] - middle[1]) as f32]
        };
        let corners = [from(a), from(b), from(c)];
        let sign = if triangle.is_inner { 1.0 } else { -1.0 };
        let share = |p: [f32; 2], q: [f32; 2], v: usize| {
            let area = (p[0] * q[1] - p[1] * q[0]) * sign;
            if area > 0.0 { area * self.nearness[v] } else { 0.0 }
        };
        let shares =
            [share(corners[1], corners[2], a), share(corners[2], corners[0], b), share(corners[0], corners[1], c)];
        let sum = shares[0] + shares[1] + shares[2];
        // A triangle seen edge-on may give no share at all.
        let shares = if sum > 0.0 { shares.map(|v| v * (1.0 / sum)) } else { [1.0, 0.0, 0.0] };
        let light = if triangle.is_inner { INNER_LIGHT } else { 1.0 };
        let [ra, rb, rc] = [&self.radiance[a], &self.radiance[b], &self.radiance[c]];
        std::array::from_fn(|n| {
            let by = if n < 2 { light } else { 1.0 };
            std::array::from_fn(|k| (shares[0] * ra[n][k] + shares[1] * rb[n][k] + shares[2] * rc[n][k]) * by)
        })
    }
}

/// Camera axes to parts of a pixel.
struct Lens {
    middle: [f32; 2],
    parts: f32,
}

impl Lens {
    /// Corner in the picture and one over the depth; what is nearer than the nearest depth is cut elsewhere.
    #[inline(always)]
    fn project(&self, [x, y, z]: [f32; 3]) -> ([i32; 2], f32) {
        let nearness = 1.0 / z;
        let part = |v: f32, k: usize| {
            let at = (self.middle[k] + v * nearness * self.parts + 0.5).clamp(-FURTHEST, FURTHEST);
            let whole = at as i32;
            whole - i32::from((whole as f32) > at)
        };
        ([part(x, 0), part(y, 1)], nearness)
    }
}
