//! Change of the picture from frame to frame, one number a frame: near 0 for a slide, a paused video or a drawn person.
//! `segment` judges by it.

use crate::types::image::Image;

/// Width and height of the pictures to compare, in cells: fine enough that a person who moves is seen to.
pub const THUMBNAIL: [usize; 2] = [64, 64];

/// Mean absolute difference of two pictures of one size, in 8-bit steps.
pub fn mean_change(a: &Image, b: &Image) -> f32 {
    let sum: u64 = a.data.iter().zip(&b.data).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f32 / a.data.len().max(1) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_is_the_mean_over_the_picture() {
        let a = Image::filled(4, 2, [10, 20, 30]);
        let mut b = a.clone();
        assert_eq!(mean_change(&a, &b), 0.0);
        b.data[5] = 54;
        assert_eq!(mean_change(&a, &b), 1.0);
        assert_eq!(mean_change(&Image::filled(0, 0, [0; 3]), &Image::filled(0, 0, [0; 3])), 0.0);
    }
}
