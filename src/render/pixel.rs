//! Light of one pixel from the triangles at its four samples.

use super::samples::NO_TRIANGLE;
use super::shadow::ShadowMap;
use super::surfaces::Surfaces;

/// Depths of one surface within a pixel differ by less than this share.
const ONE_SURFACE: f32 = 0.012;

/// What a pixel sends, weighted by the samples that are covered.
#[derive(Clone, Copy, Debug, Default)]
pub struct PixelLight {
    /// Linear RGB without the key light, and of the key light.
    pub own: [f32; 3],
    pub key: [f32; 3],
    /// Point in the light's axes of the first surface.
    pub asking: [f32; 3],
    /// Share of covered samples, 0..1.
    pub cover: f32,
}

/// Whether no sample is covered.
#[inline(always)]
pub fn is_empty(triangles: &[u32; 4]) -> bool {
    triangles[0] & triangles[1] & triangles[2] & triangles[3] == NO_TRIANGLE
}

/// Calls `each` with a triangle and its share of the pixel for every surface in it.
#[inline(always)]
fn for_surfaces(surfaces: &Surfaces, triangles: &[u32; 4], nearness: &[f32; 4], mut each: impl FnMut(u32, f32)) {
    let first = triangles[0];
    if triangles[1] == first && triangles[2] == first && triangles[3] == first {
        return each(first, 1.0);
    }
    let mut is_open = triangles.map(|triangle| triangle != NO_TRIANGLE);
    for k in 0..4 {
        if !is_open[k] {
            continue;
        }
        let triangle = &surfaces.triangles[triangles[k] as usize];
        let mut n = 1;
        for other in k + 1..4 {
            if !is_open[other] {
                continue;
            }
            let apart = (nearness[k] - nearness[other]).abs();
            let is_same = triangles[other] == triangles[k]
                || apart < ONE_SURFACE * nearness[k]
                    && surfaces.triangles[triangles[other] as usize].mesh == triangle.mesh;
            if is_same {
                is_open[other] = false;
                n += 1;
            }
        }
        each(triangles[k], n as f32 * 0.25);
    }
}

/// Light of a pixel before shadows.
pub fn pixel_light(surfaces: &Surfaces, triangles: &[u32; 4], nearness: &[f32; 4], x: usize, y: usize) -> PixelLight {
    let mut light = PixelLight::default();
    for_surfaces(surfaces, triangles, nearness, |number, share| {
        let [own, key, asking] = surfaces.radiance_at(&surfaces.triangles[number as usize], x, y);
        if light.cover == 0.0 {
            light.asking = [asking[0], asking[1], asking[2]];
        }
        light.cover += share;
        for k in 0..3 {
            light.own[k] += share * own[k];
            light.key[k] += share * key[k];
        }
    });
    light
}

/// Linear RGB of a pixel with shadows, weighted by the share of covered samples, and that share.
#[inline(always)]
pub fn shaded(
    surfaces: &Surfaces,
    shadows: &ShadowMap,
    (triangles, nearness): (&[u32; 4], &[f32; 4]),
    [x, y]: [usize; 2],
) -> ([f32; 3], f32) {
    let (mut sum, mut cover) = ([0.0f32; 3], 0.0);
    for_surfaces(surfaces, triangles, nearness, |number, share| {
        let [own, key, asking] = surfaces.radiance_at(&surfaces.triangles[number as usize], x, y);
        let is_turned_away = key[0] + key[1] + key[2] <= 1e-4;
        let lit = if is_turned_away { 0.0 } else { shadows.lit([asking[0], asking[1], asking[2]]) };
        cover += share;
        for k in 0..3 {
            sum[k] += share * super::srgb::compressed(own[k] + lit * key[k]);
        }
    });
    (sum, cover)
}
