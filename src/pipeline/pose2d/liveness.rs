//! Liveness: distinguishes real people from printed or on-screen ones, which do not move. Detected boxes are
//! associated to tracks, and the change of the picture within each track's box is measured between detections.
//! `tracker` uses the result to choose the speaker.

use super::decode::boxes;
use super::patch;
use orator_base::types::image::Image;
use orator_base::types::pose2d::PersonBox;

/// Least overlap of two boxes of one track.
const MIN_OVERLAP: f32 = 0.5;
/// Cells per side of the compared box, and the shift in cells that is compensated (a camera that is not quite static).
const CELLS: usize = 24;
const SHIFT: usize = 2;
/// Quantile of the cell changes, from the top, that counts as a box's change: a talking head covers about this share.
const MOVING_SHARE: f64 = 0.1;
/// Detections without a match after which a track is dropped.
const MAX_MISSED: usize = 3;

/// Change of the picture in a box since its track began.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Movement {
    pub n: usize,
    /// Largest change between two detections, in 8-bit steps.
    pub max_change: f32,
}

/// Tracks of the people in a shot, associated by position.
#[derive(Default)]
pub struct LivenessTracks(Vec<LivenessTrack>);

struct LivenessTrack {
    /// Box that is compared: the position at the start of the track.
    anchor: PersonBox,
    last: PersonBox,
    /// Gray values of the anchor at the last detection.
    gray: Vec<f32>,
    movement: Movement,
    n_missed: usize,
}

impl LivenessTracks {
    /// Adds the detected boxes of a frame; returns the movement of each.
    pub fn update(&mut self, image: &Image, found: &[PersonBox]) -> Vec<Movement> {
        self.0.iter_mut().for_each(|track| track.n_missed += 1);
        let movements = found.iter().map(|one| self.update_one(image, one)).collect();
        self.0.retain(|track| track.n_missed <= MAX_MISSED);
        movements
    }

    fn update_one(&mut self, image: &Image, one: &PersonBox) -> Movement {
        let open = self.0.iter_mut().filter(|track| track.n_missed > 0);
        let nearest = open.map(|track| (boxes::overlap(&track.last, one), track)).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, track)) = nearest.filter(|(overlap, _)| *overlap >= MIN_OVERLAP) else {
            let gray = without_margin(&gray_with_margin(image, one));
            let track = LivenessTrack { anchor: *one, last: *one, gray, movement: Movement::default(), n_missed: 0 };
            self.0.push(track);
            return Movement::default();
        };
        (track.last, track.n_missed) = (*one, 0);
        if boxes::overlap(&track.anchor, one) < MIN_OVERLAP {
            (track.anchor, track.gray) = (*one, without_margin(&gray_with_margin(image, one)));
            return track.movement;
        }
        let now = gray_with_margin(image, &track.anchor);
        track.movement.max_change = track.movement.max_change.max(change(&track.gray, &now));
        track.movement.n += 1;
        track.gray = without_margin(&now);
        track.movement
    }
}

/// Cells per side including the margin for the shift.
const GROWN_CELLS: usize = CELLS + 2 * SHIFT;

/// Gray values of a box and a margin of `SHIFT` cells, `GROWN_CELLS` by `GROWN_CELLS`.
fn gray_with_margin(image: &Image, one: &PersonBox) -> Vec<f32> {
    let PersonBox { x, y, width, height, .. } = *one;
    let [cell_x, cell_y] = [width, height].map(|side| f64::from(side) / CELLS as f64);
    let grown = [
        f64::from(x) - SHIFT as f64 * cell_x,
        f64::from(y) - SHIFT as f64 * cell_y,
        GROWN_CELLS as f64 * cell_x,
        GROWN_CELLS as f64 * cell_y,
    ];
    let gray = |[r, g, b]: [f32; 3]| 0.299 * r + 0.587 * g + 0.114 * b;
    patch::colours(image, grown, [GROWN_CELLS, GROWN_CELLS]).into_iter().map(gray).collect()
}

/// Box without margin, shifted by `x`, `y` cells (0..=2 * `SHIFT`).
fn shifted(grown: &[f32], x: usize, y: usize) -> impl Iterator<Item = f32> {
    (y..y + CELLS).flat_map(move |row| grown[row * GROWN_CELLS + x..row * GROWN_CELLS + x + CELLS].iter().copied())
}

fn without_margin(grown: &[f32]) -> Vec<f32> {
    shifted(grown, SHIFT, SHIFT).collect()
}

/// Change at the best shift, after subtraction of the mean (lighting).
fn change(before: &[f32], now: &[f32]) -> f32 {
    let shifts = (0..=2 * SHIFT).flat_map(|y| (0..=2 * SHIFT).map(move |x| (x, y)));
    let at = |(x, y): (usize, usize)| {
        let mut steps: Vec<f32> = before.iter().zip(shifted(now, x, y)).map(|(a, b)| b - a).collect();
        let mean = steps.iter().sum::<f32>() / steps.len().max(1) as f32;
        for step in &mut steps {
            *step = (*step - mean).abs();
        }
        steps.sort_by(|a, b| b.total_cmp(a));
        steps.get((MOVING_SHARE * steps.len() as f64) as usize).copied().unwrap_or(0.0)
    };
    shifts.map(at).fold(f32::INFINITY, f32::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two boxes of noise; the right one differs in each picture.
    fn test_image(frame: usize, light: u8, shift: usize) -> Image {
        let mut image = Image::filled(200, 100, [0; 3]);
        for (at, pixel) in image.data.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let (x, y) = ((at % 200 + shift) / 10, at / 200 / 10);
            let seed = if x < 10 { 0 } else { frame };
            let mut bits = ((seed * 64 + x) * 64 + y).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            bits = (bits ^ bits >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            *pixel = [(bits >> 41) as u8 / 2 + light; 3];
        }
        image
    }

    #[test]
    fn changing_boxes_show_a_living_person() {
        let person_at = |x: f32| PersonBox { x, y: 10.0, width: 80.0, height: 80.0, score: 0.9 };
        let mut tracks = LivenessTracks::default();
        let mut last = Vec::new();
        for frame in 0..4 {
            // Changes of light and small camera movement are not liveness.
            last = tracks
                .update(&test_image(frame, 10 * frame as u8, 3 * (frame % 2)), &[person_at(10.0), person_at(115.0)]);
        }
        assert_eq!((last[0].n, last[1].n), (3, 3));
        assert!(last[0].max_change < 6.0 && last[1].max_change > 20.0, "{last:?}");
        assert_eq!(tracks.update(&test_image(9, 0, 0), &[])[..], []);
        assert_eq!(tracks.update(&test_image(9, 0, 0), &[person_at(60.0)])[0].n, 0);
    }
}
