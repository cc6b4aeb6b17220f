//! Keypoints of another program as ours: one person, pixels, the dataset rate.

use super::follow::{FollowedPerson, follow};
use super::resample::person_at;
use crate::pose2d::span::keypoint_frames::KeypointFrames;
use anyhow::Result;
use orator_base::types::pose2d::{Keypoints, Pose2d};
use orator_base::types::time::FrameRate;
use orator_formats::keypoints::{FoundKeypoints, FoundPerson};
use orator_formats::keypoints_npz::Extras;

/// Seconds for which a person may be gone and still be the same.
const MAX_GAP_SECS: f64 = 1.0;

/// Keypoints at the dataset rate, with what our own files hold beside them.
#[derive(Clone, Debug, PartialEq)]
pub struct TakenKeypoints {
    pub keypoints: Keypoints,
    pub extras: Extras,
    /// Length of the frames at their own rate.
    pub duration_secs: f64,
    /// Sentences on what was missing, and on other people.
    pub notes: Vec<String>,
}

/// Takes in keypoints found at `source_fps` in pictures of `image_size`, as keypoints at `fps`.
pub fn take_in(
    mut found: FoundKeypoints,
    source_fps: FrameRate,
    image_size: [u32; 2],
    fps: FrameRate,
) -> Result<TakenKeypoints> {
    found.to_pixels(image_size);
    let max_gap = (MAX_GAP_SECS * source_fps.per_sec()) as usize;
    let followed = follow(&found.frames, image_size[0] as f32, max_gap);
    let chosen = found.frames.iter().zip(&followed.chosen);
    let people: Vec<Option<&FoundPerson>> = chosen.map(|(people, chosen)| people.get((*chosen)?)).collect();
    let duration_secs = source_fps.secs(people.len());
    let n_frames = fps.frames_in(duration_secs);
    let mut gathered = KeypointFrames::default();
    for t in 0..n_frames {
        let place = fps.secs(t) * source_fps.per_sec();
        let nearest = (place.round() as usize).min(people.len() - 1);
        // Two people are not mixed.
        let below = place as usize;
        let is_one = followed.identity.get(below) == followed.identity.get(below + 1);
        let place = if is_one || below + 1 >= people.len() { place } else { nearest as f64 };
        gathered.push(pose(person_at(&people, place), &followed, nearest), fps.secs(t));
    }
    // The source is gone before the arrays are there: each takes a kilobyte a frame.
    let mut notes = found.notes;
    drop(people);
    drop(found.frames);
    let (keypoints, extras) = gathered.finish(fps, image_size)?;
    notes.extend(others(&followed));
    Ok(TakenKeypoints { keypoints, extras, duration_secs, notes })
}

/// The frame of our own files; people and identity are those of the source's nearest frame.
fn pose(person: Option<FoundPerson>, followed: &FollowedPerson, nearest: usize) -> Pose2d {
    let person = person.unwrap_or_default();
    Pose2d {
        person: person.area().unwrap_or_default(),
        n_people: u8::try_from(followed.n_people[nearest]).unwrap_or(u8::MAX),
        identity: followed.identity[nearest],
        body: person.body,
        left_hand: person.left_hand,
        right_hand: person.right_hand,
        other_hand: [false; 2],
        face: None,
    }
}

/// Sentence on people beside the one followed.
fn others(followed: &FollowedPerson) -> Option<String> {
    let n_frames = followed.n_people.len();
    let n_several = followed.n_people.iter().filter(|n| **n > 1).count();
    let most = followed.n_people.iter().max().filter(|most| **most > 1)?;
    Some(format!(
        "up to {most} people in a frame ({:.0} % of the frames show several); one is followed",
        100.0 * n_several as f64 / n_frames.max(1) as f64
    ))
}
