//! Gesture rule of the synthetic speaker: a deterministic function of its speech (the predictable part), plus random
//! variation.

use super::habits::{ArmTarget, CENTRE, HIGH, Habits, POINT, REST, WIDE};
use super::words::{self, N_TARGETS, WordGesture};
use crate::drawn::figure::{ArmControls, Controls, DrawnFigure};
use crate::drawn::gesture::minimum_jerk;
use crate::drawn::speech::{Speech, Syllable};
use ndarray::{Array2, Array3, ArrayView3};
use orator_base::math::vec3::{Vec3, sub};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_WRIST, N_JOINTS, NECK, R_WRIST};
use orator_base::types::time::FrameRate;
use orator_formats::transcript::Word;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// Durations of a stroke, its hold and its return, seconds.
pub const STROKE: f64 = 0.4;
pub const HOLD: f64 = 0.5;
pub const RETURN: f64 = 0.6;
/// Range of delays of the envelope that lifts the wrists, in seconds, and the lift in metres.
const LIFT_DELAYS: [f64; 2] = [0.2, 0.8];
const LIFT: f64 = 0.2;
/// Stress above which a syllable is an accent.
const ACCENT: f64 = 0.5;

/// Delay from the start of a word to its stroke, seconds.
pub const WORD_DELAY: f64 = 0.3;
/// Stroke targets of words.
const WORD_TARGETS: [ArmTarget; N_TARGETS] = [
    [0.34, -0.2, -0.16, 0.3, 0.9, 0.1, 0.0, 0.1],
    [0.52, 0.1, -0.1, -0.5, 0.4, 0.1, 0.0, 0.16],
    [0.44, 0.4, -0.05, 0.7, 0.1, 0.6, -0.2, 0.04],
    [0.02, 0.1, -0.16, 0.9, 0.9, 0.4, 0.0, 0.02],
];

/// Variation: share of skipped accents, rate of strokes without an accent (1/s), standard deviations of a stroke's
/// time (seconds), target (metres) and hand shape, and sway of wrists (metres) and torso (radians) with its
/// frequencies.
const SKIPPED_SHARE: f64 = 0.12;
const SPONTANEOUS_HZ: f64 = 0.12;
const TIME_SD: f64 = 0.06;
const TARGET_SD: f64 = 0.035;
const SHAPE_SD: f64 = 0.1;
const WRIST_SWAY: f64 = 0.012;
const TORSO_SWAY: f64 = 0.03;
const SWAY_HZ: std::ops::Range<f64> = 0.3..1.5;

/// Movement of a hand to `goal`, beginning at `start` and lasting `secs`.
#[derive(Clone, Debug)]
struct WristMove {
    start: f64,
    secs: f64,
    goal: ArmTarget,
}

/// Gestures of the speaker for a speech.
///
/// The speech gives the envelope E(t), 0..1 (`Speech::loudness`), and the accents k: onsets t_k of stressed syllables
/// with peak loudness a_k and vowel v_k, all of them audible. Hand h follows a target x_h(t) of wrist position,
/// rotation and hand shape in body coordinates. With the minimum-jerk profile u, the rest pose REST and TARGETS[v][h],
/// the target of vowel v:
///
/// * stroke: from s = t_k + d_h for 0.4 s, x_h <- x_h + u((t - s) / 0.4) (goal - x_h), goal = REST + g_k
///   (TARGETS[v_k][h] - REST), g_k = 0.45 + 0.4 (a_k - 0.4) / 0.6;
/// * hold for 0.5 s, then return over 0.6 s with goal = REST, unless the next stroke of the hand begins;
/// * lift: both wrists rise by 0.2 m times L(t) = integral of E(t - r) w(r) dr, w a raised cosine over
///   r = 0.2 .. 0.8 s.
///
/// The right hand leads with d = 0.2 s (peak speed 0.4 s after an onset), the left follows with d = 0.4 s (0.6 s);
/// nothing depends on the audio of the current frame.
///
/// A word with a gesture (`words`) that begins at t moves its hand to WORD_TARGETS by a stroke at t + 0.3 s, with hold
/// and return as above; accent strokes of that hand from 0.4 s before it until the end of the hold are dropped.
///
/// Variation, with a separate seed: skipped accents, strokes without an accent, errors of stroke times and targets, and
/// sway of arms and torso.
pub struct RuleGestures<'a> {
    speech: &'a Speech,
    /// Movements of the left and right hand, in order of time.
    moves: [Vec<WristMove>; 2],
    sway: Option<Variation>,
}

/// Frequency (Hz) and phase of two sine waves for each of: left wrist 0..3, right wrist 3..6, torso 6..9.
struct Variation([[[f64; 2]; 2]; 9]);

impl<'a> RuleGestures<'a> {
    /// Predictable part: gestures of the rule for `speech` and the words in it.
    pub fn new(speech: &'a Speech, spoken: &[Word]) -> Self {
        Self::of_habits(&Habits::default(), speech, spoken)
    }

    /// Like `new`, for a speaker with other habits.
    pub fn of_habits(habits: &Habits, speech: &'a Speech, spoken: &[Word]) -> Self {
        let mut strokes: [Vec<(f64, ArmTarget)>; 2] = std::array::from_fn(|hand| {
            let accents = speech.syllables.iter().filter(|syllable| syllable.stress > ACCENT);
            let stroke = accents.filter_map(|accent| {
                let target = habits.targets.get(accent.vowel)?[hand]?;
                Some((accent.start + habits.delays[hand], scaled_target(&target, amplitude(accent))))
            });
            stroke.collect()
        });
        insert_word_strokes(&mut strokes, spoken, |goal| (0.0, *goal));
        Self { speech, moves: strokes.map(with_returns), sway: None }
    }

    /// Gestures of `secs` seconds with random variation.
    pub fn with_variation(speech: &'a Speech, spoken: &[Word], secs: f64, rng: &mut ChaCha8Rng) -> Self {
        Self::varied(&Habits::default(), speech, spoken, secs, rng)
    }

    /// Like `with_variation`, for a speaker with other habits.
    pub fn varied(habits: &Habits, speech: &'a Speech, spoken: &[Word], secs: f64, rng: &mut ChaCha8Rng) -> Self {
        let mut strokes: [Vec<(f64, ArmTarget)>; 2] = Default::default();
        for accent in speech.syllables.iter().filter(|syllable| syllable.stress > ACCENT) {
            let is_skipped = rng.random_bool(SKIPPED_SHARE);
            let late = TIME_SD * standard_normal(rng);
            let amplitude = amplitude(accent) * rng.random_range(0.85..1.15);
            for (hand, target) in habits.targets.get(accent.vowel).into_iter().flatten().enumerate() {
                let Some(target) = target else { continue };
                let goal = perturbed(&scaled_target(target, amplitude), rng);
                if !is_skipped {
                    strokes[hand].push((accent.start + habits.delays[hand] + late, goal));
                }
            }
        }
        let mut now = 0.0;
        loop {
            now -= rng.random_range(f64::EPSILON..1.0).ln() / SPONTANEOUS_HZ;
            if now >= secs {
                break;
            }
            let target = [WIDE, HIGH, POINT, CENTRE][rng.random_range(0..4)];
            let goal = perturbed(&scaled_target(&target, rng.random_range(0.6..1.0)), rng);
            strokes[rng.random_range(0..2)].push((now, goal));
        }
        strokes.iter_mut().for_each(|strokes| strokes.sort_by(|a, b| a.0.total_cmp(&b.0)));
        insert_word_strokes(&mut strokes, spoken, |goal| (TIME_SD * standard_normal(rng), perturbed(goal, rng)));
        let mut wave = || [rng.random_range(SWAY_HZ), rng.random_range(0.0..TAU)];
        let sway = Variation(std::array::from_fn(|_| [wave(), wave()]));
        Self { speech, moves: strokes.map(with_returns), sway: Some(sway) }
    }

    /// Controls of the figure at `secs`.
    pub fn controls(&self, secs: f64) -> Controls {
        let lift = LIFT * self.slow_envelope(secs);
        let sway = |number: usize| self.sway.as_ref().map_or(0.0, |sway| sway.at(number, secs));
        let arm = |hand: usize| {
            let mut position = self.moves[hand].iter().take_while(|m| m.start < secs).fold(REST, |mut position, m| {
                let done = minimum_jerk((secs - m.start) / m.secs);
                position.iter_mut().zip(m.goal).for_each(|(now, goal)| *now += done * (goal - *now));
                position
            });
            position[1] -= lift;
            (0..3).for_each(|k| position[k] += WRIST_SWAY * sway(3 * hand + k));
            ArmControls::from(position)
        };
        let torso = [0, 1, 2].map(|k| TORSO_SWAY * sway(6 + k));
        Controls { arms: [arm(0), arm(1)], torso, ..Controls::default() }
    }

    /// Joints at the frames of `fps`, relative to the neck, metres.
    pub fn motion(&self, n_frames: usize, fps: FrameRate) -> Motion {
        let mut joints = Array3::zeros((n_frames, N_JOINTS, 3));
        for frame_idx in 0..n_frames {
            let figure = DrawnFigure::new(&self.controls(fps.secs(frame_idx)));
            for (joint, &position) in figure.joints.iter().enumerate() {
                let relative = sub(position, figure.joints[NECK]);
                (0..3).for_each(|k| joints[[frame_idx, joint, k]] = relative[k] as f32);
            }
        }
        Motion::from_joints(fps, joints)
    }

    /// Wrist position relative to the neck, metres, at the target of a gesture; the rest of the pose is that of the
    /// rule at `secs`.
    pub fn wrist_at(&self, gesture: WordGesture, secs: f64) -> Vec3 {
        let WordGesture { hand, target } = gesture;
        let mut controls = self.controls(secs);
        let mut target = WORD_TARGETS[target];
        target[1] -= LIFT * self.slow_envelope(secs);
        controls.arms[hand] = ArmControls::from(target);
        let figure = DrawnFigure::new(&controls);
        sub(figure.joints[[L_WRIST, R_WRIST][hand]], figure.joints[NECK])
    }

    /// Lift L(t): delayed and averaged envelope.
    fn slow_envelope(&self, secs: f64) -> f64 {
        const N: usize = 24;
        let [first, last] = LIFT_DELAYS;
        let parts = (0..N).map(|n| {
            let along = (n as f64 + 0.5) / N as f64;
            (1.0 - (TAU * along).cos()) * self.speech.loudness(secs - first - along * (last - first))
        });
        parts.sum::<f64>() / N as f64
    }
}

impl Variation {
    fn at(&self, number: usize, secs: f64) -> f64 {
        self.0[number].iter().map(|[hz, phase]| (TAU * hz * secs + phase).sin()).sum()
    }
}

/// Inserts the strokes of words among those of accents, in order of time. `varied` returns the delay of a stroke and
/// its goal.
fn insert_word_strokes(
    strokes: &mut [Vec<(f64, ArmTarget)>; 2],
    spoken: &[Word],
    mut varied: impl FnMut(&ArmTarget) -> (f64, ArmTarget),
) {
    for word in spoken {
        let Some(WordGesture { hand, target }) = words::gesture(&word.word) else { continue };
        let (late, goal) = varied(&WORD_TARGETS[target]);
        let start = word.start_secs + WORD_DELAY + late;
        strokes[hand].retain(|(other, _)| !(start - STROKE..start + STROKE + HOLD).contains(other));
        let at = strokes[hand].partition_point(|(other, _)| *other < start);
        strokes[hand].insert(at, (start, goal));
    }
}

/// Strokes (start and goal, in order of time) with the return movements between them.
fn with_returns(strokes: Vec<(f64, ArmTarget)>) -> Vec<WristMove> {
    let mut moves = Vec::with_capacity(2 * strokes.len());
    for (n, (start, goal)) in strokes.iter().enumerate() {
        moves.push(WristMove { start: *start, secs: STROKE, goal: *goal });
        let back = start + STROKE + HOLD;
        if strokes.get(n + 1).is_none_or(|next| next.0 > back) {
            moves.push(WristMove { start: back, secs: RETURN, goal: REST });
        }
    }
    moves
}

/// Amplitude g of an accent; louder accents have larger strokes.
fn amplitude(accent: &Syllable) -> f64 {
    0.45 + 0.4 * (accent.peak() - 0.4) / 0.6
}

/// Target at the share `amplitude` of the way from the rest pose to `target`.
fn scaled_target(target: &ArmTarget, amplitude: f64) -> ArmTarget {
    std::array::from_fn(|k| REST[k] + amplitude * (target[k] - REST[k]))
}

fn perturbed(goal: &ArmTarget, rng: &mut ChaCha8Rng) -> ArmTarget {
    std::array::from_fn(|k| goal[k] + if k < 3 { TARGET_SD } else { SHAPE_SD } * standard_normal(rng))
}

fn standard_normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Joints of the left and right wrist.
pub const WRISTS: [usize; 2] = [L_WRIST, R_WRIST];

/// Speed of each wrist between consecutive frames, [T - 1, 2], m/s, unsmoothed.
pub fn wrist_speeds(joints: ArrayView3<f32>, fps: FrameRate) -> Array2<f64> {
    Array2::from_shape_fn((joints.shape()[0].saturating_sub(1), 2), |(t, hand)| {
        let step = |k: usize| f64::from(joints[[t + 1, WRISTS[hand], k]] - joints[[t, WRISTS[hand], k]]);
        (0..3).map(|k| step(k).powi(2)).sum::<f64>().sqrt() * fps.per_sec()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rule::ridge::correlation;
    use ndarray::{Array1, s};
    use rand::SeedableRng;

    const FPS: FrameRate = FrameRate::new(50, 1);
    const SECS: f64 = 120.0;

    fn speech(seed: u64) -> Speech {
        Speech::free(SECS, &mut ChaCha8Rng::seed_from_u64(seed))
    }

    /// Delay in seconds with the largest correlation of a wrist's speed with the onsets of accents (each a bump of 0.1
    /// s).
    fn delay(hand: usize) -> f64 {
        let speech = speech(1);
        let n_frames = FPS.frames_in(SECS);
        let speeds = wrist_speeds(RuleGestures::new(&speech, &[]).motion(n_frames, FPS).joints.view(), FPS);
        let accents =
            speech.syllables.iter().filter(|s| s.stress > ACCENT && Habits::default().targets[s.vowel][hand].is_some());
        let onsets: Vec<f64> = accents.map(|accent| accent.start).collect();
        let at = |delay: f64| {
            let bump = |secs: f64| -> f64 { onsets.iter().map(|t| (-((secs - t - delay) / 0.1).powi(2)).exp()).sum() };
            // A speed belongs to the midpoint between two frames.
            let expected = Array1::from_shape_fn(n_frames - 1, |t| bump(FPS.secs(t) + 0.5 * FPS.secs(1)));
            correlation(expected.view(), speeds.slice(s![.., hand]))
        };
        let delays = (0..60).map(|n| f64::from(n) * 0.02);
        delays.max_by(|a, b| at(*a).total_cmp(&at(*b))).unwrap()
    }

    #[test]
    fn strokes_have_the_delays_of_the_rule() {
        for (hand, expected) in [0.6, 0.4].into_iter().enumerate() {
            let measured = delay(hand);
            assert!((measured - expected).abs() <= 0.04, "hand {hand}: {measured} s");
        }
    }

    #[test]
    fn variation_is_determined_by_the_seed() {
        let speech = speech(2);
        let with = |seed| {
            RuleGestures::with_variation(&speech, &[], SECS, &mut ChaCha8Rng::seed_from_u64(seed))
                .motion(300, FrameRate::new(15, 1))
        };
        assert_eq!(with(1), with(1));
        assert_ne!(with(1), with(2));
        let rule = RuleGestures::new(&speech, &[]).motion(300, FrameRate::new(15, 1));
        assert_ne!(with(1), rule);
        assert_eq!(rule, RuleGestures::new(&speech, &[]).motion(300, FrameRate::new(15, 1)));
    }

    #[test]
    fn bones_are_constant_and_silence_gives_the_rest_pose() {
        let speech = speech(3);
        let rng = &mut ChaCha8Rng::seed_from_u64(3);
        let motion = RuleGestures::with_variation(&speech, &[], SECS, rng).motion(900, FrameRate::new(15, 1));
        let lengths = orator_base::motion::bones::measure(&motion);
        for (t, frame) in motion.joints.outer_iter().enumerate() {
            for joint in 1..N_JOINTS {
                let parent = orator_base::types::skeleton::parent(joint).unwrap();
                let own = (0..3).map(|k| (frame[[joint, k]] - frame[[parent, k]]).powi(2)).sum::<f32>().sqrt();
                assert!((own - lengths[joint - 1]).abs() < 2e-6, "frame {t}, joint {joint}: {own} m");
            }
        }
        let silent = Speech::default();
        let motionless = RuleGestures::new(&silent, &[]).motion(30, FrameRate::new(15, 1));
        assert!(wrist_speeds(motionless.joints.view(), motionless.fps).iter().all(|speed| *speed == 0.0));
    }

    #[test]
    fn a_word_moves_its_hand_to_its_target() {
        let rng = &mut ChaCha8Rng::seed_from_u64(4);
        let speech = Speech::free(SECS, rng);
        let spoken = words::words(&speech, orator_base::types::split::Split::Train, rng);
        let rule = RuleGestures::new(&speech, &spoken);
        let motion = rule.motion(FPS.frames_in(SECS), FPS);
        let mut n = 0;
        for word in spoken.iter().filter(|word| word.end_secs < SECS - 2.0) {
            let Some(gesture) = words::gesture(&word.word) else { continue };
            let t = FPS.frames_in(word.start_secs + WORD_DELAY + STROKE) + 1;
            let wrist = [L_WRIST, R_WRIST][gesture.hand];
            let distance = |target: usize| -> f64 {
                let at = rule.wrist_at(WordGesture { target, ..gesture }, FPS.secs(t));
                (0..3).map(|k| (f64::from(motion.joints[[t, wrist, k]]) - at[k]).powi(2)).sum::<f64>().sqrt()
            };
            let own = distance(gesture.target);
            let others = (0..N_TARGETS).filter(|target| *target != gesture.target).map(distance);
            assert!(own < 0.001 && others.fold(f64::MAX, f64::min) > 0.25, "{word:?}: {own} m");
            n += 1;
        }
        assert!(n > 10, "{n} words");
    }
}
