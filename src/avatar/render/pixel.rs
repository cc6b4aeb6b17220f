//! Light of one pixel from the triangles at its four samples.

use super::samples::{NO_TRIANGLE, PARTS, SPOTS};
use super::shadow::ShadowMap;
use super::srgb::{Srgb, Steps, compressed, steps};
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
    /// Pixels of a row, and which of them are drawn: from one to another.
    row: Vec<Steps>,
    runs: Vec<[usize; 2]>,
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
        self.row.resize(surfaces.width(), Steps::default());
        self.runs.resize(surfaces.width(), [0; 2]);
    }

    #[inline(always)]
    fn radiance(&mut self, surfaces: &Surfaces, shadows: Option<&ShadowMap>, number: u32, point: [i32; 2]) -> Radiance {
        match self.plane(surfaces, shadows, number) {
            Some(plane) => plane.radiance_at(point),
            None => {
                let triangle = &surfaces.triangles[number as usize];
                surfaces.radiance_at(triangle, &self.corners(surfaces, shadows, number), point)
            }
        }
    }

    /// Plane of a triangle; none where it is uneven.
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
        self.numbers[number as usize] = UNEVEN;
        if surfaces.is_even(triangle) {
            let corners = self.corners(surfaces, shadows, number);
            self.numbers[number as usize] = self.planes.len() as u32;
            self.planes.push(surfaces.plane(triangle, &corners));
        }
    }

    /// What the corners of a triangle send.
    #[inline(never)]
    fn corners(&mut self, surfaces: &Surfaces, shadows: Option<&ShadowMap>, number: u32) -> [Radiance; 3] {
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

    /// Writes a row of pixels over its background, `image`, and what is in front there; the first has a place in the
    /// picture.
    pub fn draw_row(
        &mut self,
        surfaces: &Surfaces,
        shadows: &ShadowMap,
        (triangles, nearness): (&[[u32; 4]], &[[f32; 4]]),
        [left, y]: [usize; 2],
        front: &mut [(u32, f32)],
        image: &mut [u8],
    ) {
        let srgb = Srgb::tables();
        let mut row = std::mem::take(&mut self.row);
        let n = triangles.len().min(nearness.len()).min(front.len()).min(row.len());
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
                for (front, nearness) in front[at..end].iter_mut().zip(&nearness[at..end]) {
                    let [a, b, c, d] = *nearness;
                    *front = (first, a.max(b).max(c.max(d)));
                }
                self.draw_run(surfaces, shadows, first, [left + at, y], &mut row[at..end]);
            } else {
                let (samples, pixel) = ((&triangles[at], &nearness[at]), [left + at, y]);
                let nearest = nearest(samples.1);
                front[at] = (samples.0[nearest], samples.1[nearest]);
                row[at] = steps(if self.is_one_surface(surfaces, samples.0, samples.1) {
                    let point = [0, 1].map(|k| pixel[k] as i32 * PARTS + SPOTS[0][k]);
                    with_shadow(shadows, &self.radiance(surfaces, Some(shadows), first, point))
                } else {
                    let (mut linear, cover) = self.mixed(surfaces, shadows, samples, pixel);
                    let behind = srgb.linears([image[3 * at], image[3 * at + 1], image[3 * at + 2]]);
                    for k in 0..4 {
                        linear[k] += (1.0 - cover) * behind[k];
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
                *pixel = srgb.bytes_of(*steps);
            }
        }
        self.row = row;
    }

    /// Pixels of one triangle beside each other, from a first one on.
    #[inline(always)]
    fn draw_run(
        &mut self,
        surfaces: &Surfaces,
        shadows: &ShadowMap,
        number: u32,
        [left, y]: [usize; 2],
        row: &mut [Steps],
    ) {
        let point = |x: usize| [(left + x) as i32 * PARTS, y as i32 * PARTS];
        let Some(plane) = self.plane(surfaces, Some(shadows), number) else {
            for (x, steps_of) in row.iter_mut().enumerate() {
                let radiance = self.radiance(surfaces, Some(shadows), number, point(x));
                *steps_of = steps(with_shadow(shadows, &radiance));
            }
            return;
        };
        let (mut radiance, across) = (plane.radiance_at(point(0)), &plane.across);
        for steps_of in row {
            *steps_of = steps(with_shadow(shadows, &radiance));
            for n in 0..3 {
                for k in 0..4 {
                    radiance[n][k] += across[n][k];
                }
            }
        }
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
