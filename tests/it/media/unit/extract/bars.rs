//! Tests of `orator_pipeline::extract::bars`.

use orator_base::types::image::{Image, PixelArea};
use orator_pipeline::extract::bars::{BarFinder, CODEC_BLUR_PX};

/// Noise between `left` and `right` of a 320 x 180 picture, `fill` elsewhere.
fn test_image(seed: usize, [left, right]: [usize; 2], fill: impl Fn(usize, usize) -> u8) -> Image {
    let mut image = Image::filled(320, 180, [0; 3]);
    for (at, pixel) in image.data.as_chunks_mut::<3>().0.iter_mut().enumerate() {
        let (x, y) = (at % 320, at / 320);
        let bits = ((seed * 64 + x / 3) * 64 + y / 3).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        *pixel = [if x < left || x >= 320 - right { fill(x, y) } else { (bits >> 40) as u8 }; 3];
    }
    image
}

fn found(bars: [usize; 2], fill: impl Fn(usize, usize) -> u8) -> Option<PixelArea> {
    let mut finder = BarFinder::default();
    (0..5).for_each(|seed| finder.push(&test_image(seed, bars, &fill)));
    finder.finish()
}

#[test]
fn black_and_smooth_bars_are_found() {
    let smooth = |x: usize, y: usize| (60 + (x + y) / 8) as u8;
    for fill in [&(|_, _| 3u8) as &dyn Fn(usize, usize) -> u8, &smooth] {
        let area = found([110, 109], fill).unwrap();
        assert!(
            area.x.abs_diff(110) <= CODEC_BLUR_PX && (area.x + area.width).abs_diff(211) <= CODEC_BLUR_PX,
            "{area:?}"
        );
        assert_eq!((area.y, area.height), (0, 180));
    }
}

#[test]
fn images_without_bars_have_none() {
    assert_eq!(found([0, 0], |_, _| 0), None);
    // Bars that are too narrow, on one side only, or of unequal width.
    assert_eq!(found([10, 10], |_, _| 0), None);
    assert_eq!(found([120, 0], |_, _| 0), None);
    assert_eq!(found([120, 40], |_, _| 0), None);
    let mut dark = BarFinder::default();
    (0..5).for_each(|_| dark.push(&Image::filled(320, 180, [4; 3])));
    assert_eq!(dark.finish(), None);
    // A lit figure in front of a dark wall does not end at a straight seam.
    let mut figure = BarFinder::default();
    for seed in 0..5 {
        let mut image = test_image(seed, [100, 100], |_, _| 2);
        for (at, pixel) in image.data.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let (x, y) = ((at % 320) as f64 - 160.0, (at / 320) as f64 - 90.0);
            if (x / 60.0).hypot(y / 85.0) > 1.0 {
                *pixel = [2; 3];
            }
        }
        figure.push(&image);
    }
    assert_eq!(figure.finish(), None);
    assert_eq!(BarFinder::default().finish(), None);
}

#[test]
fn tiny_images_have_no_bars() {
    let mut finder = BarFinder::default();
    (0..3).for_each(|_| finder.push(&Image::filled(3, 2, [9; 3])));
    assert_eq!(finder.finish(), None);
}
