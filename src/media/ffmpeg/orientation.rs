//! Rotation and mirroring between the coded and the upright image.

use ffmpeg_next::codec::packet::side_data::Type as SideData;
use ffmpeg_next::format::stream::Stream;
use orator_base::types::image::Image;

/// Transform from the coded to the upright image: the x and y axes of the coded image point along `x` and `y` in the
/// upright image, each a unit step (right and down are positive). Right angles and mirroring only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orientation {
    pub x: [i8; 2],
    pub y: [i8; 2],
}

impl Orientation {
    /// Coded pixels are shown as they are.
    pub const UPRIGHT: Self = Self { x: [1, 0], y: [0, 1] };

    /// Orientation from the display matrix of a stream (nine 16.16 numbers; the first two rows are the images of the
    /// axes), snapped to right angles.
    pub(crate) fn from_stream(stream: &Stream) -> Self {
        let matrix = stream.side_data().find(|side| side.kind() == SideData::DisplayMatrix);
        let Some(numbers) = matrix.filter(|side| side.data().len() >= 36).map(|side| {
            side.data().as_chunks::<4>().0.iter().map(|bytes| i32::from_ne_bytes(*bytes)).collect::<Vec<i32>>()
        }) else {
            return Self::UPRIGHT;
        };
        let [a, b, c, d] = [numbers[0], numbers[1], numbers[3], numbers[4]];
        let unit = |v: i32| v.signum() as i8;
        let is_rotated = b.unsigned_abs() > a.unsigned_abs();
        let (x, y) = if is_rotated { ([0, unit(b)], [unit(c), 0]) } else { ([unit(a), 0], [0, unit(d)]) };
        if x == [0, 0] || y == [0, 0] { Self::UPRIGHT } else { Self { x, y } }
    }

    /// Orientation with left and right of the upright image swapped.
    pub fn mirrored(self) -> Self {
        Self { x: [-self.x[0], self.x[1]], y: [-self.y[0], self.y[1]] }
    }

    /// Clockwise rotation from coded to upright image, degrees: 0, 90, 180 or 270.
    pub fn degrees(self) -> u32 {
        match self.x {
            [1, _] => 0,
            [_, 1] => 90,
            [-1, _] => 180,
            _ => 270,
        }
    }

    /// Width and height after rotation.
    pub(crate) fn upright_size(self, [width, height]: [usize; 2]) -> [usize; 2] {
        if self.x[0] == 0 { [height, width] } else { [width, height] }
    }

    /// Converts a coded image to an upright one.
    pub fn apply(self, coded: Image) -> Image {
        if self == Self::UPRIGHT {
            return coded;
        }
        let [width, height] = self.upright_size([coded.width, coded.height]);
        let mut upright = Image::filled(width, height, [0; 3]);
        // Position of coded pixel 0, 0: at the far end of every reversed axis.
        let origin = |back: bool, n: usize| if back { n as isize - 1 } else { 0 };
        let x0 = origin(self.x[0] + self.y[0] < 0, width);
        let y0 = origin(self.x[1] + self.y[1] < 0, height);
        let at = |step: [i8; 2]| 3 * (isize::from(step[0]) + isize::from(step[1]) * width as isize);
        let (dx, dy, start) = (at(self.x), at(self.y), 3 * (x0 + y0 * width as isize));
        for (row_idx, row) in coded.data.chunks_exact(3 * coded.width).enumerate() {
            let row_start = start + row_idx as isize * dy;
            for (column, pixel) in row.as_chunks::<3>().0.iter().enumerate() {
                let to = (row_start + column as isize * dx) as usize;
                upright.data[to..to + 3].copy_from_slice(pixel);
            }
        }
        upright
    }
}
