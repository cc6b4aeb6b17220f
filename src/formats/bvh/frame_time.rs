//! Frame rates of BVH files. Files store the time between frames, which many programs round to three or four digits.

use orator_base::types::time::FrameRate;

/// Common integer frame rates of cameras and studios; `BROADCAST_RATES` are multiplied by 1000/1001.
const RATES: [u32; 9] = [15, 20, 24, 25, 30, 50, 60, 100, 120];
const BROADCAST_RATES: [u32; 4] = [24, 30, 60, 120];
/// A relative difference below this is taken for the common rate.
const RATE_ROUNDING: f64 = 1.1e-3;
/// A relative difference up to this one is not reported.
const NEGLIGIBLE: f64 = 1e-4;
/// Minimum number of digits after the decimal point to which a frame time is rounded.
const MIN_DIGITS: usize = 3;

/// Frame rate for a frame time: the common rate if it is nearly equal.
pub fn rate(frame_secs: f64) -> FrameRate {
    let off = |rate: FrameRate| (rate.per_sec() * frame_secs - 1.0).abs();
    let nearest = integer_rates().chain(broadcast_rates()).min_by(|&a, &b| off(a).total_cmp(&off(b)));
    match nearest.filter(|&rate| off(rate) < RATE_ROUNDING) {
        Some(rate) => rate,
        None => FrameRate::nearest(1.0 / frame_secs).unwrap_or(FrameRate::new(1, 1)),
    }
}

/// The common rate whose frame time, rounded to the digits of `written`, is `frame_secs`; an integer rate is preferred.
/// `None` if there is none, and for frame times without a notable rounding error.
pub fn rounded_rate(written: &str, frame_secs: f64) -> Option<FrameRate> {
    let decimals = written.split_once('.').map_or(0, |(_, decimals)| decimals.trim_end_matches('0').len());
    let half_unit = 0.5 * 10f64.powi(-(decimals.max(MIN_DIGITS) as i32));
    let error = |rate: FrameRate| (1.0 / rate.per_sec() - frame_secs).abs();
    let is_meant = |rate: &FrameRate| error(*rate) <= half_unit * (1.0 + 1e-6);
    let integer = integer_rates().filter(is_meant).min_by(|&a, &b| error(a).total_cmp(&error(b)));
    let rate = integer.or_else(|| broadcast_rates().find(is_meant))?;
    (error(rate) * rate.per_sec() > NEGLIGIBLE).then_some(rate)
}

fn integer_rates() -> impl Iterator<Item = FrameRate> {
    RATES.into_iter().map(|rate| FrameRate::new(rate, 1))
}

fn broadcast_rates() -> impl Iterator<Item = FrameRate> {
    BROADCAST_RATES.into_iter().map(|rate| FrameRate::new(1000 * rate, 1001))
}
