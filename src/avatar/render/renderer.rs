//! Frames of posed meshes over a background: first visibility (nearest triangle at four samples per pixel), then
//! shading, once per surface and pixel. Only the area of the figures is processed.

use super::background::{Background, StaticScene};
use super::camera::PinholeCamera;
use super::light::Light;
use super::pixel::Shading;
use super::samples::NO_TRIANGLE;
use super::shadow::ShadowMap;
use super::surfaces::{Mesh, Surfaces};
use super::visibility::VisibleTriangles;
use orator_base::types::image::Image;
use std::sync::Arc;

/// Width and height of the figures' shadow map, texels.
const SHADOW_TEXELS: usize = 256;

/// Renderer with buffers for frames of one size.
#[derive(Clone, Debug)]
pub struct Renderer {
    size: [usize; 2],
    visibility: VisibleTriangles,
    surfaces: Surfaces,
    shading: Shading,
    shadows: ShadowMap,
    /// Frontmost triangle and its inverse depth (1/cm) at each pixel of the last frame.
    front: Vec<(u32, f32)>,
    /// For each row, the range of columns of `front` that the last frame filled.
    spans: Vec<[usize; 2]>,
    n_meshes: usize,
    scene: Option<Arc<dyn StaticScene>>,
}

impl Renderer {
    /// Renderer for images of a width and height, px.
    pub fn new(size: [usize; 2]) -> Self {
        Self {
            size,
            visibility: VisibleTriangles::new(size),
            surfaces: Surfaces::default(),
            shading: Shading::default(),
            shadows: ShadowMap::new(SHADOW_TEXELS),
            front: vec![(NO_TRIANGLE, 0.0); size[0] * size[1]],
            spans: vec![[0; 2]; size[1]],
            n_meshes: 0,
            scene: None,
        }
    }

    /// Renders meshes over a background. If the camera or the background does not have the renderer's size, the
    /// background is returned unchanged.
    pub fn draw(&mut self, camera: &PinholeCamera, meshes: &[&Mesh], light: &Light, background: &Background) -> Image {
        let mut image = background.image.clone();
        self.spans.fill([0; 2]);
        self.n_meshes = meshes.len();
        self.scene.clone_from(&background.scene);
        if camera.size != self.size || [image.width, image.height] != self.size {
            return image;
        }
        self.surfaces.set(camera, meshes, light);
        self.shading.reset(&self.surfaces);
        self.shadows.cast(self.surfaces.casters(meshes), false);
        if let Some(scene) = &self.scene {
            scene.shade(&mut image, &self.shadows);
        }
        self.fill(&mut image);
        image
    }

    /// Mesh, label and depth along the camera axis (cm) of the frontmost surface at a pixel of the last frame. Mesh
    /// indices of the background scene follow those of the frame.
    pub fn label_at(&self, px: [f64; 2]) -> Option<(usize, u16, f64)> {
        let [x, y] = px.map(|v| (v + 0.5).floor());
        // The condition is also false for NaN.
        if !(x >= 0.0 && y >= 0.0 && x < self.size[0] as f64 && y < self.size[1] as f64) {
            return None;
        }
        let (x, y) = (x as usize, y as usize);
        let at = y * self.size[0] + x;
        let (number, inverse_depth) =
            if (self.spans[y][0]..self.spans[y][1]).contains(&x) { self.front[at] } else { (NO_TRIANGLE, 0.0) };
        if let Some(triangle) = self.surfaces.triangles.get(number as usize) {
            return Some((usize::from(triangle.mesh), triangle.label, 1.0 / f64::from(inverse_depth)));
        }
        let (mesh, label, depth) = self.scene.as_ref()?.label(at)?;
        Some((self.n_meshes + usize::from(mesh), label, depth))
    }

    fn fill(&mut self, image: &mut Image) {
        let Self { size: [width, _], visibility, surfaces, shading, shadows, front, spans, scene, .. } = self;
        let background = scene.as_ref().map(|scene| scene.inverse_depth());
        visibility.visit(surfaces, background, |band, rows, columns| {
            let [left, right] = columns;
            spans[rows[0]..rows[1]].fill(columns);
            for y in rows[0]..rows[1] {
                let (there, at) = (band.at(left, y)..band.at(right, y), y * *width + left..y * *width + right);
                let samples = (&band.triangles[there.clone()], &band.inverse_depth[there]);
                let pixels = &mut image.data[3 * at.start..3 * at.end];
                shading.draw_row(surfaces, shadows, samples, [left, y], &mut front[at], pixels);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::light::direction;
    use crate::render::srgb::Srgb;

    const WHITE: Light =
        Light { to_key: [0.0, 1.0, 0.0], key: [0.0; 3], sky: [1.0; 3], ground: [1.0; 3], rim: [0.0; 3] };

    fn mesh(points: Vec<[f32; 3]>, normals: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>, label: u16) -> Mesh {
        let n = points.len();
        let (colours, labels) = (vec![[0.5; 3]; n], vec![label; n]);
        Mesh { points, normals, colours, triangles, labels, gloss: 0.3, n_closed: 0 }
    }

    fn quad(corners: [[f32; 3]; 4], normal: [f32; 3], label: u16) -> Mesh {
        mesh(corners.to_vec(), vec![normal; 4], vec![[0, 1, 2], [0, 2, 3]], label)
    }

    /// A square that faces +z.
    fn square(x: f32, y: f32, z: f32, half: f32, label: u16) -> Mesh {
        let corner = |dx: f32, dy: f32| [x + dx * half, y + dy * half, z];
        quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], [0.0, 0.0, 1.0], label)
    }

    /// A floor at height `y` that extends by `half` in each direction.
    fn floor(y: f32, z: f32, half: f32) -> Mesh {
        let corner = |dx: f32, dz: f32| [dx * half, y, z + dz * half];
        quad([corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)], [0.0, 1.0, 0.0], 5)
    }

    /// A sphere of 6 `n` x `n` patches.
    fn ball(middle: [f32; 3], radius: f32, n: usize) -> Mesh {
        // Points on the faces of a cube are normalised, which needs no trigonometry.
        let side = |k: usize| k as f32 / n as f32 * 2.0 - 1.0;
        let (mut normals, mut triangles) = (Vec::new(), Vec::new());
        for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0f32)] {
            let first = normals.len() as u32;
            let corner = |i: usize, j: usize| {
                let mut at = [0.0; 3];
                (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (sign, sign * side(i), side(j));
                direction(at)
            };
            normals.extend((0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))).map(|(i, j)| corner(i, j)));
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let at = |di: usize, dj: usize| first + ((i + di) * (n + 1) + j + dj) as u32;
                triangles.extend([[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]]);
            }
        }
        let points = normals.iter().map(|normal| std::array::from_fn(|k| middle[k] + radius * normal[k])).collect();
        mesh(points, normals, triangles, 3)
    }

    fn camera() -> PinholeCamera {
        PinholeCamera::looking_at([200, 160], 400.0, [0.0, 0.0, 100.0], [0.0; 3], 0.0)
    }

    fn black() -> Background {
        Background::picture(Image::filled(200, 160, [0; 3]))
    }

    #[test]
    fn a_sphere_has_the_right_area_and_depth() {
        let (ball, mut renderer) = (ball([0.0; 3], 12.0, 24), Renderer::new([200, 160]));
        // The difference between renderings over white and over black is the visible part of the background.
        let [white, black] = [[255; 3], [0; 3]].map(|rgb| {
            let background = Background::picture(Image::filled(200, 160, rgb));
            let image = renderer.draw(&camera(), &[&ball], &WHITE, &background);
            image.data.iter().map(|byte| Srgb::tables().linears([*byte; 3])[0] / 3.0).sum::<f32>()
        });
        let area = 200.0 * 160.0 - (white - black);
        let radius = 400.0 * 12.0 / (100.0f32 * 100.0 - 144.0).sqrt();
        assert!((area / (std::f32::consts::PI * radius * radius) - 1.0).abs() < 0.01, "{area} px");
        let (mesh, label, depth) = renderer.label_at([99.5, 79.5]).unwrap();
        assert_eq!((mesh, label), (0, 3));
        assert!((depth - 88.0).abs() < 0.1, "{depth} cm");
        assert!(renderer.label_at([99.5 + f64::from(radius) - 1.0, 79.5]).is_some());
        assert_eq!(renderer.label_at([99.5 + f64::from(radius) + 2.0, 79.5]), None);
        assert_eq!(renderer.label_at([-3.0, f64::NAN]), None);
    }

    #[test]
    fn the_nearer_surface_is_visible_in_any_order() {
        let (near, far) = (square(2.0, 0.0, 10.0, 6.0, 1), square(-2.0, 0.0, 0.0, 9.0, 2));
        let mut renderer = Renderer::new([200, 160]);
        let one = renderer.draw(&camera(), &[&near, &far], &WHITE, &black());
        assert_eq!(renderer.label_at([105.0, 80.0]).map(|found| (found.0, found.1)), Some((0, 1)));
        let other = renderer.draw(&camera(), &[&far, &near], &WHITE, &black());
        assert_eq!(one, other);
        assert_eq!(renderer.label_at([105.0, 80.0]).map(|found| (found.0, found.1)), Some((1, 1)));
        assert_eq!(renderer.label_at([62.0, 80.0]).map(|found| found.1), Some(2));
    }

    #[test]
    fn coverage_counts_the_samples_inside_an_edge() {
        // The left edge is 20 px from the axis: at half a pixel, or between samples.
        for (edge, samples) in [(20.5f32, 2.0), (20.25, 3.0), (20.75, 1.0), (20.0, 4.0)] {
            let left = edge / 4.0;
            let mesh = square(left + 5.0, 0.0, 0.0, 5.0, 0);
            let image = Renderer::new([200, 160]).draw(&camera(), &[&mesh], &WHITE, &black());
            // The centre of the image is between two pixels.
            let value = Srgb::tables().linears(image.pixel(120, 80))[1];
            assert!((value - 0.5 * samples / 4.0).abs() < 0.004, "{value} at {edge}");
            assert_eq!(image.pixel(119, 80)[1], 0);
        }
    }

    #[test]
    fn a_floor_below_the_camera_is_clipped_and_has_the_right_depth() {
        let floor = floor(-20.0, 0.0, 400.0);
        let mut renderer = Renderer::new([200, 160]);
        let image = renderer.draw(&camera(), &[&floor], &WHITE, &black());
        // The far end of the floor, 500 cm away, is 16 px below the axis.
        assert_eq!((image.pixel(100, 90)[0], image.pixel(100, 100)[0]), (0, Srgb::tables().bytes([0.5; 4])[0]));
        let (_, label, depth) = renderer.label_at([100.0, 119.0]).unwrap();
        assert!(label == 5 && (depth - 200.6).abs() < 0.5, "{depth} cm");
        let bad = square(f32::NAN, 0.0, 99.0, 1.0, 0);
        assert_eq!(renderer.draw(&camera(), &[&bad], &WHITE, &black()), black().image);
    }

    #[test]
    fn a_shadow_falls_away_from_the_light() {
        let camera = PinholeCamera::looking_at([200, 160], 250.0, [0.0, 60.0, 100.0], [0.0; 3], 0.0);
        let light =
            Light { key: [1.0; 3], sky: [0.2; 3], ground: [0.2; 3], rim: [0.0; 3], ..Light::studio([1.0, 1.0, 0.0]) };
        let (floor, ball) = (floor(0.0, 0.0, 60.0), ball([0.0, 20.0, 0.0], 6.0, 8));
        let mut renderer = Renderer::new([200, 160]);
        let together = renderer.draw(&camera, &[&floor, &ball], &light, &black());
        let on_floor = |x: f64| camera.pixel(camera.to_camera_axes([x, 0.0, 0.0])).map(f64::round);
        let at = |x: f64| together.pixel(on_floor(x)[0] as usize, on_floor(x)[1] as usize)[0];
        // The light comes from +x at 45 degrees, so from a height of 20 cm the shadow falls 20 cm towards -x.
        assert!(at(-20.0) < 140 && at(20.0) > 180 && at(-40.0).abs_diff(at(40.0)) < 12, "{} {}", at(-20.0), at(20.0));
    }

    #[test]
    fn frames_do_not_depend_on_earlier_frames() {
        let camera = PinholeCamera::looking_at([200, 160], 250.0, [30.0, 60.0, 100.0], [0.0; 3], 0.0);
        let light = Light::studio([-0.5, 0.75, 0.6]);
        let (floor, ball) = (floor(0.0, 0.0, 60.0), ball([0.0, 12.0, 0.0], 9.0, 12));
        let background = Background::gradient([200, 160], [60; 3], [180; 3]);
        let mut renderer = Renderer::new([200, 160]);
        let image = renderer.draw(&camera, &[&floor, &ball], &light, &background);
        renderer.draw(&camera, &[&square(0.0, 0.0, 40.0, 50.0, 0)], &light, &black());
        assert_eq!(image, renderer.draw(&camera, &[&floor, &ball], &light, &background));
    }
}
