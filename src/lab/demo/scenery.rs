//! Static scenery behind rendered persons: a background with depth that casts and receives shadows.

use orator_avatar::render::background::StaticScene;
use orator_avatar::render::pixel::{PixelLight, Shading, is_empty, nearest};
use orator_avatar::render::shadow::ShadowMap;
use orator_avatar::render::srgb::compressed;
use orator_avatar::render::surfaces::Surfaces;
use orator_avatar::render::visibility::VisibleTriangles;
use orator_avatar::render::{Background, Light, Mesh, PinholeCamera, Srgb};
use orator_base::types::image::Image;
use std::sync::Arc;

/// Width and height of the shadow map of a static scene, texels.
const SHADOW_TEXELS: usize = 1024;
/// Width of the blocks that are tested for shadows, px.
const BLOCK: usize = 8;

/// Scenery as seen by a camera.
#[derive(Clone, Debug)]
struct Scenery {
    /// Inverse depth of each sample, 1/cm; 0 where nothing is hit.
    inverse_depth: Vec<[f32; 4]>,
    /// Mesh and label at each pixel's centre.
    labels: Vec<Option<(u16, u16)>>,
    light: Vec<PixelLight>,
    /// Bounding box of each block in the plane perpendicular to the key light, cm.
    blocks: Vec<[[f32; 2]; 2]>,
}

/// Renders static meshes, with their shadows on each other, in front of the image `behind` of the camera's size.
/// Frames drawn over the result must use the same camera and light.
pub fn background(camera: &PinholeCamera, meshes: &[&Mesh], light: &Light, behind: Image) -> Background {
    let size = camera.size;
    let (mut surfaces, mut shading) = (Surfaces::default(), Shading::default());
    surfaces.set(camera, meshes, light);
    shading.reset(&surfaces);
    let mut shadows = ShadowMap::new(SHADOW_TEXELS);
    shadows.cast(surfaces.casters(meshes), true);
    let srgb = Srgb::tables();
    let mut image = behind;
    let n = size[0] * size[1];
    let (mut pixels, mut labels) = (vec![PixelLight::default(); n], vec![None; n]);
    let mut inverse_depth = vec![[0.0; 4]; n];
    VisibleTriangles::new(size).visit(&surfaces, None, |band, rows, columns| {
        for (x, y) in (rows[0]..rows[1]).flat_map(|y| (columns[0]..columns[1]).map(move |x| (x, y))) {
            let (at, there) = (y * size[0] + x, band.at(x, y));
            let triangles = &band.triangles[there];
            if is_empty(triangles) {
                continue;
            }
            inverse_depth[at] = band.inverse_depth[there];
            let mut pixel = shading.light(&surfaces, (triangles, &inverse_depth[at]), [x, y]);
            let lit = shadows.lit(shadows.query(pixel.shadow_point));
            let there = srgb.linears(image.pixel(x, y));
            let uncovered = 1.0 - pixel.cover;
            pixel.own.iter_mut().zip(there).for_each(|(own, there)| *own += uncovered * there);
            pixel.key.iter_mut().for_each(|v| *v *= lit);
            image.data[3 * at..3 * at + 3].copy_from_slice(&srgb.bytes(compressed(pixel.sum(1.0))));
            let front = surfaces.triangles.get(triangles[nearest(&inverse_depth[at])] as usize);
            labels[at] = front.map(|triangle| (triangle.mesh, triangle.label));
            pixels[at] = pixel;
        }
    });
    let blocks = blocks(size, &pixels);
    let scene = Scenery { inverse_depth, labels, light: pixels, blocks };
    Background { image, scene: Some(Arc::new(scene)) }
}

impl StaticScene for Scenery {
    fn inverse_depth(&self) -> &[[f32; 4]] {
        &self.inverse_depth
    }

    fn label(&self, at: usize) -> Option<(u16, u16, f64)> {
        let (mesh, label) = self.labels[at]?;
        let nearest = self.inverse_depth[at].iter().copied().fold(0.0, f32::max);
        Some((mesh, label, 1.0 / f64::from(nearest)))
    }

    fn shade(&self, image: &mut Image, shadows: &ShadowMap) {
        let srgb = Srgb::tables();
        let n_columns = image.width.div_ceil(BLOCK);
        for (number, [low, high]) in self.blocks.iter().enumerate() {
            if !(low[0] <= high[0] && shadows.may_shade(*low, *high)) {
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
                    let (open, lit) =
                        (shadows.open_share(pixel.shadow_point), shadows.lit(shadows.query(pixel.shadow_point)));
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
            low[k] = low[k].min(pixel.shadow_point[k]);
            high[k] = high[k].max(pixel.shadow_point[k]);
        }
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::people::solid::Solids;
    use orator_avatar::render::Renderer;
    use orator_base::math::rotation::Rotation;
    use orator_base::math::vec3::Vec3;

    fn rectangle(corner: Vec3, sides: [Vec3; 2]) -> Mesh {
        let mut solids = Solids::new(0.3);
        solids.tiles(corner, sides, [1, 1], |_, _| [0.5; 3]);
        solids.mesh
    }

    fn floor() -> Mesh {
        rectangle([-60.0, 0.0, 60.0], [[120.0, 0.0, 0.0], [0.0, 0.0, -120.0]])
    }

    fn cube(middle: Vec3, size: f64) -> Mesh {
        let mut solids = Solids::new(0.3);
        solids.block(middle, [size; 3], Rotation::IDENTITY, [0.5; 3]);
        solids.mesh
    }

    fn camera(position: Vec3, focal_px: f64) -> PinholeCamera {
        PinholeCamera::looking_at([200, 160], focal_px, position, [0.0; 3], 0.0)
    }

    fn black() -> Image {
        Image::filled(200, 160, [0; 3])
    }

    #[test]
    fn a_shadow_falls_on_furniture_from_figures_and_from_itself() {
        let camera = camera([0.0, 60.0, 100.0], 250.0);
        let light =
            Light { key: [1.0; 3], sky: [0.2; 3], ground: [0.2; 3], rim: [0.0; 3], ..Light::studio([1.0, 1.0, 0.0]) };
        let (floor, cube) = (floor(), cube([0.0, 20.0, 0.0], 10.0));
        let mut renderer = Renderer::new([200, 160]);
        let over = renderer.draw(&camera, &[&cube], &light, &background(&camera, &[&floor], &light, black()));
        let on_floor = |x: f64| camera.pixel(camera.to_camera_axes([x, 0.0, 0.0])).map(f64::round);
        for image in [&over, &background(&camera, &[&floor, &cube], &light, black()).image] {
            let at = |x: f64| image.pixel(on_floor(x)[0] as usize, on_floor(x)[1] as usize)[0];
            // The light comes from +x at 45 degrees: 20 cm up, the shadow falls 20 cm towards -x.
            let [near, far] = [[-20.0, 20.0], [-40.0, 40.0]].map(|positions| positions.map(at));
            assert!(near[0] < 140 && near[1] > 180 && far[0].abs_diff(far[1]) < 12, "{near:?} {far:?}");
        }
        let (mesh, label, depth) = renderer.label_at(on_floor(20.0)).unwrap();
        assert_eq!((mesh, label), (1, 0));
        assert!((depth - camera.to_camera_axes([20.0, 0.0, 0.0])[2]).abs() < 1.0);
    }

    #[test]
    fn furniture_hides_what_is_behind_it_and_inner_sides_are_seen() {
        let (camera, light) = (camera([0.0, 0.0, 100.0], 400.0), Light::studio([0.0, 0.0, 1.0]));
        let upright = |x: f64, y: f64, z: f64| rectangle([x, y, z], [[16.0, 0.0, 0.0], [0.0, 16.0, 0.0]]);
        let mut turned = upright(-8.0, -8.0, -10.0);
        turned.triangles.iter_mut().for_each(|triangle| triangle.reverse());
        let table = background(&camera, &[&upright(-8.0, -16.0, 0.0)], &light, black());
        let mut renderer = Renderer::new([200, 160]);
        let image = renderer.draw(&camera, &[&turned], &light, &table);
        assert_eq!(renderer.label_at([100.0, 90.0]).map(|found| found.0), Some(1));
        assert_eq!(renderer.label_at([100.0, 70.0]).map(|found| found.0), Some(0));
        assert!(image.pixel(100, 70)[0] > 20 && image.pixel(100, 70) != image.pixel(100, 90));
    }

    #[test]
    fn the_bytes_are_the_same_after_other_frames() {
        let (camera, light) = (camera([30.0, 60.0, 100.0], 250.0), Light::studio([-0.5, 0.75, 0.6]));
        let behind = Background::gradient([200, 160], [60; 3], [180; 3]).image;
        let scene = background(&camera, &[&floor()], &light, behind);
        let cube = cube([0.0, 12.0, 0.0], 15.0);
        let mut renderer = Renderer::new([200, 160]);
        let image = renderer.draw(&camera, &[&cube], &light, &scene);
        renderer.draw(&camera, &[&floor()], &light, &Background::picture(black()));
        assert_eq!(image, renderer.draw(&camera, &[&cube], &light, &scene));
    }
}
