//! What is done to a training picture besides its crop: light and colour, blur, something before the person, noise.

use crate::external::opencv::warp;
use crate::types::image::Image;
use anyhow::Result;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Shares of the pictures with blur, with something before the person, with noise.
const BLURRED: f64 = 0.2;
const COVERED: f64 = 0.2;
const NOISY: f64 = 0.3;

/// The picture in another light, perhaps blurred, covered or noisy.
pub fn disturb(mut image: Image, rng: &mut ChaCha8Rng) -> Result<Image> {
    if rng.random_bool(BLURRED) {
        let factor = rng.random_range(1.3..2.5);
        let small = [image.width, image.height].map(|px| ((px as f64 / factor) as usize).max(1));
        let mut blurred = Image::filled(small[0], small[1], [0; 3]);
        warp::resize(&image, &mut blurred)?;
        warp::resize(&blurred, &mut image)?;
    }
    light(&mut image, rng);
    if rng.random_bool(COVERED) {
        cover(&mut image, rng);
    }
    if rng.random_bool(NOISY) {
        let most = rng.random_range(4.0..30.0f32);
        for byte in &mut image.data {
            // The sum of four bytes is close to normal; its standard deviation is 147.8.
            let sum: i32 = rng.random::<u32>().to_le_bytes().iter().map(|v| i32::from(*v)).sum();
            *byte = (f32::from(*byte) + most * (sum - 510) as f32 / 295.6) as u8;
        }
    }
    Ok(image)
}

/// Brightness, contrast and gamma, each channel a little differently; now and then without colour.
fn light(image: &mut Image, rng: &mut ChaCha8Rng) {
    let (gain, shift) = (rng.random_range(0.6..1.4f32), rng.random_range(-30.0..30.0f32));
    let gamma = rng.random_range(-0.4..0.4f32).exp();
    let tables: [[u8; 256]; 3] = std::array::from_fn(|_| {
        let (gain, shift) = (gain * rng.random_range(0.9..1.1f32), shift + rng.random_range(-10.0..10.0f32));
        std::array::from_fn(|v| (gain * 255.0 * (v as f32 / 255.0).powf(gamma) + shift) as u8)
    });
    let is_grey = rng.random_bool(0.1);
    for pixel in image.data.chunks_exact_mut(3) {
        let seen: [u8; 3] = std::array::from_fn(|c| tables[c][usize::from(pixel[c])]);
        let grey = (seen.iter().map(|v| u16::from(*v)).sum::<u16>() / 3) as u8;
        pixel.copy_from_slice(&if is_grey { [grey; 3] } else { seen });
    }
}

/// A rectangle of one colour somewhere.
fn cover(image: &mut Image, rng: &mut ChaCha8Rng) {
    let mut part = |n: usize| {
        let length = (n as f64 * rng.random_range(0.1..0.35)) as usize;
        let start = rng.random_range(0..=n - length);
        start..start + length
    };
    let (columns, rows) = (part(image.width), part(image.height));
    let colour: [u8; 3] = rng.random();
    for row in rows {
        let pixels = &mut image.data[3 * row * image.width..][3 * columns.start..3 * columns.end];
        pixels.chunks_exact_mut(3).for_each(|pixel| pixel.copy_from_slice(&colour));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn pictures_keep_their_size_and_differ() -> Result<()> {
        let grey = Image::filled(24, 32, [120; 3]);
        let of = |seed| disturb(grey.clone(), &mut ChaCha8Rng::seed_from_u64(seed));
        for seed in 0..30 {
            let image = of(seed)?;
            assert_eq!((image.width, image.height, image.data.len()), (24, 32, grey.data.len()));
            assert!(image != grey && image == of(seed)?);
        }
        Ok(())
    }
}
