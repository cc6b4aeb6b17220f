//! PATS arrays (Ahuja et al. 2020): 52 joints at 15 frames per second, [T, 104] or [T, 2, 52] (all x, then all y) or
//! [T, 52, 2], optionally with `confidence` [T, 52]. If the neck is at 0, 0 in every frame, the coordinates are
//! relative to it. The HDF5 files of the dataset are not read: `pose/data` has to be exported as an array first.

use super::entry::point;
use super::found::{CoordinateUnit, FoundKeypoints, NamedArrays};
use super::layout::PATS;
use anyhow::{Result, ensure};
use orator_base::types::pose2d::Keypoint;
use orator_base::types::time::FrameRate;

const N: usize = PATS.n_points;
const RATE: FrameRate = FrameRate::new(15, 1);

/// The keypoints; `None` if no array has a PATS shape.
///
/// # Errors
///
/// The confidence has another shape, or neck-relative points are not in pixels.
pub fn read(arrays: &NamedArrays) -> Result<Option<FoundKeypoints>> {
    let is_pats = |shape: &[usize]| matches!(shape, [_, 2, N] | [_, N, 2]) || matches!(shape, [_, n] if *n == 2 * N);
    let Some((_, array)) = arrays.iter().find(|(_, array)| is_pats(array.shape())) else { return Ok(None) };
    let confidence = arrays.iter().find(|(name, array)| name.contains("confidence") && array.ndim() == 2);
    let n_frames = array.shape()[0];
    if let Some((name, scores)) = confidence {
        let shape = scores.shape();
        ensure!(shape == [n_frames, N], "`{name}` has shape {shape:?}, expected [{n_frames}, {N}]");
    }
    let score = |t: usize, j: usize| confidence.map_or(1.0, |(_, scores)| scores[[t, j]]);
    let xy = |t: usize, j: usize| match array.shape() {
        [_, N, 2] => [array[[t, j, 0]], array[[t, j, 1]]],
        [_, 2, N] => [array[[t, 0, j]], array[[t, 1, j]]],
        _ => [array[[t, j]], array[[t, N + j]]],
    };
    let frame = |t: usize| {
        let points: Vec<Keypoint> = (0..N).map(|j| (xy(t, j), score(t, j))).map(|([x, y], s)| point(x, y, s)).collect();
        let person = PATS.person(&points);
        if person.area().is_some() { vec![person] } else { Vec::new() }
    };
    let found = FoundKeypoints::new("PATS, 52 points".to_owned(), (0..n_frames).map(frame).collect(), Vec::new());
    let from_neck = (0..n_frames).all(|t| xy(t, 0) == [0.0; 2]);
    ensure!(
        !from_neck || found.unit == CoordinateUnit::Pixels,
        "its points are less than 2 from the neck at 0, 0: expected pixels of the video, in which the shoulders are \
         hundreds of pixels apart"
    );
    let unit = if from_neck { CoordinateUnit::FromNeck } else { found.unit };
    Ok(Some(FoundKeypoints { fps: Some(RATE), unit, layout: PATS.name.to_owned(), ..found }))
}
