//! Captured or labelled fingers of one hand over time, and their conversion to hands of a reference size for
//! evaluation. `files` reads them.

use anyhow::{Context, Result};
use orator_base::math::order::lower_median;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::hand_bones::{BONES, METRES};
use orator_base::motion::view::hand::HandJoints;
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::Side;

/// A hand in one frame: wrist, then thumb to little finger, each from base to tip; `None`: the source lacks the point.
pub type Fingers = [Option<Vec3>; N_HAND];

/// One hand over time, in the source's unit and right-handed axes.
#[derive(Clone, Debug)]
pub struct FingerTake {
    pub name: String,
    pub side: Side,
    pub frames: Vec<Fingers>,
    /// Points given by the source; the others are only network input and are excluded from errors.
    pub counted: [bool; N_HAND],
    /// Segment that is scaled to its reference length.
    pub size: Size,
}

/// Segment of a hand whose median length over a take is scaled to its length in the reference hand
/// (`hand_bones::BONES`, middle proximal phalanx 48 mm).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// The middle finger's first phalanx: 48 mm.
    Phalanx,
    /// Wrist to the middle knuckle: 93.2 mm.
    Palm,
    /// The middle finger's last two bones, for hands without knuckles: 51.3 mm.
    MiddleEnd,
}

impl Size {
    /// Human-readable name of the segment.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Phalanx => "middle proximal phalanx 48 mm",
            Self::Palm => "wrist to middle knuckle 93.2 mm",
            Self::MiddleEnd => "middle finger's last two bones 51.3 mm",
        }
    }

    /// Length of the segment in a frame.
    fn length(self, fingers: &Fingers) -> Option<f64> {
        let between = |a: usize, b: usize| Some(vec3::norm(vec3::sub(fingers[a]?, fingers[b]?)));
        match self {
            Self::Phalanx => between(9, 10),
            Self::Palm => between(0, 9),
            Self::MiddleEnd => between(10, 11).and_then(|a| Some(a + between(11, 12)?)).or_else(|| between(10, 12)),
        }
    }

    /// Length of the segment in the reference hand, metres.
    fn reference(self) -> f64 {
        let [palm, first, second, last] = BONES[2];
        METRES
            * match self {
                Self::Phalanx => first,
                Self::Palm => palm,
                Self::MiddleEnd => second + last,
            }
    }
}

/// A right hand in metres with the wrist at 0, and which points exist (the others lie on the wrist).
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    pub hand: HandJoints,
    pub there: [bool; N_HAND],
    pub counted: [bool; N_HAND],
}

impl FingerTake {
    /// One hand of the file `name`, all of whose points are evaluated.
    pub fn all_counted(name: &str, side: Side, frames: Vec<Fingers>, size: Size) -> Self {
        Self { name: format!("{name} {side:?}"), side, frames, counted: [true; N_HAND], size }
    }

    /// Whether unaligned errors are meaningful: without knuckles the palm's orientation is unknown.
    pub fn has_knuckles(&self) -> bool {
        [5, 9, 13, 17].iter().any(|&j| self.counted[j])
    }

    /// All frames with a wrist, as right hands of the reference size.
    ///
    /// # Errors
    /// No frame has a segment of nonzero length to scale by.
    pub fn truths(&self) -> Result<Vec<Truth>> {
        let lengths = self.frames.iter().filter_map(|f| self.size.length(f)).map(|l| l as f32);
        let length = lower_median(lengths.filter(|l| *l > 0.0));
        let length = length
            .with_context(|| format!("no frame of {} has the reference segment ({})", self.name, self.size.text()))?;
        let grow = self.size.reference() / f64::from(length);
        let flip = if self.side == Side::Left { -1.0 } else { 1.0 };
        let place = |p: Option<Vec3>, wrist: Vec3| {
            let [x, y, z] = vec3::scale(vec3::sub(p?, wrist), grow);
            [x, y, z].iter().all(|v| v.is_finite()).then_some([flip * x, y, z])
        };
        let truths = self.frames.iter().filter_map(|fingers| {
            let placed = fingers.map(|p| place(p, fingers[0]?));
            let there = placed.map(|p| p.is_some());
            let counted = std::array::from_fn(|j| j > 0 && there[j] && self.counted[j]);
            there[0].then(|| Truth { hand: placed.map(Option::unwrap_or_default), there, counted })
        });
        Ok(truths.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::motion::hand_bones::relaxed;

    #[test]
    fn any_unit_and_side_becomes_the_same_right_hand() {
        let mut fingers = relaxed().map(|[x, y, z]| Some([7.0 - 300.0 * x, 300.0 * y, 300.0 * z]));
        fingers[4] = None;
        for size in [Size::Phalanx, Size::Palm, Size::MiddleEnd] {
            let frames = vec![fingers; 3];
            let take = FingerTake::all_counted("a", Side::Left, frames, size);
            let truths = take.truths().unwrap();
            assert!(!truths[0].there[4] && !truths[0].counted[0] && truths[0].counted[20]);
            let off = (0..N_HAND).filter(|&j| j != 4).map(|j| vec3::norm(vec3::sub(truths[0].hand[j], relaxed()[j])));
            assert!(off.fold(0.0, f64::max) < 1e-6);
        }
        let take = FingerTake::all_counted("none", Side::Left, vec![[None; N_HAND]], Size::Palm);
        assert!(format!("{:#}", take.truths().unwrap_err()).contains("none"));
    }
}
