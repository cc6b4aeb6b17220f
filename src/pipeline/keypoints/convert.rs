//! Conversion of keypoints of another program: one person, pixel coordinates, the dataset rate.

use super::follow::{FollowedPerson, follow};
use super::resample::person_at;
use crate::pose2d::span::keypoint_frames::KeypointFrames;
use anyhow::Result;
use orator_base::types::pose2d::{Keypoints, Pose2d};
use orator_base::types::time::FrameRate;
use orator_formats::keypoints::{FoundKeypoints, FoundPerson};
use orator_formats::keypoints_npz::Extras;

/// Longest absence, in seconds, after which a person keeps the identity.
const MAX_GAP_SECS: f64 = 1.0;

/// Keypoints at the dataset rate, with the extra arrays of `keypoints.npz`.
#[derive(Clone, Debug, PartialEq)]
pub struct ConvertedKeypoints {
    pub keypoints: Keypoints,
    pub extras: Extras,
    pub duration_secs: f64,
    /// Notes on missing data and on other persons in view.
    pub notes: Vec<String>,
}

/// Converts keypoints detected at `source_fps` in pictures of `image_size` (width, height in px) to keypoints at `fps`.
pub fn convert(
    mut found: FoundKeypoints,
    source_fps: FrameRate,
    image_size: [u32; 2],
    fps: FrameRate,
) -> Result<ConvertedKeypoints> {
    found.to_pixels(image_size);
    let max_gap = (MAX_GAP_SECS * source_fps.per_sec()) as usize;
    let followed = follow(&found.frames, image_size[0] as f32, max_gap);
    let chosen = found.frames.iter().zip(&followed.chosen);
    let people: Vec<Option<&FoundPerson>> = chosen.map(|(people, chosen)| people.get((*chosen)?)).collect();
    let duration_secs = source_fps.secs(people.len());
    let n_frames = fps.frames_in(duration_secs);
    let mut gathered = KeypointFrames::default();
    for t in 0..n_frames {
        let frame_idx = fps.secs(t) * source_fps.per_sec();
        let nearest = (frame_idx.round() as usize).min(people.len() - 1);
        // No interpolation between two identities.
        let below = frame_idx as usize;
        let is_one = followed.identity.get(below) == followed.identity.get(below + 1);
        let frame_idx = if is_one || below + 1 >= people.len() { frame_idx } else { nearest as f64 };
        gathered.push(pose(person_at(&people, frame_idx), &followed, nearest), fps.secs(t));
    }
    // The source is freed before the arrays are allocated: each takes about a kilobyte per frame.
    let mut notes = found.notes;
    drop(people);
    drop(found.frames);
    let (keypoints, extras) = gathered.finish(fps, image_size)?;
    notes.extend(note_on_others(&followed));
    Ok(ConvertedKeypoints { keypoints, extras, duration_secs, notes })
}

/// One output frame; person count and identity are those of the nearest source frame.
fn pose(person: Option<FoundPerson>, followed: &FollowedPerson, nearest: usize) -> Pose2d {
    let person = person.unwrap_or_default();
    Pose2d {
        person: person.area().unwrap_or_default(),
        n_persons: u8::try_from(followed.n_persons[nearest]).unwrap_or(u8::MAX),
        identity: followed.identity[nearest],
        body: person.body,
        left_hand: person.left_hand,
        right_hand: person.right_hand,
        ..Pose2d::default()
    }
}

/// Note on the other persons in view, if there are any.
fn note_on_others(followed: &FollowedPerson) -> Option<String> {
    let n_frames = followed.n_persons.len();
    let n_several = followed.n_persons.iter().filter(|n| **n > 1).count();
    let most = followed.n_persons.iter().max().filter(|most| **most > 1)?;
    Some(format!(
        "up to {most} persons in a frame (several in {:.0} % of the frames); one of them is followed",
        100.0 * n_several as f64 / n_frames.max(1) as f64
    ))
}
