//! Unit tests of `orator_media::opencv::warp`.

use orator_base::types::image::Image;
use orator_media::opencv::warp::{Region, SrcFromDst, letterbox_centre, letterbox_top_left, warp};

/// A smooth image, so that bilinear sampling is nearly exact.
fn smooth(width: usize, height: usize) -> Image {
    let mut image = Image::filled(width, height, [0; 3]);
    for (at, pixel) in image.data.chunks_exact_mut(3).enumerate() {
        let (x, y) = ((at % width) as f64, (at / width) as f64);
        let wave = |a: f64, b: f64| (127.0 + 100.0 * (a * x + b * y).sin()) as u8;
        pixel.copy_from_slice(&[wave(0.05, 0.02), wave(-0.03, 0.06), wave(0.02, -0.04)]);
    }
    image
}

#[test]
fn rotated_crop_matches_its_transform() {
    let src = smooth(160, 121);
    let region = Region { centre: [80.3, 60.1], side: 70.0, rotation: 0.7 };
    let transform = region.src_from_dst(64).unwrap();
    let mut dst = Image::filled(64, 64, [0; 3]);
    warp(&src, &transform, &mut dst).unwrap();
    for (u, v) in [(0, 0), (63, 0), (5, 60), (32, 32)] {
        let [x, y] = transform.apply([u as f64, v as f64]);
        let found = dst.pixel(u, v);
        let nearest = src.pixel(x.round() as usize, y.round() as usize);
        assert!(found.iter().zip(nearest).all(|(a, b)| a.abs_diff(b) <= 8), "{found:?} {nearest:?}");
    }
    let centre = transform.apply([32.0, 32.0]);
    assert!((centre[0] - 80.3).abs() < 1e-9 && (centre[1] - 60.1).abs() < 1e-9);
}

#[test]
fn outside_is_black_and_implausible_regions_are_rejected() {
    let src = Image::filled(7, 5, [200; 3]);
    let mut dst = Image::filled(8, 8, [9; 3]);
    let away = Region { centre: [-5000.0, 900.0], side: 50.0, rotation: 0.3 };
    warp(&src, &away.src_from_dst(8).unwrap(), &mut dst).unwrap();
    assert!(dst.data.iter().all(|byte| *byte == 0));
    for (x, side) in [(f64::NAN, 5.0), (0.0, 0.0), (1e12, 5.0), (0.0, f64::INFINITY), (0.0, -3.0)] {
        assert_eq!(Region { centre: [x, 0.0], side, rotation: 0.0 }.src_from_dst(8), None);
    }
    let nan = SrcFromDst([[f64::NAN; 3]; 2]);
    assert!(warp(&src, &nan, &mut dst).is_err());
    assert!(warp(&Image::filled(0, 5, [0; 3]), &SrcFromDst([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), &mut dst).is_err());
}

#[test]
fn letterboxes_keep_the_aspect_ratio_and_return_the_transform() {
    for (width, height) in [(160, 90), (91, 160), (64, 64), (3, 200), (1, 1)] {
        let src = Image::filled(width, height, [250, 10, 30]);
        let mut dst = Image::filled(64, 64, [0; 3]);
        let corner = letterbox_top_left(&src, &mut dst, 114).unwrap();
        assert_eq!(dst.pixel(0, 0), [250, 10, 30]);
        if width != height {
            assert_eq!(dst.pixel(63, 63), [114; 3]);
        }
        let longest = width.max(height) as f64;
        assert!((corner.apply([64.0, 64.0])[usize::from(height > width)] - longest).abs() < 1e-9);
        let middle = letterbox_centre(&src, &mut dst, 0).unwrap();
        let centre = middle.apply([32.0, 32.0]);
        assert!((centre[0] - width as f64 / 2.0).abs() < 1e-9 && (centre[1] - height as f64 / 2.0).abs() < 1e-9);
    }
}
