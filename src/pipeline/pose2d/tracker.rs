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

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f32, width: f32, score: f32) -> Candidate {
        Candidate { person: PersonBox { x, y: 0.0, width, height: 100.0, score }, ..Candidate::default() }
    }

    fn moving(candidate: Candidate, max_change: f32) -> Candidate {
        Candidate { movement: Movement { n: 3, max_change }, ..candidate }
    }

    fn tracker_step(image_width: usize, body_visible: bool) -> TrackerStep {
        TrackerStep { image_width, follow: Some(0.3), body_visible }
    }

    #[test]
    fn the_first_choice_is_followed_past_a_better_one() {
        let mut followed = PersonTrack::default();
        followed.update(&[at(0.0, 100.0, 0.9), at(100.0, 110.0, 0.9)], tracker_step(300, false));
        assert_eq!((followed.person().x, followed.n_persons), (100.0, 2));
        followed.update(&[at(0.0, 250.0, 0.9), at(120.0, 110.0, 0.5)], tracker_step(300, true));
        assert!((followed.person().x - 106.0).abs() < 1e-4 && followed.person().score == 0.5);
        followed.update(&[at(130.0, 110.0, 0.5)], TrackerStep { follow: None, ..tracker_step(300, true) });
        assert!((followed.person().x - 106.0).abs() < 1e-4 && followed.identity() == 0);
    }

    #[test]
    fn the_followed_person_is_not_replaced_by_a_larger_one() {
        let mut followed = PersonTrack::default();
        for step in 0..30 {
            let grown = step as f32;
            let mut found = [at(40.0 + 0.5 * grown, 130.0 - grown, 0.9), at(180.0 - grown, 110.0 + 2.0 * grown, 0.95)];
            if step % 2 == 1 {
                found.reverse();
            }
            followed.update(&found, tracker_step(340, true));
            let PersonBox { x, width, score, .. } = followed.person();
            assert!(x + width / 2.0 < 120.0 && score == 0.9, "step {step}: the box has gone to {x} + {width}");
        }
        // A new tracker would choose the other person by now.
        let mut fresh = PersonTrack::default();
        fresh.update(&[at(54.5, 101.0, 0.9), at(151.0, 168.0, 0.95)], tracker_step(340, true));
        assert_eq!((fresh.person().x, fresh.n_persons, followed.identity()), (151.0, 2, 0));
    }

    #[test]
    fn a_missing_speaker_is_retained_while_the_body_is_visible() {
        let mut followed = PersonTrack::default();
        followed.update(&[at(100.0, 100.0, 0.9)], tracker_step(300, false));
        for _ in 0..5 {
            followed.update(&[], tracker_step(300, true));
        }
        assert_eq!((followed.person().x, followed.n_persons, followed.identity()), (100.0, 0, 0));
        followed.update(&[at(0.0, 30.0, 0.9)], tracker_step(300, true));
        assert_eq!((followed.person().x, followed.identity()), (0.0, 1));
        followed.update(&[], tracker_step(300, false));
        followed.update(&[], tracker_step(300, false));
        assert_eq!(followed.bbox, None);
    }

    #[test]
    fn a_printed_person_is_replaced_by_a_living_one() {
        let (large, small) = (at(80.0, 200.0, 0.9), at(0.0, 60.0, 0.8));
        let mut followed = PersonTrack::default();
        followed.update(&[large, small], tracker_step(300, false));
        assert_eq!(followed.person().x, 80.0);
        // A motionless person still shows sensor noise; a box without any is a printed or on-screen picture.
        followed.update(&[moving(large, 5.0), moving(small, 30.0)], tracker_step(300, true));
        assert_eq!((followed.person().x, followed.identity()), (80.0, 0));
        followed.update(&[moving(large, 1.0), moving(small, 30.0)], tracker_step(300, true));
        assert_eq!((followed.person().x, followed.identity(), followed.n_persons), (0.0, 1, 1));
    }

    #[test]
    fn the_active_speaker_is_preferred_to_larger_or_more_similar_persons() {
        let speaking = |candidate: Candidate| Candidate { speaks: true, appearance_distance: Some(90.0), ..candidate };
        let (large, small) = (Candidate { appearance_distance: Some(1.0), ..at(80.0, 200.0, 0.9) }, at(0.0, 30.0, 0.5));
        let mut followed = PersonTrack::default();
        followed.update(&[large, speaking(small)], tracker_step(300, false));
        followed.update(&[large, speaking(moving(small, 1.0))], tracker_step(300, true));
        assert_eq!((followed.person().x, followed.identity(), followed.n_persons), (0.0, 0, 1));
        let mut late = PersonTrack::default();
        late.update(&[large, small], tracker_step(300, false));
        late.update(&[large, speaking(small)], tracker_step(300, true));
        assert_eq!((late.person().x, late.identity()), (0.0, 1));
    }

    #[test]
    fn the_reference_picture_decides() {
        let with_distance = |candidate: Candidate, appearance_distance: f32| Candidate {
            appearance_distance: Some(appearance_distance),
            ..candidate
        };
        let mut followed = PersonTrack::default();
        followed.update(
            &[with_distance(at(80.0, 120.0, 0.9), 40.0), with_distance(at(0.0, 60.0, 0.8), 4.0)],
            tracker_step(300, false),
        );
        assert_eq!(followed.person().x, 0.0);
        let mut late = PersonTrack::default();
        late.update(&[with_distance(at(80.0, 120.0, 0.9), 40.0)], tracker_step(300, false));
        late.update(
            &[with_distance(at(80.0, 120.0, 0.9), 40.0), with_distance(at(0.0, 60.0, 0.8), 4.0)],
            tracker_step(300, true),
        );
        assert_eq!((late.person().x, late.identity()), (0.0, 1));
    }
}
