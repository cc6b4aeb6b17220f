//! What a camera does to a picture: motion blur, exposure, defocus, noise of the sensor, few pixels. Whole numbers and
//! plain arithmetic alone, so that the bytes are the same on every machine.

use super::srgb::Srgb;
use crate::types::image::Image;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::RngCore;

/// Mean in linear light of pictures of one size: what a shutter that stays open sees. `None` of none.
pub fn motion_blur(moments: &[Image]) -> Option<Image> {
    let srgb = Srgb::tables();
    let share = 1.0 / moments.len() as f32;
    let mut blurred = moments.first()?.clone();
    for (at, pixel) in blurred.data.chunks_exact_mut(3).enumerate() {
        let mut sum = [0.0; 4];
        for moment in moments {
            let there = &moment.data[3 * at..3 * at + 3];
            let linear = srgb.linears([there[0], there[1], there[2]]);
            for k in 0..4 {
                sum[k] += linear[k] * share;
            }
        }
        pixel.copy_from_slice(&srgb.bytes(sum));
    }
    Some(blurred)
}

/// A picture with `times` the light; what is too bright is white.
pub fn exposed(image: &Image, times: f32) -> Image {
    let srgb = Srgb::tables();
    let table: Vec<u8> = (0..=255u8).map(|byte| srgb.bytes(srgb.linears([byte; 3]).map(|v| v * times))[0]).collect();
    Image { data: image.data.iter().map(|byte| table[usize::from(*byte)]).collect(), ..*image }
}

/// A picture with noise of standard deviation `deviation` (of 255), independent in all pixels and colours.
pub fn noisy(image: &Image, deviation: f32, dice: &mut ChaCha8Rng) -> Image {
    // The sum of four bytes is close to normal, with deviation sqrt(4 (256^2 - 1) / 12).
    const OF_SUM: f32 = 147.8;
    let mut thrown = vec![0; 4 * image.data.len()];
    dice.fill_bytes(&mut thrown);
    let one = |(byte, four): (&u8, &[u8])| {
        let sum: i32 = four.iter().map(|v| i32::from(*v)).sum();
        (f32::from(*byte) + (sum - 510) as f32 * (deviation / OF_SUM) + 0.5) as u8
    };
    Image { data: image.data.iter().zip(thrown.chunks_exact(4)).map(one).collect(), ..*image }
}

/// A picture out of focus: close to a Gaussian of standard deviation `radius`/1.2 px, by three means over squares.
pub fn defocused(image: &Image, radius: usize) -> Image {
    let mut blurred = image.clone();
    for _ in 0..3 {
        for (step, n, lines) in [(3, image.width, image.height), (3 * image.width, image.height, image.width)] {
            let across = if step == 3 { 3 * image.width } else { 3 };
            for start in (0..lines).flat_map(|line| (0..3).map(move |colour| line * across + colour)) {
                mean_along(&mut blurred.data, start, step, n, radius);
            }
        }
    }
    blurred
}

/// Replaces `n` bytes, `step` apart, by the means of those up to `radius` away; beyond the ends stand the last ones.
fn mean_along(bytes: &mut [u8], start: usize, step: usize, n: usize, radius: usize) {
    let line: Vec<u32> = (0..n).map(|at| u32::from(bytes[start + at * step])).collect();
    let value = |at: isize| line[at.clamp(0, n as isize - 1) as usize];
    let (radius, width) = (radius as isize, 2 * radius as u32 + 1);
    let mut sum: u32 = (-radius..=radius).map(value).sum();
    for at in 0..n {
        bytes[start + at * step] = ((sum + width / 2) / width) as u8;
        sum = sum + value(at as isize + radius + 1) - value(at as isize - radius);
    }
}

/// A picture of another size, no larger: means over the pixels that each new one covers.
pub fn shrunk(image: &Image, [width, height]: [usize; 2]) -> Image {
    let (width, height) = (width.clamp(1, image.width.max(1)), height.clamp(1, image.height.max(1)));
    let (columns, rows) = (covers(image.width, width), covers(image.height, height));
    let mut shrunk = Image::filled(width, height, [0; 3]);
    for (y, row) in rows.iter().enumerate() {
        for (x, column) in columns.iter().enumerate() {
            let (mut sum, mut whole) = ([0u64; 3], 0);
            for (from_y, down) in row {
                for (from_x, across) in column {
                    let rgb = image.pixel(*from_x, *from_y);
                    (0..3).for_each(|k| sum[k] += down * across * u64::from(rgb[k]));
                    whole += down * across;
                }
            }
            let at = 3 * (y * width + x);
            (0..3).for_each(|k| shrunk.data[at + k] = ((sum[k] + whole / 2) / whole.max(1)) as u8);
        }
    }
    shrunk
}

/// Old pixels that each of `to` new ones covers, and how much of them, in parts of an old one.
fn covers(from: usize, to: usize) -> Vec<Vec<(usize, u64)>> {
    let covered = |new: usize| {
        let [start, end] = [new * from, (new + 1) * from];
        (start / to..end.div_ceil(to))
            .map(|old| (old, (end.min((old + 1) * to) - start.max(old * to)) as u64))
            .collect()
    };
    (0..to).map(covered).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// Black but for a white column.
    fn column(at: usize) -> Image {
        let mut image = Image::filled(32, 8, [0; 3]);
        (0..8).for_each(|y| image.data[3 * (y * 32 + at)..3 * (y * 32 + at) + 3].fill(255));
        image
    }

    #[test]
    fn blur_is_a_mean_of_light() {
        let blurred = motion_blur(&[column(3), column(4), column(3), column(5)]).unwrap();
        // Half the light is the byte 188, a quarter 137.
        assert_eq!([3, 4, 5, 6].map(|x| blurred.pixel(x, 2)[1]), [188, 137, 137, 0]);
        assert_eq!(motion_blur(&[]), None);
        assert_eq!(exposed(&blurred, 0.5).pixel(3, 0), [137; 3]);
        assert_eq!(exposed(&blurred, 9.0).pixel(4, 0), [255; 3]);
    }

    #[test]
    fn noise_has_its_deviation_and_comes_again_from_the_same_seed() {
        let grey = Image::filled(200, 100, [128; 3]);
        let thrown = |seed| noisy(&grey, 6.0, &mut ChaCha8Rng::seed_from_u64(seed));
        let (first, second) = (thrown(1), thrown(2));
        assert!(first == thrown(1) && first != second);
        let off: Vec<f64> = first.data.iter().map(|byte| f64::from(*byte) - 128.0).collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        let deviation = (off.iter().map(|v| v * v).sum::<f64>() / off.len() as f64).sqrt();
        assert!(mean.abs() < 0.1 && (deviation - 6.0).abs() < 0.1, "{mean} {deviation}");
        assert!(noisy(&Image::filled(9, 9, [0; 3]), 90.0, &mut ChaCha8Rng::seed_from_u64(3)).data.contains(&0));
    }

    #[test]
    fn defocus_and_few_pixels_keep_the_sum() {
        let sharp = column(16);
        let soft = defocused(&sharp, 2);
        let sum = |image: &Image| image.data.iter().map(|byte| u64::from(*byte)).sum::<u64>() as f64;
        assert!((sum(&soft) / sum(&sharp) - 1.0).abs() < 0.03);
        assert!(soft.pixel(16, 4)[0] > soft.pixel(18, 4)[0] && soft.pixel(14, 4) == soft.pixel(18, 4));
        let small = shrunk(&sharp, [10, 4]);
        assert_eq!((small.width, small.height), (10, 4));
        assert!((sum(&small) / sum(&sharp) - 10.0 * 4.0 / (32.0 * 8.0)).abs() < 0.01);
        assert_eq!(shrunk(&sharp, [32, 8]), sharp);
    }
}
