//! Gaussian blur at single cells of a small map: heat-maps only need it around their peaks.

/// Gaussian kernel of odd width with sum 1; widths 1 to 7 are OpenCV's fixed tables.
pub struct GaussianBlur(Vec<f32>);

impl GaussianBlur {
    /// Kernel of `width` cells (made odd) with OpenCV's standard deviation for it.
    pub fn new(width: usize) -> Self {
        match width | 1 {
            1 => Self(vec![1.0]),
            3 => Self(vec![0.25, 0.5, 0.25]),
            5 => Self([1.0, 4.0, 6.0, 4.0, 1.0].map(|weight| weight / 16.0).to_vec()),
            7 => Self(vec![0.03125, 0.109375, 0.21875, 0.28125, 0.21875, 0.109375, 0.03125]),
            width => {
                let half = (width / 2) as f64;
                let sigma = 0.3 * (half - 1.0) + 0.8;
                let gaussian_weight = |cell: usize| (-((cell as f64 - half) / sigma).powi(2) / 2.0).exp();
                let sum: f64 = (0..width).map(gaussian_weight).sum();
                Self((0..width).map(|cell| (gaussian_weight(cell) / sum) as f32).collect())
            }
        }
    }

    /// Blurred value at column `x`, row `y` of a map with rows of `width` cells. The border is reflected without
    /// repeating the edge cell. Returns 0 if the map has another size.
    pub fn at(&self, map: &[f32], width: usize, x: usize, y: usize) -> f32 {
        let height = map.len() / width.max(1);
        let half = (self.0.len() / 2) as isize;
        let mut sum = 0.0;
        for (dy, wy) in (-half..).zip(&self.0) {
            let row = reflect(y as isize + dy, height) * width;
            let across = (-half..)
                .zip(&self.0)
                .map(|(dx, wx)| wx * map.get(row + reflect(x as isize + dx, width)).copied().unwrap_or(0.0));
            sum += wy * across.sum::<f32>();
        }
        sum
    }
}

/// Index in 0..size after reflection at both ends (`cb|abc|ba`: the edge is not repeated).
fn reflect(at: isize, size: usize) -> usize {
    let last = size as isize - 1;
    if last <= 0 {
        return 0;
    }
    let at = at.rem_euclid(2 * last);
    at.min(2 * last - at) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use opencv::core::{BORDER_DEFAULT, Mat, MatTraitConst, Size};

    #[test]
    fn equals_opencv() {
        let (width, height) = (9, 7);
        let map: Vec<f32> = (0..63).map(|k| ((k * 37) % 17) as f32).collect();
        let src = Mat::new_rows_cols_with_data::<f32>(7, 9, &map).unwrap();
        for size in [3, 5, 7, 11] {
            let mut dst = Mat::default();
            opencv::imgproc::gaussian_blur_def(&src, &mut dst, Size::new(size, size), 0.0).unwrap();
            assert_eq!(BORDER_DEFAULT, 4);
            let gaussian = GaussianBlur::new(size as usize);
            for y in 0..height {
                for x in 0..width {
                    let expected = *dst.at_2d::<f32>(y as i32, x as i32).unwrap();
                    assert!((gaussian.at(&map, width, x, y) - expected).abs() < 1e-4, "{size} {x} {y}");
                }
            }
        }
    }
}
