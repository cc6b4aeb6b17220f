//! Gestures for speech: each phrase has strokes to new positions in front of the body, each stressed syllable a beat
//! of hands and head, each longer pause a rest. Controls are smooth functions of time.

use super::figure::{ArmControls, Controls, N_ARM};
use super::speech::Speech;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

/// Rest pose: hands folded low in front of the body.
const REST: [f64; N_ARM] = [0.17, 0.35, -0.19, 0.6, 0.45, 0.35, 0.0, 0.06];

/// Movement of the arms to `arms`, beginning at `start` and lasting `secs`.
#[derive(Clone, Debug)]
struct Stroke {
    start: f64,
    secs: f64,
    arms: [[f64; N_ARM]; 2],
    /// Turn, nod, tilt of the head, radians.
    head: [f64; 3],
}

/// Short downward movement of hands and head around a stressed syllable.
#[derive(Clone, Debug)]
struct BeatGesture {
    at: f64,
    depth: f64,
    /// Share of the depth for the left and right hand.
    hands: [f64; 2],
}

/// Gestures of a clip.
#[derive(Clone, Debug)]
pub struct DrawnGestures {
    strokes: Vec<Stroke>,
    beats: Vec<BeatGesture>,
    /// Phases of the slow sway.
    sway: [f64; 4],
}

impl DrawnGestures {
    /// Generates the strokes and beats of a speech.
    pub fn new(speech: &Speech, rng: &mut ChaCha8Rng) -> Self {
        let sway = std::array::from_fn(|_| rng.random_range(0.0..2.0 * PI));
        let mut gestures = Self { strokes: Vec::new(), beats: Vec::new(), sway };
        for (number, phrase) in speech.phrases.iter().enumerate() {
            let phrase_syllables = &speech.syllables[phrase.first..phrase.last];
            for (k, syllable) in phrase_syllables.iter().enumerate().filter(|(_, s)| s.stress > 0.5) {
                let one_handed = rng.random_range(0.0..1.0) < 0.35;
                let side = usize::from(rng.random_range(0.0..1.0) < 0.5);
                if k < 3 || rng.random_range(0.0..1.0) < 0.5 {
                    gestures.stroke(syllable.start - 0.3, one_handed.then_some(side), rng);
                }
                let mut hands = [1.0; 2];
                if one_handed {
                    hands[1 - side] = 0.25;
                }
                let depth = rng.random_range(0.02..0.045) * syllable.stress;
                gestures.beats.push(BeatGesture { at: (syllable.start + syllable.end) / 2.0, depth, hands });
            }
            let (Some(end), next) = (phrase_syllables.last().map(|s| s.end), speech.phrases.get(number + 1)) else {
                continue;
            };
            if next.is_none_or(|next| speech.syllables.get(next.first).is_none_or(|s| s.start - end > 0.6)) {
                gestures.strokes.push(Stroke { start: end, secs: 0.8, arms: [REST; 2], head: [0.0; 3] });
            }
        }
        gestures
    }

    /// Adds a stroke to a new position of both hands, or of one hand while the other rests.
    fn stroke(&mut self, start: f64, only: Option<usize>, rng: &mut ChaCha8Rng) {
        let position = |rng: &mut ChaCha8Rng| -> [f64; N_ARM] {
            [
                rng.random_range(0.16..0.3),
                rng.random_range(0.12..0.36),
                rng.random_range(-0.28..-0.15),
                rng.random_range(-0.5..1.0),
                rng.random_range(0.5..1.0),
                rng.random_range(0.05..0.5),
                rng.random_range(-0.2..0.1),
                rng.random_range(0.04..0.16),
            ]
        };
        let first = position(rng);
        // Two-handed gestures are usually nearly symmetric.
        let second = std::array::from_fn(|k| 0.85 * first[k] + 0.15 * REST[k]);
        let mut arms = if rng.random_range(0.0..1.0) < 0.6 { [first, second] } else { [first, position(rng)] };
        if let Some(side) = only {
            arms[1 - side] = REST;
        }
        let head = [rng.random_range(-0.18..0.18), rng.random_range(-0.05..0.08), rng.random_range(-0.07..0.07)];
        self.strokes.push(Stroke { start, secs: rng.random_range(0.5..0.75), arms, head });
    }

    /// Controls at `secs`.
    pub fn controls(&self, secs: f64) -> Controls {
        let mut arms = [REST; 2];
        let mut head = [0.0; 3];
        for stroke in self.strokes.iter().take_while(|stroke| stroke.start < secs) {
            let done = minimum_jerk((secs - stroke.start) / stroke.secs);
            for (now, goal) in arms.as_flattened_mut().iter_mut().zip(stroke.arms.as_flattened()) {
                *now += done * (goal - *now);
            }
            for (now, goal) in head.iter_mut().zip(stroke.head) {
                *now += done * (goal - *now);
            }
        }
        for beat in &self.beats {
            let dip = beat.depth * (-((secs - beat.at) / 0.11).powi(2)).exp();
            for (arm, share) in arms.iter_mut().zip(beat.hands) {
                arm[1] += share * dip;
                arm[4] -= 4.0 * share * dip;
            }
            head[1] -= 2.2 * dip;
        }
        let slow = |k: usize, hz: f64| (2.0 * PI * hz * secs + self.sway[k]).sin();
        Controls {
            arms: arms.map(ArmControls::from),
            torso: [0.06 * slow(0, 0.11), 0.02 * slow(1, 0.17) - 0.02, 0.015 * slow(2, 0.13)],
            head,
            neck: [0.015 * slow(2, 0.13), 0.004 * slow(3, 0.24), 0.012 * slow(1, 0.17)],
        }
    }
}

/// Minimum-jerk profile from 0 to 1 (Flash and Hogan 1985).
pub fn minimum_jerk(along: f64) -> f64 {
    let u = along.clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn::figure::DrawnFigure;
    use orator_base::math::vec3::{norm, sub};
    use orator_base::types::skeleton::{L_WRIST, R_WRIST};
    use rand::SeedableRng;

    #[test]
    fn hand_speeds_are_realistic_and_hands_stay_separated() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let speech = Speech::new(20.0, &mut rng);
        let gestures = DrawnGestures::new(&speech, &mut rng);
        let figures: Vec<DrawnFigure> =
            (0..600).map(|n| DrawnFigure::new(&gestures.controls(f64::from(n) / 30.0))).collect();
        let mut path_length = 0.0;
        for pair in figures.windows(2) {
            let step = norm(sub(pair[1].joints[R_WRIST], pair[0].joints[R_WRIST]));
            assert!(step < 0.06, "a wrist moved {step} m in a frame");
            path_length += step;
        }
        let mean_speed = path_length / 20.0;
        assert!((0.05..0.6).contains(&mean_speed), "{mean_speed} m/s");
        assert!(figures.iter().all(|f| norm(sub(f.joints[L_WRIST], f.joints[R_WRIST])) > 0.2));
    }
}
