//! What is behind and around the figures and stays as it is: a picture, a gradient, or furniture with depth of its own.

use super::camera::PinholeCamera;
use super::light::Light;
use super::pixel::{PixelLight, Shading, is_empty, nearest};
use super::shadow::ShadowMap;
use super::srgb::{Srgb, compressed};
use super::surfaces::{Mesh, Surfaces};
use super::visibility::VisibleTriangles;
use orator_base::types::image::Image;
use std::sync::Arc;

/// Texels of the shadow map of a static scene, each way.
const SHADOW_TEXELS: usize = 1024;
/// Width of the blocks in which shadows are looked for, px.
const BLOCK: usize = 8;

/// Background of a picture, drawn once and copied into every frame.
#[derive(Clone, Debug)]
pub struct Background {
    pub image: Image,
    pub(super) scene: Option<Arc<StaticScene>>,
}

/// Furniture and walls as a camera sees them.
#[derive(Clone, Debug)]
pub(super) struct StaticScene {
    /// One over the depth of each sample, 1/cm; 0 where there is nothing.
    pub nearness: Vec<[f32; 4]>,
    /// Mesh and label at each pixel's middle.
    labels: Vec<Option<(u16, u16)>>,
    light: Vec<PixelLight>,
    /// Least and greatest position across the key light of each block, cm.
    blocks: Vec<[[f32; 2]; 2]>,
}

impl Background {
    pub fn picture(image: Image) -> Self {
        Self { image, scene: None }
    }

    /// One sRGB colour at the top that turns into another towards the bottom.
    pub fn gradient([width, height]: [usize; 2], top: [u8; 3], bottom: [u8; 3]) -> Self {
        let last = height.max(2) - 1;
        let row = |y: usize| {
            let colour: [u8; 3] = std::array::from_fn(|k| {
                let [from, to] = [top, bottom].map(|colour| usize::from(colour[k]));
                ((from * (last - y) + to * y + last / 2) / last) as u8
            });
            colour.repeat(width)
        };
        Self::picture(Image { width, height, data: (0..height).flat_map(row).collect() })
    }

    /// Meshes that do not move, with their shadows on each other, before a picture of the camera's size. Frames drawn
    /// over them must have this camera and this light.
    pub fn of_scene(camera: &PinholeCamera, meshes: &[&Mesh], light: &Light, behind: Image) -> Self {
        let size = camera.size;
        let (mut surfaces, mut shading) = (Surfaces::default(), Shading::default());
        surfaces.set(camera, meshes, light);
        shading.open(&surfaces);
        let mut shadows = ShadowMap::new(SHADOW_TEXELS);
        shadows.cast(surfaces.casters(meshes), true);
        let srgb = Srgb::tables();
        let mut image = behind;
        let n = size[0] * size[1];
        let (mut pixels, mut labels) = (vec![PixelLight::default(); n], vec![None; n]);
        let mut nearness = vec![[0.0; 4]; n];
        VisibleTriangles::new(size).visit(&surfaces, None, |band, rows, columns| {
            for (x, y) in (rows[0]..rows[1]).flat_map(|y| (columns[0]..columns[1]).map(move |x| (x, y))) {
                let (at, there) = (y * size[0] + x, band.at(x, y));
                let triangles = &band.triangles[there];
                if is_empty(triangles) {
                    continue;
                }
                nearness[at] = band.nearness[there];
                let mut pixel = shading.light(&surfaces, (triangles, &nearness[at]), [x, y]);
                let lit = shadows.lit(shadows.asking(pixel.asking));
                let there = srgb.linears(image.pixel(x, y));
                let uncovered = 1.0 - pixel.cover;
                pixel.own.iter_mut().zip(there).for_each(|(own, there)| *own += uncovered * there);
                pixel.key.iter_mut().for_each(|v| *v *= lit);
                image.data[3 * at..3 * at + 3].copy_from_slice(&srgb.bytes(compressed(pixel.sum(1.0))));
                let front = surfaces.triangles.get(triangles[nearest(&nearness[at])] as usize);
                labels[at] = front.map(|triangle| (triangle.mesh, triangle.label));
                pixels[at] = pixel;
            }
        });
        let blocks = blocks(size, &pixels);
        let scene = StaticScene { nearness, labels, light: pixels, blocks };
        Self { image, scene: Some(Arc::new(scene)) }
    }
}

impl StaticScene {
    /// Mesh, label and depth (cm) at a pixel.
    pub fn label(&self, at: usize) -> Option<(u16, u16, f64)> {
        let (mesh, label) = self.labels[at]?;
        let nearest = self.nearness[at].iter().copied().fold(0.0, f32::max);
        Some((mesh, label, 1.0 / f64::from(nearest)))
    }

    /// Lays the shadows of figures over a copy of the background.
    pub fn shade(&self, image: &mut Image, shadows: &ShadowMap) {
        let srgb = Srgb::tables();
        let n_columns = image.width.div_ceil(BLOCK);
        for (number, [low, high]) in self.blocks.iter().enumerate() {
            if !(low[0] <= high[0] && shadows.reaches(*low, *high)) {
                continue;
            }
            let from = [number % n_columns * BLOCK, number / n_columns * BLOCK];
            for y in from[1]..(from[1] + BLOCK).min(image.height) {
                for x in from[0]..(from[0] + BLOCK).min(image.width) {
                    let at = y * image.width + x;
                    let mut pixel = self.light[at];
                    if pixel.cover == 0.0 {
                        continue;
                    }
                    let (open, lit) = (shadows.open_share(pixel.asking), shadows.lit(shadows.asking(pixel.asking)));
                    if open < 1.0 || lit < 1.0 {
                        pixel.own.iter_mut().for_each(|v| *v *= open);
                        image.data[3 * at..3 * at + 3].copy_from_slice(&srgb.bytes(compressed(pixel.sum(lit))));
                    }
                }
            }
        }
    }
}

fn blocks([width, height]: [usize; 2], pixels: &[PixelLight]) -> Vec<[[f32; 2]; 2]> {
    let n_columns = width.div_ceil(BLOCK);
    let mut blocks = vec![[[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]]; n_columns * height.div_ceil(BLOCK)];
    for (at, pixel) in pixels.iter().enumerate().filter(|(_, pixel)| pixel.cover > 0.0) {
        let [low, high] = &mut blocks[at / width / BLOCK * n_columns + at % width / BLOCK];
        for k in 0..2 {
            low[k] = low[k].min(pixel.asking[k]);
            high[k] = high[k].max(pixel.asking[k]);
        }
    }
    blocks
}
