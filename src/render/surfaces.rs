//! Meshes as a camera and a light see them: vertices in the picture with the light they send.

use super::camera::{NEAR_CM, PinholeCamera};
use super::light::{Light, direction, dot};
use super::mesh::Mesh;
use super::samples::{Extent, FlatTriangle, PARTS};
use super::shadow::{self, ShadowMap};

/// Furthest point that is drawn, cm.
const FAR_CM: f32 = 1e6;
/// Furthest corner from the picture's, parts of a pixel: products of two are whole numbers in f64.
const FURTHEST: f32 = (1 << 23) as f32;
/// Light that reaches the inner side of a surface, which is mostly the inside of clothes.
const INNER_LIGHT: f32 = 0.45;

/// Ratio of the depths within a triangle up to which it is even.
const EVEN: f32 = 1.03;

/// Light of its own, light of the key where that reaches it (linear RGB), and the point in the light's axes where to ask
/// whether it does. The fourth numbers fill up registers; the first of them is the cosine of the angle to the viewer.
pub type Radiance = [[f32; 4]; 3];

/// One triangle of `Surfaces`.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceTriangle {
    pub vertices: [u32; 3],
    pub mesh: u16,
    pub label: u16,
    /// Whether its inner side is seen.
    pub is_inner: bool,
    pub extent: Extent,
}

/// Vertices and triangles of all meshes of a picture.
#[derive(Clone, Debug, Default)]
pub struct Surfaces {
    /// Width and height of the picture, px.
    size: [usize; 2],
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
        self.size = camera.size;
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
                let mut radiance = [own, key, asking].map(|[a, b, c]| [a, b, c, 0.0]);
                radiance[0][3] = dot(normal, to_viewer);
                self.radiance.push(radiance);
                self.light_points.push(ShadowMap::seen(&axes, *point));
            }
            for triangle in &mesh.triangles {
                let label = mesh.labels.get(triangle[0] as usize).copied().unwrap_or(0);
                let vertices = triangle.map(|v| v + start as u32);
                let depths = vertices.map(|v| self.seen[v as usize][2]);
                let triangle =
                    SurfaceTriangle { vertices, mesh: number as u16, label, is_inner: false, extent: [[0; 2]; 2] };
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
        let flat = self.flat(&triangle);
        let (area, extent) = (flat.area(), flat.extent(self.size));
        if area != 0 && extent.iter().all(|[first, last]| first < last) {
            self.triangles.push(SurfaceTriangle { is_inner: area > 0, extent, ..triangle });
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

    /// Takes light of their own from the vertices that are close behind something.
    pub fn occlude(&mut self, shadows: &ShadowMap) {
        // Vertices on the far side are not seen.
        for [own, _, asking] in self.radiance.iter_mut().filter(|[own, ..]| own[3] > -0.3) {
            let open = shadows.open_share([asking[0], asking[1], asking[2]]);
            own.iter_mut().for_each(|v| *v *= open);
        }
    }

    /// Whether a triangle is so far away for its size that what it sends changes evenly over the picture.
    pub fn is_even(&self, triangle: &SurfaceTriangle) -> bool {
        let [a, b, c] = self.flat(triangle).nearness;
        a.max(b).max(c) < EVEN * a.min(b).min(c)
    }

    /// What a triangle sends over the picture, as a plane.
    pub fn plane(&self, triangle: &SurfaceTriangle) -> RadiancePlane {
        let flat = self.flat(triangle);
        let from = flat.corners[0];
        let [to_b, to_c] = [1, 2].map(|n| [0, 1].map(|k| (flat.corners[n][k] - from[k]) as f32));
        let per_area = 1.0 / (to_b[0] * to_c[1] - to_b[1] * to_c[0]);
        let [a, b, c] = self.lit(triangle);
        let slope = |p: f32, q: f32| -> Radiance {
            let (p, q) = (p * per_area, q * per_area);
            std::array::from_fn(|n| std::array::from_fn(|k| (b[n][k] - a[n][k]) * p + (c[n][k] - a[n][k]) * q))
        };
        RadiancePlane { from, at: a, across: slope(to_c[1], -to_b[1]), down: slope(-to_c[0], to_b[0]) }
    }

    /// What a triangle sends from a point (parts of a pixel) within it.
    pub fn radiance_at(&self, triangle: &SurfaceTriangle, point: [i32; 2]) -> Radiance {
        let flat = self.flat(triangle);
        let corners = flat.corners.map(|corner| [0, 1].map(|k| (corner[k] - point[k]) as f32));
        let sign = if triangle.is_inner { 1.0 } else { -1.0 };
        let shares: [f32; 3] = std::array::from_fn(|n| {
            let [p, q] = [corners[(n + 1) % 3], corners[(n + 2) % 3]];
            ((p[0] * q[1] - p[1] * q[0]) * sign).max(0.0) * flat.nearness[n]
        });
        let sum = shares[0] + shares[1] + shares[2];
        let shares = if sum > 0.0 { shares.map(|v| v / sum) } else { [1.0, 0.0, 0.0] };
        let [a, b, c] = self.lit(triangle);
        std::array::from_fn(|n| {
            std::array::from_fn(|k| shares[0] * a[n][k] + shares[1] * b[n][k] + shares[2] * c[n][k])
        })
    }

    /// What the corners of a triangle send; less on its inner side.
    #[inline(always)]
    fn lit(&self, triangle: &SurfaceTriangle) -> [Radiance; 3] {
        let mut lit = triangle.vertices.map(|v| self.radiance[v as usize]);
        if triangle.is_inner {
            lit.iter_mut().flat_map(|corner| &mut corner[..2]).flatten().for_each(|v| *v *= INNER_LIGHT);
        }
        lit
    }
}

/// What a triangle sends as a plane over the picture: at a point (parts of a pixel), and its change a part.
#[derive(Clone, Copy, Debug)]
pub struct RadiancePlane {
    from: [i32; 2],
    at: Radiance,
    across: Radiance,
    down: Radiance,
}

impl RadiancePlane {
    #[inline(always)]
    pub fn radiance_at(&self, point: [i32; 2]) -> Radiance {
        let [dx, dy] = [0, 1].map(|k| (point[k] - self.from[k]) as f32);
        let along = |n: usize| {
            let mut sum = self.at[n];
            let slopes = self.across[n].iter().zip(&self.down[n]);
            sum.iter_mut().zip(slopes).for_each(|(sum, (across, down))| *sum += across * dx + down * dy);
            sum
        };
        [along(0), along(1), along(2)]
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
