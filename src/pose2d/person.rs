//! The person detector, and which of the people it finds is the speaker: in a new shot the largest, most central and
//! surest; from then on the one who overlaps the box followed.

use super::decode::{boxes, detections, yolox_grid};
use super::feed::Feed;
use crate::onnx::{Decode, ModelEntry, Runtime};
use crate::types::image::Image;
use crate::types::pose2d::PersonBox;
use anyhow::{Result, bail};
use std::path::Path;

/// Least overlap of a found box with the followed one to be the same person.
const SAME_PERSON: f32 = 0.2;
/// Looks in a row without the speaker after which another is chosen.
const MAX_MISSED: usize = 2;

/// Finds people in a picture.
pub struct Detector {
    feed: Feed,
    decode: Decode,
}

impl Detector {
    pub fn open(runtime: &Runtime, entry: &ModelEntry, dir: &Path) -> Result<Self> {
        Ok(Self { feed: Feed::open(runtime, entry, dir)?, decode: entry.decode.clone() })
    }

    pub fn secs_inside(&self) -> f64 {
        self.feed.secs_inside()
    }

    /// The people in the picture, surest first, in px.
    pub fn find(&mut self, image: &Image) -> Result<Vec<PersonBox>> {
        let size = self.feed.size();
        let (src_from_dst, outputs) = self.feed.whole(image)?;
        let found = match &self.decode {
            Decode::Detections { boxes, labels, person, min_score, max_overlap } => {
                let (shape, rows) = outputs.floats(boxes)?;
                if shape.last() != Some(&5) {
                    bail!("the output {boxes:?} of a detector must have rows of 5 numbers, its shape is {shape:?}");
                }
                let labels = labels.as_ref().map(|name| outputs.integers(name)).transpose()?.map(|(_, labels)| labels);
                detections::decode(rows, labels, *person, *min_score, *max_overlap)
            }
            Decode::YoloxGrid { predictions, strides, min_score, max_overlap } => {
                let (shape, rows) = outputs.floats(predictions)?;
                let row_len = shape.last().map_or(0, |len| usize::try_from(*len).unwrap_or(0));
                yolox_grid::decode(rows, row_len, size, strides, *min_score, *max_overlap)?
            }
            other => bail!("a person detector cannot be read as {other:?}"),
        };
        let place = |person: PersonBox| {
            let at = |x: f32, y: f32| src_from_dst.apply([f64::from(x), f64::from(y)]).map(|px| px as f32);
            let [x, y] = at(person.x, person.y);
            let [right, bottom] = at(person.x + person.width, person.y + person.height);
            PersonBox { x, y, width: right - x, height: bottom - y, score: person.score }
        };
        Ok(found.into_iter().map(place).collect())
    }
}

/// The box of the one speaker through a shot.
#[derive(Default)]
pub struct Followed {
    /// x, y, width, height in px.
    pub place: Option<[f64; 4]>,
    pub score: f32,
    /// People seen at the last look.
    pub n_people: u8,
    n_missed: usize,
    /// People taken so far; the one followed is the last of them.
    n_taken: i64,
}

impl Followed {
    /// Takes in what the detector found in a picture `image_width` px wide; `weight` is that of a new box against the
    /// followed one. `body_seen`: a body was found in the followed box since the last look.
    pub fn look(&mut self, found: &[PersonBox], image_width: usize, weight: f64, body_seen: bool) {
        self.n_people = u8::try_from(found.len()).unwrap_or(u8::MAX);
        let Some(place) = self.place else {
            self.choose(found, image_width);
            return;
        };
        let [x, y, width, height] = place.map(|px| px as f32);
        let followed = PersonBox { x, y, width, height, score: 0.0 };
        let nearest = found.iter().map(|one| (boxes::overlap(one, &followed), one));
        match nearest.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((overlap, same)) if overlap >= SAME_PERSON => {
                let new = numbers(same);
                self.place = Some(std::array::from_fn(|at| (1.0 - weight) * place[at] + weight * new[at]));
                (self.score, self.n_missed) = (same.score, 0);
            }
            _ => {
                self.n_missed += 1;
                if self.n_missed >= MAX_MISSED && (!found.is_empty() || !body_seen) {
                    self.choose(found, image_width);
                }
            }
        }
    }

    /// The likeliest speaker of those found; none if there is nobody.
    fn choose(&mut self, found: &[PersonBox], image_width: usize) {
        let middle = image_width as f32 / 2.0;
        let weight = |one: &PersonBox| {
            let off = ((one.x + one.width / 2.0 - middle) / middle.max(1.0)).abs().min(1.0);
            one.score * one.width * one.height * (1.0 - 0.5 * off)
        };
        let best = found.iter().max_by(|a, b| weight(a).total_cmp(&weight(b)));
        self.place = best.map(numbers);
        self.n_taken += i64::from(best.is_some());
        self.score = best.map_or(0.0, |one| one.score);
        self.n_missed = 0;
    }

    /// Follows nobody; whoever is taken next is another person.
    pub fn begin_anew(&mut self) {
        *self = Self { n_taken: self.n_taken, ..Self::default() };
    }

    /// The number of the person followed, from 0.
    pub fn identity(&self) -> i64 {
        (self.n_taken - 1).max(0)
    }

    /// The box as it is written down; zeros if nobody is followed.
    pub fn person(&self) -> PersonBox {
        let Some([x, y, width, height]) = self.place.map(|place| place.map(|px| px as f32)) else {
            return PersonBox::default();
        };
        PersonBox { x, y, width, height, score: self.score }
    }
}

fn numbers(one: &PersonBox) -> [f64; 4] {
    [one.x, one.y, one.width, one.height].map(f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f32, width: f32, score: f32) -> PersonBox {
        PersonBox { x, y: 0.0, width, height: 100.0, score }
    }

    #[test]
    fn the_first_choice_is_followed_past_a_better_one() {
        let mut followed = Followed::default();
        followed.look(&[at(0.0, 100.0, 0.9), at(100.0, 110.0, 0.9)], 300, 0.3, false);
        assert_eq!((followed.person().x, followed.n_people), (100.0, 2));
        followed.look(&[at(0.0, 250.0, 0.9), at(120.0, 110.0, 0.5)], 300, 0.3, true);
        assert!((followed.person().x - 106.0).abs() < 1e-4 && followed.person().score == 0.5);
    }

    #[test]
    fn of_two_people_the_followed_one_stays_while_the_other_outgrows_it() {
        let mut followed = Followed::default();
        for step in 0..30 {
            let grown = step as f32;
            let mut found = [at(40.0 + 0.5 * grown, 130.0 - grown, 0.9), at(180.0 - grown, 110.0 + 2.0 * grown, 0.95)];
            if step % 2 == 1 {
                found.reverse();
            }
            followed.look(&found, 340, 0.3, true);
            let PersonBox { x, width, score, .. } = followed.person();
            assert!(x + width / 2.0 < 120.0 && score == 0.9, "step {step}: the box has gone to {x} + {width}");
        }
        // A new follower would take the other by now.
        let mut anew = Followed::default();
        anew.look(&[at(54.5, 101.0, 0.9), at(151.0, 168.0, 0.95)], 340, 0.3, true);
        assert_eq!((anew.person().x, anew.n_people), (151.0, 2));
    }

    #[test]
    fn a_lost_speaker_is_kept_while_the_body_is_seen_then_replaced() {
        let mut followed = Followed::default();
        followed.look(&[at(100.0, 100.0, 0.9)], 300, 0.3, false);
        for _ in 0..5 {
            followed.look(&[], 300, 0.3, true);
        }
        assert_eq!((followed.person().x, followed.n_people), (100.0, 0));
        followed.look(&[at(0.0, 30.0, 0.9)], 300, 0.3, true);
        assert_eq!(followed.person().x, 0.0);
        followed.look(&[], 300, 0.3, false);
        followed.look(&[], 300, 0.3, false);
        assert_eq!(followed.place, None);
    }
}
