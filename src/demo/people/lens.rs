//! What lens and sensor make of a rendered picture: motion blur, a lens out of focus, little light with noise.

use crate::types::image::Image;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Defects of a clip's pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraDefects {
    /// Standard deviation of the blur, px; 0: sharp.
    pub blur_px: f64,
    /// Share of the light that reaches the sensor; 0: all, without noise.
    pub darkness: f64,
    /// Seed of the noise.
    pub seed: u64,
}

impl CameraDefects {
    /// Picture of a frame as the sensor gives it.
    pub fn taken(&self, mut image: Image, frame_idx: usize) -> Image {
        if self.blur_px > 0.0 {
            blur(&mut image, self.blur_px);
        }
        if self.darkness > 0.0 {
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(frame_idx as u64);
            darken(&mut image, self.darkness, &mut rng);
        }
        image
    }
}

/// Mean of pictures of one size, each rounded to the nearest byte.
pub fn mean(images: &[Image]) -> Option<Image> {
    let first = images.first()?;
    let n = images.len();
    let byte = |at: usize| ((images.iter().map(|image| usize::from(image.data[at])).sum::<usize>() + n / 2) / n) as u8;
    Some(Image { data: (0..first.data.len()).map(byte).collect(), ..*first })
}

/// Gaussian blur as two passes over rows and columns.
fn blur(image: &mut Image, sigma: f64) {
    let reach = (3.0 * sigma).ceil() as usize;
    let raw: Vec<f64> = (0..=reach).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp()).collect();
    let sum = raw[0] + 2.0 * raw[1..].iter().sum::<f64>();
    let weights: Vec<f32> = raw.iter().map(|w| (w / sum) as f32).collect();
    let (width, height) = (image.width, image.height);
    let values: Vec<f32> = image.data.iter().map(|&v| f32::from(v)).collect();
    let passed = |values: &[f32], n: usize, step: usize, along: &dyn Fn(usize) -> usize| -> Vec<f32> {
        (0..values.len())
            .map(|at| {
                let here = along(at);
                (1..=reach).fold(weights[0] * values[at], |sum, k| {
                    let back = at - step * k.min(here);
                    let ahead = at + step * k.min(n - 1 - here);
                    sum + weights[k] * (values[back] + values[ahead])
                })
            })
            .collect()
    };
    let rows = passed(&values, width, 3, &|at| at / 3 % width);
    let both = passed(&rows, height, 3 * width, &|at| at / (3 * width));
    image.data = both.into_iter().map(|v| (v + 0.5).clamp(0.0, 255.0) as u8).collect();
}

/// Lets a share of the light through and adds the noise of photons and of the sensor.
fn darken(image: &mut Image, light: f64, rng: &mut ChaCha8Rng) {
    let linear: Vec<f32> = (0..256).map(|v| ((v as f32) / 255.0).powf(2.2) * light as f32).collect();
    for byte in &mut image.data {
        let value = linear[usize::from(*byte)];
        // The sum of four bytes is close to normal; its standard deviation is 147.8.
        let noise: i32 = rng.random::<u32>().to_le_bytes().iter().map(|&v| i32::from(v)).sum();
        let normal = (noise - 510) as f32 / 147.8;
        let noisy = value + normal * (0.0006 * value + 1.5e-5).sqrt();
        *byte = (255.0 * noisy.max(0.0).powf(1.0 / 2.2) + 0.5).min(255.0) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blur_keeps_the_light_and_darkness_takes_it() {
        let mut image = Image::filled(40, 30, [0; 3]);
        image.data[3 * (15 * 40 + 20)..][..3].fill(255);
        let blurred = CameraDefects { blur_px: 1.5, ..CameraDefects::default() }.taken(image.clone(), 0);
        let sum: u32 = blurred.data.iter().map(|&v| u32::from(v)).sum();
        assert!(blurred.data.iter().all(|&v| v < 30) && (600..930).contains(&sum), "{sum}");
        let grey = Image::filled(40, 30, [128; 3]);
        let dark = CameraDefects { darkness: 0.1, seed: 3, ..CameraDefects::default() };
        let taken = dark.taken(grey.clone(), 1);
        let mean = taken.data.iter().map(|&v| f64::from(v)).sum::<f64>() / taken.data.len() as f64;
        assert!((35.0..55.0).contains(&mean), "{mean}");
        assert!(taken != dark.taken(grey.clone(), 2) && taken == dark.taken(grey.clone(), 1));
        assert_eq!(super::mean(&[grey.clone(), grey.clone()]).unwrap(), grey);
    }
}
