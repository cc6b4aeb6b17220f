//! Movements of a wrist: runs of high speed, divided at minima of the speed. The times of a movement are those of the
//! minimum-jerk movement (Flash and Hogan 1985) that fits its positions best, because the first and last tenth of the
//! path are hidden in the noise of the joints. Velocities are smoothed by a Gaussian, without delay.

use super::wrist_track::{ARM_METRES, WristTrack};
use ndarray::Array3;
use orator_base::math::gaussian::gaussian;
use orator_base::math::order::{self, Ordered};
use orator_base::math::vec3::{Vec3, dot, norm, scale, sub};
use std::f64::consts::PI;
use std::ops::Range;

/// Range of the standard deviation of the Gaussian, seconds, and the noise of the velocity at which it aims, m/s.
const SIGMA_SECS: [f64; 2] = [0.035, 0.075];
const NOISE_SPEED: f64 = 0.05;
/// Speed between movement and pause, and minimum peak speed of a movement: at least m/s, and multiples of the noise.
const LOW_SPEED: [f64; 2] = [0.1, 2.2];
const PEAK_SPEED: [f64; 2] = [0.25, 4.0];
/// Quantile of the speed that is taken for noise, since every hand pauses at times.
const QUIET_SHARE: f64 = 0.1;
/// Speed between two peaks, relative to the lower one, below which they are two movements.
const VALLEY: f64 = 0.6;
/// Minimum extent of a movement along an axis, metres.
const MIN_EXTENT: f64 = 0.04;
/// Shortest movement, and shortest pause between two, seconds.
pub(super) const MIN_MOVEMENT_SECS: f64 = 0.12;
pub(super) const MIN_PAUSE_SECS: f64 = 0.2;
/// Seconds before and after a movement that are fitted, and the steps of the search for its start and end.
const FIT_MARGIN_SECS: f64 = 0.2;
const FIT_STEPS: [f64; 3] = [0.04, 0.04, 0.013];

/// Thresholds of a hand, adapted to the length of its arm and the noise of its joints; `metres` scales lengths.
#[derive(Clone, Copy, Debug)]
pub(super) struct WristThresholds {
    pub(super) metres: f64,
    pub(super) low_speed: f64,
    pub(super) peak_speed: f64,
}

/// Run of frames without a missing one.
pub(super) struct WristRun {
    pub(super) first_frame: usize,
    per_sec: f64,
    /// Positions as given and smoothed, metres.
    positions: Vec<Vec3>,
    pub(super) smooth: Vec<Vec3>,
    /// Speeds, m/s.
    pub(super) speeds: Vec<f64>,
}

/// Movement of a run, seconds from its first frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct WristMovement {
    pub(super) start_secs: f64,
    pub(super) end_secs: f64,
}

/// Thresholds for tracks of one hand, and the runs of each track.
pub(super) fn runs(tracks: &[WristTrack]) -> (WristThresholds, Vec<Vec<WristRun>>) {
    let metres = order::median(tracks.iter().filter_map(|track| track.arm_metres)).unwrap_or(ARM_METRES) / ARM_METRES;
    let per_sec = tracks.first().map_or(1.0, |track| track.fps.per_sec());
    let mut runs: Vec<Vec<WristRun>> = tracks.iter().map(WristRun::of).collect();
    // The third difference of white noise has 20 times its variance, that of a movement is small.
    let thirds = runs
        .iter()
        .flatten()
        .flat_map(|run| run.positions.windows(4))
        .flat_map(|p| [0, 1, 2].map(|k| (p[3][k] - 3.0 * p[2][k] + 3.0 * p[1][k] - p[0][k]).abs()));
    let noise = order::median(thirds).unwrap_or(0.0) / (0.6745 * 20_f64.sqrt());
    let [min, max] = SIGMA_SECS;
    let variance = noise * noise / (4.0 * PI.sqrt() * per_sec);
    let sigma_secs = (variance / NOISE_SPEED.powi(2)).cbrt().clamp(min, max);
    runs.iter_mut().flatten().for_each(|run| run.smooth(sigma_secs));
    let speeds = runs.iter().flatten().flat_map(|run| run.speeds.iter().copied());
    let quiet = Ordered::new(speeds).quantile(QUIET_SHARE).unwrap_or(0.0);
    let noise_speed = (variance / sigma_secs.powi(3)).sqrt().max(quiet);
    let threshold = |[least, multiple]: [f64; 2]| (least * metres).max(multiple * noise_speed);
    let (low_speed, peak_speed) = (threshold(LOW_SPEED), threshold(PEAK_SPEED));
    (WristThresholds { metres, low_speed, peak_speed }, runs)
}

impl WristRun {
    fn of(track: &WristTrack) -> Vec<Self> {
        let (mut runs, mut first_frame) = (Vec::new(), 0);
        for run in track.positions.chunk_by(|a, b| a.is_some() == b.is_some()) {
            let positions: Vec<Vec3> = run.iter().flatten().copied().collect();
            if !positions.is_empty() {
                let (smooth, speeds) = (Vec::new(), Vec::new());
                runs.push(Self { first_frame, per_sec: track.fps.per_sec(), positions, smooth, speeds });
            }
            first_frame += run.len();
        }
        runs
    }

    fn smooth(&mut self, sigma_secs: f64) {
        let n = self.positions.len();
        let mut smooth = Array3::from_shape_fn((n, 1, 3), |(t, _, k)| self.positions[t][k] as f32);
        gaussian(smooth.view_mut(), sigma_secs * self.per_sec);
        self.smooth = (0..n).map(|t| std::array::from_fn(|k| f64::from(smooth[[t, 0, k]]))).collect();
        let speed = |t: usize| {
            let (before, after) = (t.saturating_sub(1), (t + 1).min(n - 1));
            norm(sub(self.smooth[after], self.smooth[before])) * self.per_sec / (after - before).max(1) as f64
        };
        self.speeds = (0..n).map(speed).collect();
    }

    pub(super) fn secs(&self) -> f64 {
        self.positions.len() as f64 / self.per_sec
    }

    /// Frames within two times, at least one.
    pub(super) fn frames(&self, start_secs: f64, end_secs: f64) -> Range<usize> {
        let last = self.positions.len() - 1;
        let start = ((start_secs * self.per_sec).ceil().max(0.0) as usize).min(last);
        start..((end_secs * self.per_sec).floor().max(0.0) as usize).clamp(start, last) + 1
    }

    /// Movements in order; two that are less than `MIN_PAUSE_SECS` apart follow each other without a pause.
    pub(super) fn movements(&self, thresholds: &WristThresholds) -> Vec<WristMovement> {
        let mut found = self.fast_parts(thresholds);
        let spans: Vec<[f64; 2]> = found.iter().map(|part| [part.start_secs, part.end_secs]).collect();
        for (n, part) in found.iter_mut().enumerate() {
            let before = n.checked_sub(1).map_or(f64::NEG_INFINITY, |n| spans[n][1]);
            let after = spans.get(n + 1).map_or(f64::INFINITY, |next| next[0]);
            let within = |secs: f64| secs.clamp(before.min(spans[n][0]), after.max(spans[n][1]));
            let window = within(spans[n][0] - FIT_MARGIN_SECS)..within(spans[n][1] + FIT_MARGIN_SECS);
            [part.start_secs, part.end_secs] = self.fitted(spans[n], window);
        }
        found.retain(|part| self.extent(part) > MIN_EXTENT * thresholds.metres);
        for n in 1..found.len() {
            if found[n].start_secs - found[n - 1].end_secs < MIN_PAUSE_SECS {
                let middle = f64::midpoint(found[n].start_secs, found[n - 1].end_secs);
                (found[n].start_secs, found[n - 1].end_secs) = (middle, middle);
            }
        }
        for part in &mut found {
            part.start_secs = part.start_secs.clamp(0.0, self.secs());
            part.end_secs = part.end_secs.clamp(part.start_secs, self.secs());
        }
        found.retain(|part| part.end_secs - part.start_secs >= MIN_MOVEMENT_SECS / 2.0);
        found
    }

    /// Parts of the run around peaks of the speed, divided where the speed is lowest.
    fn fast_parts(&self, thresholds: &WristThresholds) -> Vec<WristMovement> {
        let (mut found, mut start) = (Vec::new(), 0);
        for part in self.speeds.chunk_by(|a, b| (*a > thresholds.low_speed) == (*b > thresholds.low_speed)) {
            let frames = start..start + part.len();
            start = frames.end;
            let is_peak = |t: &usize| {
                let at = |t: usize| self.speeds.get(t).copied().unwrap_or(0.0);
                at(*t) >= thresholds.peak_speed && at(*t) > at(t + 1) && at(*t) >= at(t.wrapping_sub(1))
            };
            // The last peak, and the speed of the fastest since the last valley.
            let mut peaks = frames.clone().filter(is_peak);
            let Some(mut last) = peaks.next() else { continue };
            let (mut fastest, mut edges) = (self.speeds[last], vec![frames.start]);
            for peak in peaks {
                let slowest = (last..peak).min_by(|a, b| self.speeds[*a].total_cmp(&self.speeds[*b])).unwrap_or(peak);
                if self.speeds[slowest] < VALLEY * fastest.min(self.speeds[peak]) {
                    edges.push(slowest);
                    fastest = 0.0;
                }
                (last, fastest) = (peak, f64::max(fastest, self.speeds[peak]));
            }
            edges.push(frames.end - 1);
            let secs = |frame: usize| frame as f64 / self.per_sec;
            let parts = edges.windows(2).map(|pair| [secs(pair[0]), secs(pair[1])]);
            found.extend(parts.map(|[start_secs, end_secs]| WristMovement { start_secs, end_secs }));
        }
        found
    }

    /// Start and end of the minimum-jerk movement along a straight line that fits the positions in a window best.
    fn fitted(&self, initial: [f64; 2], window: Range<f64>) -> [f64; 2] {
        let frames = self.frames(window.start, window.end);
        let n = frames.len() as f64;
        if frames.len() < 5 {
            return initial;
        }
        // The part of the sum of squares that the movement explains.
        let explained = |[start, end]: [f64; 2]| {
            let done = |t: usize| {
                let x = ((t as f64 / self.per_sec - start) / (end - start)).clamp(0.0, 1.0);
                x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x)
            };
            let mean = frames.clone().map(done).sum::<f64>() / n;
            let (mut along, mut squares) = ([0.0; 3], 0.0);
            for t in frames.clone() {
                let weight = done(t) - mean;
                squares += weight * weight;
                (0..3).for_each(|k| along[k] += weight * self.positions[t][k]);
            }
            if squares < 1e-9 { 0.0 } else { dot(along, along) / squares }
        };
        let mut best = (explained(initial), initial);
        for step in FIT_STEPS {
            let [start, end] = best.1;
            for (a, b) in (-3..=3).flat_map(|a| (-3..=3).map(move |b| (a, b))) {
                let times = [start + step * f64::from(a), end + step * f64::from(b)];
                if times[1] - times[0] >= MIN_MOVEMENT_SECS {
                    let fit = explained(times);
                    best = if fit > best.0 { (fit, times) } else { best };
                }
            }
        }
        best.1
    }

    fn extent(&self, part: &WristMovement) -> f64 {
        let smooth = &self.smooth[self.frames(part.start_secs, part.end_secs)];
        let range = |k: usize| {
            let values = || smooth.iter().map(|p| p[k]);
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        };
        range(0).max(range(1)).max(range(2))
    }
}

/// Mean position.
pub(super) fn mean(positions: &[Vec3]) -> Vec3 {
    let sum = positions.iter().fold([0.0; 3], |sum, p| std::array::from_fn(|k| sum[k] + p[k]));
    scale(sum, 1.0 / positions.len().max(1) as f64)
}
