//! What a joint of a grown person can do, in degrees: one table, for the left side; the right is its mirror image.
//! Fingers as the specification of Rebol et al. 2021 was re-implemented (knuckle -20..90, middle joint 0..110, end
//! joint 0..80); elbow, forearm, wrist and thumb after the normal ranges of the American Academy of Orthopaedic
//! Surgeons (Joint Motion, 1965; also Norkin and White, Measurement of Joint Motion), the elbow with 10 degrees of
//! carrying angle to each side, since a nearly straight arm does not show the plane it bends in.

/// Ranges of a joint that bends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    pub flexion: [f64; 2],
    /// Positive towards the thumb.
    pub side: [f64; 2],
}

const fn limit(flexion: [f64; 2], side: [f64; 2]) -> Limit {
    Limit { flexion, side }
}

/// Forearm against upper arm.
pub const ELBOW: Limit = limit([0.0, 150.0], [-10.0, 10.0]);
/// Turn of the hand about the forearm, the palm along the elbow's axis at 0: pronation to supination. AAOS: 80 both
/// ways; 10 more for what the elbow's plane is wrong by.
pub const SUPINATION: [f64; 2] = [-90.0, 90.0];
/// Extension to flexion; ulnar to radial deviation.
pub const WRIST: Limit = limit([-70.0, 80.0], [-30.0, 20.0]);
/// Thumb to little finger, each from the knuckle to the end joint. The thumb's angles are counted from its own resting
/// line (`figure::thumb_rest`).
pub const FINGERS: [[Limit; 3]; 5] = [
    [limit([-35.0, 40.0], [-35.0, 35.0]), limit([-20.0, 60.0], [-10.0, 10.0]), limit([-20.0, 80.0], [0.0, 0.0])],
    finger([-10.0, 20.0]),
    finger([-15.0, 15.0]),
    finger([-20.0, 10.0]),
    finger([-30.0, 10.0]),
];
/// How far a finger's flexion may be from the mean of the four fingers at the same level (Rebol et al. 2021).
pub const CURL_COHERENCE: f64 = 10.0;

const fn finger(spread: [f64; 2]) -> [Limit; 3] {
    [limit([-20.0, 90.0], spread), limit([0.0, 110.0], [0.0, 0.0]), limit([0.0, 80.0], [0.0, 0.0])]
}

/// The place in `range` for an angle on the circle: itself within, the nearer end beyond. Close to the point opposite
/// the range it passes from one end to the other, so that nothing jumps.
pub fn within([low, high]: [f64; 2], degrees: f64) -> f64 {
    let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
    let off = turn(degrees - middle);
    if off.abs() <= half {
        return middle + off;
    }
    let share = ((180.0 - off.abs()) / (OPPOSITE_SHARE * (180.0 - half))).clamp(0.0, 1.0);
    middle + half.copysign(off) * share
}

/// The part of the forbidden arc, from its middle, over which the ends pass into each other.
const OPPOSITE_SHARE: f64 = 0.4;

/// The angle in -180..=180 that is the same turn.
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
