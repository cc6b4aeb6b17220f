//! `keypoints.npz`: the 2D keypoints of a video at the dataset rate. Arrays: `body` f32 [T,17,3] (COCO-17; x px, y px,
//! score), `left_hand`, `right_hand` f32 [T,21,3], `image_size` i64 [2] (width, height), `fps` f64 [2] (numerator,
//! denominator; or one number), `time_secs` f64 [T], `person` f32 [T,5] (x, y, width, height, score), `n_persons` i64
//! [T], `identity` i64 [T], `other_hand` i64 [T,2] (1: this hand was a duplicate of the other one); with a hand model
//! with depth `hand_depth` f32 [T,2,21] (px); with a face model `mouth_opening`, `face_score` f32 [T].

use super::keypoints::range;
use super::npz::{self, Npz};
use anyhow::{Result, bail, ensure};
use ndarray::{Array1, Array2, Array3, ArrayD, Ix1, Ix2, Ix3, aview1};
use orator_base::types::pose2d::{Keypoints, N_BODY, N_HAND};
use orator_base::types::time::FrameRate;
use std::path::Path;

/// Arrays of the file other than the keypoints.
#[derive(Clone, Debug, PartialEq)]
pub struct Extras {
    /// Source time of each frame in seconds, [T].
    pub time_secs: Array1<f64>,
    /// Bounding box of the tracked person: x, y, width, height in px, score; [T, 5].
    pub person: Array2<f32>,
    /// Number of persons detected in each frame, [T].
    pub n_persons: Array1<i64>,
    /// Identity of the tracked person, [T]; incremented when another person is selected or tracking restarts.
    pub identity: Array1<i64>,
    /// Whether the left and right hand are missing because the detection at their position was the other hand, [T, 2].
    pub other_hand: Array2<bool>,
    /// Face measurements; `None` if no face model was run.
    pub face: Option<FaceFrames>,
}

/// Face measurements of the tracked person in each frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceFrames {
    /// Distance between the lips divided by the distance between the outer eye corners, [T]; NaN: no face detected.
    pub opening: Array1<f32>,
    /// Confidence that a face is present, 0..1, [T]; 0: no face detected.
    pub score: Array1<f32>,
}

/// Minimum plausible width and height of an image, px.
const MIN_IMAGE_SIDE: u32 = 16;

/// Reads the keypoints, in pixels. A point with a non-finite value becomes a missing point (all zeros).
///
/// # Errors
///
/// The file is unreadable, `body` is missing, or arrays have wrong or inconsistent shapes.
pub fn read(path: &Path) -> Result<Keypoints> {
    Ok(read_noting(path)?.0)
}

/// [`read`], with one note for each missing array that names its substitute.
pub fn read_noting(path: &Path) -> Result<(Keypoints, Vec<String>)> {
    read_sized(path, None)
}

/// [`read_noting`], with `size` (width, height), if given, replacing the image size of the file. Coordinates in 0..1
/// are fractions of the image size and are converted to pixels.
///
/// # Errors
///
/// Those of [`read`]; fractional coordinates without a known image size.
pub fn read_sized(path: &Path, size: Option<[u32; 2]>) -> Result<(Keypoints, Vec<String>)> {
    let (mut keypoints, known_size, mut notes) = read_as_written(path)?;
    if let Some(size) = size {
        keypoints.image_size = size;
        notes.retain(|note| !note.contains("`image_size`"));
    }
    if range::are_fractions(range::coordinates(&keypoints)) {
        let size = size.or(known_size).filter(|size| size.iter().all(|px| *px >= MIN_IMAGE_SIDE));
        let Some([width, height]) = size else {
            bail!(
                "{}: coordinates are fractions of the image size (0..1), and the image size is \
                 unknown: set it with --size, e.g. --size 1280x720, or add `image_size` [1280, 720] to the file",
                path.display()
            );
        };
        let n_negative = range::coordinates(&keypoints).filter(|xy| xy[0] < 0.0 || xy[1] < 0.0).count();
        ensure!(
            n_negative * 5 < range::coordinates(&keypoints).count().max(1),
            "{}: coordinates are between -1 and 1: expected pixels, or fractions of the image size from 0 to 1",
            path.display()
        );
        for points in [&mut keypoints.body, &mut keypoints.left_hand, &mut keypoints.right_hand] {
            for mut point in points.lanes_mut(ndarray::Axis(2)).into_iter().filter(|point| point[2] > 0.0) {
                point[0] = point[0] * width as f32 - 0.5;
                point[1] = point[1] * height as f32 - 0.5;
            }
        }
        notes.push(format!("coordinates in 0..1: interpreted as fractions of the image size, {width}x{height} px"));
    }
    Ok((keypoints, notes))
}

/// The keypoints in the unit of the file, the image size if the file has one, and the notes of [`read_noting`].
pub(super) fn read_as_written(path: &Path) -> Result<(Keypoints, Option<[u32; 2]>, Vec<String>)> {
    let mut npz = Npz::open(path)?;
    let mut notes = Vec::new();
    let body = points(npz.floats("body", &[None, Some(N_BODY), Some(3)])?)?;
    let n_frames = body.shape()[0];
    let mut hand = |name: &str, notes: &mut Vec<String>| {
        if !npz.has(name) {
            notes.push(format!("no `{name}`: marked as not detected"));
            return Ok(Array3::zeros((n_frames, N_HAND, 3)));
        }
        points(npz.floats(name, &[Some(n_frames), Some(N_HAND), Some(3)])?)
    };
    let left_hand = hand("left_hand", &mut notes)?;
    let right_hand = hand("right_hand", &mut notes)?;
    let depth_shape = [Some(n_frames), Some(2), Some(N_HAND)];
    let hand_depth = npz.has("hand_depth").then(|| npz.floats("hand_depth", &depth_shape)).transpose()?;
    let hand_depth = hand_depth.map(ArrayD::into_dimensionality::<Ix3>).transpose()?;
    let fps = if npz.has("fps") {
        npz.frame_rate("fps")?
    } else {
        notes.push("no `fps`: assuming 15 fps".to_owned());
        FrameRate::new(15, 1)
    };
    let known_size = if npz.has("image_size") {
        let size = npz.numbers("image_size", &[Some(2)])?;
        let side = |v: f64| if (1.0..=1e6).contains(&v) { Some(v as u32) } else { None };
        match (side(size[0]), side(size[1])) {
            (Some(width), Some(height)) => Some([width, height]),
            _ => bail!(
                "{}: invalid `image_size` {size}: expected width and height in px, each 1 to 1000000; \
                 omit the array if they are unknown",
                path.display()
            ),
        }
    } else {
        notes.push("no `image_size`: estimated from the farthest points".to_owned());
        None
    };
    let extent = |axis: usize| body.slice(ndarray::s![.., .., axis]).fold(1.0f32, |m, &v| m.max(v)).min(1e6).ceil();
    let image_size = known_size.unwrap_or_else(|| [extent(0) as u32, extent(1) as u32]);
    Ok((Keypoints { fps, image_size, body, left_hand, right_hand, hand_depth }, known_size, notes))
}

/// Reads the arrays other than the keypoints.
///
/// # Errors
///
/// The file is unreadable, or an array is missing or has a wrong shape.
pub fn read_extras(path: &Path) -> Result<Extras> {
    let mut npz = Npz::open(path)?;
    let time_secs = npz.numbers("time_secs", &[None])?.into_dimensionality::<Ix1>()?;
    let n_frames = Some(time_secs.len());
    let person = npz.floats("person", &[n_frames, Some(5)])?.into_dimensionality::<Ix2>()?;
    let n_persons = npz.numbers("n_people", &[n_frames])?.mapv(|v| v as i64).into_dimensionality::<Ix1>()?;
    let identity = npz.numbers("identity", &[n_frames])?.mapv(|v| v as i64).into_dimensionality::<Ix1>()?;
    // Files of earlier versions lack this array.
    let other_hand = match npz.has("other_hand") {
        true => npz.numbers("other_hand", &[n_frames, Some(2)])?.mapv(|v| v != 0.0).into_dimensionality::<Ix2>()?,
        false => Array2::from_elem((time_secs.len(), 2), false),
    };
    let face = npz.has("mouth_opening").then(|| -> Result<FaceFrames> {
        let mut face_array =
            |name: &str| -> Result<Array1<f32>> { Ok(npz.floats(name, &[n_frames])?.into_dimensionality::<Ix1>()?) };
        Ok(FaceFrames { opening: face_array("mouth_opening")?, score: face_array("face_score")? })
    });
    let face = face.transpose()?;
    Ok(Extras { time_secs, person, n_persons, identity, other_hand, face })
}

/// Writes the file at `path`. The bytes are deterministic.
pub fn write(path: &Path, keypoints: &Keypoints, extras: &Extras) -> Result<()> {
    npz::write(path, |npz| {
        npz.add_array("body", &keypoints.body)?;
        npz.add_array("left_hand", &keypoints.left_hand)?;
        npz.add_array("right_hand", &keypoints.right_hand)?;
        npz.add_array("image_size", &aview1(&keypoints.image_size.map(i64::from)))?;
        npz.add_array("fps", &npz::rate(keypoints.fps))?;
        npz.add_array("time_secs", &extras.time_secs)?;
        npz.add_array("person", &extras.person)?;
        npz.add_array("n_people", &extras.n_persons)?;
        npz.add_array("identity", &extras.identity)?;
        if let Some(hand_depth) = &keypoints.hand_depth {
            npz.add_array("hand_depth", hand_depth)?;
        }
        if extras.other_hand.iter().any(|other| *other) {
            npz.add_array("other_hand", &extras.other_hand.mapv(i64::from))?;
        }
        if let Some(FaceFrames { opening, score }) = &extras.face {
            npz.add_array("mouth_opening", opening)?;
            npz.add_array("face_score", score)?;
        }
        Ok(())
    })
}

/// Points [T, n, 3], with every non-finite point replaced by a missing one (zeros).
fn points(array: ArrayD<f32>) -> Result<Array3<f32>> {
    let mut points = array.into_dimensionality::<Ix3>()?;
    for mut point in points.lanes_mut(ndarray::Axis(2)) {
        if point.iter().any(|v| !v.is_finite()) {
            point.fill(0.0);
        }
    }
    Ok(points)
}
