//! Survey of full-size pictures, two consecutive per second: whether they are interlaced, and whether they have bars.

use super::bars::BarFinder;
use orator_base::types::image::{Image, PixelArea};
use orator_base::types::time::FrameRate;

/// Frames between the first samples, and the number of those samples.
const EARLY_STEP: usize = 5;
const EARLY_SAMPLES: usize = 6;
/// Least mean share of combed pixels of an interlaced video: if most frames are flagged as interlaced, and if not.
const MIN_COMBS_FLAGGED: f64 = 5e-5;
const MIN_COMBS_NOT_FLAGGED: f64 = 5e-4;
/// Least share of the samples with combing if the frames are not flagged as interlaced.
const MIN_COMBED_SHARE: f64 = 0.25;

/// Least difference of neighbouring lines in combing, 8-bit steps of green.
const MIN_LINE_STEP: i32 = 10;

pub struct PictureSurvey {
    frames_per_sec: usize,
    /// Number of non-repeated frames so far, and the index at which the next sample begins.
    n_frames: usize,
    next_sample: usize,
    /// First picture of a sample.
    first: Option<Image>,
    combs: Vec<f64>,
    n_flagged: usize,
    bars: BarFinder,
}

impl PictureSurvey {
    /// Creates a survey of frames at `rate`.
    pub fn new(rate: FrameRate) -> Self {
        Self {
            frames_per_sec: (rate.per_sec().round() as usize).max(2),
            n_frames: 0,
            next_sample: 0,
            first: None,
            combs: Vec::new(),
            n_flagged: 0,
            bars: BarFinder::default(),
        }
    }

    /// Whether the next frame's picture is needed.
    pub fn needs_picture(&self) -> bool {
        self.first.is_some() || self.n_frames == self.next_sample
    }

    /// Adds the next non-repeated frame, with its picture if needed.
    pub fn push(&mut self, picture: Option<Image>, is_flagged: bool) {
        self.n_frames += 1;
        self.n_flagged += usize::from(is_flagged);
        let Some(picture) = picture else { return };
        match self.first.take() {
            None => {
                self.bars.push(&picture);
                self.first = Some(picture);
            }
            Some(first) => {
                self.combs.push(comb_share(&first, &picture));
                let step = if self.combs.len() < EARLY_SAMPLES { EARLY_STEP } else { self.frames_per_sec };
                self.next_sample += step.max(2);
            }
        }
    }

    /// Mean share of combed pixels over the samples.
    pub fn comb_share(&self) -> f64 {
        self.combs.iter().sum::<f64>() / self.combs.len().max(1) as f64
    }

    /// Whether the pictures are interlaced. If the frames are flagged as interlaced, less combing is required.
    pub fn is_interlaced(&self) -> bool {
        let n_combed = self.combs.iter().filter(|share| **share >= MIN_COMBS_NOT_FLAGGED).count();
        let often = n_combed as f64 >= MIN_COMBED_SHARE * self.combs.len() as f64;
        let flagged = 2 * self.n_flagged > self.n_frames;
        let share = self.comb_share();
        if flagged { share >= MIN_COMBS_FLAGGED } else { often && share >= MIN_COMBS_NOT_FLAGGED }
    }

    /// Area between the bars; `None` without bars.
    pub fn active_area(&self) -> Option<PixelArea> {
        self.bars.finish()
    }
}

/// Share of combed pixels of `image` that also change in the next picture `after`. Combed: lines alternate four times;
/// the change excludes static stripes such as cloth. Samples every fourth column.
pub fn comb_share(image: &Image, after: &Image) -> f64 {
    let [width, height] = [image.width, image.height];
    if height < 5 || width == 0 || [after.width, after.height] != [width, height] {
        return 0.0;
    }
    let row = |y: usize| &image.data[3 * y * width..3 * (y + 1) * width];
    let mut n_combed = 0usize;
    for y in 2..height - 2 {
        let lines = [row(y - 2), row(y - 1), row(y), row(y + 1), row(y + 2)];
        let next = &after.data[3 * y * width..3 * (y + 1) * width];
        for at in (1..3 * width).step_by(12) {
            let [a, b, c, d, e] = lines.map(|line| i32::from(line[at]));
            let steps = [b - a, b - c, d - c, d - e];
            let alternates =
                steps.iter().all(|step| *step > MIN_LINE_STEP) || steps.iter().all(|step| *step < -MIN_LINE_STEP);
            n_combed += usize::from(alternates && (c - i32::from(next[at])).abs() > MIN_LINE_STEP);
        }
    }
    n_combed as f64 / (width.div_ceil(4) * (height - 4)) as f64
}
