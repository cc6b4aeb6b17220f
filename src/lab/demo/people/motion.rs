//! Procedural motion of a person over a clip, synchronised with the speech: strokes before stressed syllables, beats
//! on them, rests in pauses, nods while listening, gaze and trunk movements. All are smooth functions of time.

use super::body::{ArmPosture, FingerShape};
use super::condition::{GestureStyle, Seat};
use super::vocabulary;
use super::vocabulary::Arms;
use orator_base::math::vec3::Vec3;
use orator_test_support::drawn::gesture::minimum_jerk;
use orator_test_support::drawn::speech::Speech;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Longest pause in seconds in which the hands do not return to rest.
const PAUSE: f64 = 0.45;

/// Posture of trunk and head.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrunkPosture {
    /// Rotation to the person's left, lean forwards, lean to the person's left; radians.
    pub trunk: [f64; 3],
    /// Rotation to the left, nod forwards, tilt to the left, relative to the trunk; radians.
    pub head: [f64; 3],
    /// Shift of the hips to the left, metres.
    pub shift: f64,
}

/// Forward lean that is constant over a clip; all values are 0 for an upright person.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeanStyle {
    /// Forward lean of the trunk in radians that the arms do not follow.
    pub lean: f64,
    /// Downward pitch of the head, radians.
    pub bow: f64,
    /// Forward displacement of the hands relative to an upright person, metres of a body of unit 1.
    pub ahead: f64,
    /// `ArmPosture::forward` of both arms for an upright trunk.
    pub elbows: f64,
}

impl LeanStyle {
    pub fn sample(rng: &mut ChaCha8Rng) -> Self {
        Self {
            lean: rng.random_range(0.04..0.45),
            bow: rng.random_range(0.0..0.4),
            ahead: rng.random_range(0.02..0.2),
            elbows: rng.random_range(0.3..1.6),
        }
    }

    /// Converts a wrist position from the axes of an upright torso to those of the leaning one, and moves it forwards.
    pub fn wrist(&self, [x, down, away]: Vec3) -> Vec3 {
        let (sin, cos) = self.lean.sin_cos();
        let away = away - self.ahead;
        [x, cos * down + sin * away, cos * away - sin * down]
    }

    /// Additional distance of a desk's near edge, metres of a body of unit 1.
    pub fn desk_ahead(&self) -> f64 {
        0.45 * self.lean.sin() + 0.5 * self.ahead
    }
}

/// Transition to `to` that begins at `start` and takes `secs` seconds.
#[derive(Clone, Debug)]
struct MotionTransition<T> {
    start: f64,
    secs: f64,
    to: T,
}

/// Downward dip of hands and head at a stressed syllable.
#[derive(Clone, Debug)]
struct BeatDip {
    at: f64,
    depth: f64,
    /// Relative amplitudes of the left and right hand.
    hands: [f64; 2],
}

/// All procedural movements of a person over a clip.
#[derive(Clone, Debug)]
pub struct ActorMotion {
    begin: Arms,
    arms: Vec<MotionTransition<[Option<ArmPosture>; 2]>>,
    beats: Vec<BeatDip>,
    heads: Vec<MotionTransition<[f64; 3]>>,
    trunks: Vec<MotionTransition<[f64; 3]>>,
    /// Time in seconds and depth of the nods in listening pauses.
    nods: Vec<(f64, f64)>,
    sway: [f64; 6],
    seat: Seat,
    pub lean_style: LeanStyle,
}

/// Planner of the arm movements.
struct ArmPlan<'a> {
    gesture_style: GestureStyle,
    rests: Vec<Arms>,
    /// Index of the rest under the desk, which is left and reached by way of the desk's edge.
    hidden: Option<usize>,
    rest: usize,
    moves: Vec<MotionTransition<[Option<ArmPosture>; 2]>>,
    rng: &'a mut ChaCha8Rng,
}

impl ArmPlan<'_> {
    fn is_hidden(&self) -> bool {
        self.hidden == Some(self.rest)
    }

    fn secs(&mut self) -> f64 {
        match self.gesture_style {
            GestureStyle::Fast => self.rng.random_range(0.15..0.3),
            _ => self.rng.random_range(0.42..0.75),
        }
    }

    /// Adds a gesture; an idle hand goes to its rest.
    fn stroke(&mut self, start: f64) {
        let (goal, secs) = (vocabulary::stroke(self.gesture_style, self.rng), self.secs());
        let start = self.over_edge(start);
        if self.is_hidden() {
            self.rest = (self.rest + 1) % self.rests.len();
        }
        let rest = self.rests[self.rest];
        let to = [0, 1].map(|side| goal[side].or(Some(rest[side])));
        self.moves.push(MotionTransition { start, secs, to });
    }

    fn return_to_rest(&mut self, start: f64) {
        let next = if self.rng.random_bool(0.5) { self.rng.random_range(0..self.rests.len()) } else { self.rest };
        let was_hidden = self.is_hidden();
        let start = if was_hidden && next != self.rest { self.over_edge(start) } else { start };
        let secs = self.secs().max(0.5);
        let comes = !was_hidden && self.hidden == Some(next);
        self.rest = next;
        let start = if comes { self.over(start) } else { start };
        self.moves.push(MotionTransition { start, secs, to: self.rests[next].map(Some) });
    }

    fn over_edge(&mut self, start: f64) -> f64 {
        if self.is_hidden() { self.over(start) } else { start }
    }

    /// Moves both hands over the desk's edge; returns the time at which the next movement may begin.
    fn over(&mut self, start: f64) -> f64 {
        self.moves.push(MotionTransition { start, secs: 0.45, to: vocabulary::over_edge().map(Some) });
        start + 0.36
    }
}

impl ActorMotion {
    /// Plans the movements for a speech of `secs` seconds; `held` is the side and the grip of a hand that holds an
    /// object.
    pub fn new(
        speech: &Speech,
        secs: f64,
        (gesture_style, seat): (GestureStyle, Seat),
        held: Option<(usize, FingerShape)>,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let mut rests = vocabulary::rests(gesture_style, seat, rng);
        let hidden = (seat == Seat::Desk && gesture_style == GestureStyle::Free && rng.random_bool(0.6)).then(|| {
            rests.push(vocabulary::under_desk());
            rests.len() - 1
        });
        let sway = std::array::from_fn(|_| rng.random_range(0.0..TAU));
        let begins_hidden = hidden.filter(|_| rng.random_bool(0.5));
        let first = begins_hidden.unwrap_or_else(|| rng.random_range(0..rests.len()));
        let mut plan = ArmPlan { gesture_style, rests, hidden, rest: first, moves: Vec::new(), rng };
        let mut beats = Vec::new();
        let stroke_probability =
            if gesture_style == GestureStyle::Folded || gesture_style == GestureStyle::Crossing { 0.3 } else { 0.75 };
        let syllables = &speech.syllables;
        for (k, syllable) in syllables.iter().enumerate() {
            if syllable.stress > 0.5 {
                let at = (syllable.start + syllable.end) / 2.0;
                let probability = if gesture_style == GestureStyle::Fast { 0.95 } else { stroke_probability };
                if plan.rng.random_bool(probability) {
                    plan.stroke(syllable.start - 0.3);
                    if gesture_style == GestureStyle::Fast && plan.rng.random_bool(0.6) {
                        plan.stroke(syllable.start + 0.1);
                    }
                    if gesture_style == GestureStyle::Folded {
                        plan.return_to_rest(syllable.start + 0.9);
                    }
                }
                let side = usize::from(plan.rng.random_bool(0.5));
                let mut hands = [1.0; 2];
                if plan.rng.random_bool(0.4) || plan.is_hidden() {
                    hands[side] = 0.2;
                }
                let depth =
                    if gesture_style == GestureStyle::Folded { 0.012 } else { plan.rng.random_range(0.02..0.05) };
                beats.push(BeatDip { at, depth: depth * syllable.stress, hands });
            }
            let gap = syllables.get(k + 1).map_or(secs, |next| next.start) - syllable.end;
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
        let nods = syllables.windows(2).filter(|pair| pair[1].start - pair[0].end > 1.0).flat_map(|pair| {
            let depth = rng.random_range(0.05..0.16);
            [0.35, 0.8].map(|after| (pair[0].end + after, depth))
        });
        let nods = nods.collect();
        let (heads, trunks) = (gaze_moves(secs, rng), trunk_moves(secs, seat, rng));
        Self { begin, arms: moves, beats, heads, trunks, nods, sway, seat, lean_style: LeanStyle::default() }
    }

    /// Posture of the arms at a time.
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
        arms.iter_mut().for_each(|arm| arm.forward = self.lean_style.elbows + self.lean_style.lean);
        arms
    }

    /// Posture of trunk and head at a time.
    pub fn trunk(&self, secs: f64) -> TrunkPosture {
        let reached = |moves: &[MotionTransition<[f64; 3]>]| {
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
                self.lean_style.lean + lean + 0.012 * slow(1, 0.17) + 0.004 * slow(2, 0.27),
                side + still * 0.015 * slow(3, 0.13),
            ],
            head: [
                yaw - 0.4 * turn + 0.02 * slow(4, 0.23),
                nod + dips.sum::<f64>() + nods.sum::<f64>() - 0.5 * lean + self.lean_style.bow - self.lean_style.lean,
                tilt - 0.5 * side + 0.015 * slow(5, 0.19),
            ],
            shift: still * 0.012 * slow(3, 0.13),
        }
    }
}

/// Restricts the posture of a hand that holds an object: in front of the body, thumb up, gripping.
fn hold(posture: &mut ArmPosture, grip: FingerShape) {
    posture.fingers = grip;
    posture.roll = posture.roll.clamp(-0.4, 0.4);
    posture.raise = posture.raise.clamp(0.1, 0.6);
    posture.inwards = posture.inwards.clamp(0.1, 0.4);
    posture.wrist[1] = posture.wrist[1].min(0.3);
    posture.wrist[0] = posture.wrist[0].clamp(0.12, 0.32);
    posture.wrist[2] = posture.wrist[2].min(-0.22);
}

/// Gaze movements: mostly towards the viewer, occasionally up to 45 degrees aside.
fn gaze_moves(secs: f64, rng: &mut ChaCha8Rng) -> Vec<MotionTransition<[f64; 3]>> {
    let mut moves = Vec::new();
    let mut now = rng.random_range(0.0..1.0);
    while now < secs {
        let max_yaw = if rng.random_bool(0.3) { 0.78 } else { 0.2 };
        let to = [rng.random_range(-max_yaw..max_yaw), rng.random_range(-0.14..0.2), rng.random_range(-0.13..0.13)];
        moves.push(MotionTransition { start: now, secs: rng.random_range(0.35..0.7), to });
        now += rng.random_range(0.9..2.4);
    }
    moves
}

/// Slow leans and rotations of the trunk.
fn trunk_moves(secs: f64, seat: Seat, rng: &mut ChaCha8Rng) -> Vec<MotionTransition<[f64; 3]>> {
    let (turn, lean) = match seat {
        Seat::Standing => (0.25, [-0.05, 0.12]),
        Seat::Chair => (0.2, [-0.08, 0.22]),
        Seat::Desk => (0.14, [-0.02, 0.12]),
    };
    let mut moves = Vec::new();
    let mut now = -1.0;
    while now < secs {
        let to = [rng.random_range(-turn..turn), rng.random_range(lean[0]..lean[1]), rng.random_range(-0.07..0.07)];
        moves.push(MotionTransition { start: now, secs: rng.random_range(0.8..1.6), to });
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

    /// Median over clips of the forward distance of the left elbow from its shoulder behind a desk, cm.
    fn elbow_ahead(leans: bool) -> f64 {
        let build = Build::ADULT;
        let rig = build.rig();
        let seated = SeatedRig { rig: &rig, seat: Seat::Desk, knees: 0.1, shins: 0.1 };
        let mut ahead: Vec<f64> = (0..60)
            .map(|seed| {
                let speech = Voice::new(seed, 4.0, None).speech;
                let rng = &mut ChaCha8Rng::seed_from_u64(seed);
                let mut actor_motion = ActorMotion::new(&speech, 4.0, (GestureStyle::Free, Seat::Desk), None, rng);
                if leans {
                    actor_motion.lean_style = LeanStyle::sample(rng);
                }
                let torso = seated.torso(&actor_motion.trunk(2.0));
                let obstacles = Obstacles { lean_style: actor_motion.lean_style, ..Obstacles::default() };
                let joints = obstacles.resolve(&build, &actor_motion.arms(2.0), &torso);
                torso.world(joints[L_ELBOW])[2] - torso.world(joints[L_SHOULDER])[2]
            })
            .collect();
        ahead.sort_by(f64::total_cmp);
        ahead[30]
    }

    #[test]
    fn leaning_over_a_desk_moves_the_elbows_in_front_of_the_shoulders() {
        let (upright, leaning) = (elbow_ahead(false), elbow_ahead(true));
        assert!((-5.0..9.0).contains(&upright) && (10.0..22.0).contains(&leaning), "{upright} {leaning}");
    }
}
