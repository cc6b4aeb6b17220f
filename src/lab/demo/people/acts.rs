//! Gestures, looks and movements of the trunk over a clip, tied to its speech: strokes before stressed syllables, beats
//! on them, rests in pauses, nods while listening. All are smooth functions of time.

use super::body::{ArmPosture, FingerShape};
use super::condition::{Manner, Seat};
use super::vocabulary;
use super::vocabulary::Arms;
use orator_base::math::vec3::Vec3;
use orator_test_support::drawn::gesture::minimum_jerk;
use orator_test_support::drawn::speech::Speech;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Longest pause without a rest, seconds.
const PAUSE: f64 = 0.45;

/// Trunk and head, radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrunkPosture {
    /// Turn to the person's left, lean ahead, lean to the person's left.
    pub trunk: [f64; 3],
    /// Turn to the left, nod ahead, tilt to the left, all relative to the trunk.
    pub head: [f64; 3],
    /// Shift of the hips to the left, metres.
    pub shift: f64,
}

/// How somebody leans ahead over a whole clip; all 0 of who is upright.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Carriage {
    /// Lean of the trunk ahead that the arms do not follow, radians.
    pub lean: f64,
    /// How far the head is bowed, radians.
    pub bow: f64,
    /// How much further ahead the hands are than those of who is upright, metres of a body of unit 1.
    pub ahead: f64,
    /// `ArmPosture::forward` of both arms of an upright trunk.
    pub elbows: f64,
}

impl Carriage {
    pub fn sample(rng: &mut ChaCha8Rng) -> Self {
        Self {
            lean: rng.random_range(0.04..0.45),
            bow: rng.random_range(0.0..0.4),
            ahead: rng.random_range(0.02..0.2),
            elbows: rng.random_range(0.3..1.6),
        }
    }

    /// Wrist in the axes of the leaning torso, of one in those of an upright body.
    pub fn wrist(&self, [x, down, away]: Vec3) -> Vec3 {
        let (sin, cos) = self.lean.sin_cos();
        let away = away - self.ahead;
        [x, cos * down + sin * away, cos * away - sin * down]
    }

    /// How much further ahead than a desk's usual place its near edge is, metres of a body of unit 1.
    pub fn desk_ahead(&self) -> f64 {
        0.45 * self.lean.sin() + 0.5 * self.ahead
    }
}

/// Movement to `to` within `secs` from `start` on.
#[derive(Clone, Debug)]
struct Move<T> {
    start: f64,
    secs: f64,
    to: T,
}

/// Dip of hands and head around a stressed syllable.
#[derive(Clone, Debug)]
struct BeatDip {
    at: f64,
    depth: f64,
    /// Shares of left and right hand.
    hands: [f64; 2],
}

/// All movements of a clip.
#[derive(Clone, Debug)]
pub struct Acts {
    begin: Arms,
    arms: Vec<Move<[Option<ArmPosture>; 2]>>,
    beats: Vec<BeatDip>,
    heads: Vec<Move<[f64; 3]>>,
    trunks: Vec<Move<[f64; 3]>>,
    /// Start and depth of nods of a listener.
    nods: Vec<(f64, f64)>,
    sway: [f64; 6],
    seat: Seat,
    pub carriage: Carriage,
}

/// Maker of the arms' movements.
struct ArmPlan<'a> {
    manner: Manner,
    rests: Vec<Arms>,
    /// Rest that is left and returned to over the edge of the desk.
    hidden: Option<usize>,
    rest: usize,
    moves: Vec<Move<[Option<ArmPosture>; 2]>>,
    rng: &'a mut ChaCha8Rng,
}

impl ArmPlan<'_> {
    fn is_hidden(&self) -> bool {
        self.hidden == Some(self.rest)
    }

    fn secs(&mut self) -> f64 {
        match self.manner {
            Manner::Fast => self.rng.random_range(0.15..0.3),
            _ => self.rng.random_range(0.42..0.75),
        }
    }

    /// Hands go where a gesture is; an idle hand rests.
    fn stroke(&mut self, start: f64) {
        let (goal, secs) = (vocabulary::stroke(self.manner, self.rng), self.secs());
        let start = self.over_edge(start);
        if self.is_hidden() {
            self.rest = (self.rest + 1) % self.rests.len();
        }
        let rest = self.rests[self.rest];
        let to = [0, 1].map(|side| goal[side].or(Some(rest[side])));
        self.moves.push(Move { start, secs, to });
    }

    fn return_to_rest(&mut self, start: f64) {
        let next = if self.rng.random_bool(0.5) { self.rng.random_range(0..self.rests.len()) } else { self.rest };
        let was_hidden = self.is_hidden();
        let start = if was_hidden && next != self.rest { self.over_edge(start) } else { start };
        let secs = self.secs().max(0.5);
        let comes = !was_hidden && self.hidden == Some(next);
        self.rest = next;
        let start = if comes { self.over(start) } else { start };
        self.moves.push(Move { start, secs, to: self.rests[next].map(Some) });
    }

    fn over_edge(&mut self, start: f64) -> f64 {
        if self.is_hidden() { self.over(start) } else { start }
    }

    /// Both hands over the desk's edge; returns when the next movement may begin.
    fn over(&mut self, start: f64) -> f64 {
        self.moves.push(Move { start, secs: 0.45, to: vocabulary::over_edge().map(Some) });
        start + 0.36
    }
}

impl Acts {
    /// Movements to a speech of `secs` seconds; `held` is the side and the grip of a hand that holds something.
    pub fn new(
        speech: &Speech,
        secs: f64,
        (manner, seat): (Manner, Seat),
        held: Option<(usize, FingerShape)>,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let mut rests = vocabulary::rests(manner, seat, rng);
        let hidden = (seat == Seat::Desk && manner == Manner::Free && rng.random_bool(0.6)).then(|| {
            rests.push(vocabulary::under_desk());
            rests.len() - 1
        });
        let sway = std::array::from_fn(|_| rng.random_range(0.0..TAU));
        let begins_hidden = hidden.filter(|_| rng.random_bool(0.5));
        let first = begins_hidden.unwrap_or_else(|| rng.random_range(0..rests.len()));
        let mut plan = ArmPlan { manner, rests, hidden, rest: first, moves: Vec::new(), rng };
        let mut beats = Vec::new();
        let rare = if manner == Manner::Folded || manner == Manner::Crossing { 0.3 } else { 0.75 };
        let said = &speech.syllables;
        for (k, syllable) in said.iter().enumerate() {
            if syllable.stress > 0.5 {
                let at = (syllable.start + syllable.end) / 2.0;
                let chance = if manner == Manner::Fast { 0.95 } else { rare };
                if plan.rng.random_bool(chance) {
                    plan.stroke(syllable.start - 0.3);
                    if manner == Manner::Fast && plan.rng.random_bool(0.6) {
                        plan.stroke(syllable.start + 0.1);
                    }
                    if manner == Manner::Folded {
                        plan.return_to_rest(syllable.start + 0.9);
                    }
                }
                let side = usize::from(plan.rng.random_bool(0.5));
                let mut hands = [1.0; 2];
                if plan.rng.random_bool(0.4) || plan.is_hidden() {
                    hands[side] = 0.2;
                }
                let depth = if manner == Manner::Folded { 0.012 } else { plan.rng.random_range(0.02..0.05) };
                beats.push(BeatDip { at, depth: depth * syllable.stress, hands });
            }
            let gap = said.get(k + 1).map_or(secs, |next| next.start) - syllable.end;
            if gap > PAUSE && plan.rng.random_bool(0.8) {
                plan.return_to_rest(syllable.end);
            }
        }
        plan.moves.sort_by(|a, b| a.start.total_cmp(&b.start));
        let ArmPlan { rests, mut moves, .. } = plan;
        let mut begin = rests[first];
        if let Some((side, grip)) = held {
            let hold = |posture: &mut ArmPosture| hold(posture, grip);
            hold(&mut begin[side]);
            moves.iter_mut().filter_map(|m| m.to[side].as_mut()).for_each(hold);
        }
        let nods = said.windows(2).filter(|pair| pair[1].start - pair[0].end > 1.0).flat_map(|pair| {
            let depth = rng.random_range(0.05..0.16);
            [0.35, 0.8].map(|after| (pair[0].end + after, depth))
        });
        let nods = nods.collect();
        let (heads, trunks) = (looks(secs, rng), shifts(secs, seat, rng));
        Self { begin, arms: moves, beats, heads, trunks, nods, sway, seat, carriage: Carriage::default() }
    }

    /// Arms at a time.
    pub fn arms(&self, secs: f64) -> Arms {
        let mut arms = self.begin;
        for step in self.arms.iter().take_while(|step| step.start < secs) {
            let done = minimum_jerk((secs - step.start) / step.secs);
            for (arm, goal) in arms.iter_mut().zip(step.to) {
                *arm = goal.map_or(*arm, |goal| arm.towards(goal, done));
            }
        }
        for beat in &self.beats {
            let dip = beat.depth * (-((secs - beat.at) / 0.11).powi(2)).exp();
            for (arm, share) in arms.iter_mut().zip(beat.hands) {
                arm.wrist[1] += share * dip;
                arm.raise -= 3.0 * share * dip;
            }
        }
        arms.iter_mut().for_each(|arm| arm.forward = self.carriage.elbows + self.carriage.lean);
        arms
    }

    /// Trunk and head at a time.
    pub fn trunk(&self, secs: f64) -> TrunkPosture {
        let reached = |moves: &[Move<[f64; 3]>]| {
            moves.iter().take_while(|step| step.start < secs).fold([0.0; 3], |mut now: [f64; 3], step| {
                let done = minimum_jerk((secs - step.start) / step.secs);
                (0..3).for_each(|k| now[k] += done * (step.to[k] - now[k]));
                now
            })
        };
        let slow = |k: usize, hz: f64| (TAU * hz * secs + self.sway[k]).sin();
        let [turn, lean, side] = reached(&self.trunks);
        let [yaw, nod, tilt] = reached(&self.heads);
        let dips = self.beats.iter().map(|beat| 2.0 * beat.depth * (-((secs - beat.at) / 0.13).powi(2)).exp());
        let nods = self.nods.iter().map(|(at, depth)| depth * (-((secs - at) / 0.12).powi(2)).exp());
        let still = if self.seat == Seat::Standing { 1.0 } else { 0.5 };
        TrunkPosture {
            trunk: [
                turn + 0.03 * slow(0, 0.11),
                self.carriage.lean + lean + 0.012 * slow(1, 0.17) + 0.004 * slow(2, 0.27),
                side + still * 0.015 * slow(3, 0.13),
            ],
            head: [
                yaw - 0.4 * turn + 0.02 * slow(4, 0.23),
                nod + dips.sum::<f64>() + nods.sum::<f64>() - 0.5 * lean + self.carriage.bow - self.carriage.lean,
                tilt - 0.5 * side + 0.015 * slow(5, 0.19),
            ],
            shift: still * 0.012 * slow(3, 0.13),
        }
    }
}

/// Posture of a hand that holds something: before the body, the thumb up, gripping.
fn hold(posture: &mut ArmPosture, grip: FingerShape) {
    posture.fingers = grip;
    posture.roll = posture.roll.clamp(-0.4, 0.4);
    posture.raise = posture.raise.clamp(0.1, 0.6);
    posture.inwards = posture.inwards.clamp(0.1, 0.4);
    posture.wrist[1] = posture.wrist[1].min(0.3);
    posture.wrist[0] = posture.wrist[0].clamp(0.12, 0.32);
    posture.wrist[2] = posture.wrist[2].min(-0.22);
}

/// Where the head looks: mostly at the viewer, now and then up to 45 degrees aside.
fn looks(secs: f64, rng: &mut ChaCha8Rng) -> Vec<Move<[f64; 3]>> {
    let mut moves = Vec::new();
    let mut now = rng.random_range(0.0..1.0);
    while now < secs {
        let most = if rng.random_bool(0.3) { 0.78 } else { 0.2 };
        let to = [rng.random_range(-most..most), rng.random_range(-0.14..0.2), rng.random_range(-0.13..0.13)];
        moves.push(Move { start: now, secs: rng.random_range(0.35..0.7), to });
        now += rng.random_range(0.9..2.4);
    }
    moves
}

/// Where the trunk leans and turns.
fn shifts(secs: f64, seat: Seat, rng: &mut ChaCha8Rng) -> Vec<Move<[f64; 3]>> {
    let (turn, lean) = match seat {
        Seat::Standing => (0.25, [-0.05, 0.12]),
        Seat::Chair => (0.2, [-0.08, 0.22]),
        Seat::Desk => (0.14, [-0.02, 0.12]),
    };
    let mut moves = Vec::new();
    let mut now = -1.0;
    while now < secs {
        let to = [rng.random_range(-turn..turn), rng.random_range(lean[0]..lean[1]), rng.random_range(-0.07..0.07)];
        moves.push(Move { start: now, secs: rng.random_range(0.8..1.6), to });
        now += rng.random_range(1.5..4.0);
    }
    moves
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::people::body::Build;
    use crate::demo::people::contact::Obstacles;
    use crate::demo::people::trunk::SeatedRig;
    use crate::demo::people::voice::Voice;
    use orator_base::types::skeleton::{L_ELBOW, L_SHOULDER};
    use rand::SeedableRng;

    /// How far the left elbow is before its shoulder behind a desk, cm: the median over clips.
    fn elbow_ahead(leans: bool) -> f64 {
        let build = Build::ADULT;
        let rig = build.rig();
        let seated = SeatedRig { rig: &rig, seat: Seat::Desk, knees: 0.1, shins: 0.1 };
        let mut ahead: Vec<f64> = (0..60)
            .map(|seed| {
                let speech = Voice::new(seed, 4.0, None).speech;
                let rng = &mut ChaCha8Rng::seed_from_u64(seed);
                let mut acts = Acts::new(&speech, 4.0, (Manner::Free, Seat::Desk), None, rng);
                if leans {
                    acts.carriage = Carriage::sample(rng);
                }
                let torso = seated.torso(&acts.trunk(2.0));
                let free = Obstacles { carriage: acts.carriage, ..Obstacles::default() };
                let joints = free.free(&build, &acts.arms(2.0), &torso);
                torso.world(joints[L_ELBOW])[2] - torso.world(joints[L_SHOULDER])[2]
            })
            .collect();
        ahead.sort_by(f64::total_cmp);
        ahead[30]
    }

    #[test]
    fn elbows_of_who_leans_over_a_desk_are_before_the_shoulders() {
        let (upright, leaning) = (elbow_ahead(false), elbow_ahead(true));
        assert!((-5.0..9.0).contains(&upright) && (10.0..22.0).contains(&leaning), "{upright} {leaning}");
    }
}
