//! A picture in memory, and options for reading the pictures of a video.

use serde::{Deserialize, Serialize};

/// Picture of 8-bit RGB; rows from the top, without padding: `data.len() == 3 * width * height`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Image {
    pub width: usize,
    pub height: usize,
    pub data: Vec<u8>,
}

impl Image {
    /// Creates a picture of one colour.
    pub fn filled(width: usize, height: usize, rgb: [u8; 3]) -> Self {
        Self { width, height, data: rgb.repeat(width * height) }
    }

    /// Returns the part of the picture within `area`, which is clipped to the picture.
    pub fn cropped(&self, area: PixelArea) -> Self {
        let [x, y] = [area.x.min(self.width), area.y.min(self.height)];
        let [width, height] = [area.width.min(self.width - x), area.height.min(self.height - y)];
        let mut data = Vec::with_capacity(3 * width * height);
        for start in (y..y + height).map(|row| 3 * (row * self.width + x)) {
            data.extend_from_slice(&self.data[start..start + 3 * width]);
        }
        Self { width, height, data }
    }

    /// Pads the picture with black to `size` (width, height), which must not be smaller; the picture is centred.
    pub fn framed(&self, [width, height]: [usize; 2]) -> Self {
        let mut framed = Self::filled(width, height, [0; 3]);
        let [left, top] = [width.saturating_sub(self.width) / 2, height.saturating_sub(self.height) / 2];
        let n_bytes = 3 * self.width.min(width);
        for (y, row) in self.data.chunks_exact((3 * self.width).max(1)).take(height).enumerate() {
            let to = 3 * ((top + y) * width + left);
            framed.data[to..to + n_bytes].copy_from_slice(&row[..n_bytes]);
        }
        framed
    }

    /// Returns the pixel in column `x`, row `y`. Panics outside the picture, like indexing.
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        let at = 3 * (y * self.width + x);
        [self.data[at], self.data[at + 1], self.data[at + 2]]
    }
}

/// Rectangle in a picture, px.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PixelArea {
    pub x: usize,
    pub y: usize,
    pub width: usize,
    pub height: usize,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct PictureOptions {
    /// Deinterlace: one field of a frame is kept, the other is interpolated where the two fields differ.
    pub deinterlace: bool,
    pub mirrored: bool,
}

impl PictureOptions {
    /// Returns whether pictures are read unchanged.
    pub fn is_plain(&self) -> bool {
        *self == Self::default()
    }
}
