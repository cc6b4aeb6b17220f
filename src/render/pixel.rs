//! Light of one pixel from the triangles at its four samples.

use super::samples::{NO_TRIANGLE, PARTS, SPOTS};
use super::shadow::ShadowMap;
use super::srgb::compressed;
use super::surfaces::{Radiance, RadiancePlane, Surfaces};

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

/// Share of the key light that was found last, and where.
#[derive(Clone, Copy, Debug, Default)]
struct LastShadow {
    pixel: [usize; 2],
    mesh: u16,
    nearness: f32,
    lit: f32,
}

/// Light of the triangles of a picture, worked out where it is asked for.
#[derive(Clone, Debug, Default)]
pub struct Shading {
    /// Plane of each triangle.
    numbers: Vec<u32>,
    planes: Vec<RadiancePlane>,
    last: LastShadow,
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
    nearness: f32,
    /// Share of the pixel.
    share: f32,
    /// Point of the surface, parts of a pixel.
    point: [i32; 2],
}

/// Whether all samples show the first one's surface.
#[inline(always)]
fn is_one_surface(surfaces: &Surfaces, triangles: &[u32; 4], nearness: &[f32; 4]) -> bool {
    let mesh = |k: usize| surfaces.triangles.get(triangles[k] as usize).map(|triangle| triangle.mesh);
    let first = mesh(0);
    first.is_some() && (1..4).all(|k| (nearness[0] - nearness[k]).abs() < ONE_SURFACE * nearness[0] && mesh(k) == first)
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
        each(Part { triangle: triangles[k], nearness: nearness[k], share: n as f32 * 0.25, point });
    }
}

impl Shading {
    /// Starts over with the triangles of another picture.
    pub fn open(&mut self, surfaces: &Surfaces) {
        self.numbers.clear();
        self.numbers.resize(surfaces.triangles.len(), NO_PLANE);
        self.planes.clear();
        self.last = LastShadow::default();
    }

    #[inline(always)]
    fn radiance(&mut self, surfaces: &Surfaces, number: u32, point: [i32; 2]) -> Radiance {
        let plane = self.numbers[number as usize];
        if let Some(plane) = self.planes.get(plane as usize) {
            return plane.radiance_at(point);
        }
        self.first_radiance(surfaces, number, point)
    }

    #[inline(never)]
    fn first_radiance(&mut self, surfaces: &Surfaces, number: u32, point: [i32; 2]) -> Radiance {
        let triangle = &surfaces.triangles[number as usize];
        if self.numbers[number as usize] == NO_PLANE && surfaces.is_even(triangle) {
            self.numbers[number as usize] = self.planes.len() as u32;
            self.planes.push(surfaces.plane(triangle));
        } else {
            self.numbers[number as usize] = UNEVEN;
        }
        surfaces.radiance_at(triangle, point)
    }

    /// Light of a pixel before shadows.
    pub fn light(&mut self, surfaces: &Surfaces, samples: (&[u32; 4], &[f32; 4]), pixel: [usize; 2]) -> PixelLight {
        let mut light = PixelLight::default();
        for_parts(surfaces, samples, pixel, |Part { triangle, share, point, .. }| {
            let [own, key, asking] = self.radiance(surfaces, triangle, point);
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

    /// Linear RGB of a pixel with shadows, weighted by the share of covered samples, and that share.
    #[inline(always)]
    pub fn shaded(
        &mut self,
        surfaces: &Surfaces,
        shadows: &ShadowMap,
        samples: (&[u32; 4], &[f32; 4]),
        pixel: [usize; 2],
    ) -> ([f32; 4], f32) {
        let (triangles, nearness) = samples;
        let [first, others @ ..] = *triangles;
        let mut point = pixel.map(|v| v as i32 * PARTS);
        let is_whole = others == [first; 3];
        if is_whole || is_one_surface(surfaces, triangles, nearness) {
            // Most pixels.
            if !is_whole {
                (0..2).for_each(|k| point[k] += SPOTS[0][k]);
            }
            let whole = Part { triangle: first, nearness: nearness[0], share: 1.0, point };
            return (self.part(surfaces, shadows, whole, pixel), 1.0);
        }
        self.mixed(surfaces, shadows, samples, pixel)
    }

    #[inline(never)]
    fn mixed(
        &mut self,
        surfaces: &Surfaces,
        shadows: &ShadowMap,
        samples: (&[u32; 4], &[f32; 4]),
        pixel: [usize; 2],
    ) -> ([f32; 4], f32) {
        let (mut sum, mut cover) = ([0.0f32; 4], 0.0);
        for_parts(surfaces, samples, pixel, |part| {
            let light = self.part(surfaces, shadows, part, pixel);
            cover += part.share;
            for k in 0..4 {
                sum[k] += part.share * light[k];
            }
        });
        (sum, cover)
    }

    /// Linear RGB of one surface with its shadow.
    #[inline(always)]
    fn part(&mut self, surfaces: &Surfaces, shadows: &ShadowMap, part: Part, pixel: [usize; 2]) -> [f32; 4] {
        let [own, key, asking] = self.radiance(surfaces, part.triangle, part.point);
        let is_turned_away = key[0] + key[1] + key[2] <= 1e-4;
        let lit = if is_turned_away {
            0.0
        } else {
            let (mesh, nearness) = (surfaces.triangles[part.triangle as usize].mesh, part.nearness);
            self.lit(shadows, [asking[0], asking[1], asking[2]], LastShadow { pixel, mesh, nearness, lit: 0.0 })
        };
        let mut light = own;
        for k in 0..4 {
            light[k] += lit * key[k];
        }
        compressed(light)
    }

    /// Share of the key light at a pixel; the second of two neighbours on a surface takes over that of the first, as
    /// shadows are soft.
    #[inline(always)]
    fn lit(&mut self, shadows: &ShadowMap, asking: [f32; 3], here: LastShadow) -> f32 {
        let last = self.last;
        let is_second = here.pixel[0] & 1 == 1 && last.pixel == [here.pixel[0] - 1, here.pixel[1]];
        if is_second && last.mesh == here.mesh && (last.nearness - here.nearness).abs() < ONE_SURFACE * here.nearness {
            return last.lit;
        }
        let lit = shadows.lit(asking);
        self.last = LastShadow { lit, ..here };
        lit
    }
}
