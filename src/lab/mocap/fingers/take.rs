//! Captured or labelled fingers of one hand over time, and how they become hands of one size that errors are measured
//! on. `files` finds them.

use anyhow::{Context, Result};
use orator_base::math::order::lower_median;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::hand_bones::{BONES, METRES};
use orator_base::motion::view::hand::HandJoints;
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::Side;

/// A hand in one frame, wrist first, then thumb to little finger, each base to tip; `None`: the source has no such
/// point.
pub type Fingers = [Option<Vec3>; N_HAND];

/// One hand over time, in the source's own unit; right-handed axes.
#[derive(Clone, Debug)]
pub struct FingerTake {
    pub name: String,
    pub side: Side,
    pub frames: Vec<Fingers>,
    /// Points that are the source's own; the others only help to see the hand and count in no error.
    pub counted: [bool; N_HAND],
    /// Stretch that is set to the reference length.
    pub size: Size,
}

/// The stretch whose median over a take is given the length it has in the reference hand (`hand_bones::BONES` with
/// the middle finger's first phalanx at 48 mm).
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
    /// Name of the stretch, for people.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Phalanx => "middle proximal phalanx 48 mm",
            Self::Palm => "wrist to middle knuckle 93.2 mm",
            Self::MiddleEnd => "middle finger's last two bones 51.3 mm",
        }
    }

    /// Length of the stretch in a frame.
    fn length(self, fingers: &Fingers) -> Option<f64> {
        let between = |a: usize, b: usize| Some(vec3::norm(vec3::sub(fingers[a]?, fingers[b]?)));
        match self {
            Self::Phalanx => between(9, 10),
            Self::Palm => between(0, 9),
            Self::MiddleEnd => between(10, 11).and_then(|a| Some(a + between(11, 12)?)).or_else(|| between(10, 12)),
        }
    }

    /// Length of the stretch in the reference hand, metres.
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

/// A right hand in metres with the wrist at 0, and which of its points are there (the others lie on the wrist).
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    pub hand: HandJoints,
    pub there: [bool; N_HAND],
    pub counted: [bool; N_HAND],
}

impl FingerTake {
    /// One hand of the file `name`, all of whose points count.
    pub fn whole(name: &str, side: Side, frames: Vec<Fingers>, size: Size) -> Self {
        Self { name: format!("{name} {side:?}"), side, frames, counted: [true; N_HAND], size }
    }

    /// Whether errors without alignment mean anything: not without knuckles, from which the palm's place follows.
    pub fn has_knuckles(&self) -> bool {
        [5, 9, 13, 17].iter().any(|&j| self.counted[j])
    }

    /// All frames with a wrist as right hands of the reference size. Errors: the stretch that gives the size is
    /// nowhere, or of no length.
    pub fn truths(&self) -> Result<Vec<Truth>> {
        let lengths = self.frames.iter().filter_map(|f| self.size.length(f)).map(|l| l as f32);
        let length = lower_median(lengths.filter(|l| *l > 0.0));
        let length = length.with_context(|| format!("{}: no frame has its {}", self.name, self.size.text()))?;
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
            let take = FingerTake::whole("a", Side::Left, frames, size);
            let truths = take.truths().unwrap();
            assert!(!truths[0].there[4] && !truths[0].counted[0] && truths[0].counted[20]);
            let off = (0..N_HAND).filter(|&j| j != 4).map(|j| vec3::norm(vec3::sub(truths[0].hand[j], relaxed()[j])));
            assert!(off.fold(0.0, f64::max) < 1e-6);
        }
        let take = FingerTake::whole("none", Side::Left, vec![[None; N_HAND]], Size::Palm);
        assert!(format!("{:#}", take.truths().unwrap_err()).contains("none"));
    }
}
