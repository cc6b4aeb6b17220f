//! Camera effects on a rendered image: motion blur, out-of-focus blur, and low light with sensor noise.

use orator_avatar::render::Srgb;
use orator_base::types::image::Image;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Image defects of a clip.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraDefects {
    /// Standard deviation of the blur, px; 0: sharp.
    pub blur_px: f64,
    /// Share of the light that reaches the sensor, 0..1; the value 0 disables darkening and noise.
    pub darkness: f64,
    /// Seed of the noise.
    pub seed: u64,
}

impl CameraDefects {
    /// Applies the defects to a rendered frame.
    pub fn apply(&self, mut image: Image, frame_idx: usize) -> Image {
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

/// Mean in linear light of images of one size; `None` if there are none.
pub fn mean(images: &[Image]) -> Option<Image> {
    let (srgb, first) = (Srgb::tables(), images.first()?);
    let share = 1.0 / images.len() as f32;
    let mut sums = vec![[0.0; 4]; first.width * first.height];
    for image in images {
        for (sum, light) in sums.iter_mut().zip(linear(image)) {
            (0..3).for_each(|k| sum[k] += share * light[k]);
        }
    }
    Some(Image { data: sums.into_iter().flat_map(|light| srgb.bytes(light)).collect(), ..*first })
}

/// Linear RGB of the pixels.
fn linear(image: &Image) -> impl Iterator<Item = [f32; 4]> {
    let srgb = Srgb::tables();
    image.data.chunks_exact(3).map(move |pixel| srgb.linears([pixel[0], pixel[1], pixel[2]]))
}

/// Gaussian blur in linear light, in two passes over rows and columns.
fn blur(image: &mut Image, sigma: f64) {
    let radius = (3.0 * sigma).ceil() as usize;
    let raw: Vec<f64> = (0..=radius).map(|k| exp_neg(0.5 * (k as f64 / sigma) * (k as f64 / sigma))).collect();
    let sum = raw[0] + 2.0 * raw[1..].iter().sum::<f64>();
    let weights: Vec<f32> = raw.iter().map(|w| (w / sum) as f32).collect();
    let (width, height) = (image.width, image.height);
    let passed = |values: &[[f32; 4]], n: usize, step: usize, along: &dyn Fn(usize) -> usize| -> Vec<[f32; 4]> {
        (0..values.len())
            .map(|at| {
                let here = along(at);
                let mut sum = values[at].map(|v| weights[0] * v);
                for k in 1..=radius {
                    let back = values[at - step * k.min(here)];
                    let ahead = values[at + step * k.min(n - 1 - here)];
                    (0..3).for_each(|c| sum[c] += weights[k] * (back[c] + ahead[c]));
                }
                sum
            })
            .collect()
    };
    let values: Vec<[f32; 4]> = linear(image).collect();
    let rows = passed(&values, width, 1, &|at| at % width);
    let both = passed(&rows, height, width, &|at| at / width);
    image.data = both.into_iter().flat_map(|light| Srgb::tables().bytes(light)).collect();
}

/// e^-x for x in 0..=10, by operations with exactly specified results, so that images are reproducible.
fn exp_neg(x: f64) -> f64 {
    let part = x / 1024.0;
    let series = 1.0 + part * (1.0 + part * (0.5 + part * (1.0 / 6.0 + part / 24.0)));
    (0..10).fold(1.0 / series, |power, _| power * power)
}

/// Darkens the image to a share of its light and adds photon and sensor noise.
fn darken(image: &mut Image, share: f64, rng: &mut ChaCha8Rng) {
    let srgb = Srgb::tables();
    for pixel in image.data.chunks_exact_mut(3) {
        let mut light = srgb.linears([pixel[0], pixel[1], pixel[2]]);
        for value in &mut light[..3] {
            *value *= share as f32;
            // The sum of four bytes is close to normal; its standard deviation is 147.8.
            let noise: i32 = rng.random::<u32>().to_le_bytes().iter().map(|&v| i32::from(v)).sum();
            *value += (noise - 510) as f32 / 147.8 * (0.0006 * *value + 1.5e-5).sqrt();
        }
        pixel.copy_from_slice(&srgb.bytes(light));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blur_keeps_the_light_and_darkness_takes_it() {
        let mut image = Image::filled(40, 30, [0; 3]);
        image.data[3 * (15 * 40 + 20)..][..3].fill(255);
        let blurred = CameraDefects { blur_px: 1.5, ..CameraDefects::default() }.apply(image.clone(), 0);
        let light: Vec<f32> = linear(&blurred).map(|light| light[1]).collect();
        let (sum, max) = (light.iter().sum::<f32>(), light.iter().copied().fold(0.0, f32::max));
        assert!((sum - 1.0).abs() < 0.03 && (max - 0.071).abs() < 0.002, "{sum} {max}");
        for (x, known) in [(0.0, 1.0), (1.0, 0.367_879_441_171_442_3), (8.0, 3.354_626_279_025_118e-4)] {
            assert!((exp_neg(x) / known - 1.0).abs() < 1e-8);
        }
        let grey = Image::filled(40, 30, [128; 3]);
        let dark = CameraDefects { darkness: 0.1, seed: 3, ..CameraDefects::default() };
        let noisy = dark.apply(grey.clone(), 1);
        let mean = noisy.data.iter().map(|&v| f64::from(v)).sum::<f64>() / noisy.data.len() as f64;
        assert!((35.0..55.0).contains(&mean), "{mean}");
        assert!(noisy != dark.apply(grey.clone(), 2) && noisy == dark.apply(grey.clone(), 1));
        assert_eq!(super::mean(&[grey.clone(), grey.clone()]).unwrap(), grey);
        // Half the light of white has the byte 188.
        let [black, white] = [[0; 3], [255; 3]].map(|rgb| Image::filled(40, 30, rgb));
        assert_eq!(super::mean(&[black, white]).unwrap(), Image::filled(40, 30, [188; 3]));
    }
}
