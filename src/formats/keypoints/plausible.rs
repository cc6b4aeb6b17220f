//! Plausibility of bodies whose point order was identified by the number of points alone: lengths of the limbs, size of
//! the face, left and right, up and down. The limits are far outside of what persons show in any posture and view, so
//! that only points in another order violate them.

use super::found::{CoordinateUnit, FoundKeypoints};
use anyhow::{Result, bail};
use orator_base::math::order::Ordered;
use orator_base::types::pose2d::{Keypoint, N_BODY};

type Body = [Keypoint; N_BODY];

/// Minimum and maximum number of persons, over all frames, that are examined.
const MIN_PERSONS: usize = 5;
const MAX_PERSONS: usize = 20_000;
/// Quantile of the projected lengths of a limb that is taken for its length.
const LONG: f64 = 0.98;
/// Maximum ratio of the size of the face to the longest limb.
const MAX_FACE_RATIO: f64 = 0.9;
/// Factor of the limits for fractions of the image, in which lengths depend on the direction.
const FRACTION_SLACK: f64 = 1.8;
/// Fraction of the persons above which sides or heights are contradictory.
const NEARLY_ALL: f64 = 0.9;
/// Minimum ratio of two horizontal distances whose directions are compared.
const MIN_WIDTH_RATIO: f64 = 0.1;

const NOSE: usize = 0;
const EYES: [usize; 2] = [1, 2];
const EARS: [usize; 2] = [3, 4];
const SHOULDERS: [usize; 2] = [5, 6];
const HIPS: [usize; 2] = [11, 12];
const LIMBS: [(&str, [usize; 2]); 4] =
    [("left upper arm", [5, 7]), ("right upper arm", [6, 8]), ("left forearm", [7, 9]), ("right forearm", [8, 10])];
/// Pairs of limbs of similar length, with the maximum ratio of their lengths. Forearms often point at the camera.
const SIMILAR: [(usize, usize, f64); 4] = [(0, 1, 5.0), (2, 3, 10.0), (0, 2, 10.0), (1, 3, 10.0)];
const FACE: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [0, 4], [1, 2], [3, 4]];

/// Checks the bodies of a file.
///
/// # Errors
///
/// The points are not those of a person; the message names the assumed order and how to state another.
pub fn check(found: &FoundKeypoints) -> Result<()> {
    let bodies: Vec<&Body> = found.frames.iter().flatten().map(|person| &person.body).take(MAX_PERSONS).collect();
    let slack = if found.unit == CoordinateUnit::Fraction { FRACTION_SLACK } else { 1.0 };
    if let Some(reason) = contradiction(&bodies, slack) {
        bail!(
            "by their number, its points are in the order of {}, but {reason}: write points in another order to an \
             .npz file as `body` [T, 17, 3] in the order of COCO (`orator guide keypoints`)",
            found.layout
        );
    }
    Ok(())
}

fn contradiction(bodies: &[&Body], slack: f64) -> Option<String> {
    let limbs = LIMBS.map(|(_, limb)| length(bodies, limb));
    for (a, b, max_ratio) in SIMILAR {
        let (Some(first), Some(second)) = (limbs[a], limbs[b]) else { continue };
        let ((longer, shorter), ratio) =
            if first > second { ((a, b), first / second) } else { ((b, a), second / first) };
        if ratio > max_ratio * slack {
            return Some(format!("the {} is {ratio:.0} times as long as the {}", LIMBS[longer].0, LIMBS[shorter].0));
        }
    }
    let shoulders = length(bodies, SHOULDERS);
    let longest = limbs.into_iter().chain([shoulders]).flatten().fold(0.0, f64::max);
    let face = FACE.into_iter().filter_map(|pair| length(bodies, pair)).fold(0.0, f64::max);
    // Without arms, the shoulders may be short because the person is seen from the side.
    if limbs[..2].iter().any(Option::is_some) && face > MAX_FACE_RATIO * slack * longest {
        return Some("the face is as large as an arm is long".to_owned());
    }
    for (name, pair) in [("eyes", EYES), ("ears", EARS), ("hips", HIPS)] {
        let is_opposite = |body: &Body| {
            let (width, shoulders) = (width(body, pair)?, width(body, SHOULDERS)?);
            let (small, large) = (width.abs().min(shoulders.abs()), width.abs().max(shoulders.abs()));
            (small > MIN_WIDTH_RATIO * large).then_some((width > 0.0) != (shoulders > 0.0))
        };
        if nearly_all(bodies, is_opposite) {
            return Some(format!("left and right of the {name} and of the shoulders are opposite"));
        }
    }
    let nose = |body: &Body| Some(f64::from(visible(body, NOSE)?.y) > height(body, SHOULDERS)?);
    if nearly_all(bodies, nose) {
        return Some("the nose is below the shoulders (y must point down)".to_owned());
    }
    let hips = |body: &Body| Some(height(body, HIPS)? < height(body, SHOULDERS)?);
    nearly_all(bodies, hips).then(|| "the hips are above the shoulders (y must point down)".to_owned())
}

fn visible(body: &Body, at: usize) -> Option<&Keypoint> {
    body.get(at).filter(|point| point.score > 0.0)
}

/// Length between two points that few persons exceed; `None` if it is unknown or 0.
fn length(bodies: &[&Body], [a, b]: [usize; 2]) -> Option<f64> {
    let distance = |body: &&Body| {
        let (a, b) = (visible(body, a)?, visible(body, b)?);
        Some(f64::from((a.x - b.x).hypot(a.y - b.y)))
    };
    let distances: Vec<f64> = bodies.iter().filter_map(distance).collect();
    let is_known = distances.len() >= MIN_PERSONS;
    Ordered::new(distances).lower_quantile(LONG).filter(|length| is_known && *length > 0.0)
}

/// Horizontal distance from the right to the left of two points.
fn width(body: &Body, [left, right]: [usize; 2]) -> Option<f64> {
    Some(f64::from(visible(body, left)?.x - visible(body, right)?.x))
}

/// Mean y of two points.
fn height(body: &Body, [left, right]: [usize; 2]) -> Option<f64> {
    Some(f64::from(visible(body, left)?.y + visible(body, right)?.y) / 2.0)
}

/// Whether a statement holds for nearly all of the persons for which it can be decided.
fn nearly_all(bodies: &[&Body], holds: impl Fn(&Body) -> Option<bool>) -> bool {
    let decided: Vec<bool> = bodies.iter().filter_map(|body| holds(body)).collect();
    let n = decided.iter().filter(|holds| **holds).count();
    decided.len() >= MIN_PERSONS && n as f64 > NEARLY_ALL * decided.len() as f64
}
