//! Which of the people found in a shot are alive: a drawn or photographed person does not move. The boxes of each look
//! are tied into tracks, and of each track it is measured how much the picture in its box changes from look to look.
//! `tracker` chooses whom of them to follow.

use super::decode::boxes;
use super::patch;
use orator_base::types::image::Image;
use orator_base::types::pose2d::PersonBox;

/// Overlap of two boxes of one track.
const SAME_TRACK: f32 = 0.5;
/// Cells a side of the box that is compared, and cells by which it may have moved (a camera that is not quite still).
const CELLS: usize = 24;
const SHIFT: usize = 2;
/// The change of a box is that of the cell above which this share of the cells lie: a talking head is that much of one.
const MOVING_SHARE: f64 = 0.1;
/// Looks without a track's person after which it is forgotten.
const MAX_MISSED: usize = 3;

/// How a box has moved since its track began.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Movement {
    /// Times it was measured.
    pub n: usize,
    /// The largest change from look to look, in 8-bit steps.
    pub most: f32,
}

/// The people of a shot, by where they are.
#[derive(Default)]
pub struct LivenessTracks(Vec<LivenessTrack>);

struct LivenessTrack {
    /// The box that is compared: where the person was first.
    anchor: PersonBox,
    last: PersonBox,
    /// Gray of the anchor in the picture of the last look.
    gray: Vec<f32>,
    movement: Movement,
    n_missed: usize,
}

impl LivenessTracks {
    /// Takes in the boxes of a look; the movement of each.
    pub fn look(&mut self, image: &Image, found: &[PersonBox]) -> Vec<Movement> {
        self.0.iter_mut().for_each(|track| track.n_missed += 1);
        let movements = found.iter().map(|one| self.take(image, one)).collect();
        self.0.retain(|track| track.n_missed <= MAX_MISSED);
        movements
    }

    fn take(&mut self, image: &Image, one: &PersonBox) -> Movement {
        let open = self.0.iter_mut().filter(|track| track.n_missed > 0);
        let nearest = open.map(|track| (boxes::overlap(&track.last, one), track)).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, track)) = nearest.filter(|(overlap, _)| *overlap >= SAME_TRACK) else {
            let gray = inside(&around(image, one));
            let track = LivenessTrack { anchor: *one, last: *one, gray, movement: Movement::default(), n_missed: 0 };
            self.0.push(track);
            return Movement::default();
        };
        (track.last, track.n_missed) = (*one, 0);
        if boxes::overlap(&track.anchor, one) < SAME_TRACK {
            (track.anchor, track.gray) = (*one, inside(&around(image, one)));
            return track.movement;
        }
        let now = around(image, &track.anchor);
        track.movement.most = track.movement.most.max(change(&track.gray, &now));
        track.movement.n += 1;
        track.gray = inside(&now);
        track.movement
    }
}

/// Cells a side with those by which a box may have moved.
const GROWN: usize = CELLS + 2 * SHIFT;

/// Gray of a box and `SHIFT` cells around it, `GROWN` by `GROWN`.
fn around(image: &Image, one: &PersonBox) -> Vec<f32> {
    let PersonBox { x, y, width, height, .. } = *one;
    let [cell_x, cell_y] = [width, height].map(|side| f64::from(side) / CELLS as f64);
    let grown = [
        f64::from(x) - SHIFT as f64 * cell_x,
        f64::from(y) - SHIFT as f64 * cell_y,
        GROWN as f64 * cell_x,
        GROWN as f64 * cell_y,
    ];
    let gray = |[r, g, b]: [f32; 3]| 0.299 * r + 0.587 * g + 0.114 * b;
    patch::colours(image, grown, [GROWN, GROWN]).into_iter().map(gray).collect()
}

/// The box alone, moved by `x`, `y` cells of 0 to twice `SHIFT`.
fn moved(grown: &[f32], x: usize, y: usize) -> impl Iterator<Item = f32> {
    (y..y + CELLS).flat_map(move |row| grown[row * GROWN + x..row * GROWN + x + CELLS].iter().copied())
}

fn inside(grown: &[f32]) -> Vec<f32> {
    moved(grown, SHIFT, SHIFT).collect()
}

/// The change where the box fits best, light of the whole left out.
fn change(before: &[f32], now: &[f32]) -> f32 {
    let places = (0..=2 * SHIFT).flat_map(|y| (0..=2 * SHIFT).map(move |x| (x, y)));
    let at = |(x, y): (usize, usize)| {
        let mut steps: Vec<f32> = before.iter().zip(moved(now, x, y)).map(|(a, b)| b - a).collect();
        let mean = steps.iter().sum::<f32>() / steps.len().max(1) as f32;
        for step in &mut steps {
            *step = (*step - mean).abs();
        }
        steps.sort_by(|a, b| b.total_cmp(a));
        steps.get((MOVING_SHARE * steps.len() as f64) as usize).copied().unwrap_or(0.0)
    };
    places.map(at).fold(f32::INFINITY, f32::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two boxes of noise; the right one is drawn anew in each picture.
    fn picture(frame: usize, light: u8, shift: usize) -> Image {
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
    fn what_changes_in_its_box_is_alive() {
        let place = |x: f32| PersonBox { x, y: 10.0, width: 80.0, height: 80.0, score: 0.9 };
        let mut tracks = LivenessTracks::default();
        let mut last = Vec::new();
        for frame in 0..4 {
            // Light and a little of the camera's movement do not make a picture live.
            last = tracks.look(&picture(frame, 10 * frame as u8, 3 * (frame % 2)), &[place(10.0), place(115.0)]);
        }
        assert_eq!((last[0].n, last[1].n), (3, 3));
        assert!(last[0].most < 6.0 && last[1].most > 20.0, "{last:?}");
        assert_eq!(tracks.look(&picture(9, 0, 0), &[])[..], []);
        assert_eq!(tracks.look(&picture(9, 0, 0), &[place(60.0)])[0].n, 0);
    }
}
