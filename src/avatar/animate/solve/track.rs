//! Rotation tracks of a joint. Gaps between detected frames are interpolated along the shortest path; before and after
//! them the nearest rotation is held.

use orator_base::math::rotation::Rotation;

/// Rotations of one joint, by frame.
pub type RotationTrack = Vec<Rotation>;
/// Rotations of one joint by frame; `None` where it was not detected.
pub type ObservedTrack = Vec<Option<Rotation>>;

/// World rotations of a joint from its parent's world rotations and its local ones.
pub fn world(parent: &RotationTrack, local: &RotationTrack) -> RotationTrack {
    parent.iter().zip(local).map(|(&parent, &local)| parent * local).collect()
}

pub fn mirrored(mut track: RotationTrack) -> RotationTrack {
    track.iter_mut().for_each(|rotation| *rotation = rotation.mirrored());
    track
}

/// Fills the gaps of a track; `rest` if nothing was detected. With `relax_frames` it moves to `rest` within that many
/// frames of the nearest detected one.
pub fn filled(observed: ObservedTrack, rest: Rotation, relax_frames: Option<f64>) -> RotationTrack {
    let (mut before, mut after) = (None, next_observed(&observed, 0));
    let mut track = RotationTrack::with_capacity(observed.len());
    for (t, now) in observed.iter().enumerate() {
        if let Some(rotation) = *now {
            before = Some((t, rotation));
            after = next_observed(&observed, t + 1);
            track.push(rotation);
            continue;
        }
        let (bridge, distance) = match (before, after) {
            (None, None) => (rest, 0),
            (Some((at, rotation)), None) => (rotation, t - at),
            (None, Some((at, rotation))) => (rotation, at - t),
            (Some((from, a)), Some((to, b))) => {
                (a.slerp(b, (t - from) as f64 / (to - from) as f64), (t - from).min(to - t))
            }
        };
        track.push(match relax_frames {
            Some(frames) => bridge.slerp(rest, smoothstep([0.0, frames], distance as f64)),
            None => bridge,
        });
    }
    track
}

/// First detected frame from `start` on.
fn next_observed(observed: &ObservedTrack, start: usize) -> Option<(usize, Rotation)> {
    observed[start..].iter().position(Option::is_some).and_then(|ahead| Some((start + ahead, observed[start + ahead]?)))
}

/// Smooth step from 0 below `low` to 1 above `high`.
pub fn smoothstep([low, high]: [f64; 2], at: f64) -> f64 {
    let share = ((at - low) / (high - low)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
