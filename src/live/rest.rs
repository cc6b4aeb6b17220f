//! Blend of the generated motion with the rest pose: in silence the speaker comes to rest, and begins to move when speech
//! is ahead. During speech, and in pauses of less than a second, the motion is that of the network.

use orator_avatar::animate::solve::track::smoothstep;
use orator_base::types::sound::SAMPLE_RATE;
use std::collections::VecDeque;

/// Length of a pause after which the speaker comes to rest, and the time that this takes.
const HOLD_SECS: f64 = 1.0;
const FALL_SECS: f64 = 0.8;
/// Time before speech at which the motion begins, if the network looks that far ahead, and the time until it is complete.
const LEAD_SECS: f64 = 0.4;
const RISE_SECS: f64 = 0.3;
/// Level of speech above that of the background, dB, and the range of this threshold in dB of full scale.
const ABOVE_BACKGROUND_DB: f64 = 12.0;
const THRESHOLD_DB: [f64; 2] = [-50.0, -30.0];
/// Rise of the estimated level of the background, dB per second.
const BACKGROUND_RISE_DB: f64 = 1.0;

pub struct RestBlend {
    n_samples: usize,
    background_db: f64,
    /// Times of the pieces with speech that can still count, in seconds.
    speech: VecDeque<f64>,
    weight: f64,
}

impl RestBlend {
    pub fn new() -> Self {
        Self { n_samples: 0, background_db: f64::MAX, speech: VecDeque::new(), weight: 0.0 }
    }

    /// Adds the next piece of sound (16 kHz), about 20 ms.
    pub fn push(&mut self, piece: &[f32]) {
        let power = piece.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / piece.len().max(1) as f64;
        let level = 10.0 * (power + 1e-10).log10();
        // Inserted silence says nothing about the background.
        if power > 0.0 {
            let secs = piece.len() as f64 / f64::from(SAMPLE_RATE);
            self.background_db = level.min(self.background_db + BACKGROUND_RISE_DB * secs);
        }
        let [low, high] = THRESHOLD_DB;
        if level > (self.background_db + ABOVE_BACKGROUND_DB).clamp(low, high) {
            self.speech.push_back(self.n_samples as f64 / f64::from(SAMPLE_RATE));
        }
        self.n_samples += piece.len();
    }

    /// Weight 0 (rest pose) to 1 (generated motion) of the pose at `secs`, `step` seconds after the one before.
    pub fn weight(&mut self, secs: f64, step: f64) -> f32 {
        while self.speech.front().is_some_and(|at| *at < secs - HOLD_SECS) {
            self.speech.pop_front();
        }
        let is_speech = self.speech.front().is_some_and(|at| *at < secs + LEAD_SECS);
        let change = if is_speech { step / RISE_SECS } else { -step / FALL_SECS };
        self.weight = (self.weight + change).clamp(0.0, 1.0);
        smoothstep([0.0, 1.0], self.weight) as f32
    }
}
