//! Tests of `orator_pipeline::extract::thumbnail`.

use orator_base::types::image::Image;
use orator_pipeline::extract::thumbnail::{THUMBNAIL, mean_change};

/// Noise determined by `seed`, shifted by `shift` px to the right and scaled in brightness by `light`.
pub(super) fn scene(seed: usize, shift: usize, light: f64) -> Image {
    let mut image = Image::filled(THUMBNAIL[0], THUMBNAIL[1], [0; 3]);
    for (at, byte) in image.data.iter_mut().enumerate() {
        let (x, y) = ((at / 3 % THUMBNAIL[0] + shift) / 4, at / 3 / THUMBNAIL[0] / 4);
        let mut bits = ((seed * 64 + x) * 64 + y).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        bits = (bits ^ bits >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        *byte = (light * ((bits >> 40) & 255) as f64) as u8;
    }
    image
}

#[test]
fn a_difference_is_the_mean_over_the_image() {
    let a = Image::filled(4, 2, [10, 20, 30]);
    let mut b = a.clone();
    assert_eq!(mean_change(&a, &b), 0.0);
    b.data[5] = 54;
    assert_eq!(mean_change(&a, &b), 1.0);
    assert_eq!(mean_change(&Image::filled(0, 0, [0; 3]), &Image::filled(0, 0, [0; 3])), 0.0);
}
