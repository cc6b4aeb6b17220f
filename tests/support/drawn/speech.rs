//! Speech of the synthetic speaker: phrases of syllables with stress and pauses, and their audio, a pulse train
//! through three formant filters with some noise at the onsets.

use orator_base::types::sound::{SAMPLE_RATE, Sound};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// First three formants of five vowels, Hz (Peterson and Barney 1952, men).
const VOWELS: [[f64; 3]; 5] = [
    [730.0, 1090.0, 2440.0],
    [530.0, 1840.0, 2480.0],
    [270.0, 2290.0, 3010.0],
    [570.0, 840.0, 2410.0],
    [300.0, 870.0, 2240.0],
];
const BANDWIDTHS: [f64; 3] = [80.0, 100.0, 140.0];

/// One syllable: times in seconds; `stress` 0..1; `vowel` indexes the table of formants.
#[derive(Clone, Debug)]
pub struct Syllable {
    pub start: f64,
    pub end: f64,
    pub stress: f64,
    pub vowel: usize,
    /// Pitch, Hz.
    pub pitch: f64,
    /// Loudness of its phrase, 0..1.
    pub volume: f64,
}

/// Syllables `first..last` of one breath.
#[derive(Clone, Debug)]
pub struct Phrase {
    pub first: usize,
    pub last: usize,
}

/// Speech of a clip.
#[derive(Clone, Debug, Default)]
pub struct Speech {
    pub syllables: Vec<Syllable>,
    pub phrases: Vec<Phrase>,
}

impl Speech {
    /// Generates phrases that fill `secs` seconds, each followed by a pause.
    pub fn new(secs: f64, rng: &mut ChaCha8Rng) -> Self {
        let stress = |k: i32, _: f64, rng: &mut ChaCha8Rng| match k % 3 {
            1 => rng.random_range(0.7..1.0),
            _ => rng.random_range(0.0..0.35),
        };
        Self::phrases([0.25, secs], 5..13, 0.3..0.9, |_| 1.0, stress, rng)
    }

    /// Generates free speech of `secs` seconds: phrases of any length and loudness, with irregular accents (stress at
    /// least 0.7, all others at most 0.2) that are at least half a second apart.
    pub fn free(secs: f64, rng: &mut ChaCha8Rng) -> Self {
        let (start, mut last_accent) = (rng.random_range(0.2..0.8), f64::NEG_INFINITY);
        let stress = |_: i32, now: f64, rng: &mut ChaCha8Rng| {
            if now - last_accent > 0.5 && rng.random_bool(0.4) {
                last_accent = now;
                return rng.random_range(0.7..1.0);
            }
            rng.random_range(0.0..0.2)
        };
        Self::phrases([start, secs], 5..22, 0.3..1.5, |rng| rng.random_range(0.7..1.0), stress, rng)
    }

    /// Generates phrases in a time range from ranges of the number of syllables and of the pause in seconds, the
    /// volume of a phrase, and the stress of its syllable `k` at a time.
    fn phrases(
        [mut now, secs]: [f64; 2],
        counts: Range<i32>,
        pauses: Range<f64>,
        volume: impl Fn(&mut ChaCha8Rng) -> f64,
        mut stress: impl FnMut(i32, f64, &mut ChaCha8Rng) -> f64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let mut speech = Self::default();
        while now < secs - 0.5 {
            let first = speech.syllables.len();
            let (count, volume) = (rng.random_range(counts.clone()), volume(rng));
            let base = rng.random_range(105.0..125.0);
            for k in 0..count {
                let stress = stress(k, now, rng);
                let length = rng.random_range(0.13..0.2) + 0.08 * stress;
                if now + length > secs - 0.1 {
                    break;
                }
                let pitch = base * (1.0 - 0.2 * f64::from(k) / f64::from(count)) * (1.0 + 0.18 * stress);
                let vowel = rng.random_range(0..VOWELS.len());
                speech.syllables.push(Syllable { start: now, end: now + length, stress, vowel, pitch, volume });
                now += length + 0.02;
            }
            speech.phrases.push(Phrase { first, last: speech.syllables.len() });
            now += rng.random_range(pauses.clone());
        }
        speech
    }

    /// Loudness of the voice at `secs`, 0..1; also the opening of the mouth.
    pub fn loudness(&self, secs: f64) -> f64 {
        let next = self.syllables.partition_point(|s| s.end <= secs);
        self.syllables.get(next).filter(|s| s.start <= secs).map_or(0.0, |s| s.loudness(secs))
    }

    /// Audio of `secs` seconds.
    pub fn sound(&self, secs: f64, rng: &mut ChaCha8Rng) -> Sound {
        self.sound_of_tract(secs, 1.0, rng)
    }

    /// Audio of `secs` seconds by a vocal tract whose formants are scaled by `formants`.
    pub fn sound_of_tract(&self, secs: f64, formants: f64, rng: &mut ChaCha8Rng) -> Sound {
        let rate = f64::from(SAMPLE_RATE);
        let mut samples = vec![0.0f32; (secs * rate).round().max(0.0) as usize];
        for syllable in &self.syllables {
            let mut voice = VoiceSource::new(syllable, formants, rate);
            let (start, end) = ((syllable.start * rate) as usize, (syllable.end * rate) as usize);
            for n in start..end.min(samples.len()) {
                let now = n as f64 / rate;
                let hiss = rng.random_range(-1.0..1.0) * (-(now - syllable.start) / 0.015).exp();
                let sound = voice.next(rate) + 0.25 * hiss;
                samples[n] = (0.3 * sound * syllable.loudness(now)) as f32;
            }
        }
        let peak = samples.iter().fold(1e-6f32, |peak, s| peak.max(s.abs()));
        samples.iter_mut().for_each(|s| *s *= 0.6 / peak);
        Sound { rate: SAMPLE_RATE, samples }
    }
}

impl Syllable {
    /// Largest loudness of the syllable, 0..1.
    pub fn peak(&self) -> f64 {
        (0.45 + 0.55 * self.stress) * self.volume
    }

    fn loudness(&self, secs: f64) -> f64 {
        let along = ((secs - self.start) / (self.end - self.start)).clamp(0.0, 1.0);
        self.peak() * (PI * along).sin().powf(0.6)
    }
}

/// Glottal pulses through three resonators in series.
struct VoiceSource {
    phase: f64,
    pitch: f64,
    formants: [Resonator; 3],
}

impl VoiceSource {
    fn new(syllable: &Syllable, factor: f64, rate: f64) -> Self {
        let formants = std::array::from_fn(|k| Resonator::new(factor * VOWELS[syllable.vowel][k], BANDWIDTHS[k], rate));
        Self { phase: 0.0, pitch: syllable.pitch, formants }
    }

    fn next(&mut self, rate: f64) -> f64 {
        self.phase += self.pitch / rate;
        // Rounded sawtooth: the glottal flow rises slowly and stops abruptly.
        self.phase -= self.phase.floor();
        let flow = self.phase - (self.phase / 0.95).powi(12);
        self.formants.iter_mut().fold(flow - 0.45, |sound, formant| formant.next(sound))
    }
}

/// A two-pole resonator with unit gain at 0 Hz (Klatt 1980, section I.A).
struct Resonator {
    a: f64,
    b: f64,
    c: f64,
    last: [f64; 2],
}

impl Resonator {
    fn new(hz: f64, bandwidth: f64, rate: f64) -> Self {
        let radius = (-PI * bandwidth / rate).exp();
        let (b, c) = (2.0 * radius * (TAU * hz / rate).cos(), -radius * radius);
        Self { a: 1.0 - b - c, b, c, last: [0.0; 2] }
    }

    fn next(&mut self, sound: f64) -> f64 {
        let out = self.a * sound + self.b * self.last[0] + self.c * self.last[1];
        self.last = [out, self.last[0]];
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn audio_is_loud_in_syllables_and_silent_in_pauses() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let speech = Speech::new(8.0, &mut rng);
        let sound = speech.sound(8.0, &mut rng);
        assert_eq!(sound.samples.len(), 8 * SAMPLE_RATE as usize);
        assert!(sound.samples.iter().all(|s| s.is_finite() && s.abs() <= 0.61));
        let rms = |from: f64, to: f64| {
            let part = &sound.samples[(from * 16e3) as usize..(to * 16e3) as usize];
            (part.iter().map(|s| s * s).sum::<f32>() / part.len() as f32).sqrt()
        };
        for pair in speech.phrases.windows(2) {
            let (end, start) = (speech.syllables[pair[0].last - 1].end, speech.syllables[pair[1].first].start);
            assert_eq!(rms(end + 0.01, start - 0.01), 0.0);
        }
        let stressed = speech.syllables.iter().find(|s| s.stress > 0.6).unwrap();
        assert!(rms(stressed.start, stressed.end) > 0.05);
    }
}
