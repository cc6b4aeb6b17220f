//! Choice of the speaker among the detected persons: in a new shot the largest, most central and most certain one,
//! weighted by similarity to the reference picture; after that the one that overlaps the tracked box. A candidate that
//! turns out to be a picture is replaced by a living one, one far from the reference by one close to it, and anyone by
//! the known active speaker.

use super::decode::boxes;
use super::liveness::Movement;
use orator_base::types::pose2d::PersonBox;

/// Least overlap of a detection with the tracked box to be the same person.
const MIN_OVERLAP: f32 = 0.2;
/// Consecutive detections without the speaker after which another person is chosen.
const MAX_MISSED: usize = 2;
/// A box whose change never exceeds this, in 8-bit steps, in this many measurements, is a picture.
const MAX_PICTURE_CHANGE: f32 = 4.0;
const MIN_MEASUREMENTS: usize = 3;
/// Least change of a living person, absolute and relative to that of a picture.
const MIN_LIVE_CHANGE: f32 = 6.0;
const MIN_LIVE_RATIO: f32 = 2.0;
/// Appearance distance in 8-bit steps at which a candidate's weight is halved.
const HALF_WEIGHT_DISTANCE: f32 = 5.0;
/// Weight multiplier for a candidate known to be speaking.
const SPEAKING_WEIGHT: f32 = 1e6;
/// Persons smaller than this share of the speaker's box are not counted.
const MIN_RELATIVE_AREA: f32 = 0.2;

#[derive(Clone, Copy, Debug, Default)]
pub struct Candidate {
    pub person: PersonBox,
    pub movement: Movement,
    /// Distance to the reference appearance, if there is one.
    pub appearance_distance: Option<f32>,
    /// Known to be the active speaker of the shot.
    pub speaks: bool,
}

impl Candidate {
    fn is_picture(&self) -> bool {
        self.movement.n >= MIN_MEASUREMENTS && self.movement.max_change < MAX_PICTURE_CHANGE
    }

    fn is_livelier_than(&self, picture: &Self) -> bool {
        self.movement.max_change >= MIN_LIVE_CHANGE.max(MIN_LIVE_RATIO * picture.movement.max_change)
    }

    /// Weight as speaker: size, score, centrality, liveness, similarity to the reference.
    fn weight(&self, image_width: usize) -> f32 {
        let middle = image_width as f32 / 2.0;
        let PersonBox { x, width, height, score, .. } = self.person;
        let eccentricity = ((x + width / 2.0 - middle) / middle.max(1.0)).abs().min(1.0);
        let alive = if self.is_picture() { 0.1 } else { 1.0 };
        let similarity = self
            .appearance_distance
            .map_or(1.0, |appearance_distance| 1.0 / (1.0 + (appearance_distance / HALF_WEIGHT_DISTANCE).powi(2)));
        let speaks = if self.speaks { SPEAKING_WEIGHT } else { 1.0 };
        score * width * height * (1.0 - 0.5 * eccentricity) * alive * similarity * speaks
    }

    /// Whether `other` replaces this one: it speaks, is alive while this is a picture, or much closer to the reference.
    fn gives_way_to(&self, other: &Self) -> bool {
        let is_more_similar = || matches!((self.appearance_distance, other.appearance_distance), (Some(mine), Some(other)) if other < HALF_WEIGHT_DISTANCE && mine > 2.0 * other.max(2.5));
        !self.speaks && (other.speaks || (self.is_picture() && other.is_livelier_than(self)) || is_more_similar())
    }
}

/// Parameters of an update of the track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackerStep {
    pub image_width: usize,
    /// Weight of a new box in the moving average; `None`: the box stays and a missing person is not counted as missed.
    pub follow: Option<f64>,
    /// A body was detected in the tracked box since the last detection.
    pub body_visible: bool,
}

/// Track of the speaker through a shot.
#[derive(Default)]
pub struct PersonTrack {
    /// Bounding box x, y, width, height in px.
    pub bbox: Option<[f64; 4]>,
    pub score: f32,
    /// Number of persons of relevant size at the last detection, pictures excluded.
    pub n_persons: u8,
    n_missed: usize,
    /// Number of identities so far; the current one is the last.
    n_identities: i64,
}

impl PersonTrack {
    pub fn update(&mut self, found: &[Candidate], step: TrackerStep) {
        if let Some(bbox) = self.bbox {
            self.continue_track(found, bbox, step);
        } else {
            self.choose(found, step.image_width);
        }
        let least = self.bbox.map_or(0.0, |[_, _, width, height]| MIN_RELATIVE_AREA * (width * height) as f32);
        let is_relevant = |one: &&Candidate| one.person.width * one.person.height >= least && !one.is_picture();
        self.n_persons = u8::try_from(found.iter().filter(is_relevant).count()).unwrap_or(u8::MAX);
    }

    fn continue_track(&mut self, found: &[Candidate], bbox: [f64; 4], step: TrackerStep) {
        let [x, y, width, height] = bbox.map(|px| px as f32);
        let followed = PersonBox { x, y, width, height, score: 0.0 };
        let nearest = found.iter().map(|one| (boxes::overlap(&one.person, &followed), one));
        match nearest.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((overlap, same)) if overlap >= MIN_OVERLAP => {
                let better: Vec<Candidate> = found.iter().filter(|other| same.gives_way_to(other)).copied().collect();
                if !better.is_empty() {
                    return self.choose(&better, step.image_width);
                }
                if let Some(weight) = step.follow {
                    let new = to_array(&same.person);
                    self.bbox = Some(std::array::from_fn(|at| (1.0 - weight) * bbox[at] + weight * new[at]));
                    (self.score, self.n_missed) = (same.person.score, 0);
                }
            }
            _ if step.follow.is_some() => {
                self.n_missed += 1;
                if self.n_missed >= MAX_MISSED && (!found.is_empty() || !step.body_visible) {
                    self.choose(found, step.image_width);
                }
            }
            _ => {}
        }
    }

    /// Starts following the candidate with the largest weight; nobody if there is none.
    pub fn choose(&mut self, found: &[Candidate], image_width: usize) {
        let best = found.iter().max_by(|a, b| a.weight(image_width).total_cmp(&b.weight(image_width)));
        self.bbox = best.map(|one| to_array(&one.person));
        self.n_identities += i64::from(best.is_some());
        self.score = best.map_or(0.0, |one| one.person.score);
        self.n_missed = 0;
    }

    /// Stops following; the next person chosen is a new identity.
    pub fn reset(&mut self) {
        *self = Self { n_identities: self.n_identities, ..Self::default() };
    }

    pub fn merge_with_previous(&mut self) {
        self.n_identities = (self.n_identities - 1).max(1);
    }

    /// Number of identities so far.
    pub fn n_identities(&self) -> i64 {
        self.n_identities
    }

    /// Number of the current identity, from 0.
    pub fn identity(&self) -> i64 {
        (self.n_identities - 1).max(0)
    }

    /// Box for the output file; zeros if nobody is followed.
    pub fn person(&self) -> PersonBox {
        let Some([x, y, width, height]) = self.bbox.map(|bbox| bbox.map(|px| px as f32)) else {
            return PersonBox::default();
        };
        PersonBox { x, y, width, height, score: self.score }
    }
}

fn to_array(one: &PersonBox) -> [f64; 4] {
    [one.x, one.y, one.width, one.height].map(f64::from)
}
