//! Light of one pixel from the triangles at its four samples.

use super::samples::{NO_TRIANGLE, PARTS, SPOTS};
use super::shadow::ShadowMap;
use super::srgb::compressed;
use super::surfaces::{INNER_LIGHT, Radiance, RadiancePlane, Surfaces};

/// Depths of one surface within a pixel differ by less than this share.
const ONE_SURFACE: f32 = 0.012;
/// No plane of a triangle is known yet, or none exists.
const NO_PLANE: u32 = u32::MAX;
const UNEVEN: u32 = u32::MAX - 1;

/// What a pixel sends, weighted by the samples that are covered.
#[derive(Clone, Copy, Debug, Default)]
pub struct PixelLight {
    /// Linear RGB without the key light, and of the key light.
    pub own: [f32; 4],
    pub key: [f32; 4],
    /// Point in the light's axes of the first surface.
    pub asking: [f32; 3],
    /// Share of covered samples, 0..1.
    pub cover: f32,
}

impl PixelLight {
    /// Linear RGB with a share of the key light.
    #[inline(always)]
    pub fn sum(&self, lit: f32) -> [f32; 4] {
        let mut sum = self.own;
        sum.iter_mut().zip(self.key).for_each(|(sum, key)| *sum += lit * key);
        sum
    }
}

/// Light of the triangles of a picture, worked out where it is asked for.
#[derive(Clone, Debug, Default)]
pub struct Shading {
    /// What the vertices send, and for which of them that is known.
    vertices: Vec<Radiance>,
    is_known: Vec<bool>,
    /// Plane of each triangle.
    numbers: Vec<u32>,
    planes: Vec<RadiancePlane>,
    /// Numbers of the last pixel's mesh: from one to another.
    mesh: [u32; 2],
    /// Pixels of a row that one surface fills: columns, and what they send.
    columns: Vec<usize>,
    row: Vec<Radiance>,
    n_row: usize,
}

/// Whether no sample is covered.
#[inline(always)]
pub fn is_empty(triangles: &[u32; 4]) -> bool {
    triangles[0] & triangles[1] & triangles[2] & triangles[3] == NO_TRIANGLE
}

/// Sample that is nearest to the camera.
#[inline(always)]
pub fn nearest(nearness: &[f32; 4]) -> usize {
    (1..4).fold(0, |best, k| if nearness[k] > nearness[best] { k } else { best })
}

/// One of the surfaces in a pixel.
#[derive(Clone, Copy, Default)]
struct Part {
    triangle: u32,
    /// Share of the pixel.
    share: f32,
    /// Point of the surface, parts of a pixel.
    point: [i32; 2],
}

/// Calls `each` for every surface in a pixel.
#[inline(always)]
fn for_parts(
    surfaces: &Surfaces,
    (triangles, nearness): (&[u32; 4], &[f32; 4]),
    [x, y]: [usize; 2],
    mut each: impl FnMut(Part),
) {
    let mut is_open = triangles.map(|triangle| triangle != NO_TRIANGLE);
    for k in 0..4 {
        if !is_open[k] {
            continue;
        }
        let mesh = surfaces.triangles[triangles[k] as usize].mesh;
        let mut n = 1;
        for other in k + 1..4 {
            if is_open[other] {
                let is_near = (nearness[k] - nearness[other]).abs() < ONE_SURFACE * nearness[k];
                if is_near && surfaces.triangles[triangles[other] as usize].mesh == mesh {
                    is_open[other] = false;
                    n += 1;
                }
            }
        }
        let point = [x as i32 * PARTS + SPOTS[k][0], y as i32 * PARTS + SPOTS[k][1]];
        each(Part { triangle: triangles[k], share: n as f32 * 0.25, point });
    }
}

impl Shading {
    /// Starts over with the triangles of another picture.
    pub fn open(&mut self, surfaces: &Surfaces) {
        self.numbers.clear();
        self.numbers.resize(surfaces.triangles.len(), NO_PLANE);
        self.planes.clear();
        self.vertices.resize(surfaces.n_vertices(), Radiance::default());
        self.is_known.clear();
        self.is_known.resize(surfaces.n_vertices(), false);
        self.mesh = [0; 2];
        self.columns.resize(surfaces.width(), 0);
        self.row.resize(surfaces.width(), Radiance::default());
        self.n_row = 0;
    }

    #[inline(always)]
    fn radiance(&mut self, surfaces: &Surfaces, shadows: Option<&ShadowMap>, number: u32, point: [i32; 2]) -> Radiance {
        let plane = self.numbers[number as usize];
        if let Some(plane) = self.planes.get(plane as usize) {
            return plane.radiance_at(point);
        }
        self.first_radiance(surfaces, shadows, number, point)
    }

    #[inline(never)]
    fn first_radiance(
        &mut self,
        surfaces: &Surfaces,
        shadows: Option<&ShadowMap>,
        number: u32,
        point: [i32; 2],
    ) -> Radiance {
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
        if self.numbers[number as usize] == NO_PLANE && surfaces.is_even(triangle) {
            self.numbers[number as usize] = self.planes.len() as u32;
            let plane = surfaces.plane(triangle, &corners);
            self.planes.push(plane);
            return plane.radiance_at(point);
        }
        self.numbers[number as usize] = UNEVEN;
        surfaces.radiance_at(triangle, &corners, point)
    }

    /// Whether all samples show the first one's surface.
    #[inline(always)]
    fn is_one_surface(&mut self, surfaces: &Surfaces, triangles: &[u32; 4], nearness: &[f32; 4]) -> bool {
        let [a, b, c, d] = *nearness;
        let reach = ONE_SURFACE * a;
        if !((a - b).abs() < reach && (a - c).abs() < reach && (a - d).abs() < reach) {
            return false;
        }
        let [a, b, c, d] = *triangles;
        if !(self.mesh[0] <= a && a < self.mesh[1]) {
            self.mesh = surfaces.numbers_of_mesh(a);
        }
        let [first, end] = self.mesh;
        a.min(b).min(c).min(d) >= first && a.max(b).max(c).max(d) < end
    }

    /// Light of a pixel before shadows.
    pub fn light(&mut self, surfaces: &Surfaces, samples: (&[u32; 4], &[f32; 4]), pixel: [usize; 2]) -> PixelLight {
        let mut light = PixelLight::default();
        for_parts(surfaces, samples, pixel, |Part { triangle, share, point }| {
            let [own, key, asking] = self.radiance(surfaces, None, triangle, point);
            if light.cover == 0.0 {
                light.asking = [asking[0], asking[1], asking[2]];
            }
            light.cover += share;
            for k in 0..4 {
                light.own[k] += share * own[k];
                light.key[k] += share * key[k];
            }
        });
        light
    }

    /// Takes a pixel into the row where one surface fills it.
    #[inline(always)]
    pub fn add(
        &mut self,
        surfaces: &Surfaces,
        shadows: &ShadowMap,
        (triangles, nearness): (&[u32; 4], &[f32; 4]),
        pixel: [usize; 2],
    ) -> bool {
        let [first, others @ ..] = *triangles;
        let is_whole = others == [first; 3];
        if !is_whole && !self.is_one_surface(surfaces, triangles, nearness) {
            return false;
        }
        let spot = if is_whole { [0; 2] } else { SPOTS[0] };
        let point = [pixel[0] as i32 * PARTS + spot[0], pixel[1] as i32 * PARTS + spot[1]];
        let radiance = self.radiance(surfaces, Some(shadows), first, point);
        (self.columns[self.n_row], self.row[self.n_row]) = (pixel[0], radiance);
        self.n_row += 1;
        true
    }

    /// Ends a row: calls `each` with the columns of its pixels and their linear RGB with shadows.
    #[inline(always)]
    pub fn close_row(&mut self, shadows: &ShadowMap, mut each: impl FnMut(usize, [f32; 4])) {
        let row = &mut self.row[..self.n_row];
        for radiance in &mut *row {
            radiance[0] = with_shadow(shadows, radiance);
        }
        for (&column, radiance) in self.columns.iter().zip(row) {
            each(column, radiance[0]);
        }
        self.n_row = 0;
    }

    /// Linear RGB of a pixel with several surfaces, weighted by the share of covered samples, and that share.
    #[inline(never)]
    pub fn mixed(
        &mut self,
        surfaces: &Surfaces,
        shadows: &ShadowMap,
        samples: (&[u32; 4], &[f32; 4]),
        pixel: [usize; 2],
    ) -> ([f32; 4], f32) {
        let (mut sum, mut cover) = ([0.0f32; 4], 0.0);
        for_parts(surfaces, samples, pixel, |Part { triangle, share, point }| {
            let light = with_shadow(shadows, &self.radiance(surfaces, Some(shadows), triangle, point));
            cover += share;
            for k in 0..4 {
                sum[k] += share * light[k];
            }
        });
        (sum, cover)
    }
}

/// Linear RGB of what a surface sends, with its shadow.
#[inline(always)]
fn with_shadow(shadows: &ShadowMap, [own, key, asking]: &Radiance) -> [f32; 4] {
    let is_turned_away = key[0] + key[1] + key[2] <= 1e-4;
    let lit = if is_turned_away { 0.0 } else { shadows.lit([asking[0], asking[1], asking[2]]) };
    let mut light = *own;
    for k in 0..4 {
        light[k] += lit * key[k];
    }
    compressed(light)
}
