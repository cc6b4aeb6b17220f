//! Meshes as a camera and a light see them: vertices in the picture with the light they send.

use super::camera::{NEAR_CM, PinholeCamera};
use super::light::{Light, direction, dot};
use super::samples::{Extent, FlatTriangle, PARTS};
use super::shadow::{self, ShadowMap};

/// Furthest point that is drawn, cm.
const FAR_CM: f32 = 1e6;
/// Furthest corner from the picture's, parts of a pixel: products of two are whole numbers in f64.
const FURTHEST: f32 = (1 << 23) as f32;
/// Light that reaches the inner side of a surface, which is mostly the inside of clothes.
pub const INNER_LIGHT: f32 = 0.45;

/// Ratio of the depths within a triangle up to which it is even.
const EVEN: f32 = 1.03;

/// Triangle mesh in world axes (cm, y up), counter-clockwise seen from outside; all vertex lists are equally long.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    pub points: Vec<[f32; 3]>,
    /// Unit outward normals.
    pub normals: Vec<[f32; 3]>,
    /// Linear RGB reflectance, 0..1.
    pub colours: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
    /// Number of the first triangles that enclose volumes, whose inner sides nobody sees.
    pub n_closed: usize,
    /// Label of each vertex, for instance the joint that moves it; a triangle has that of its first vertex.
    pub labels: Vec<u16>,
    /// Strength of the highlight, 0 (cloth) .. 1 (glass).
    pub gloss: f32,
}

/// Light of its own, light of the key where that reaches it (linear RGB), and the point in the light's axes where to ask
/// whether it does. The fourth numbers fill up registers.
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

/// What the light of a vertex follows from, in world axes.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    point: [f32; 3],
    /// Outward, of any length.
    normal: [f32; 3],
    colour: [f32; 3],
    gloss: f32,
}

/// Vertices and triangles of all meshes of a picture.
#[derive(Clone, Debug, Default)]
pub struct Surfaces {
    /// Width and height of the picture, px.
    size: [usize; 2],
    eye: [f32; 3],
    light: Light,
    /// The light's axes.
    axes: [[f32; 3]; 3],
    /// In camera axes, cm.
    seen: Vec<[f32; 3]>,
    corners: Vec<[i32; 2]>,
    nearness: Vec<f32>,
    vertices: Vec<Vertex>,
    /// In the light's axes, cm.
    light_points: Vec<[f32; 3]>,
    /// First vertex of each mesh.
    starts: Vec<usize>,
    pub triangles: Vec<SurfaceTriangle>,
}

impl Surfaces {
    /// Takes over the meshes of a picture in place of those before.
    pub fn set(&mut self, camera: &PinholeCamera, meshes: &[&Mesh], light: &Light) {
        self.clear();
        self.size = camera.size;
        self.eye = camera.position.map(|v| v as f32);
        (self.light, self.axes) = (*light, light.axes());
        let rows = camera.axes.inverse().axes().map(|axis| axis.map(|v| v as f32));
        let middle = camera.size.map(|n| (n as f32 - 1.0) / 2.0 * PARTS as f32);
        let lens = Lens { middle, parts: camera.focal_px as f32 * PARTS as f32 };
        for (number, mesh) in meshes.iter().enumerate() {
            let start = self.seen.len();
            self.starts.push(start);
            let gloss = mesh.gloss;
            let mut is_beyond = true;
            for ((&point, &normal), &colour) in mesh.points.iter().zip(&mesh.normals).zip(&mesh.colours) {
                let from_eye = less(point, self.eye);
                let seen = [dot(rows[0], from_eye), dot(rows[1], from_eye), dot(rows[2], from_eye)];
                let (corner, nearness) = lens.project(seen);
                is_beyond &= (NEAR_CM as f32..FAR_CM).contains(&seen[2]);
                self.seen.push(seen);
                self.corners.push(corner);
                self.nearness.push(nearness);
                self.vertices.push(Vertex { point, normal, colour, gloss });
                self.light_points.push(ShadowMap::seen(&self.axes, point));
            }
            // From within a closed surface, inner sides are seen.
            let n_closed = if is_beyond { mesh.n_closed } else { 0 };
            for (at, triangle) in mesh.triangles.iter().enumerate() {
                let label = mesh.labels.get(triangle[0] as usize).copied().unwrap_or(0);
                let [a, b, c] = *triangle;
                let vertices = [a + start as u32, b + start as u32, c + start as u32];
                let triangle =
                    SurfaceTriangle { vertices, mesh: number as u16, label, is_inner: false, extent: [[0; 2]; 2] };
                if is_beyond {
                    self.push(triangle, at < n_closed);
                    continue;
                }
                let depth = |n: usize| self.seen[vertices[n] as usize][2];
                let depths = [depth(0), depth(1), depth(2)];
                if depths.iter().all(|z| (NEAR_CM as f32..FAR_CM).contains(z)) {
                    self.push(triangle, false);
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
        self.vertices.clear();
        self.light_points.clear();
        self.starts.clear();
        self.triangles.clear();
    }

    /// Takes a triangle that may be seen, of a closed surface only from outside.
    #[inline(always)]
    fn push(&mut self, triangle: SurfaceTriangle, is_closed: bool) {
        let flat = self.flat(&triangle);
        let area = flat.area();
        if area == 0 || is_closed && area > 0 {
            return;
        }
        let extent = flat.extent(self.size);
        if extent.iter().all(|[first, last]| first < last) {
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
                let [a, b] = [self.vertices[from], self.vertices[to]];
                let mixed = |a: [f32; 3], b: [f32; 3]| std::array::from_fn(|k| between(a[k], b[k]));
                let vertex = Vertex {
                    point: mixed(a.point, b.point),
                    normal: mixed(direction(a.normal), direction(b.normal)),
                    colour: mixed(a.colour, b.colour),
                    gloss: a.gloss,
                };
                let (corner, nearness) = lens.project(seen);
                kept[n_kept] = self.seen.len() as u32;
                n_kept += 1;
                self.seen.push(seen);
                self.corners.push(corner);
                self.nearness.push(nearness);
                self.vertices.push(vertex);
                // Shadows are cast by the whole triangle.
                self.light_points.push(self.light_points[from]);
            }
        }
        for n in 2..n_kept {
            self.push(SurfaceTriangle { vertices: [kept[0], kept[n - 1], kept[n]], ..triangle }, false);
        }
    }

    /// A triangle in the picture.
    #[inline(always)]
    pub fn flat(&self, triangle: &SurfaceTriangle) -> FlatTriangle {
        let [a, b, c] = triangle.vertices;
        let [a, b, c] = [a as usize, b as usize, c as usize];
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

    /// Numbers of the triangles of one triangle's mesh, from one to another: those of a mesh follow each other.
    pub fn numbers_of_mesh(&self, number: u32) -> [u32; 2] {
        let mesh = self.triangles.get(number as usize).map(|triangle| triangle.mesh);
        let Some(mesh) = mesh else { return [0; 2] };
        let first = self.triangles.partition_point(|triangle| triangle.mesh < mesh);
        let end = self.triangles.partition_point(|triangle| triangle.mesh <= mesh);
        [first as u32, end as u32]
    }

    /// Width of the picture, px.
    pub fn width(&self) -> usize {
        self.size[0]
    }

    /// Number of vertices.
    pub fn n_vertices(&self) -> usize {
        self.vertices.len()
    }

    /// What a vertex sends; with `shadows`, less of its own close behind something that they hold, and the place in
    /// their map instead of the point in the light's axes.
    pub fn radiance(&self, vertex: u32, shadows: Option<&ShadowMap>) -> Radiance {
        let Vertex { point, normal, colour, gloss } = self.vertices[vertex as usize];
        let (normal, to_viewer) = (direction(normal), direction(less(self.eye, point)));
        let [mut own, key] = self.light.on(normal, to_viewer, colour, gloss);
        let mut asking = shadow::asking_point(&self.light, &self.axes, point, normal);
        if let Some(shadows) = shadows {
            let open = shadows.open_share(asking);
            own.iter_mut().for_each(|v| *v *= open);
            asking = shadows.asking(asking);
        }
        [own, key, asking].map(|[a, b, c]| [a, b, c, 0.0])
    }

    /// Whether a triangle is so far away for its size that what it sends changes evenly over the picture.
    pub fn is_even(&self, triangle: &SurfaceTriangle) -> bool {
        let [a, b, c] = self.flat(triangle).nearness;
        a.max(b).max(c) < EVEN * a.min(b).min(c)
    }

    /// What a triangle whose corners send this sends over the picture, as a plane.
    pub fn plane(&self, triangle: &SurfaceTriangle, [a, b, c]: &[Radiance; 3]) -> RadiancePlane {
        let flat = self.flat(triangle);
        let from = flat.corners[0];
        let [_, b_px, c_px] = flat.corners;
        let to_b = [(b_px[0] - from[0]) as f32, (b_px[1] - from[1]) as f32];
        let to_c = [(c_px[0] - from[0]) as f32, (c_px[1] - from[1]) as f32];
        let per_area = PARTS as f32 / (to_b[0] * to_c[1] - to_b[1] * to_c[0]);
        let slope = |p: f32, q: f32| {
            let (p, q) = (p * per_area, q * per_area);
            let mut slope = Radiance::default();
            for (n, slope) in slope.iter_mut().enumerate() {
                for k in 0..4 {
                    slope[k] = (b[n][k] - a[n][k]) * p + (c[n][k] - a[n][k]) * q;
                }
            }
            slope
        };
        RadiancePlane { from, at: *a, across: slope(to_c[1], -to_b[1]), down: slope(-to_c[0], to_b[0]) }
    }

    /// What a triangle whose corners send this sends from a point (parts of a pixel) within it.
    pub fn radiance_at(&self, triangle: &SurfaceTriangle, [a, b, c]: &[Radiance; 3], point: [i32; 2]) -> Radiance {
        let flat = self.flat(triangle);
        let corners = flat.corners.map(|corner| [0, 1].map(|k| (corner[k] - point[k]) as f32));
        let sign = if triangle.is_inner { 1.0 } else { -1.0 };
        let shares: [f32; 3] = std::array::from_fn(|n| {
            let [p, q] = [corners[(n + 1) % 3], corners[(n + 2) % 3]];
            ((p[0] * q[1] - p[1] * q[0]) * sign).max(0.0) * flat.nearness[n]
        });
        let sum = shares[0] + shares[1] + shares[2];
        let shares = if sum > 0.0 { shares.map(|v| v / sum) } else { [1.0, 0.0, 0.0] };
        std::array::from_fn(|n| {
            std::array::from_fn(|k| shares[0] * a[n][k] + shares[1] * b[n][k] + shares[2] * c[n][k])
        })
    }
}

/// What a triangle sends as a plane over the picture: at a point (parts of a pixel), and its change a pixel.
#[derive(Clone, Copy, Debug)]
pub struct RadiancePlane {
    from: [i32; 2],
    at: Radiance,
    pub across: Radiance,
    down: Radiance,
}

impl RadiancePlane {
    #[inline(always)]
    pub fn radiance_at(&self, point: [i32; 2]) -> Radiance {
        let [dx, dy] = [0, 1].map(|k| (point[k] - self.from[k]) as f32 * (1.0 / PARTS as f32));
        std::array::from_fn(|n| {
            std::array::from_fn(|k| self.at[n][k] + (self.across[n][k] * dx + self.down[n][k] * dy))
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

#[inline(always)]
fn less(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
