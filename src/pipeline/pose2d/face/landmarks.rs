//! Measurements on the 468 points of MediaPipe's face mesh. The lip opening is in space, independent of head rotation.

use orator_base::math::vec3;
use orator_media::opencv::warp::Region;

pub const N_LANDMARKS: usize = 468;
/// Outer corners of the eyes, right first.
const EYES: [usize; 2] = [33, 263];
/// Points in the middle of the inner upper lip, each paired with one of the lower lip.
const UPPER_LIP: [usize; 3] = [82, 13, 312];
const LOWER_LIP: [usize; 3] = [87, 14, 317];
pub const NOSE_TIP: usize = 1;
/// Side of the face square relative to the face size (MediaPipe's face_landmark_landmarks_to_roi).
const CROP_SCALE: f64 = 1.5;

/// Point x, y in px of the picture, depth in units of the same size.
pub type FacePoint = [f64; 3];

/// Lip distance relative to the distance of the outer eye corners; 0: closed. `None` if it is not finite.
pub fn opening(points: &[FacePoint]) -> Option<f64> {
    let middle = |lip: [usize; 3]| {
        let sum = lip.iter().try_fold([0.0; 3], |sum, at| Some(vec3::add(sum, *points.get(*at)?)));
        sum.map(|sum| vec3::scale(sum, 1.0 / 3.0))
    };
    let lips = vec3::norm(vec3::sub(middle(UPPER_LIP)?, middle(LOWER_LIP)?));
    let eyes = vec3::norm(vec3::sub(*points.get(EYES[0])?, *points.get(EYES[1])?));
    Some(lips / eyes).filter(|opening| opening.is_finite())
}

/// How far a face is turned sideways: offset of the nose tip from the midpoint of the eyes along the eye line,
/// relative to the eye distance in the picture; 0: frontal. `None` if it is not finite.
pub fn turn(points: &[FacePoint]) -> Option<f64> {
    let flat = |at: usize| points.get(at).map(|[x, y, _]| [*x, *y, 0.0]);
    let ([right, left], nose) = ([flat(EYES[0])?, flat(EYES[1])?], flat(NOSE_TIP)?);
    let (line, middle) = (vec3::sub(left, right), vec3::scale(vec3::add(left, right), 0.5));
    let turn = vec3::dot(vec3::sub(nose, middle), line).abs() / vec3::dot(line, line);
    Some(turn).filter(|turn| turn.is_finite())
}

/// Square around a face, rotated with its eye line.
pub fn region(points: &[FacePoint]) -> Region {
    let eye = |at: usize| points.get(at).copied().unwrap_or([f64::NAN; 3]);
    let ([right, left], mut low, mut high) = (EYES.map(eye), [f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let rotation = (left[1] - right[1]).atan2(left[0] - right[0]);
    let (sin, cos) = rotation.sin_cos();
    for [x, y, _] in points {
        let turned = [x * cos + y * sin, y * cos - x * sin];
        low = [low[0].min(turned[0]), low[1].min(turned[1])];
        high = [high[0].max(turned[0]), high[1].max(turned[1])];
    }
    let [x, y] = [(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0];
    Region {
        centre: [x * cos - y * sin, x * sin + y * cos],
        side: CROP_SCALE * (high[0] - low[0]).max(high[1] - low[1]),
        rotation,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A face 100 px wide and 140 px high around (200, 100), eyes 60 px and lips `open` px apart, rotated by `angle`.
    fn face(open: f64, angle: f64) -> Vec<FacePoint> {
        let mut points: Vec<FacePoint> = (0..N_LANDMARKS)
            .map(|k| {
                let around = k as f64 / N_LANDMARKS as f64 * std::f64::consts::TAU;
                [50.0 * around.cos(), 70.0 * around.sin(), 0.0]
            })
            .collect();
        (points[EYES[0]], points[EYES[1]]) = ([-30.0, -20.0, 0.0], [30.0, -20.0, 0.0]);
        for (upper, lower) in UPPER_LIP.into_iter().zip(LOWER_LIP) {
            (points[upper], points[lower]) = ([0.0, 30.0, 5.0], [0.0, 30.0 + open, 5.0]);
        }
        let (sin, cos) = angle.sin_cos();
        points.iter().map(|[x, y, z]| [200.0 + x * cos - y * sin, 100.0 + x * sin + y * cos, *z]).collect()
    }

    #[test]
    fn mouth_opening_is_relative_to_the_eyes() {
        assert!((opening(&face(12.0, 0.3)).unwrap() - 0.2).abs() < 1e-9);
        assert_eq!(opening(&face(0.0, 0.0)), Some(0.0));
        assert_eq!((opening(&[]), opening(&vec![[1.0; 3]; N_LANDMARKS])), (None, None));
    }

    #[test]
    fn the_square_is_around_the_face_and_turned_with_it() {
        for angle in [0.0, 0.4, -1.0] {
            let found = region(&face(5.0, angle));
            assert!((found.rotation - angle).abs() < 1e-9 && (found.side - 210.0).abs() < 0.5, "{found:?}");
            assert!((found.centre[0] - 200.0).abs() < 0.5 && (found.centre[1] - 100.0).abs() < 0.5, "{found:?}");
        }
        assert_eq!(region(&[]).src_from_dst(192), None);
        assert_eq!(region(&vec![[f64::NAN; 3]; N_LANDMARKS]).src_from_dst(192), None);
    }
}
