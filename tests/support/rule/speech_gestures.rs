//! The second rule, for arbitrary speech with word times; it shares only the figure with `rule`.

use super::habits::ArmTarget;
use super::speech_events::SpeechEvents;
use crate::drawn::figure::{ArmControls, Controls, DrawnFigure};
use crate::drawn::gesture::minimum_jerk;
use ndarray::Array3;
use orator_base::math::vec3::{Vec3, sub};
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::skeleton::{L_WRIST, N_JOINTS, NECK};
use orator_base::types::time::FrameRate;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::{PI, TAU};

/// Rest pose of the left and right hand: out, down, away (metres), roll, raise, curl, index, spread.
const REST: [ArmTarget; 2] =
    [[0.18, 0.34, -0.2, 0.8, 0.3, 0.4, 0.0, 0.05], [0.2, 0.28, -0.24, 0.2, 0.6, 0.5, 0.0, 0.05]];
/// Stroke targets of words, for the left hand.
const TARGETS: [ArmTarget; 4] = [
    [0.4, 0.0, -0.2, 0.3, 0.9, 0.1, 0.0, 0.14],
    [0.06, -0.02, -0.3, 0.8, 0.9, 0.3, 0.0, 0.05],
    [0.44, 0.3, -0.1, -0.4, 0.4, 0.1, 0.0, 0.14],
    [0.08, 0.22, -0.38, 0.5, 0.4, 0.7, -0.6, 0.03],
];

/// Delay from a word to its stroke, and durations of stroke, hold and return, seconds.
pub const WORD_DELAY: f64 = 0.45;
pub const STROKE: f64 = 0.45;
const HOLD: f64 = 0.4;
const RETURN: f64 = 0.7;
/// Delay from the peak of a loud syllable to its beat, durations of the downward and upward movement, seconds; depth
/// in metres for a syllable at the loud level.
const BEAT_DELAY: f64 = 0.28;
const BEAT_DOWN: f64 = 0.15;
const BEAT_BACK: f64 = 0.3;
const BEAT_DEPTH: f64 = 0.1;
/// Delays from the start of a phrase to the start of its arc, and from its end to the lowering of the hand; durations
/// of raising and lowering; duration of the sweep to the side and back (all in seconds); width of the sweep and height
/// of the arc in metres.
const ARC_DELAY: [f64; 2] = [0.25, 0.15];
const ARC_UP: f64 = 0.8;
const ARC_DOWN: f64 = 0.9;
const SWEEP_SECS: f64 = 3.0;
const SWEEP: f64 = 0.16;
const RISE: f64 = 0.1;
/// Nod of the head after a loud syllable in radians, its delay in seconds, and the turn of the head during a phrase in
/// radians.
const NOD: f64 = 0.1;
const NOD_DELAY: f64 = 0.12;
const TURN: f64 = 0.15;

/// Variation: share of skipped beats and words, standard deviations of times (seconds), beat depth (relative) and
/// targets (metres), and sway of the wrists (metres) with its frequencies.
const SKIPPED_SHARE: f64 = 0.1;
const TIME_SD: f64 = 0.05;
const DEPTH_SD: f64 = 0.2;
const TARGET_SD: f64 = 0.03;
const WRIST_SWAY: f64 = 0.01;
const SWAY_HZ: std::ops::Range<f64> = 0.2..1.2;

/// Gestures of the second rule for the events of a speech.
///
/// * right hand: a beat of 0.1 m x height at 0.28 s after the peak of each loud syllable (down in 0.15 s, back in
///   0.3 s), on an arc over the duration of the phrase: up by 0.1 m within 0.8 s, to the side and back in 3 s, down at
///   its end;
/// * left hand: to one of four targets at 0.45 s after the start of a word of `speech_events::WORDS`, with hold and return;
/// * head: a nod after each loud syllable, a turn with the arc.
pub struct SpeechGestures {
    events: SpeechEvents,
    /// Start, duration (seconds) and goal of the movements of the left hand.
    moves: Vec<(f64, f64, ArmTarget)>,
    /// Frequency (Hz) and phase for three axes of the left and right wrist.
    sway: Option<[[f64; 2]; 6]>,
}

impl SpeechGestures {
    /// Predictable part: the rule without variation.
    pub fn new(events: &SpeechEvents) -> Self {
        let strokes = events.words.iter().map(|(at, target_idx)| (at + WORD_DELAY, TARGETS[*target_idx]));
        Self { events: events.clone(), moves: with_returns(strokes.collect()), sway: None }
    }

    /// The rule with random variation.
    pub fn varied(events: &SpeechEvents, rng: &mut ChaCha8Rng) -> Self {
        let normal = |rng: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(rng) };
        let mut varied_events = SpeechEvents { phrases: events.phrases.clone(), ..SpeechEvents::default() };
        for (at, height) in &events.beats {
            let (is_skipped, delay, depth) = (rng.random_bool(SKIPPED_SHARE), normal(rng), normal(rng));
            if !is_skipped {
                varied_events.beats.push((at + TIME_SD * delay, height * (1.0 + DEPTH_SD * depth).max(0.2)));
            }
        }
        let mut strokes = Vec::new();
        for (at, target_idx) in &events.words {
            let (is_skipped, delay) = (rng.random_bool(SKIPPED_SHARE), normal(rng));
            let goal = std::array::from_fn(|k| {
                TARGETS[*target_idx][k] + if k < 3 { TARGET_SD } else { 2.0 * TARGET_SD } * normal(rng)
            });
            if !is_skipped {
                strokes.push((at + WORD_DELAY + TIME_SD * delay, goal));
            }
        }
        let sway = std::array::from_fn(|_| [rng.random_range(SWAY_HZ), rng.random_range(0.0..TAU)]);
        Self { events: varied_events, moves: with_returns(strokes), sway: Some(sway) }
    }

    fn controls(&self, secs: f64) -> Controls {
        let mut left = REST[0];
        for (start, lasts, goal) in self.moves.iter().take_while(|(start, ..)| *start < secs) {
            let done = minimum_jerk((secs - start) / lasts);
            left.iter_mut().zip(goal).for_each(|(now, goal)| *now += done * (goal - *now));
        }
        let mut right = REST[1];
        let (up, swept) = self.arc(secs);
        right[0] += SWEEP * up * swept;
        right[1] -= RISE * up;
        let beat = self.pulses(secs, BEAT_DELAY);
        right[1] += BEAT_DEPTH * beat;
        right[4] -= 0.8 * beat;
        if let Some(sway) = &self.sway {
            let at = |k: usize| WRIST_SWAY * (TAU * sway[k][0] * secs + sway[k][1]).sin();
            (0..3).for_each(|k| {
                left[k] += at(k);
                right[k] += at(3 + k);
            });
        }
        Controls { arms: [ArmControls::from(left), ArmControls::from(right)], ..Controls::default() }
    }

    /// Wrist position relative to the neck, metres, of the left hand at a target of the words; the rest of the pose is that
    /// of the rule at `secs`.
    pub fn wrist_at(&self, target: usize, secs: f64) -> Vec3 {
        let mut controls = self.controls(secs);
        controls.arms[0] = ArmControls::from(TARGETS[target]);
        let figure = DrawnFigure::new(&controls);
        sub(figure.joints[L_WRIST], figure.joints[NECK])
    }

    /// Height of the hand in its arc, 0..1, and position in the sweep, 0..1.
    fn arc(&self, secs: f64) -> (f64, f64) {
        let of_phrase = |[start, end]: &[f64; 2]| {
            let up = minimum_jerk((secs - start - ARC_DELAY[0]) / ARC_UP);
            let down = minimum_jerk((secs - end - ARC_DELAY[1]) / ARC_DOWN);
            let along = ((secs - start - ARC_DELAY[0]) / SWEEP_SECS).clamp(0.0, 1.0);
            (up * (1.0 - down), (PI * along).sin().max(0.0))
        };
        let is_near = |phrase: &&[f64; 2]| phrase[0] < secs && secs < phrase[1] + ARC_DELAY[1] + ARC_DOWN;
        let phrases = self.events.phrases.iter().filter(is_near).map(of_phrase);
        phrases.fold((0.0, 0.0), |most, phrase| (f64::max(most.0, phrase.0), f64::max(most.1, phrase.1)))
    }

    /// Sum of the pulses at `delay` after the loud syllables.
    fn pulses(&self, secs: f64, delay: f64) -> f64 {
        let of_beat = |(at, height): &(f64, f64)| {
            let since = secs - at - delay;
            let pulse = minimum_jerk(since / BEAT_DOWN) * (1.0 - minimum_jerk((since - BEAT_DOWN) / BEAT_BACK));
            height * pulse
        };
        self.events.beats.iter().filter(|beat| (beat.0 - secs).abs() < 2.0).map(of_beat).sum()
    }

    /// Joints at the frames of `fps`, relative to the neck, metres.
    pub fn motion(&self, n_frames: usize, fps: FrameRate) -> Motion {
        let mut joints = Array3::zeros((n_frames, N_JOINTS, 3));
        for t in 0..n_frames {
            let figure = DrawnFigure::new(&self.controls(fps.secs(t)));
            for (joint, position) in figure.joints.iter().enumerate() {
                let relative = sub(*position, figure.joints[NECK]);
                (0..3).for_each(|k| joints[[t, joint, k]] = relative[k] as f32);
            }
        }
        Motion::from_joints(fps, joints)
    }

    /// Head angles at the frames of `fps`, radians; the trunk stays upright.
    pub fn posture(&self, n_frames: usize, fps: FrameRate) -> Posture {
        let mut posture = Posture::missing(n_frames);
        posture.trunk.fill(0.0);
        posture.head.fill(0.0);
        for t in 0..n_frames {
            let secs = fps.secs(t);
            let (up, swept) = self.arc(secs);
            posture.head[[t, 0]] = (TURN * up * swept) as f32;
            posture.head[[t, 1]] = (NOD * self.pulses(secs, NOD_DELAY)) as f32;
        }
        posture
    }
}

/// Strokes in order of time, each followed by its return movement unless the next one starts earlier.
fn with_returns(strokes: Vec<(f64, ArmTarget)>) -> Vec<(f64, f64, ArmTarget)> {
    let mut moves = Vec::with_capacity(2 * strokes.len());
    for (n, (start, goal)) in strokes.iter().enumerate() {
        moves.push((*start, STROKE, *goal));
        let back = start + STROKE + HOLD;
        if strokes.get(n + 1).is_none_or(|next| next.0 > back) {
            moves.push((back, RETURN, REST[0]));
        }
    }
    moves
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::types::skeleton::R_WRIST;
    use rand::SeedableRng;

    const FPS: FrameRate = FrameRate::new(50, 1);

    fn events() -> SpeechEvents {
        SpeechEvents { beats: vec![(2.0, 1.0)], phrases: vec![[1.0, 5.0]], words: vec![(8.0, 1)] }
    }

    #[test]
    fn gestures_follow_the_rule() {
        let motion = SpeechGestures::new(&events()).motion(FPS.frames_in(12.0), FPS);
        let at = |joint: usize, secs: f64, k: usize| motion.joints[[FPS.frames_in(secs), joint, k]];
        // Nothing moves before the phrase; the left hand waits for its word.
        assert_eq!(at(R_WRIST, 1.2, 1), at(R_WRIST, 0.0, 1));
        assert_eq!(at(L_WRIST, 8.4, 0), at(L_WRIST, 0.0, 0));
        // At the end of its stroke the left hand is at its target: 0.06 m out, above the neck.
        assert!((at(L_WRIST, 8.92, 0) - 0.06).abs() < 0.01, "{}", at(L_WRIST, 8.92, 0));
        assert!((at(L_WRIST, 8.92, 1) + 0.02).abs() < 0.01, "{}", at(L_WRIST, 8.92, 1));
        assert!((at(L_WRIST, 11.5, 1) - 0.34).abs() < 0.005);
        // The beat is lowest 0.28 + 0.15 s after the loud syllable.
        let low = (100..150).max_by(|a, b| motion.joints[[*a, R_WRIST, 1]].total_cmp(&motion.joints[[*b, R_WRIST, 1]]));
        assert!((FPS.secs(low.unwrap()) - 2.43).abs() < 0.05, "{low:?}");
        // The hand is raised and to the side during the phrase, and lowered after it.
        assert!(at(R_WRIST, 4.0, 1) < at(R_WRIST, 0.0, 1) - 0.05 && at(R_WRIST, 3.0, 0) < at(R_WRIST, 0.0, 0) - 0.05);
        assert!((at(R_WRIST, 6.5, 1) - at(R_WRIST, 0.0, 1)).abs() < 1e-6);
        let posture = SpeechGestures::new(&events()).posture(FPS.frames_in(12.0), FPS);
        assert!(posture.head[[FPS.frames_in(2.27), 1]] > 0.09 && posture.head[[FPS.frames_in(9.0), 1]] == 0.0);
    }

    #[test]
    fn variation_is_determined_by_the_seed() {
        let varied = |seed| SpeechGestures::varied(&events(), &mut ChaCha8Rng::seed_from_u64(seed)).motion(600, FPS);
        assert!(varied(1) == varied(1) && varied(1) != varied(2));
        assert_ne!(varied(1), SpeechGestures::new(&events()).motion(600, FPS));
        assert!(varied(3).joints.iter().all(|v| v.is_finite()));
    }
}
