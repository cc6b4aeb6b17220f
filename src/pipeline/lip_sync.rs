//! Audio-visual synchrony: probability that the voice belongs to the visible mouth, and offset between audio and video.
//! The lip opening and the openness of the voice, both high-pass filtered, are compared over a range of lags.

use orator_base::audio::openness::Openness;
use orator_base::types::sound::SoundOffset;
use orator_base::types::time::FrameRate;

/// Number of lags on either side of zero, in steps of `LAG_STEP_SECS`.
const N_LAGS: i32 = 22;
const LAG_STEP_SECS: f64 = 1.0 / 30.0;
/// Delay of the voice after the lips in seconds: the mean over clips of talking people.
const VOICE_DELAY_SECS: f64 = 0.025;
/// Window of the moving average that is subtracted, in seconds: removes head rotation and the loudness of a sentence.
const HIGH_PASS_SECS: f64 = 0.7;
/// Added to the lip opening before its logarithm, so that closed-mouth frames do not dominate.
const LOG_OFFSET: f32 = 0.1;
/// Window around a frame in seconds, and the least share of its frames in which mouth and speech must be known.
const WINDOW_SECS: f64 = 8.0;
const MIN_KNOWN_SHARE: f64 = 0.75;
/// Least duration of known frames, in seconds, for the offset of a complete video.
const MIN_KNOWN_SECS: f64 = 3.0;
/// Standard deviation of the log opening below which the score is reduced: correlation of nearly static lips is chance.
const MIN_LIP_DEVIATION: f64 = 0.06;
/// Correlation of lips and own voice that is tested against 0, the correlation with unrelated voices.
const OWN_CORRELATION: f64 = 0.25;
/// Independent samples per second, at most one a frame: unrelated pairs correlate by 1 / sqrt(9 * seconds).
const INDEPENDENT_PER_SEC: f64 = 9.0;
/// Limit of the normalised signals in standard deviations.
const MAX_DEVIATIONS: f64 = 3.0;
/// Probability of the own voice before any comparison, and changes between own and other voice per second.
const PRIOR: f64 = 0.3;
const CHANGES_PER_SEC: f64 = 0.01;
/// The prior probability of a lag decreases by a factor of e per this many seconds.
const LAG_SPREAD_SECS: f64 = 0.1;
/// Least speech probability of a frame with speech, or loudness in dB where that probability is unknown.
const SPEECH_SHARE: f32 = 0.4;
const SPEECH_DB: f32 = -50.0;

/// Result of comparing lips and voice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LipSync {
    /// Probability that the voice is that of the visible mouth, 0..1, [T]; NaN where mouth or speech is long unknown.
    pub score: Vec<f32>,
    /// Offset of the complete video; `None` if too few frames could be compared.
    pub offset: Option<SoundOffset>,
}

/// Whether a frame contains speech: by the share of speech around it, 0..1, or by loudness in dB if the share is NaN.
pub fn is_speech(share: f32, sound_db: f32) -> bool {
    if share.is_nan() { sound_db >= SPEECH_DB } else { share >= SPEECH_SHARE }
}

/// Compares the lip opening at `time_secs` (NaN: not visible) with `voice`, over the frames that contain speech.
pub fn compare(opening: &[f32], time_secs: &[f64], is_speech: &[bool], voice: &Openness, fps: FrameRate) -> LipSync {
    let matched = LipVoiceMatch::new(opening, time_secs, is_speech, voice, fps);
    LipSync { score: matched.own_voice(), offset: matched.offset() }
}

/// Correlation sums of lips and voice for every lag.
pub struct LipVoiceMatch {
    /// Lag in seconds, and prefix sums over the frames at that lag.
    lags: Vec<(f64, PairSums)>,
    n_frames: usize,
    fps: FrameRate,
}

impl LipVoiceMatch {
    /// Takes the arguments of `compare`.
    pub fn new(opening: &[f32], time_secs: &[f64], is_speech: &[bool], voice: &Openness, fps: FrameRate) -> Self {
        let half_window = (HIGH_PASS_SECS / 2.0 * fps.per_sec()).round() as usize;
        let lips =
            high_pass(&opening.iter().map(|&opening| (opening + LOG_OFFSET).ln()).collect::<Vec<_>>(), half_window);
        let at_lag = |step: i32| {
            let lag = f64::from(step) * LAG_STEP_SECS;
            let openness: Vec<f32> = time_secs.iter().map(|secs| voice.at(secs + lag + VOICE_DELAY_SECS)).collect();
            (lag, PairSums::new(&lips, &high_pass(&openness, half_window), is_speech))
        };
        Self { lags: (-N_LAGS..=N_LAGS).map(at_lag).collect(), n_frames: lips.len(), fps }
    }

    /// Probability at each frame that the voice is that of the visible mouth, [T]; NaN where mouth or speech is unknown
    /// for too long. Each lag is a hypothesis about the complete video, weighted by its likelihood and its prior.
    pub fn own_voice(&self) -> Vec<f32> {
        let fps = self.fps.per_sec();
        let (mut sum, mut total, mut largest) = (vec![0.0_f64; self.n_frames], 0.0_f64, f64::NEG_INFINITY);
        for (lag, sums) in &self.lags {
            let (probabilities, evidence) = sums.own_voice(fps);
            let evidence = evidence - lag.abs() / LAG_SPREAD_SECS;
            let scale = evidence.max(largest);
            let (rescale, weight) = ((largest - scale).exp(), (evidence - scale).exp());
            sum.iter_mut().zip(probabilities).for_each(|(sum, own)| *sum = *sum * rescale + own * weight);
            (total, largest) = (total * rescale + weight, scale);
        }
        let around = ((WINDOW_SECS * fps).round() as usize).max(1);
        let is_known = |t: usize| {
            let start = t.saturating_sub(around / 2).min(self.n_frames.saturating_sub(around));
            let end = (start + around).min(self.n_frames);
            self.lags[self.lags.len() / 2].1.n(start, end) >= MIN_KNOWN_SHARE * around as f64
        };
        (0..self.n_frames).map(|t| if is_known(t) { (sum[t] / total) as f32 } else { f32::NAN }).collect()
    }

    /// Lag of the largest correlation over all frames; `None` if too few frames could be compared.
    pub fn offset(&self) -> Option<SoundOffset> {
        let (lags, fps) = (&self.lags, self.fps);
        let least = MIN_KNOWN_SECS * fps.per_sec();
        let correlations: Option<Vec<f64>> = lags.iter().map(|(_, sums)| sums.score(0, self.n_frames, least)).collect();
        let correlations = correlations?;
        let (at, correlation) = correlations.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        // Sub-step refinement: vertex of the parabola through the best lag and its neighbours.
        let neighbour = |k: usize| correlations.get(k).copied();
        let part = match (at.checked_sub(1).and_then(neighbour), neighbour(at + 1)) {
            (Some(before), Some(after)) if before + after < 2.0 * correlation => {
                0.5 * (before - after) / (before - 2.0 * correlation + after)
            }
            _ => 0.0,
        };
        let compared_secs = lags[at].1.n(0, self.n_frames) / fps.per_sec();
        // For an unrelated voice, the largest correlation over all lags times the square root of the duration follows
        // roughly this Gumbel distribution (fitted to 2900 unrelated pairs of clips and voices, 4 to 20 s).
        let best = correlation * compared_secs.sqrt();
        let confidence = (-(-(best - 0.6) / 0.133).exp()).exp();
        Some(SoundOffset { secs: lags[at].0 + part * LAG_STEP_SECS, correlation, confidence, compared_secs })
    }
}

/// Subtracts from each value the mean of the finite values within `half_window` frames of it; NaN stays NaN.
fn high_pass(values: &[f32], half_window: usize) -> Vec<f32> {
    let (mut sums, mut counts) = (vec![0.0_f64], vec![0_usize]);
    for value in values {
        let known = value.is_finite();
        sums.push(sums[sums.len() - 1] + if known { f64::from(*value) } else { 0.0 });
        counts.push(counts[counts.len() - 1] + usize::from(known));
    }
    let local_mean = |t: usize| {
        let (start, end) = (t.saturating_sub(half_window), values.len().min(t + half_window + 1));
        (sums[end] - sums[start]) / (counts[end] - counts[start]).max(1) as f64
    };
    values.iter().enumerate().map(|(t, &value)| value - local_mean(t) as f32).collect()
}

/// Prefix sums over the frames in which lips and voice are both known: count, x, y, xx, yy, xy.
struct PairSums(Vec<[f64; 6]>);

impl PairSums {
    fn new(lips: &[f32], voice: &[f32], is_speech: &[bool]) -> Self {
        let (mut sums, mut sum) = (vec![[0.0; 6]], [0.0; 6]);
        for ((x, y), speech) in lips.iter().zip(voice).zip(is_speech) {
            let (x, y) = (f64::from(*x), f64::from(*y));
            if *speech && x.is_finite() && y.is_finite() {
                let terms = [1.0, x, y, x * x, y * y, x * y];
                sum.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
            }
            sums.push(sum);
        }
        Self(sums)
    }

    /// Number of known frames in `start..end`.
    fn n(&self, start: usize, end: usize) -> f64 {
        self.0[end][0] - self.0[start][0]
    }

    /// Probability of the own voice at each frame, and the log-likelihood of all frames relative to an unrelated voice:
    /// forward-backward algorithm of a hidden Markov model with the states own and other voice.
    fn own_voice(&self, fps: f64) -> (Vec<f64>, f64) {
        let [n, x, y, xx, yy, _] = self.0[self.0.len() - 1];
        let n = n.max(1.0);
        let deviation = |sum: f64, squares: f64| (squares / n - (sum / n).powi(2)).max(0.0).sqrt();
        let (lip_deviation, voice_deviation) = (deviation(x, xx).max(MIN_LIP_DEVIATION), deviation(y, yy).max(1e-6));
        let likelihood_ratio = |pair: &[[f64; 6]]| {
            let [is_known, lips, voice]: [f64; 3] = std::array::from_fn(|k| pair[1][k] - pair[0][k]);
            let limited = |value: f64| value.clamp(-MAX_DEVIATIONS, MAX_DEVIATIONS);
            let product = limited((lips - x / n) / lip_deviation) * limited((voice - y / n) / voice_deviation);
            let per_sample = OWN_CORRELATION * (product - OWN_CORRELATION / 2.0);
            (is_known * per_sample * (INDEPENDENT_PER_SEC / fps).min(1.0)).exp()
        };
        let ratios: Vec<f64> = self.0.windows(2).map(likelihood_ratio).collect();
        let change = (CHANGES_PER_SEC / fps).min(0.5);
        let after_step = |own: f64| own * (1.0 - change) + (1.0 - own) * change;
        let (mut probabilities, mut evidence, mut own) = (Vec::with_capacity(ratios.len()), 0.0, PRIOR);
        for ratio in &ratios {
            let likelihood = own * ratio + 1.0 - own;
            evidence += likelihood.ln();
            probabilities.push(own * ratio / likelihood);
            own = after_step(own * ratio / likelihood);
        }
        let mut later = 0.5;
        for (own, ratio) in probabilities.iter_mut().zip(&ratios).rev() {
            *own = *own * later / (*own * later + (1.0 - *own) * (1.0 - later));
            later = after_step(later * ratio / (later * ratio + 1.0 - later));
        }
        (probabilities, evidence)
    }

    /// Correlation over `start..end`, scaled down where the lips hardly move; `None` if fewer than `least` are known.
    fn score(&self, start: usize, end: usize, least: f64) -> Option<f64> {
        let [n, x, y, xx, yy, xy]: [f64; 6] = std::array::from_fn(|k| self.0[end][k] - self.0[start][k]);
        if n < least.max(2.0) {
            return None;
        }
        let (lip_variance, voice_variance) = ((xx - x * x / n).max(0.0), (yy - y * y / n).max(0.0));
        let correlation = (xy - x * y / n) / (lip_variance * voice_variance).sqrt().max(1e-9);
        Some(correlation.clamp(-1.0, 1.0) * ((lip_variance / n).sqrt() / MIN_LIP_DEVIATION).min(1.0))
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use orator_base::audio::openness::OpennessMeter;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::f64::consts::TAU;

    pub const FPS: FrameRate = FrameRate::new(15, 1);

    /// Synthetic mouth opening, 0..1, for about four syllables a second of random length and width.
    pub struct Mouth(Vec<[f64; 3]>);

    impl Mouth {
        pub fn new(secs: f64, seed: u64) -> Self {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let (mut syllables, mut now) = (Vec::new(), 0.0);
            while now < secs {
                let length = rng.random_range(0.12..0.35);
                syllables.push([now, now + length, rng.random_range(0.2..1.0)]);
                now += length + if rng.random_bool(0.15) { rng.random_range(0.1..0.6) } else { 0.0 };
            }
            Self(syllables)
        }

        fn at(&self, secs: f64) -> f64 {
            let syllable = self.0.partition_point(|syllable| syllable[1] <= secs);
            self.0
                .get(syllable)
                .filter(|syllable| syllable[0] <= secs)
                .map_or(0.0, |[start, end, open]| open * (TAU / 2.0 * (secs - start) / (end - start)).sin())
        }

        /// Voice of the mouth, delayed by `delay` seconds: a murmur, plus harmonics up to 4 kHz scaled by the opening.
        pub fn voice(&self, secs: f64, delay: f64) -> Openness {
            let mut meter = OpennessMeter::default();
            let sample = |n: usize| {
                let now = n as f64 / 16_000.0;
                let open = self.at(now - delay - VOICE_DELAY_SECS);
                let tone = |hz: f64| (TAU * hz * now).sin();
                let vowel = [800.0, 1300.0, 2400.0, 3600.0].map(tone).iter().sum::<f64>();
                (0.1 * (tone(150.0) + tone(450.0)) + 0.1 * open * open * vowel) as f32
            };
            meter.push(&(0..(secs * 16_000.0) as usize).map(sample).collect::<Vec<_>>());
            meter.finish()
        }

        /// Measured lip opening with noise; every `missing_every`-th frame is missing.
        pub fn measured(&self, secs: f64, missing_every: usize, seed: u64) -> (Vec<f32>, Vec<f64>) {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let times: Vec<f64> = (0..FPS.frames_in(secs)).map(|t| FPS.secs(t)).collect();
            let opening = |(t, secs): (usize, &f64)| {
                let noise = rng.random_range(-0.02..0.02);
                if t % missing_every == 0 { f32::NAN } else { (0.05 + 0.25 * self.at(*secs) + noise) as f32 }
            };
            (times.iter().enumerate().map(opening).collect(), times)
        }
    }

    fn compared(secs: f64, own: bool, delay: f64, seed: u64) -> LipSync {
        let mouth = Mouth::new(secs, seed);
        let (opening, times) = mouth.measured(secs, 9, seed);
        let voice = if own { mouth } else { Mouth::new(secs, seed + 1000) }.voice(secs, delay);
        compare(&opening, &times, &vec![true; times.len()], &voice, FPS)
    }

    #[test]
    fn the_delay_of_the_voice_is_measured() {
        for (k, delay) in [-0.4, -0.21, 0.0, 0.033, 0.1, 0.4].into_iter().enumerate() {
            let found = compared(10.0, true, delay, k as u64);
            let offset = found.offset.unwrap();
            assert!((offset.secs - delay).abs() < 0.02 && offset.is_reliable(), "{delay}: {offset:?}");
            assert!(found.score.iter().all(|score| *score > 0.5), "{delay}: {:?}", found.score);
        }
    }

    #[test]
    fn an_unrelated_voice_is_unlikely_and_its_offset_unreliable() {
        let (mut n_sure, mut n_accepted) = (0, 0);
        for seed in 0..12 {
            let (own, other) = (compared(12.0, true, 0.0, seed), compared(12.0, false, 0.0, seed));
            n_sure += usize::from(other.offset.unwrap().is_reliable());
            n_accepted += usize::from(other.score[60] >= 0.5);
            assert!(own.score[60] > 0.9, "{seed}: {}", own.score[60]);
        }
        assert!(n_accepted <= 3, "{n_accepted} of 12 voices of others are accepted");
        assert!(n_sure <= 1, "{n_sure} of 12 voices of others are surely those of the mouth");
    }

    /// The lips are those of another person from `start` to `end`, seconds.
    fn partly_unrelated(secs: f64, start: f64, end: f64, seed: u64) -> Vec<f32> {
        let (own, other) = (Mouth::new(secs, seed), Mouth::new(secs, seed + 500));
        let outside = own.0.iter().filter(|syllable| syllable[1] < start || syllable[0] >= end);
        let inside = other.0.iter().filter(|syllable| syllable[0] >= start && syllable[1] < end);
        let mut syllables: Vec<[f64; 3]> = outside.chain(inside).copied().collect();
        syllables.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let (opening, times) = Mouth(syllables).measured(secs, 999, seed);
        compare(&opening, &times, &vec![true; times.len()], &own.voice(secs, 0.0), FPS).score
    }

    #[test]
    fn seconds_without_correlation_are_accepted_and_another_voice_for_long_is_not() {
        for seed in 0..3 {
            let score = partly_unrelated(60.0, 27.0, 33.0, seed);
            assert!(score.iter().all(|own| *own > 0.5), "{seed}: {score:?}");
        }
        let scores: Vec<Vec<f32>> = (0..3).map(|seed| partly_unrelated(120.0, 60.0, 120.0, seed)).collect();
        let rejected = |frames: std::ops::Range<usize>| {
            scores.iter().flat_map(|score| &score[frames.clone()]).filter(|own| **own < 0.5).count()
        };
        let (own, other) = (rejected(0..850), rejected(900..1800));
        assert!(own < 26 && other > 1_620, "{own} of 2550 own and {other} of 2700 other frames are rejected");
    }

    #[test]
    fn missing_mouth_speech_or_movement_gives_no_score() {
        let mouth = Mouth::new(20.0, 5);
        let ((opening, times), voice) = (mouth.measured(20.0, 999, 5), mouth.voice(20.0, 0.0));
        let all = vec![true; times.len()];
        let hidden = vec![f32::NAN; times.len()];
        for (opening, is_speech) in [(&hidden, &all), (&opening, &vec![false; times.len()])] {
            let found = compare(opening, &times, is_speech, &voice, FPS);
            assert!(found.offset.is_none() && found.score.iter().all(|score| score.is_nan()));
        }
        // The second half is not visible. A frame has a score if 6 of the 8 s around it are visible.
        let half: Vec<f32> = (0..300).map(|t| if t < 150 { opening[t] } else { f32::NAN }).collect();
        let found = compare(&half, &times, &all, &voice, FPS);
        assert!(found.score[..110].iter().all(|score| *score > 0.5) && found.score[200..].iter().all(|s| s.is_nan()));
        let static_lips: Vec<f32> = opening.iter().map(|opening| 0.1 + 0.01 * opening).collect();
        let found = compare(&static_lips, &times, &all, &voice, FPS);
        assert!(found.score.iter().all(|score| *score < 0.2) && !found.offset.unwrap().is_reliable());
        assert_eq!(compare(&[], &[], &[], &Openness::default(), FPS), LipSync::default());
    }
}
