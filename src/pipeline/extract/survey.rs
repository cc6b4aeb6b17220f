//! A look at some pictures of a video in full, two in a row each second: whether they are interlaced, and whether bars
//! stand beside the picture proper.

use super::bars::BarFinder;
use orator_base::types::image::{Image, PixelArea};
use orator_base::types::time::FrameRate;
use orator_media::ffmpeg::deinterlace::comb_share;

/// Frames between two looks at the beginning, and the number of those looks.
const EARLY_STEP: usize = 5;
const EARLY_LOOKS: usize = 6;
/// Mean share of combed pixels of a video that is interlaced: where most frames say that they are, and where none does.
const FLAGGED: f64 = 5e-5;
const NOT_FLAGGED: f64 = 5e-4;
/// Least share of the looks that show combs where the frames do not say that they are interlaced.
const MOST_LOOKS: f64 = 0.25;

/// Looks at a video.
pub struct PictureSurvey {
    frames_per_sec: usize,
    /// New frames so far, and the one at which the next look begins.
    n_frames: usize,
    next_look: usize,
    /// First picture of a look.
    first: Option<Image>,
    combs: Vec<f64>,
    n_flagged: usize,
    bars: BarFinder,
}

impl PictureSurvey {
    /// A survey of frames at `rate`.
    pub fn new(rate: FrameRate) -> Self {
        Self {
            frames_per_sec: (rate.per_sec().round() as usize).max(2),
            n_frames: 0,
            next_look: 0,
            first: None,
            combs: Vec::new(),
            n_flagged: 0,
            bars: BarFinder::default(),
        }
    }

    /// Whether the next frame's picture is looked at.
    pub fn wants_picture(&self) -> bool {
        self.first.is_some() || self.n_frames == self.next_look
    }

    /// Takes in the next frame that repeats none, with its picture if that is wanted.
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
                let step = if self.combs.len() < EARLY_LOOKS { EARLY_STEP } else { self.frames_per_sec };
                self.next_look += step.max(2);
            }
        }
    }

    /// Mean share of combed pixels.
    pub fn comb_share(&self) -> f64 {
        self.combs.iter().sum::<f64>() / self.combs.len().max(1) as f64
    }

    /// Whether the pictures are interlaced: they show combs, of which few are enough where the frames say so too.
    pub fn is_interlaced(&self) -> bool {
        let n_combed = self.combs.iter().filter(|share| **share >= NOT_FLAGGED).count();
        let often = n_combed as f64 >= MOST_LOOKS * self.combs.len() as f64;
        let flagged = 2 * self.n_flagged > self.n_frames;
        let share = self.comb_share();
        if flagged { share >= FLAGGED } else { often && share >= NOT_FLAGGED }
    }

    /// Area between the bars; `None` without bars.
    pub fn active_area(&self) -> Option<PixelArea> {
        self.bars.finish()
    }
}
