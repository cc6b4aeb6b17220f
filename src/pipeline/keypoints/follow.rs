//! Selection of one person among several: detections of neighbouring frames are joined to tracks by overlap or
//! proximity; the track with the largest weight (size, score, centrality, length) is chosen, and the frames that it
//! does not cover go to the next.

use crate::pose2d::decode::boxes::overlap;
use orator_base::types::pose2d::PersonBox;
use orator_formats::keypoints::FoundPerson;

/// Least overlap (IoU) of two boxes of the same person.
const SAME_PERSON: f32 = 0.2;
/// Largest distance of the centres of two boxes with less overlap, in widths of the wider box.
const MAX_DISTANCE: f32 = 0.5;
/// Similarity of two boxes with less overlap but equal centres; below that of any two with enough overlap.
const NEAR_SIMILARITY: f32 = 0.1;

/// The person that is followed through a video; one value per frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FollowedPerson {
    /// Index among the persons of the frame.
    pub chosen: Vec<Option<usize>>,
    /// Identity number; incremented when another person is followed.
    pub identity: Vec<i64>,
    pub n_persons: Vec<usize>,
}

/// Detections of one person over several frames.
struct BoxTrack {
    /// Frame and index among its persons, in order of time.
    detections: Vec<(usize, usize)>,
    last: PersonBox,
    weight: f64,
}

/// Follows one person through `frames` of pictures `image_width` px wide. A person who is absent for more than
/// `max_gap` frames counts as another person.
pub fn follow(frames: &[Vec<FoundPerson>], image_width: f32, max_gap: usize) -> FollowedPerson {
    let mut tracks = tracks(frames, image_width, max_gap);
    // The sort is stable, so the earlier track wins a tie.
    tracks.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    let mut owner: Vec<Option<usize>> = vec![None; frames.len()];
    let mut chosen = vec![None; frames.len()];
    for (number, track) in tracks.iter().enumerate() {
        let free: Vec<(usize, usize)> = track.detections.iter().copied().filter(|(t, _)| owner[*t].is_none()).collect();
        for &(t, person) in &free {
            chosen[t] = Some(person);
        }
        // Gaps within a track belong to it, so that nobody else is followed while the person is hidden.
        for pair in track.detections.windows(2) {
            owner[pair[0].0..=pair[1].0].iter_mut().for_each(|slot| *slot = slot.or(Some(number)));
        }
        for (t, _) in free {
            owner[t] = Some(number);
        }
    }
    let (mut identity, mut n_changes, mut before) = (Vec::with_capacity(frames.len()), 0, None);
    for slot in owner {
        if slot.is_some() && slot != before {
            n_changes += i64::from(before.is_some());
            before = slot;
        }
        identity.push(n_changes);
    }
    FollowedPerson { chosen, identity, n_persons: frames.iter().map(Vec::len).collect() }
}

fn tracks(frames: &[Vec<FoundPerson>], image_width: f32, max_gap: usize) -> Vec<BoxTrack> {
    let mut tracks: Vec<BoxTrack> = Vec::new();
    let mut active: Vec<usize> = Vec::new();
    for (t, people) in frames.iter().enumerate() {
        active.retain(|track| tracks[*track].detections.last().is_some_and(|(last, _)| t - last <= max_gap));
        let areas: Vec<(usize, PersonBox)> =
            people.iter().enumerate().filter_map(|(k, person)| Some((k, person.area()?))).collect();
        let mut pairs: Vec<(f32, usize, usize)> = Vec::new();
        for (at, (_, area)) in areas.iter().enumerate() {
            let near = active.iter().map(|track| (similarity(&tracks[*track].last, area), at, *track));
            pairs.extend(near.filter(|(similarity, _, _)| *similarity > 0.0));
        }
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.2, a.1).cmp(&(b.2, b.1))));
        let mut track_of: Vec<Option<usize>> = vec![None; areas.len()];
        for (_, at, track) in pairs {
            if track_of[at].is_none() && !track_of.contains(&Some(track)) {
                track_of[at] = Some(track);
            }
        }
        for ((person, area), track) in areas.into_iter().zip(track_of) {
            let track = track.unwrap_or_else(|| {
                tracks.push(BoxTrack { detections: Vec::new(), last: area, weight: 0.0 });
                active.push(tracks.len() - 1);
                tracks.len() - 1
            });
            let track = &mut tracks[track];
            track.detections.push((t, person));
            track.last = area;
            track.weight += weight(&area, image_width);
        }
    }
    tracks
}

/// Similarity of two boxes: their overlap, a small value if they are only close, or 0.
fn similarity(a: &PersonBox, b: &PersonBox) -> f32 {
    let shared = overlap(a, b);
    if shared >= SAME_PERSON {
        return shared;
    }
    let centre = |area: &PersonBox| [area.x + area.width / 2.0, area.y + area.height / 2.0];
    let ([ax, ay], [bx, by]) = (centre(a), centre(b));
    let distance = (ax - bx).hypot(ay - by) / a.width.max(b.width).max(1.0);
    if distance <= MAX_DISTANCE { NEAR_SIMILARITY * (1.0 - distance) } else { 0.0 }
}

/// Weight of a detection: size, score and distance from the centre of the picture.
fn weight(area: &PersonBox, image_width: f32) -> f64 {
    let middle = image_width / 2.0;
    let off = ((area.x + area.width / 2.0 - middle) / middle.max(1.0)).abs().min(1.0);
    f64::from(area.score * area.width * area.height * (1.0 - 0.5 * off))
}
