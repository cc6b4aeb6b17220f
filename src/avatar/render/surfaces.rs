//! Meshes prepared for a camera and a light: projected vertices with their shading inputs.

use super::camera::{NEAR_CM, PinholeCamera};
use super::light::{Light, direction, dot};
use super::samples::{Extent, FlatTriangle, SUBPIXELS};
use super::shadow::{self, ShadowMap};

/// Maximum depth that is drawn, cm.
const FAR_CM: f32 = 1e6;
/// Maximum distance of a corner from the image origin, subpixels: products of two are exact in f64.
const MAX_COORDINATE: f32 = (1 << 23) as f32;
/// Factor for the light on the inner side of a surface, mostly the inside of clothes.
pub const INNER_LIGHT: f32 = 0.45;

/// Maximum ratio of depths within a triangle whose radiance is interpolated linearly in the image.
const MAX_PLANAR_RATIO: f32 = 1.03;

/// Triangle mesh in world axes (cm, y up), counter-clockwise from outside; all vertex lists have equal length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    pub points: Vec<[f32; 3]>,
    /// Outward unit normals.
    pub normals: Vec<[f32; 3]>,
    /// Linear RGB reflectance, 0..1.
    pub colours: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
    /// The first `n_closed` triangles form closed surfaces, whose inner sides are never visible.
    pub n_closed: usize,
    /// Label of each vertex, for example the joint that moves it; a triangle takes the label of its first vertex.
    pub labels: Vec<u16>,
    /// Specular strength, 0 (cloth) .. 1 (glass).
    pub gloss: f32,
}

/// Linear RGB without the key light, linear RGB of the unshadowed key light, and the shadow query point in light axes.
/// The fourth components are padding for SIMD.
pub type Radiance = [[f32; 4]; 3];

/// One triangle of `Surfaces`.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceTriangle {
    pub vertices: [u32; 3],
    pub mesh: u16,
    pub label: u16,
    /// Whether its inner side faces the camera.
    pub is_inner: bool,
    pub extent: Extent,
}

/// Shading inputs of a vertex, in world axes.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    point: [f32; 3],
    /// Outward, of any length.
    normal: [f32; 3],
    colour: [f32; 3],
    gloss: f32,
}

/// Vertices and triangles of all meshes of an image.
#[derive(Clone, Debug, Default)]
pub struct Surfaces {
    /// Width and height of the image, px.
    size: [usize; 2],
    eye: [f32; 3],
    light: Light,
    /// Axes of the light, see `Light::axes`.
    axes: [[f32; 3]; 3],
    /// Points in camera axes, cm.
    camera_points: Vec<[f32; 3]>,
    corners: Vec<[i32; 2]>,
    inverse_depth: Vec<f32>,
    vertices: Vec<Vertex>,
    /// Points in light axes, cm.
    light_points: Vec<[f32; 3]>,
    /// Index of the first vertex of each mesh.
    starts: Vec<usize>,
    pub triangles: Vec<SurfaceTriangle>,
}

impl Surfaces {
    /// Replaces the meshes of the last image.
    pub fn set(&mut self, camera: &PinholeCamera, meshes: &[&Mesh], light: &Light) {
        self.clear();
        self.size = camera.size;
        self.eye = camera.position.map(|v| v as f32);
        (self.light, self.axes) = (*light, light.axes());
        let rows = camera.axes.inverse().axes().map(|axis| axis.map(|v| v as f32));
        let middle = camera.size.map(|n| (n as f32 - 1.0) / 2.0 * SUBPIXELS as f32);
        let projection = Projection { middle, parts: camera.focal_px as f32 * SUBPIXELS as f32 };
        for (number, mesh) in meshes.iter().enumerate() {
            let start = self.camera_points.len();
            self.starts.push(start);
            let gloss = mesh.gloss;
            let mut is_beyond = true;
            for ((&point, &normal), &colour) in mesh.points.iter().zip(&mesh.normals).zip(&mesh.colours) {
                let from_eye = sub(point, self.eye);
                let camera_point = [dot(rows[0], from_eye), dot(rows[1], from_eye), dot(rows[2], from_eye)];
                let (corner, inverse_depth) = projection.project(camera_point);
                is_beyond &= (NEAR_CM as f32..FAR_CM).contains(&camera_point[2]);
                self.camera_points.push(camera_point);
                self.corners.push(corner);
                self.inverse_depth.push(inverse_depth);
                self.vertices.push(Vertex { point, normal, colour, gloss });
                self.light_points.push(ShadowMap::light_space(&self.axes, point));
            }
            // A camera may be inside a closed surface, where inner sides are visible.
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
                let depth = |n: usize| self.camera_points[vertices[n] as usize][2];
                let depths = [depth(0), depth(1), depth(2)];
                if depths.iter().all(|z| (NEAR_CM as f32..FAR_CM).contains(z)) {
                    self.push(triangle, false);
                } else if depths.iter().all(|z| z.abs() < FAR_CM) && depths.iter().any(|z| *z > NEAR_CM as f32) {
                    self.push_cut(triangle, &projection);
                }
            }
        }
    }

    fn clear(&mut self) {
        self.camera_points.clear();
        self.corners.clear();
        self.inverse_depth.clear();
        self.vertices.clear();
        self.light_points.clear();
        self.starts.clear();
        self.triangles.clear();
    }

    /// Adds a triangle that may be visible; triangles of closed surfaces only if they face the camera.
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

    /// Clips a triangle at the minimum depth and adds the rest as one or two triangles with new vertices.
    fn push_cut(&mut self, triangle: SurfaceTriangle, projection: &Projection) {
        let near = NEAR_CM as f32;
        let mut corners: [u32; 4] = [0; 4];
        let mut n_corners = 0;
        for side in 0..3 {
            let [from, to] = [side, (side + 1) % 3].map(|n| triangle.vertices[n] as usize);
            let [from_z, to_z] = [from, to].map(|v| self.camera_points[v][2]);
            if from_z >= near {
                corners[n_corners] = from as u32;
                n_corners += 1;
            }
            if (from_z >= near) != (to_z >= near) {
                let share = (near - from_z) / (to_z - from_z);
                let between = |a: f32, b: f32| a + share * (b - a);
                let [a, b] = [self.camera_points[from], self.camera_points[to]];
                let camera_point = [between(a[0], b[0]), between(a[1], b[1]), near];
                let [a, b] = [self.vertices[from], self.vertices[to]];
                let mixed = |a: [f32; 3], b: [f32; 3]| std::array::from_fn(|k| between(a[k], b[k]));
                let vertex = Vertex {
                    point: mixed(a.point, b.point),
                    normal: mixed(direction(a.normal), direction(b.normal)),
                    colour: mixed(a.colour, b.colour),
                    gloss: a.gloss,
                };
                let (corner, inverse_depth) = projection.project(camera_point);
                corners[n_corners] = self.camera_points.len() as u32;
                n_corners += 1;
                self.camera_points.push(camera_point);
                self.corners.push(corner);
                self.inverse_depth.push(inverse_depth);
                self.vertices.push(vertex);
                // The unclipped triangle casts the shadow.
                self.light_points.push(self.light_points[from]);
            }
        }
        for n in 2..n_corners {
            self.push(SurfaceTriangle { vertices: [corners[0], corners[n - 1], corners[n]], ..triangle }, false);
        }
    }

    #[inline(always)]
    pub fn flat(&self, triangle: &SurfaceTriangle) -> FlatTriangle {
        let [a, b, c] = triangle.vertices;
        let [a, b, c] = [a as usize, b as usize, c as usize];
        FlatTriangle {
            corners: [self.corners[a], self.corners[b], self.corners[c]],
            inverse_depth: [self.inverse_depth[a], self.inverse_depth[b], self.inverse_depth[c]],
        }
    }

    /// Points in light axes, and triangles, of each mesh.
    pub fn casters<'a>(
        &'a self,
        meshes: &'a [&Mesh],
    ) -> impl Iterator<Item = (&'a [[f32; 3]], &'a [[u32; 3]])> + Clone {
        let parts = meshes.iter().zip(&self.starts);
        parts.map(|(mesh, &start)| (&self.light_points[start..start + mesh.points.len()], &mesh.triangles[..]))
    }

    /// Range of triangle indices of the mesh of triangle `number`; triangles are sorted by mesh.
    pub fn numbers_of_mesh(&self, number: u32) -> [u32; 2] {
        let mesh = self.triangles.get(number as usize).map(|triangle| triangle.mesh);
        let Some(mesh) = mesh else { return [0; 2] };
        let first = self.triangles.partition_point(|triangle| triangle.mesh < mesh);
        let end = self.triangles.partition_point(|triangle| triangle.mesh <= mesh);
        [first as u32, end as u32]
    }

    /// Width of the image, px.
    pub fn width(&self) -> usize {
        self.size[0]
    }

    pub fn n_vertices(&self) -> usize {
        self.vertices.len()
    }

    /// Radiance of a vertex. With `shadows`, ambient occlusion is applied and the third component is a shadow query
    /// (`ShadowMap::query`) instead of a point in light axes.
    pub fn radiance(&self, vertex: u32, shadows: Option<&ShadowMap>) -> Radiance {
        let Vertex { point, normal, colour, gloss } = self.vertices[vertex as usize];
        let (normal, to_viewer) = (direction(normal), direction(sub(self.eye, point)));
        let [mut own, key] = self.light.on(normal, to_viewer, colour, gloss);
        let mut shadow_point = shadow::query_point(&self.light, &self.axes, point, normal);
        if let Some(shadows) = shadows {
            let open = shadows.open_share(shadow_point);
            own.iter_mut().for_each(|v| *v *= open);
            shadow_point = shadows.query(shadow_point);
        }
        [own, key, shadow_point].map(|[a, b, c]| [a, b, c, 0.0])
    }

    /// Whether the depth varies so little within a triangle that its radiance is nearly linear in the image.
    pub fn is_planar(&self, triangle: &SurfaceTriangle) -> bool {
        let [a, b, c] = self.flat(triangle).inverse_depth;
        a.max(b).max(c) < MAX_PLANAR_RATIO * a.min(b).min(c)
    }

    /// Radiance of a triangle as a linear function of the image position, from its values at the corners.
    pub fn plane(&self, triangle: &SurfaceTriangle, [a, b, c]: &[Radiance; 3]) -> RadiancePlane {
        let flat = self.flat(triangle);
        let from = flat.corners[0];
        let [_, b_px, c_px] = flat.corners;
        let to_b = [(b_px[0] - from[0]) as f32, (b_px[1] - from[1]) as f32];
        let to_c = [(c_px[0] - from[0]) as f32, (c_px[1] - from[1]) as f32];
        let per_area = SUBPIXELS as f32 / (to_b[0] * to_c[1] - to_b[1] * to_c[0]);
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

    /// Radiance at a point (subpixels) within a triangle, interpolated with perspective from its values at the corners.
    pub fn radiance_at(&self, triangle: &SurfaceTriangle, [a, b, c]: &[Radiance; 3], point: [i32; 2]) -> Radiance {
        let flat = self.flat(triangle);
        let corners = flat.corners.map(|corner| [0, 1].map(|k| (corner[k] - point[k]) as f32));
        let sign = if triangle.is_inner { 1.0 } else { -1.0 };
        let shares: [f32; 3] = std::array::from_fn(|n| {
            let [p, q] = [corners[(n + 1) % 3], corners[(n + 2) % 3]];
            ((p[0] * q[1] - p[1] * q[0]) * sign).max(0.0) * flat.inverse_depth[n]
        });
        let sum = shares[0] + shares[1] + shares[2];
        let shares = if sum > 0.0 { shares.map(|v| v / sum) } else { [1.0, 0.0, 0.0] };
        std::array::from_fn(|n| {
            std::array::from_fn(|k| shares[0] * a[n][k] + shares[1] * b[n][k] + shares[2] * c[n][k])
        })
    }
}

/// Radiance, linear in the image position: the value `at` the point `from` (subpixels), and its gradient per pixel.
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
        let [dx, dy] = [0, 1].map(|k| (point[k] - self.from[k]) as f32 * (1.0 / SUBPIXELS as f32));
        std::array::from_fn(|n| {
            std::array::from_fn(|k| self.at[n][k] + (self.across[n][k] * dx + self.down[n][k] * dy))
        })
    }
}

/// Projection from camera axes to subpixels.
struct Projection {
    middle: [f32; 2],
    parts: f32,
}

impl Projection {
    /// Position in the image and inverse depth; points nearer than `NEAR_CM` are clipped elsewhere.
    #[inline(always)]
    fn project(&self, [x, y, z]: [f32; 3]) -> ([i32; 2], f32) {
        let inverse_depth = 1.0 / z;
        let part = |v: f32, k: usize| {
            let at = (self.middle[k] + v * inverse_depth * self.parts + 0.5).clamp(-MAX_COORDINATE, MAX_COORDINATE);
            let whole = at as i32;
            whole - i32::from((whole as f32) > at)
        };
        ([part(x, 0), part(y, 1)], inverse_depth)
    }
}

#[inline(always)]
fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
