//! Colours of the marker suit, read from `fixtures/marker_palette.txt`, which also defines the marker models.

use std::sync::LazyLock;

const FILE: &str = include_str!("../../../fixtures/marker_palette.txt");
/// Number of body markers: the first 13 points of COCO-17.
pub const N_BODY_MARKERS: usize = 13;
/// Number of markers per hand, without the wrist, which is a body marker.
pub const N_FINGER_MARKERS: usize = 20;
/// Number of colours: body markers, then finger markers, which are shared by both hands.
pub const N_COLOURS: usize = N_BODY_MARKERS + N_FINGER_MARKERS;

/// RGB of each marker: COCO points 0..13, then thumb to little finger, each from base to tip.
pub static COLOURS: LazyLock<[[u8; 3]; N_COLOURS]> = LazyLock::new(|| {
    let mut colours = [[0; 3]; N_COLOURS];
    let lines = FILE.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    for (colour, line) in colours.iter_mut().zip(lines) {
        for (channel, word) in colour.iter_mut().zip(line.split_whitespace().skip(1)) {
            *channel = word.parse().unwrap_or_default();
        }
    }
    colours
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_as_far_apart_as_the_file_says() {
        let far = |a: [u8; 3], b: [u8; 3]| -> f64 {
            a.iter().zip(b).map(|(&a, b)| (f64::from(a) - f64::from(b)).powi(2)).sum::<f64>().sqrt()
        };
        for (i, &a) in COLOURS.iter().enumerate() {
            for &b in &COLOURS[..i] {
                assert!(far(a, b) >= 75.0, "{a:?} {b:?}");
            }
            let mean = a.iter().map(|&v| f64::from(v)).sum::<f64>() / 3.0;
            let from_grey = a.iter().map(|&v| (f64::from(v) - mean).powi(2)).sum::<f64>().sqrt();
            assert!(from_grey >= 95.0, "{a:?} {from_grey}");
        }
    }
}
