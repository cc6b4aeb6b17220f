//! A look at some pictures of a video in full, two in a row each second: whether they are interlaced, and whether bars
//! stand beside the picture proper.

use super::bars::BarFinder;
use orator_base::types::image::{Image, PixelArea};
use orator_base::types::time::FrameRate;

/// Frames between two looks at the beginning, and the number of those looks.
const EARLY_STEP: usize = 5;
const EARLY_LOOKS: usize = 6;
/// Mean share of combed pixels of a video that is interlaced: where most frames say that they are, and where none does.
const FLAGGED: f64 = 5e-5;
const NOT_FLAGGED: f64 = 5e-4;
/// Least share of the looks that show combs where the frames do not say that they are interlaced.
const MOST_LOOKS: f64 = 0.25;

/// Least difference of neighbouring lines in a comb, 8-bit steps of green.
const STEP: i32 = 10;

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

/// Share of the pixels of `image` that are in a comb and have changed in the picture `after` it: lines that alternate
/// four times, by more than what stands still like a striped cloth explains. Every fourth column is looked at.
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
            let alternates = steps.iter().all(|step| *step > STEP) || steps.iter().all(|step| *step < -STEP);
            n_combed += usize::from(alternates && (c - i32::from(next[at])).abs() > STEP);
        }
    }
    n_combed as f64 / (width.div_ceil(4) * (height - 4)) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bright disc on a wall with a thin line, 120 x 80; `x`: its centre on even and on odd lines.
    fn disc(x: [f64; 2]) -> Image {
        let mut image = Image::filled(120, 80, [40; 3]);
        for (at, pixel) in image.data.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let (column, line) = ((at % 120) as f64, at / 120);
            let value = (20.5 - (column - x[line % 2]).hypot(line as f64 - 40.0)).clamp(0.0, 1.0);
            *pixel = [if line == 7 { 200 } else { (40.0 + 180.0 * value) as u8 }; 3];
        }
        image
    }

    #[test]
    fn moving_combs_are_measured_and_nothing_else() {
        assert!(comb_share(&disc([50.0, 62.0]), &disc([74.0, 86.0])) > 0.01);
        let still = disc([50.0; 2]);
        assert_eq!(comb_share(&still, &disc([62.0; 2])), 0.0);
        let mut striped = still;
        striped.data.chunks_exact_mut(3 * 120).step_by(2).for_each(|line| line.fill(90));
        assert_eq!(comb_share(&striped, &striped), 0.0);
        for size in [[0, 0], [1, 1], [3, 4], [1, 9]] {
            let tiny = Image::filled(size[0], size[1], [7; 3]);
            assert_eq!(comb_share(&tiny, &tiny), 0.0);
        }
    }
}
