//! Shading of pixels from the triangles at their four samples.

use super::samples::{NO_TRIANGLE, SAMPLE_OFFSETS, SUBPIXELS};
use super::shadow::ShadowMap;
use super::srgb::{Srgb, Steps, compressed, steps};
use super::surfaces::{INNER_LIGHT, Radiance, RadiancePlane, Surfaces};

/// Relative depth difference within a pixel below which two samples belong to one surface.
const SAME_SURFACE_RATIO: f32 = 0.012;
/// Entries of `numbers`: a plane not computed yet, and a triangle whose radiance is not planar.
const NO_PLANE: u32 = u32::MAX;
const NOT_PLANAR: u32 = u32::MAX - 1;

/// Light of a pixel, weighted by its covered samples.
#[derive(Clone, Copy, Debug, Default)]
pub struct PixelLight {
    /// Linear RGB without the key light, and of the unshadowed key light.
    pub own: [f32; 4],
    pub key: [f32; 4],
    /// Shadow query point of the first surface, in light axes.
    pub shadow_point: [f32; 3],
    /// Fraction of covered samples, 0..1.
    pub cover: f32,
}

impl PixelLight {
    /// Linear RGB if a fraction `lit` of the key light arrives.
    #[inline(always)]
    pub fn sum(&self, lit: f32) -> [f32; 4] {
        let mut sum = self.own;
        sum.iter_mut().zip(self.key).for_each(|(sum, key)| *sum += lit * key);
        sum
    }
}

/// Shading of the triangles of an image, computed on demand.
#[derive(Clone, Debug, Default)]
pub struct Shading {
    /// Radiance of each vertex, and whether it is computed.
    vertices: Vec<Radiance>,
    is_known: Vec<bool>,
    /// Index into `planes` for each triangle.
    numbers: Vec<u32>,
    planes: Vec<RadiancePlane>,
    /// Range of triangle indices of the last pixel's mesh.
    mesh: [u32; 2],
    /// Pixels of a row, and the column ranges that are drawn.
    row: Vec<Steps>,
    runs: Vec<[usize; 2]>,
}

/// Whether no sample is covered.
#[inline(always)]
pub fn is_empty(triangles: &[u32; 4]) -> bool {
    triangles[0] & triangles[1] & triangles[2] & triangles[3] == NO_TRIANGLE
}

/// Index of the sample nearest to the camera.
#[inline(always)]
pub fn nearest(inverse_depth: &[f32; 4]) -> usize {
    (1..4).fold(0, |best, k| if inverse_depth[k] > inverse_depth[best] { k } else { best })
}

/// A surface within a pixel.
#[derive(Clone, Copy, Default)]
struct PixelSurface {
    triangle: u32,
    /// Fraction of the pixel.
    share: f32,
    /// Point on the surface, in subpixels.
    point: [i32; 2],
}

/// Calls `each` for every surface in a pixel.
#[inline(always)]
fn for_surfaces(
    surfaces: &Surfaces,
    (triangles, inverse_depth): (&[u32; 4], &[f32; 4]),
    [x, y]: [usize; 2],
    mut each: impl FnMut(PixelSurface),
) {
    let mut is_pending = triangles.map(|triangle| triangle != NO_TRIANGLE);
    for k in 0..4 {
        if !is_pending[k] {
            continue;
        }
        let mesh = surfaces.triangles[triangles[k] as usize].mesh;
        let mut n = 1;
        for other in k + 1..4 {
            if is_pending[other] {
                let is_near = (inverse_depth[k] - inverse_depth[other]).abs() < SAME_SURFACE_RATIO * inverse_depth[k];
                if is_near && surfaces.triangles[triangles[other] as usize].mesh == mesh {
                    is_pending[other] = false;
                    n += 1;
                }
            }
        }
        let point = [x as i32 * SUBPIXELS + SAMPLE_OFFSETS[k][0], y as i32 * SUBPIXELS + SAMPLE_OFFSETS[k][1]];
        each(PixelSurface { triangle: triangles[k], share: n as f32 * 0.25, point });
    }
}

impl Shading {
    /// Resets the caches for the triangles of another image.
    pub fn reset(&mut self, surfaces: &Surfaces) {
        self.numbers.clear();
        self.numbers.resize(surfaces.triangles.len(), NO_PLANE);
        self.planes.clear();
        self.vertices.resize(surfaces.n_vertices(), Radiance::default());
        self.is_known.clear();
        self.is_known.resize(surfaces.n_vertices(), false);
        self.mesh = [0; 2];
        self.row.resize(surfaces.width(), Steps::default());
        self.runs.resize(surfaces.width(), [0; 2]);
    }

    #[inline(always)]
    fn radiance(&mut self, surfaces: &Surfaces, shadows: Option<&ShadowMap>, number: u32, point: [i32; 2]) -> Radiance {
        match self.plane(surfaces, shadows, number) {
            Some(plane) => plane.radiance_at(point),
            None => {
                let triangle = &surfaces.triangles[number as usize];
                surfaces.radiance_at(triangle, &self.corner_radiances(surfaces, shadows, number), point)
            }
        }
    }

    /// Radiance plane of a triangle; `None` if its radiance is not planar.
    #[inline(always)]
    fn plane(&mut self, surfaces: &Surfaces, shadows: Option<&ShadowMap>, number: u32) -> Option<&RadiancePlane> {
        if self.numbers[number as usize] == NO_PLANE {
            self.make_plane(surfaces, shadows, number);
        }
        self.planes.get(self.numbers[number as usize] as usize)
    }

    #[inline(never)]
    fn make_plane(&mut self, surfaces: &Surfaces, shadows: Option<&ShadowMap>, number: u32) {
        let triangle = &surfaces.triangles[number as usize];
        self.numbers[number as usize] = NOT_PLANAR;
        if surfaces.is_planar(triangle) {
            let corners = self.corner_radiances(surfaces, shadows, number);
            self.numbers[number as usize] = self.planes.len() as u32;
            self.planes.push(surfaces.plane(triangle, &corners));
        }
    }

    #[inline(never)]
    fn corner_radiances(&mut self, surfaces: &Surfaces, shadows: Option<&ShadowMap>, number: u32) -> [Radiance; 3] {
        let triangle = &surfaces.triangles[number as usize];
        let mut corners = [Radiance::default(); 3];
        for (corner, vertex) in corners.iter_mut().zip(triangle.vertices) {
            let at = vertex as usize;
            if !self.is_known[at] {
                (self.vertices[at], self.is_known[at]) = (surfaces.radiance(vertex, shadows), true);
            }
            *corner = self.vertices[at];
            if triangle.is_inner {
                corner[..2].iter_mut().flatten().for_each(|v| *v *= INNER_LIGHT);
            }
        }
        corners
    }

    /// Whether all samples show the surface of the first one.
    #[inline(always)]
    fn is_one_surface(&mut self, surfaces: &Surfaces, triangles: &[u32; 4], inverse_depth: &[f32; 4]) -> bool {
        let [a, b, c, d] = *inverse_depth;
        let tolerance = SAME_SURFACE_RATIO * a;
        if !((a - b).abs() < tolerance && (a - c).abs() < tolerance && (a - d).abs() < tolerance) {
            return false;
        }
        let [a, b, c, d] = *triangles;
        if !(self.mesh[0] <= a && a < self.mesh[1]) {
            self.mesh = surfaces.numbers_of_mesh(a);
        }
        let [first, end] = self.mesh;
        a.min(b).min(c).min(d) >= first && a.max(b).max(c).max(d) < end
    }

    /// Light of a pixel before shadows are applied.
    pub fn light(&mut self, surfaces: &Surfaces, samples: (&[u32; 4], &[f32; 4]), pixel: [usize; 2]) -> PixelLight {
        let mut light = PixelLight::default();
        for_surfaces(surfaces, samples, pixel, |PixelSurface { triangle, share, point }| {
            let [own, key, shadow_point] = self.radiance(surfaces, None, triangle, point);
            if light.cover == 0.0 {
                light.shadow_point = [shadow_point[0], shadow_point[1], shadow_point[2]];
            }
            light.cover += share;
            for k in 0..4 {
                light.own[k] += share * own[k];
                light.key[k] += share * key[k];
            }
        });
        light
    }

    /// Draws a row of pixels over `image` and stores the frontmost triangles in `front`; `[left, y]`: the first pixel.
    pub fn draw_row(
        &mut self,
        surfaces: &Surfaces,
        shadows: &ShadowMap,
        (triangles, inverse_depth): (&[[u32; 4]], &[[f32; 4]]),
        [left, y]: [usize; 2],
        front: &mut [(u32, f32)],
        image: &mut [u8],
    ) {
        let srgb = Srgb::tables();
        let mut row = std::mem::take(&mut self.row);
        let n = triangles.len().min(inverse_depth.len()).min(front.len()).min(row.len());
        let (mut at, mut n_runs) = (0, 0);
        while at < n {
            let first = triangles[at][0];
            let mut end = at + 1;
            if triangles[at] == [first; 4] {
                while end < n && triangles[end] == [first; 4] {
                    end += 1;
                }
                if first == NO_TRIANGLE {
                    front[at..end].fill((NO_TRIANGLE, 0.0));
                    at = end;
                    continue;
                }
                for (front, inverse_depth) in front[at..end].iter_mut().zip(&inverse_depth[at..end]) {
                    let [a, b, c, d] = *inverse_depth;
                    *front = (first, a.max(b).max(c.max(d)));
                }
                self.draw_run(surfaces, shadows, first, [left + at, y], &mut row[at..end]);
            } else {
                let (samples, pixel) = ((&triangles[at], &inverse_depth[at]), [left + at, y]);
                let nearest = nearest(samples.1);
                front[at] = (samples.0[nearest], samples.1[nearest]);
                row[at] = steps(if self.is_one_surface(surfaces, samples.0, samples.1) {
                    let point = [0, 1].map(|k| pixel[k] as i32 * SUBPIXELS + SAMPLE_OFFSETS[0][k]);
                    with_shadow(shadows, &self.radiance(surfaces, Some(shadows), first, point))
                } else {
                    let (mut linear, cover) = self.mixed(surfaces, shadows, samples, pixel);
                    let background = srgb.linears([image[3 * at], image[3 * at + 1], image[3 * at + 2]]);
                    for k in 0..4 {
                        linear[k] += (1.0 - cover) * background[k];
                    }
                    linear
                });
            }
            match self.runs[..n_runs].last_mut() {
                Some(run) if run[1] == at => run[1] = end,
                _ => {
                    self.runs[n_runs] = [at, end];
                    n_runs += 1;
                }
            }
            at = end;
        }
        for &[from, to] in &self.runs[..n_runs] {
            for (pixel, steps) in image[3 * from..3 * to].as_chunks_mut::<3>().0.iter_mut().zip(&row[from..to]) {
                *pixel = srgb.bytes_from_steps(*steps);
            }
        }
        self.row = row;
    }

    /// Draws adjacent pixels that show one triangle, starting at `[left, y]`.
    #[inline(always)]
    fn draw_run(
        &mut self,
        surfaces: &Surfaces,
        shadows: &ShadowMap,
        number: u32,
        [left, y]: [usize; 2],
        row: &mut [Steps],
    ) {
        let point = |x: usize| [(left + x) as i32 * SUBPIXELS, y as i32 * SUBPIXELS];
        let Some(plane) = self.plane(surfaces, Some(shadows), number) else {
            for (x, pixel) in row.iter_mut().enumerate() {
                let radiance = self.radiance(surfaces, Some(shadows), number, point(x));
                *pixel = steps(with_shadow(shadows, &radiance));
            }
            return;
        };
        let (mut radiance, across) = (plane.radiance_at(point(0)), &plane.across);
        for pixel in row {
            *pixel = steps(with_shadow(shadows, &radiance));
            for n in 0..3 {
                for k in 0..4 {
                    radiance[n][k] += across[n][k];
                }
            }
        }
    }

    /// Linear RGB of a pixel with several surfaces, weighted by coverage, and the fraction of covered samples.
    #[inline(never)]
    pub fn mixed(
        &mut self,
        surfaces: &Surfaces,
        shadows: &ShadowMap,
        samples: (&[u32; 4], &[f32; 4]),
        pixel: [usize; 2],
    ) -> ([f32; 4], f32) {
        let (mut sum, mut cover) = ([0.0f32; 4], 0.0);
        for_surfaces(surfaces, samples, pixel, |PixelSurface { triangle, share, point }| {
            let light = with_shadow(shadows, &self.radiance(surfaces, Some(shadows), triangle, point));
            cover += share;
            for k in 0..4 {
                sum[k] += share * light[k];
            }
        });
        (sum, cover)
    }
}

/// Linear RGB of a surface, with shadow and tone mapping.
#[inline(always)]
fn with_shadow(shadows: &ShadowMap, [own, key, shadow_point]: &Radiance) -> [f32; 4] {
    let is_turned_away = key[0] + key[1] + key[2] <= 1e-4;
    let lit = if is_turned_away { 0.0 } else { shadows.lit([shadow_point[0], shadow_point[1], shadow_point[2]]) };
    let mut light = *own;
    for k in 0..4 {
        light[k] += lit * key[k];
    }
    compressed(light)
}
