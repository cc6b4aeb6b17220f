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
