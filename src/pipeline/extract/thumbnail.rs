//! Thumbnail of a frame for shot detection: small colour and gray pictures and a coarse grid. `block_match` compares
//! two of them; `segment` uses their mean change from frame to frame as a measure of movement.

use orator_base::types::image::Image;

/// Width and height of a thumbnail, px: fine enough to show the movement of a person.
pub const THUMBNAIL: [usize; 2] = [64, 64];
/// Cells per side of the grid; each is the mean of a block of the picture.
pub const CELLS: usize = 16;
/// Least change of a cell in 8-bit steps: above the effect of compression and soft light changes on its mean.
pub const STEP: u8 = 20;

pub struct Thumbnail {
    /// `THUMBNAIL` in size.
    pub image: Image,
    /// Luma of each pixel, 0..255.
    pub gray: Vec<f32>,
    /// `CELLS` by `CELLS`, RGB.
    pub grid: Vec<[u8; 3]>,
}

impl Thumbnail {
    /// Creates a thumbnail from a picture of `THUMBNAIL` px.
    pub fn new(image: Image) -> Self {
        let block = THUMBNAIL.map(|side| side / CELLS);
        let mut sums = vec![[0u32; 3]; CELLS * CELLS];
        let mut gray = Vec::with_capacity(image.data.len() / 3);
        for (at, pixel) in image.data.as_chunks::<3>().0.iter().enumerate() {
            let (x, y) = (at % THUMBNAIL[0], at / THUMBNAIL[0]);
            let cell = &mut sums[(y / block[1]).min(CELLS - 1) * CELLS + (x / block[0]).min(CELLS - 1)];
            (0..3).for_each(|channel| cell[channel] += u32::from(pixel[channel]));
            let [r, g, b] = pixel.map(f32::from);
            gray.push(0.299 * r + 0.587 * g + 0.114 * b);
        }
        let n_pixels = (block[0] * block[1]) as u32;
        let grid = sums.into_iter().map(|sum| sum.map(|sum| (sum / n_pixels).min(255) as u8)).collect();
        Self { image, gray, grid }
    }

    /// Share of the grid cells whose colour differs by more than `STEP` in any channel.
    pub fn change(&self, other: &Self) -> f64 {
        let cells = self.grid.iter().zip(&other.grid);
        let n_changed = cells.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > STEP)).count();
        n_changed as f64 / self.grid.len().max(1) as f64
    }
}

/// Mean absolute difference of equally sized pictures, in 8-bit steps: near 0 for a slide, a paused video or a drawing.
pub fn mean_change(a: &Image, b: &Image) -> f32 {
    let sum: u64 = a.data.iter().zip(&b.data).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f32 / a.data.len().max(1) as f32
}
