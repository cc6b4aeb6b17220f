//! Sound from one rate to another, in pieces: a windowed sinc whose band ends as librosa's default (soxr, high quality)
//! does, half way down at 0.9565 of the lower Nyquist frequency. Onsets found in what it gives are those librosa finds
//! after loading a file at 16 kHz; a plainer resampler, such as the program's own, moves some of them across the threshold:
//! the published onset counts need this one.

/// Zero crossings of the kernel on either side, at the lower rate.
const HALF: f64 = 96.0;
/// Where the band ends, share of the lower Nyquist frequency.
const BAND: f64 = 0.9565;
/// Of Kaiser's window: stop band 125 dB down.
const BETA: f64 = 12.9;

/// One sound on its way to another rate.
pub struct Resampler {
    /// Output sample k lies at input sample `k * down / up`.
    up: u64,
    down: u64,
    /// Input samples the kernel reaches to either side.
    reach: u64,
    /// Weights of each of `up` places between two input samples [2 reach + 1].
    phases: Vec<Vec<f32>>,
    /// Input from sample `first` on.
    samples: Vec<f32>,
    first: i64,
    n_in: u64,
    n_out: u64,
}

impl Resampler {
    /// From one rate to another, samples a second; 0 is taken for 1.
    pub fn new(from: u32, to: u32) -> Self {
        let (from, to) = (u64::from(from.max(1)), u64::from(to.max(1)));
        let common = gcd(from, to);
        let (up, down) = (to / common, from / common);
        // input samples in a sample of the lower rate
        let scale = (from as f64 / to as f64).max(1.0);
        let reach = (HALF * scale).ceil() as u64;
        let weights = |phase: u64| {
            let weight = |i: u64| {
                let at = (i as f64 - reach as f64 - phase as f64 / up as f64) / scale;
                (BAND * sinc(BAND * at) * kaiser(at / HALF) / scale) as f32
            };
            (0..=2 * reach + 1).map(weight).collect()
        };
        let phases = (0..up).map(weights).collect();
        let samples = vec![0.0; reach as usize];
        Self { up, down, reach, phases, samples, first: -(reach as i64), n_in: 0, n_out: 0 }
    }

    /// Takes the next samples; those of the other rate that are ready are appended to `out`.
    pub fn push(&mut self, samples: &[f32], out: &mut Vec<f32>) {
        for piece in samples.chunks(1 << 14) {
            self.samples.extend_from_slice(piece);
            self.n_in += piece.len() as u64;
            self.convert(out);
        }
    }

    /// Appends what is left, so that both sounds last equally long (rounded up, as librosa does).
    pub fn finish(mut self, out: &mut Vec<f32>) {
        let n_all = (self.n_in * self.up).div_ceil(self.down);
        self.samples.extend(std::iter::repeat_n(0.0, self.reach as usize + 2));
        self.convert(out);
        let n_extra = usize::try_from(self.n_out.saturating_sub(n_all)).unwrap_or(0);
        out.truncate(out.len().saturating_sub(n_extra));
    }

    fn convert(&mut self, out: &mut Vec<f32>) {
        loop {
            let at = self.n_out * self.down;
            let (middle, phase) = ((at / self.up) as i64, at % self.up);
            // the kernel's first input sample, never before `first`
            let start = (middle - self.reach as i64 - self.first) as usize;
            let weights = &self.phases[phase as usize];
            let Some(sound) = self.samples.get(start..start + weights.len()) else {
                let n = start.min(self.samples.len());
                self.samples.drain(..n);
                self.first += n as i64;
                return;
            };
            out.push(sound.iter().zip(weights).map(|(x, w)| x * w).sum());
            self.n_out += 1;
        }
    }
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn sinc(x: f64) -> f64 {
    let x = std::f64::consts::PI * x;
    if x.abs() < 1e-12 { 1.0 } else { x.sin() / x }
}

/// Kaiser's window at -1..1; 0 beyond.
fn kaiser(x: f64) -> f64 {
    if x.abs() > 1.0 { 0.0 } else { bessel(BETA * (1.0 - x * x).sqrt()) / bessel(BETA) }
}

/// The modified Bessel function of order 0.
fn bessel(x: f64) -> f64 {
    let (mut sum, mut term) = (1.0, 1.0);
    for k in 1..60 {
        term *= (x / 2.0 / f64::from(k)).powi(2);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn a_tone_stays_a_tone_however_it_comes() {
        for (from, to, hz) in
            [(44_100, 16_000, 3000.0), (8000, 16_000, 1500.0), (16_000, 16_000, 500.0), (48_000, 16_000, 7000.0)]
        {
            let tone = |rate: u32, i: usize| (TAU * hz * i as f64 / f64::from(rate)).sin() as f32;
            let sound: Vec<f32> = (0..from as usize / 2).map(|i| tone(from, i)).collect();
            let mut out = Vec::new();
            let mut resampler = Resampler::new(from, to);
            sound.chunks(1234).for_each(|piece| resampler.push(piece, &mut out));
            resampler.finish(&mut out);
            assert_eq!(out.len(), to as usize / 2);
            for (i, v) in out.iter().enumerate().take(out.len() - 400).skip(400) {
                assert!((v - tone(to, i)).abs() < 1e-4, "{from} {to}, {i}: {v}");
            }
        }
        // beyond the band nothing is left
        let mut out = Vec::new();
        let mut resampler = Resampler::new(44_100, 16_000);
        let high: Vec<f32> = (0..20_000).map(|i| (TAU * 9000.0 * f64::from(i) / 44_100.0).sin() as f32).collect();
        resampler.push(&high, &mut out);
        assert!(out[400..].iter().all(|v| v.abs() < 1e-4));
        let mut none = Vec::new();
        Resampler::new(44_100, 16_000).finish(&mut none);
        assert!(none.is_empty());
    }
}
