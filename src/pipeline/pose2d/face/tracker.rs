//! The face of the person followed from frame to frame: looked for where the body's eyes and nose are, then where it was.

use super::landmarks::{self, FacePoint};
use super::model::{DetectedFace, FaceModel};
use crate::pose2d::decode::ScoredPoint;
use anyhow::Result;
use orator_base::types::image::Image;
use orator_base::types::pose2d::{FaceSeen, coco};
use orator_media::opencv::warp::Region;

/// A face is one from this score on.
const LEAST_SCORE: f64 = 0.5;
/// A face whose nose is further from the body's, in sides of its square, is somebody else's.
const SAME_NOSE: f64 = 0.15;

/// Where a face was in the frame before.
#[derive(Default)]
pub struct FaceTrack {
    region: Option<Region>,
    points: Option<Vec<FacePoint>>,
}

impl FaceTrack {
    /// Points of the face in the last frame, where it was seen.
    pub fn points(&self) -> Option<&[FacePoint]> {
        self.points.as_deref()
    }

    /// The face of the body whose points are given, of which those that score `least` are seen.
    pub fn find(
        &mut self,
        model: &mut FaceModel,
        image: &Image,
        body: &[ScoredPoint; 17],
        least: f64,
    ) -> Result<Option<FaceSeen>> {
        let mut face_of = |region: &Region| face_of(model, image, region, body, least);
        self.points = None;
        let mut found = match self.region.take() {
            Some(region) => face_of(&region)?,
            None => None,
        };
        if found.is_none()
            && let Some(region) = around_eyes(body, least)
            && let Some(first) = face_of(&region)?
        {
            // The first square is a guess, one around the face found is not.
            found = face_of(&landmarks::region(&first.points))?;
        }
        let Some(face) = found else { return Ok(None) };
        self.region = Some(landmarks::region(&face.points));
        let seen = |opening: f64| FaceSeen { score: face.score as f32, opening: opening as f32 };
        let seen = landmarks::opening(&face.points).map(seen);
        self.points = Some(face.points);
        Ok(seen)
    }
}

/// The face in a square, if there is one and it is the body's.
fn face_of(
    model: &mut FaceModel,
    image: &Image,
    region: &Region,
    body: &[ScoredPoint; 17],
    least: f64,
) -> Result<Option<DetectedFace>> {
    let Some(face) = model.find(image, region)? else { return Ok(None) };
    let [x, y, _] = face.points[landmarks::NOSE_TIP];
    let nose = body[coco::NOSE];
    let is_here = nose[2] < least || (x - nose[0]).hypot(y - nose[1]) <= SAME_NOSE * region.side;
    Ok(Some(face).filter(|face| face.score >= LEAST_SCORE && is_here))
}

/// Where the face of a body should be: the square below the line of its eyes, as large as eyes, nose and ears say.
fn around_eyes(body: &[ScoredPoint; 17], least: f64) -> Option<Region> {
    let [nose, left, right] = [coco::NOSE, coco::L_EYE, coco::R_EYE].map(|at| body[at]);
    if nose[2].min(left[2]).min(right[2]) < least {
        return None;
    }
    let apart = |a: ScoredPoint, b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let eyes = [(left[0] + right[0]) / 2.0, (left[1] + right[1]) / 2.0];
    // A turned head narrows the eyes, not the way to the nose.
    let mut size = apart(left, [right[0], right[1]]).max(1.3 * apart(nose, eyes));
    let [left_ear, right_ear] = [coco::L_EAR, coco::R_EAR].map(|at| body[at]);
    if left_ear[2].min(right_ear[2]) >= least {
        size = size.max(0.45 * apart(left_ear, [right_ear[0], right_ear[1]]));
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
    fn the_face_is_below_the_eyes_whatever_its_turn() {
        let mut body = [[0.0; 3]; 17];
        body[coco::NOSE] = [100.0, 120.0, 0.9];
        body[coco::L_EYE] = [120.0, 100.0, 0.9];
        body[coco::R_EYE] = [80.0, 100.0, 0.9];
        let upright = around_eyes(&body, 0.3).unwrap();
        assert_eq!((upright.centre, upright.side, upright.rotation), ([100.0, 118.0], 160.0, 0.0));
        body[coco::L_EAR] = [150.0, 100.0, 0.9];
        body[coco::R_EAR] = [50.0, 100.0, 0.9];
        assert_eq!(around_eyes(&body, 0.3).unwrap().side, 180.0);
        // Lying on the side: the right eye above the left one, the face to the left of both.
        (body[coco::L_EYE], body[coco::R_EYE]) = ([100.0, 120.0, 0.9], [100.0, 80.0, 0.9]);
        let lying = around_eyes(&body, 0.3).unwrap();
        assert!(lying.centre[0] < 100.0 && (lying.rotation - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
        body[coco::R_EYE][2] = 0.1;
        assert_eq!(around_eyes(&body, 0.3), None);
    }
}
