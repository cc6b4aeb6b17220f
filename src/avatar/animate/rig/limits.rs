//! Joint limits in degrees, for the left side, wide enough for what captured people do: the normal ranges of an adult
//! (American Academy of Orthopaedic Surgeons, Joint Motion, 1965; Norkin and White, Measurement of Joint Motion; fingers
//! of Rebol et al. 2021), widened where 0.1 % of the frames of a capture lie beyond. The captures, and what they reach:
//! `orator guide animation`.

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

/// Forearm against upper arm; to the side 10 degrees of carrying angle, since a nearly straight arm does not show its
/// plane of flexion.
pub const ELBOW: Limit = limit([0.0, 175.0], [-10.0, 10.0]);
/// Rotation of the hand about the forearm from pronation to supination, 0 with the palm along the elbow's axis: 80 both
/// ways by AAOS. The axis is seen only in a bent arm, and other skeletons turn theirs against ours, so that people who
/// were captured are found up to 60 degrees further.
pub const SUPINATION: [f64; 2] = [-140.0, 140.0];
/// Extension to flexion; ulnar to radial deviation.
pub const WRIST: Limit = limit([-80.0, 90.0], [-45.0, 35.0]);
/// Thumb to little finger, each from the knuckle to the end joint. Angles of the thumb are relative to its resting line
/// (`rig::finger_hinge`).
pub const FINGERS: [[Limit; 3]; 5] = [
    [limit([-35.0, 45.0], [-45.0, 35.0]), limit([-25.0, 60.0], SIDE), limit([-20.0, 80.0], SIDE)],
    finger([-45.0, 20.0], SIDE, SIDE),
    finger([-25.0, 15.0], SIDE, SIDE),
    finger([-20.0, 25.0], SIDE, SIDE),
    finger([-30.0, 60.0], [-60.0, 25.0], [-25.0, 32.0]),
];
/// Sideways range of a joint that does not bend sideways: what the axes of fingers differ by from person to person.
const SIDE: [f64; 2] = [-25.0, 25.0];
/// Largest difference of a finger's flexion from the mean of the four fingers at the same level (Rebol et al. 2021).
pub const CURL_COHERENCE: f64 = 10.0;

const fn finger(spread: [f64; 2], middle_side: [f64; 2], end_side: [f64; 2]) -> [Limit; 3] {
    [limit([-20.0, 122.0], spread), limit([-5.0, 110.0], middle_side), limit([-10.0, 80.0], end_side)]
}

/// Angle in `range` for an angle on the circle: itself within, the nearer end beyond. Near the point opposite the range
/// the result blends from one end to the other, so that it is continuous.
pub fn within([low, high]: [f64; 2], degrees: f64) -> f64 {
    let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
    let off = turn(degrees - middle);
    if off.abs() <= half {
        return middle + off;
    }
    let share = ((180.0 - off.abs()) / (OPPOSITE_SHARE * (180.0 - half))).clamp(0.0, 1.0);
    middle + half.copysign(off) * share
}

/// Share of the forbidden arc, around its middle, over which the ends blend.
const OPPOSITE_SHARE: f64 = 0.4;

/// Equivalent angle in -180..=180.
pub fn turn(degrees: f64) -> f64 {
    degrees - 360.0 * (degrees / 360.0).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn within_is_the_angle_or_the_nearer_end_and_never_jumps() {
        let range = [-20.0, 90.0];
        for (given, expected) in
            [(-20.0, -20.0), (0.0, 0.0), (90.0, 90.0), (120.0, 90.0), (-60.0, -20.0), (380.0, 20.0)]
        {
            assert!((within(range, given) - expected).abs() < 1e-9, "{given}");
        }
        let mut last = within(range, -180.0);
        for step in -18_000..=18_000 {
            let now = within(range, f64::from(step) / 100.0);
            assert!((now - last).abs() < 0.05 && (-20.0..=90.0).contains(&now));
            assert_eq!(within(range, now), now);
            last = now;
        }
    }
}
