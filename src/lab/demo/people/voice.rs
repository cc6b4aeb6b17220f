//! Voice of a rendered person: speech of the drawn speaker with another pitch and vocal tract, listening pauses, and
//! the opening of the mouth.

use orator_base::types::sound::Sound;
use orator_test_support::drawn::speech::Speech;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Mean pitch of `Speech`, Hz.
const SPEECH_PITCH: f64 = 115.0;
/// Mouth opening for the vowels of `Speech`: a, e, i, o, u.
const OPENING: [f64; 5] = [1.0, 0.65, 0.35, 0.7, 0.3];
/// Time offsets in seconds over which the opening is averaged: the jaw moves slowly.
const JAW: [f64; 5] = [-0.04, -0.02, 0.0, 0.02, 0.04];
/// Window in seconds of the loudness of captured audio.
const LOUDNESS_SECS: f64 = 0.04;

/// Speech and its sound.
#[derive(Clone, Debug)]
pub struct Voice {
    pub speech: Speech,
    pub sound: Sound,
    /// Whether the sound is a recording that does not belong to `speech`.
    captured: bool,
    chews: bool,
}

impl Voice {
    /// Creates the voice of a seed for `secs` seconds; pitch 90 to 240 Hz, formants proportional to a typical vocal
    /// tract of that pitch. The seed `person`, if given, fixes pitch and formants independently of what is spoken.
    pub fn new(seed: u64, secs: f64, person: Option<u64>) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut speech = if rng.random_bool(0.5) { Speech::new(secs, &mut rng) } else { Speech::free(secs, &mut rng) };
        let tract = |rng: &mut ChaCha8Rng| (rng.random_range(0.0..1.0_f64), rng.random_range(-0.03..0.03));
        let of_speech = tract(&mut rng);
        let (high, shade) = person.map_or(of_speech, |seed| tract(&mut ChaCha8Rng::seed_from_u64(seed)));
        let pitch = 90.0 * (240.0_f64 / 90.0).powf(high);
        let formants = 0.94 + 0.24 * high + shade;
        speech.syllables.iter_mut().for_each(|syllable| syllable.pitch *= pitch / SPEECH_PITCH);
        if secs > 5.0 && rng.random_bool(0.5) {
            let start = rng.random_range(1.5..secs - 2.5);
            let end = start + rng.random_range(1.4..2.4);
            speech.syllables.retain(|syllable| syllable.end < start || syllable.start > end);
            // Phrases refer to removed syllables; they are not used here.
            speech.phrases.clear();
        }
        let sound = speech.sound_of_tract(secs, formants, &mut rng);
        Self { speech, sound, captured: false, chews: rng.random_bool(0.4) }
    }

    /// Voice with a recorded sound, or silent; gestures still follow the speech of the seed.
    pub fn recorded(seed: u64, secs: f64, sound: Option<Sound>) -> Self {
        let silent = Sound { rate: orator_base::types::sound::SAMPLE_RATE, samples: Vec::new() };
        Self { sound: sound.unwrap_or(silent), captured: true, ..Self::new(seed, secs, None) }
    }

    /// Mouth opening while speaking, 0..1.
    pub fn mouth(&self, secs: f64) -> f64 {
        if self.captured {
            return self.loudness(secs);
        }
        let opening = |now: f64| {
            let next = self.speech.syllables.partition_point(|s| s.end <= now);
            let vowel = self.speech.syllables.get(next).map_or(0, |s| s.vowel);
            self.speech.loudness(now) * OPENING[vowel % OPENING.len()]
        };
        JAW.iter().map(|&offset| opening(secs + offset)).sum::<f64>() / JAW.len() as f64
    }

    /// Mouth opening of a silent person, who may chew, 0..1.
    pub fn chewing(&self, secs: f64) -> f64 {
        if self.chews { 0.12 * (TAU * 1.4 * secs).sin().max(0.0) } else { 0.0 }
    }

    /// Loudness relative to the peak of the sound, 0..1.
    fn loudness(&self, secs: f64) -> f64 {
        let rate = f64::from(self.sound.rate);
        let half = (LOUDNESS_SECS / 2.0 * rate) as usize;
        let middle = (secs * rate) as usize;
        let samples = &self.sound.samples;
        let part = samples.get(middle.saturating_sub(half)..(middle + half).min(samples.len())).unwrap_or_default();
        let power = part.iter().map(|s| f64::from(s * s)).sum::<f64>() / part.len().max(1) as f64;
        let peak = samples.iter().fold(1e-6f32, |peak, s| peak.max(s.abs()));
        (2.5 * power.sqrt() / f64::from(peak)).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voices_differ_in_pitch_and_the_mouth_is_shut_in_pauses() {
        let pitch = |seed: u64| Voice::new(seed, 6.0, None).speech.syllables[0].pitch;
        let pitches: Vec<f64> = (0..40).map(pitch).collect();
        let (low, high) =
            (pitches.iter().copied().fold(f64::MAX, f64::min), pitches.iter().copied().fold(0.0, f64::max));
        assert!(low < 110.0 && high > 200.0, "{low} {high}");
        let voice = Voice::new(3, 8.0, None);
        let syllables = &voice.speech.syllables;
        let loud = syllables.iter().max_by(|a, b| a.stress.total_cmp(&b.stress)).unwrap();
        assert!(voice.mouth((loud.start + loud.end) / 2.0) > 0.15);
        for pair in syllables.windows(2).filter(|pair| pair[1].start - pair[0].end > 0.2) {
            assert_eq!(voice.mouth((pair[0].end + pair[1].start) / 2.0), 0.0);
        }
    }
}
