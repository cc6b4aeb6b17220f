//! Static backgrounds behind the rendered meshes: a picture, a gradient, or a scene with its own depth.

use super::shadow::ShadowMap;
use orator_base::types::image::Image;
use std::fmt::Debug;
use std::sync::Arc;

/// Background of an image, drawn once and copied into every frame.
#[derive(Clone, Debug)]
pub struct Background {
    pub image: Image,
    pub scene: Option<Arc<dyn StaticScene>>,
}

/// Static surfaces in front of and behind the figures, rendered for one camera.
pub trait StaticScene: Debug + Send + Sync {
    /// Inverse depth of each sample, 1/cm; 0 where there is no surface. Shape: pixels, row by row, four samples each.
    fn inverse_depth(&self) -> &[[f32; 4]];

    /// Mesh, label and depth (cm) at a pixel index; `None` where there is no surface.
    fn label(&self, at: usize) -> Option<(u16, u16, f64)>;

    /// Draws the shadows of the figures over a copy of the background.
    fn shade(&self, image: &mut Image, shadows: &ShadowMap);
}

impl Background {
    pub fn picture(image: Image) -> Self {
        Self { image, scene: None }
    }

    /// Vertical gradient between two sRGB colours.
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
}
