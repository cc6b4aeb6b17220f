//! Guard against a body whose sides are swapped: a model that takes a turned figure for one seen from behind calls the
//! left arm the right one. No body turns round between two frames; what looks so is a swap, and is undone.

use super::decode::ScoredPoint;
use crate::types::pose2d::coco;

/// Left and right points of eyes, ears, arms and legs.
const PAIRS: [(usize, usize); 8] = [(1, 2), (3, 4), (5, 6), (7, 8), (9, 10), (11, 12), (13, 14), (15, 16)];
/// The pairs that tell the sides apart: shoulders, elbows, wrists, hips.
const TOLD_BY: [(usize, usize); 4] = [
    (coco::L_SHOULDER, coco::R_SHOULDER),
    (coco::L_ELBOW, coco::R_ELBOW),
    (coco::L_WRIST, coco::R_WRIST),
    (coco::L_HIP, coco::R_HIP),
];
/// Sides are swapped where the points move less than this share of the way when named the other way round.
const SWAPPED: f64 = 0.5;

/// Remembers which side was which in the frames of a shot.
#[derive(Clone, Debug, Default)]
pub struct SideGuard {
    /// The last body, its sides as they are believed.
    body: Option<[ScoredPoint; 17]>,
    /// Frames that agree with what is believed, less those that do not; below 0 the belief was wrong from the start.
    agreement: i64,
    is_opposed: bool,
}

/// What the guard did to a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// As the model gave them.
    Kept,
    /// Named the other way round.
    Swapped,
    /// As the model gave them, and the other way round than in the frames before.
    Corrected,
}

impl SideGuard {
    /// Forgets the shot.
    pub fn begin_anew(&mut self) {
        *self = Self::default();
    }

    /// Names the sides of the next frame's body as in the frames before. `least` is the score, 0 to 1, below which a
    /// point tells nothing.
    pub fn apply(&mut self, body: &mut [ScoredPoint; 17], least: f64) -> Sides {
        if let Some(before) = &self.body {
            let kept = if self.is_opposed { swapped(body) } else { *body };
            self.is_opposed ^= is_swap(before, &kept, least);
        }
        self.agreement += if self.is_opposed { -1 } else { 1 };
        let sides = match (self.is_opposed, self.agreement < 0) {
            (false, _) => Sides::Kept,
            (true, false) => Sides::Swapped,
            (true, true) => {
                (self.agreement, self.is_opposed) = (1, false);
                Sides::Corrected
            }
        };
        if sides == Sides::Swapped {
            *body = swapped(body);
        }
        self.body = Some(*body);
        sides
    }
}

/// The body with left and right exchanged.
fn swapped(body: &[ScoredPoint; 17]) -> [ScoredPoint; 17] {
    let mut body = *body;
    PAIRS.into_iter().for_each(|(left, right)| body.swap(left, right));
    body
}

/// Whether the points of `now` lie where those of the other side were: over all pairs seen in both, two at least.
fn is_swap(before: &[ScoredPoint; 17], now: &[ScoredPoint; 17], least: f64) -> bool {
    let away = |a: ScoredPoint, b: ScoredPoint| (a[0] - b[0]).hypot(a[1] - b[1]);
    let seen = |&(left, right): &(usize, usize)| {
        [before[left], before[right], now[left], now[right]].iter().all(|point| point[2] >= least)
    };
    let (mut n, mut straight, mut crossed) = (0, 0.0, 0.0);
    for (left, right) in TOLD_BY.into_iter().filter(seen) {
        n += 1;
        straight += away(before[left], now[left]) + away(before[right], now[right]);
        crossed += away(before[left], now[right]) + away(before[right], now[left]);
    }
    n >= 2 && crossed < SWAPPED * straight
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body of shoulders `width` px apart, left on the right of the picture, that sways by `sway` px.
    fn body(width: f64, sway: f64) -> [ScoredPoint; 17] {
        let mut body = [[100.0 + sway, 20.0, 0.9]; 17];
        for (at, (left, right)) in PAIRS.into_iter().enumerate() {
            let half = width / 2.0 * [0.2, 0.3, 1.0, 1.2, 0.8, 0.7, 0.7, 0.7][at];
            body[left] = [100.0 + sway + half, 20.0 * at as f64, 0.9];
            body[right] = [100.0 + sway - half, 20.0 * at as f64 + 3.0, 0.9];
        }
        body
    }

    #[test]
    fn swapped_frames_are_undone() {
        let mut guard = SideGuard::default();
        for frame in 0..60 {
            let truth = body(80.0, (f64::from(frame) * 0.3).sin() * 4.0);
            let is_swapped = (20..35).contains(&frame) || frame == 50;
            let mut given = if is_swapped { swapped(&truth) } else { truth };
            let sides = guard.apply(&mut given, 0.3);
            assert_eq!(given, truth, "frame {frame}");
            assert_eq!(sides, if is_swapped { Sides::Swapped } else { Sides::Kept });
        }
    }

    #[test]
    fn a_wrong_beginning_does_not_last() {
        let mut guard = SideGuard::default();
        let truth = body(80.0, 0.0);
        let corrected: Vec<bool> = (0..30)
            .map(|frame| {
                let mut given = if frame < 5 { swapped(&truth) } else { truth };
                guard.apply(&mut given, 0.3) == Sides::Corrected
            })
            .collect();
        assert_eq!(corrected.iter().position(|corrected| *corrected), Some(10));
        let mut given = truth;
        assert_eq!((guard.apply(&mut given, 0.3), given), (Sides::Kept, truth));
    }

    #[test]
    fn a_body_that_turns_round_is_believed() {
        let mut guard = SideGuard::default();
        for step in 0..=60 {
            let truth = body(80.0 * (f64::from(step) / 60.0 * std::f64::consts::PI).cos(), 0.0);
            let mut given = truth;
            assert_eq!((guard.apply(&mut given, 0.3), given), (Sides::Kept, truth), "step {step}");
        }
    }

    #[test]
    fn unseen_points_tell_nothing() {
        let mut guard = SideGuard::default();
        let truth = body(80.0, 0.0);
        guard.apply(&mut truth.clone(), 0.3);
        let unsure = swapped(&truth).map(|[x, y, _]| [x, y, 0.1]);
        assert_eq!(guard.apply(&mut unsure.clone(), 0.3), Sides::Kept);
    }
}
