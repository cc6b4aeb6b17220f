//! Joint limits in degrees, for the left side: the normal ranges of an adult (American Academy of Orthopaedic Surgeons,
//! Joint Motion, 1965; Norkin and White, Measurement of Joint Motion; fingers by Rebol et al. 2021), widened by about
//! 12 degrees beyond percentiles 0.1 and 99.9 of captured fingers on hands of several proportions.
//! `orator guide animation` lists the captures.

/// Ranges of a hinge joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    pub flexion: [f64; 2],
    /// Sideways range, positive towards the thumb.
    pub side: [f64; 2],
}

const fn limit(flexion: [f64; 2], side: [f64; 2]) -> Limit {
    Limit { flexion, side }
}

/// Forearm relative to upper arm. The sideways range of 10 degrees is the carrying angle; in a nearly straight arm the
/// plane of flexion is not observable.
pub const ELBOW: Limit = limit([0.0, 175.0], [-10.0, 10.0]);
/// Rotation of the hand about the forearm from pronation to supination; 0 with the palm along the elbow axis. The AAOS
/// range is 80 both ways. The axis is observable only in a bent arm, and other skeletons define it differently, so that
/// captured persons exceed this range by up to 60 degrees.
pub const SUPINATION: [f64; 2] = [-140.0, 140.0];
/// Extension to flexion; ulnar to radial deviation.
pub const WRIST: Limit = limit([-90.0, 100.0], [-60.0, 55.0]);
/// Thumb to little finger, each from the knuckle to the end joint. Angles of the thumb are relative to its rest
/// direction (`rig::finger_hinge`).
pub const FINGERS: [[Limit; 3]; 5] = [
    [limit([-50.0, 60.0], [-65.0, 45.0]), limit([-50.0, 65.0], [-50.0, 45.0]), limit([-35.0, 85.0], SIDE)],
    finger([-55.0, 35.0], [-55.0, 45.0]),
    finger([-40.0, 35.0], SIDE),
    finger([-40.0, 40.0], SIDE),
    finger([-65.0, 65.0], [-70.0, 45.0]),
];
/// Sideways range of a joint that does not bend sideways: variation of finger axes between persons.
const SIDE: [f64; 2] = [-45.0, 45.0];
/// Maximum difference of a finger's flexion from the mean of the four fingers at the same joint (Rebol et al. 2021).
pub const CURL_COHERENCE: f64 = 10.0;

const fn finger(spread: [f64; 2], middle_side: [f64; 2]) -> [Limit; 3] {
    [limit([-45.0, 130.0], spread), limit([-25.0, 115.0], middle_side), limit([-25.0, 90.0], SIDE)]
}

/// Clamps a circular angle to a range. Opposite the range the result blends from one end to the other, continuously.
pub fn clamp_circular([low, high]: [f64; 2], degrees: f64) -> f64 {
    let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
    let off = turn(degrees - middle);
    if off.abs() <= half {
        return middle + off;
    }
    let share = ((180.0 - off.abs()) / (OPPOSITE_SHARE * (180.0 - half))).clamp(0.0, 1.0);
    middle + half.copysign(off) * share
}

/// Fraction of the forbidden arc, around its middle, over which the ends blend.
const OPPOSITE_SHARE: f64 = 0.4;

/// Equivalent angle in -180..=180.
pub fn turn(degrees: f64) -> f64 {
    degrees - 360.0 * (degrees / 360.0).round()
}
