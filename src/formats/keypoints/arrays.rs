//! Keypoint arrays in `.npy` and `.npz`, identified by shape: MediaPipe landmarks, PATS, COCO, and `keypoints.npz`.

use super::entry::point;
use super::found::{FoundKeypoints, FoundPerson, NamedArrays};
use super::{counted, mediapipe, pats};
use crate::npz::Npz;
use crate::{keypoints_npz, npy};
use anyhow::{Context, Result, bail};
use ndarray::{Array3, ArrayView2, Axis};
use orator_base::types::pose2d::Keypoint;
use orator_base::types::time::FrameRate;
use std::path::Path;

/// Reads the array of a `.npy` file.
pub fn read_npy(path: &Path, bytes: &[u8]) -> Result<FoundKeypoints> {
    let expected =
        || format!("{} is not a .npy file of numbers: expected float32, float64 or integers", path.display());
    let array = npy::numbers(bytes).with_context(expected)?.with_context(expected)?;
    from_arrays(path, vec![(String::new(), array.mapv(|v| v as f32))])
}

/// Reads a `.npz`. `fps` (one number, or numerator and denominator) and `image_size` (width, height) are always read.
pub fn read_npz(path: &Path) -> Result<FoundKeypoints> {
    let mut npz = Npz::open(path)?;
    let fps = if npz.has("fps") { Some(npz.frame_rate("fps")?) } else { None };
    if npz.has("body") {
        return read_keypoints_npz(path, fps);
    }
    let names: Vec<String> = npz.names().to_vec();
    // Arrays of strings and objects are ignored.
    let arrays = names.into_iter().filter_map(|name| npz.floats(&name, &[]).ok().map(|array| (name, array)));
    let arrays: NamedArrays = arrays.collect();
    let size = arrays.iter().find(|(name, array)| name == "image_size" && array.len() == 2);
    let size = size.map(|(_, array)| array.iter().map(|px| *px as u32).collect::<Vec<_>>());
    let mut found = from_arrays(path, arrays)?;
    found.fps = fps.or(found.fps);
    found.image_size = size.map(|size| [size[0], size[1]]).filter(|size| size.iter().all(|px| *px > 0));
    Ok(found)
}

type ArraysReader = fn(&NamedArrays) -> Result<Option<FoundKeypoints>>;

fn from_arrays(path: &Path, arrays: NamedArrays) -> Result<FoundKeypoints> {
    let shapes: Vec<String> = arrays.iter().map(|(name, array)| format!("{name} {:?}", array.shape())).collect();
    let readers: [ArraysReader; 3] = [mediapipe::read, pats::read, counted::read];
    let read = readers.into_iter().find_map(|read| read(&arrays).transpose()).transpose();
    match read.with_context(|| path.display().to_string())? {
        Some(found) => Ok(found),
        None => bail!(
            "{}: expected an array `body` [T, 17, 3], MediaPipe landmarks ([T, 33, 3..5], or with hands [T, 21, 3]; \
             [T, 75, 3..4], [T, 543, 3], [T, 1662]), PATS ([T, 2, 52], [T, 104]) or COCO ([T, 17, 2..3], [T, 133, 2..3]); \
             found: {}",
            path.display(),
            shapes.iter().map(|shape| shape.trim()).collect::<Vec<_>>().join(", ")
        ),
    }
}

/// Reads `keypoints.npz` as written by this program.
fn read_keypoints_npz(path: &Path, fps: Option<FrameRate>) -> Result<FoundKeypoints> {
    let (keypoints, image_size, notes) = keypoints_npz::read_as_written(path)?;
    let person = |t: usize| {
        let points = |array: &Array3<f32>| -> Vec<Keypoint> { triples(array.index_axis(Axis(0), t)) };
        let hand = |array: &Array3<f32>| points(array).try_into().unwrap_or_default();
        let body = points(&keypoints.body).try_into().unwrap_or_default();
        FoundPerson { body, left_hand: hand(&keypoints.left_hand), right_hand: hand(&keypoints.right_hand) }
    };
    let frames = (0..keypoints.n_frames()).map(|t| vec![person(t)]).collect();
    // The caller replaces missing rates and sizes and adds its own notes on them.
    let notes = notes.into_iter().filter(|note| !note.contains("`fps`") && !note.contains("image_size")).collect();
    Ok(FoundKeypoints { fps, image_size, ..FoundKeypoints::new("orator, 17 points".to_owned(), frames, notes) })
}

fn triples(points: ArrayView2<f32>) -> Vec<Keypoint> {
    points.outer_iter().map(|p| point(p[0], p[1], p[2])).collect()
}
