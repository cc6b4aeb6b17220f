//! Face tracking: initialised from the eyes and nose of the body, then from the face of the previous frame.

use super::landmarks::{self, FacePoint};
use super::model::{DetectedFace, FaceModel};
use crate::pose2d::decode::ScoredPoint;
use anyhow::Result;
use orator_base::types::image::Image;
use orator_base::types::pose2d::{FaceMeasurement, coco};
use orator_media::opencv::warp::Region;

/// Least presence score of a face.
const MIN_SCORE: f64 = 0.5;
/// Largest distance of the face's nose from the body's, in sides of the square; beyond it the face is another person's.
const MAX_NOSE_DISTANCE: f64 = 0.15;

/// Tracking state: region for the next frame and landmarks of the last.
#[derive(Default)]
pub struct FaceTrack {
    region: Option<Region>,
    points: Option<Vec<FacePoint>>,
}

impl FaceTrack {
    /// Landmarks of the last frame, if a face was detected.
    pub fn points(&self) -> Option<&[FacePoint]> {
        self.points.as_deref()
    }

    /// Detects the face of the person with the keypoints `body`; those that score at least `least` count as visible.
    pub fn find(
        &mut self,
        model: &mut FaceModel,
        image: &Image,
        body: &[ScoredPoint; 17],
        least: f64,
    ) -> Result<Option<FaceMeasurement>> {
        let mut detect = |region: &Region| detect(model, image, region, body, least);
        self.points = None;
        let mut found = match self.region.take() {
            Some(region) => detect(&region)?,
            None => None,
        };
        if found.is_none()
            && let Some(region) = region_from_eyes(body, least)
            && let Some(first) = detect(&region)?
        {
            // The first square is only an estimate, so the model runs again on the square around the detected face.
            found = detect(&landmarks::region(&first.points))?;
        }
        let Some(face) = found else { return Ok(None) };
        self.region = Some(landmarks::region(&face.points));
        let measured = |opening: f64| FaceMeasurement { score: face.score as f32, opening: opening as f32 };
        let face_seen = landmarks::opening(&face.points).map(measured);
        self.points = Some(face.points);
        Ok(face_seen)
    }
}

/// Face in a square, if present and belonging to the body.
fn detect(
    model: &mut FaceModel,
    image: &Image,
    region: &Region,
    body: &[ScoredPoint; 17],
    least: f64,
) -> Result<Option<DetectedFace>> {
    let Some(face) = model.find(image, region)? else { return Ok(None) };
    let [x, y, _] = face.points[landmarks::NOSE_TIP];
    let nose = body[coco::NOSE];
    let is_same_person = nose[2] < least || (x - nose[0]).hypot(y - nose[1]) <= MAX_NOSE_DISTANCE * region.side;
    Ok(Some(face).filter(|face| face.score >= MIN_SCORE && is_same_person))
}

/// Expected face region of a body: the square below its eye line, sized by eyes, nose and ears.
fn region_from_eyes(body: &[ScoredPoint; 17], least: f64) -> Option<Region> {
    let [nose, left, right] = [coco::NOSE, coco::L_EYE, coco::R_EYE].map(|at| body[at]);
    if nose[2].min(left[2]).min(right[2]) < least {
        return None;
    }
    let distance = |a: ScoredPoint, b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let eyes = [(left[0] + right[0]) / 2.0, (left[1] + right[1]) / 2.0];
    // Head rotation shortens the eye distance, but not the distance to the nose.
    let mut size = distance(left, [right[0], right[1]]).max(1.3 * distance(nose, eyes));
    let [left_ear, right_ear] = [coco::L_EAR, coco::R_EAR].map(|at| body[at]);
    if left_ear[2].min(right_ear[2]) >= least {
        size = size.max(0.45 * distance(left_ear, [right_ear[0], right_ear[1]]));
    }
    let rotation = (left[1] - right[1]).atan2(left[0] - right[0]);
    let (sin, cos) = rotation.sin_cos();
    let centre = [eyes[0] - 0.45 * size * sin, eyes[1] + 0.45 * size * cos];
    Some(Region { centre, side: 4.0 * size, rotation })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_face_region_rotates_with_the_eyes() {
        let mut body = [[0.0; 3]; 17];
        body[coco::NOSE] = [100.0, 120.0, 0.9];
        body[coco::L_EYE] = [120.0, 100.0, 0.9];
        body[coco::R_EYE] = [80.0, 100.0, 0.9];
        let upright = region_from_eyes(&body, 0.3).unwrap();
        assert_eq!((upright.centre, upright.side, upright.rotation), ([100.0, 118.0], 160.0, 0.0));
        body[coco::L_EAR] = [150.0, 100.0, 0.9];
        body[coco::R_EAR] = [50.0, 100.0, 0.9];
        assert_eq!(region_from_eyes(&body, 0.3).unwrap().side, 180.0);
        // Lying on the side: the right eye is above the left, the face to the left of both.
        (body[coco::L_EYE], body[coco::R_EYE]) = ([100.0, 120.0, 0.9], [100.0, 80.0, 0.9]);
        let lying = region_from_eyes(&body, 0.3).unwrap();
        assert!(lying.centre[0] < 100.0 && (lying.rotation - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
        body[coco::R_EYE][2] = 0.1;
        assert_eq!(region_from_eyes(&body, 0.3), None);
    }
}
