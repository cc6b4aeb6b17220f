//! Detection of letterbox and pillarbox bars: black bars, or smooth ones (a blurred copy of the picture, a plain
//! colour). Bars are outer columns or rows of similar width on both sides that are black or without detail in the
//! entire video and end at a straight seam. Dark or plain walls do not end at a seam.

use orator_base::types::image::{Image, PixelArea};

/// Number of bands across an axis, in each of which a position has one mean; most pixels sampled per position.
const BANDS: usize = 32;
const MAX_SAMPLES: usize = 256;
/// Largest brightness of a black bar, and least brightness of a lit band, in 8-bit steps.
const BLACK: f32 = 24.0;
const LIT: f32 = 48.0;
/// Largest difference of neighbours in a smooth bar, and least across a seam, in 8-bit steps, averaged over the video.
const SMOOTH: f32 = 1.0;
const SEAM: f32 = 5.0;
/// Least share of the bands that are lit next to a black bar, and that show the seam of a smooth bar.
const MIN_LIT_SHARE: f32 = 0.5;
const MIN_SEAM_SHARE: f32 = 0.6;
/// Pixels over which an encoder blurs a seam, and over which the scaler of a blurred copy does.
pub const CODEC_BLUR_PX: usize = 4;
const SCALER_BLUR_PX: usize = 12;
/// Largest difference of the widths of the two bars, as a share of the axis.
const MAX_ASYMMETRY: f32 = 0.02;
/// Largest share of the axis between smooth bars, and largest share of the picture at which cropping is worthwhile.
const MAX_SHARE_BETWEEN_SMOOTH: f32 = 0.65;
const MAX_CROP_SHARE: f32 = 0.8;

/// Detects bars from a sample of the pictures of a video.
#[derive(Default)]
pub struct BarFinder {
    size: [usize; 2],
    columns: AxisProfile,
    rows: AxisProfile,
}

impl BarFinder {
    /// Adds a picture; all must have the same size.
    pub fn push(&mut self, image: &Image) {
        let [width, height] = [image.width, image.height];
        let green = |x: usize, y: usize| image.data[3 * (y * width + x) + 1];
        self.size = [width, height];
        self.columns.push(width, height, green);
        self.rows.push(height, width, |y, x| green(x, y));
    }

    /// Area between the bars; `None` if there are no bars that are worth cropping.
    pub fn finish(&self) -> Option<PixelArea> {
        let [width, height] = self.size;
        let ([left, right], [top, bottom]) = (self.columns.bars(), self.rows.bars());
        let area = PixelArea { x: left, y: top, width: width - left - right, height: height - top - bottom };
        let share = (area.width * area.height) as f32 / (width * height).max(1) as f32;
        (share > 0.0 && share <= MAX_CROP_SHARE).then_some(area)
    }
}

/// Statistics of the positions along one axis: columns from the left, or rows from the top.
#[derive(Default)]
struct AxisProfile {
    n_pictures: usize,
    /// Largest mean brightness of each band at each position, [band][position].
    brightest: Vec<f32>,
    /// Sums over the pictures: `detail` is the mean difference to the next position; `seam` the difference of the band
    /// means across each position, [band][position].
    detail: Vec<f32>,
    seam: Vec<f32>,
}

impl AxisProfile {
    /// Adds a picture of `n` positions with `n_px` px each, of which about `MAX_SAMPLES` are sampled.
    fn push(&mut self, n: usize, n_px: usize, value: impl Fn(usize, usize) -> u8) {
        let step = (n_px / MAX_SAMPLES).max(1);
        let n_across = n_px / step;
        if n < 2 * SCALER_BLUR_PX || n_across < BANDS {
            return;
        }
        if self.detail.len() != n {
            let zeros = |n| vec![0.0; n];
            *self = Self { n_pictures: 0, brightest: zeros(BANDS * n), detail: zeros(n), seam: zeros(BANDS * n) };
        }
        self.n_pictures += 1;
        for band in 0..BANDS {
            let across = band * n_across / BANDS..(band + 1) * n_across / BANDS;
            let n_values = across.len() as f32;
            let mut sums = vec![0u32; n];
            for at in across {
                let at = at * step;
                let mut previous = value(0, at);
                for (position, sum) in sums.iter_mut().enumerate() {
                    let current = value(position, at);
                    *sum += u32::from(current);
                    self.detail[position.saturating_sub(1)] += f32::from(current.abs_diff(previous)) / n_across as f32;
                    previous = current;
                }
            }
            let mean = |position: usize| sums[position.min(n - 1)] as f32 / n_values;
            for position in 0..n {
                let slot = band * n + position;
                self.brightest[slot] = self.brightest[slot].max(mean(position));
                self.seam[slot] += (mean(position + 1) - mean(position.saturating_sub(1))).abs();
            }
        }
    }

    /// Widths of the bars at both ends in px; 0 where there is none.
    fn bars(&self) -> [usize; 2] {
        let n = self.detail.len();
        // A single picture is not enough: its own content may look like bars.
        if self.n_pictures < 2 {
            return [0; 2];
        }
        let is_symmetric = |[low, high]: &[usize; 2]| {
            low.min(high) > &0 && low + high < n && low.abs_diff(*high) as f32 <= MAX_ASYMMETRY * n as f32 + 2.0
        };
        let smooth = || {
            let widths = self.smooth_bars()?;
            ((n - widths[0] - widths[1]) as f32 <= MAX_SHARE_BETWEEN_SMOOTH * n as f32).then_some(widths)
        };
        self.black_bars().filter(is_symmetric).or_else(|| smooth().filter(is_symmetric)).unwrap_or_default()
    }

    fn black_bars(&self) -> Option<[usize; 2]> {
        let n = self.detail.len();
        let brightest = |position: usize, band: usize| self.brightest[band * n + position];
        let is_black = |position: &usize| (0..BANDS).all(|band| brightest(*position, band) <= BLACK);
        let low = (0..n).take_while(is_black).count();
        let high = (0..n).rev().take_while(is_black).count();
        let lit = |start: usize, end: usize| {
            share(|band| (start..end).any(|position| brightest(position, band) >= LIT)) >= MIN_LIT_SHARE
        };
        (low + high + CODEC_BLUR_PX < n && lit(low, low + CODEC_BLUR_PX) && lit(n - high - CODEC_BLUR_PX, n - high))
            .then_some([low, high])
    }

    fn smooth_bars(&self) -> Option<[usize; 2]> {
        let (n, n_pictures) = (self.detail.len(), self.n_pictures as f32);
        let is_smooth = |position: &usize| self.detail[*position] <= SMOOTH * n_pictures;
        let low = (0..n).take_while(is_smooth).count();
        let high = (0..n).rev().skip(1).take_while(is_smooth).count();
        if low + high + SCALER_BLUR_PX >= n {
            return None;
        }
        let shown = |position: usize| share(|band| self.seam[band * n + position] >= SEAM * n_pictures);
        let strength = |position: &usize| (0..BANDS).map(|band| self.seam[band * n + *position]).sum::<f32>();
        // Going inward from the bar, the strongest of the first few positions that show a seam.
        let strongest_seam = |inward: &mut dyn Iterator<Item = usize>| {
            let seams = inward
                .take(SCALER_BLUR_PX)
                .skip_while(|position| shown(*position) < MIN_SEAM_SHARE)
                .take(CODEC_BLUR_PX);
            seams.max_by(|a, b| strength(a).total_cmp(&strength(b)))
        };
        let first = strongest_seam(&mut (low..n))?;
        let last = strongest_seam(&mut (0..n - high).rev())?;
        (first < last).then(|| [first, n - 1 - last])
    }
}

/// Share of the bands that satisfy `holds`.
fn share(holds: impl Fn(usize) -> bool) -> f32 {
    (0..BANDS).filter(|band| holds(*band)).count() as f32 / BANDS as f32
}
