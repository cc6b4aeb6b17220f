//! Which of the people found is the speaker: in a new shot the largest, most central and surest, who looks most like
//! the reference if there is one; from then on the one who overlaps the box followed. One who proves to be a picture
//! gives way to one who is alive, one far from the reference to one who is near it, and anybody to the one who is known
//! to speak.

use super::decode::boxes;
use super::liveness::Movement;
use orator_base::types::pose2d::PersonBox;

/// Least overlap of a found box with the followed one to be the same person.
const SAME_PERSON: f32 = 0.2;
/// Looks in a row without the speaker after which another is chosen.
const MAX_MISSED: usize = 2;
/// A box that never changed by more than this, in 8-bit steps, in so many looks, is a picture.
const STILL: f32 = 4.0;
const STILL_LOOKS: usize = 3;
/// A living person changes by so much at least, and by so many times what a picture does.
const ALIVE: f32 = 6.0;
const TIMES_ALIVE: f32 = 2.0;
/// Distance of appearances, in 8-bit steps, at which a person's weight is half.
const DISTANCE_OF_HALF_WEIGHT: f32 = 5.0;
/// Weight multiplier for a candidate known to be speaking.
const SPEAKS: f32 = 1e6;
/// People smaller than this share of the speaker's box are not counted.
const RELEVANT: f32 = 0.2;

/// Somebody found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Candidate {
    pub person: PersonBox,
    pub movement: Movement,
    /// Distance to the reference, where there is one.
    pub appearance_distance: Option<f32>,
    /// This one is known to speak in the shot.
    pub speaks: bool,
}

impl Candidate {
    fn is_picture(&self) -> bool {
        self.movement.n >= STILL_LOOKS && self.movement.most < STILL
    }

    fn outlives(&self, picture: &Self) -> bool {
        self.movement.most >= ALIVE.max(TIMES_ALIVE * picture.movement.most)
    }

    /// How likely this is the speaker: size, score, nearness to the middle, life, likeness.
    fn weight(&self, image_width: usize) -> f32 {
        let middle = image_width as f32 / 2.0;
        let PersonBox { x, width, height, score, .. } = self.person;
        let off = ((x + width / 2.0 - middle) / middle.max(1.0)).abs().min(1.0);
        let alive = if self.is_picture() { 0.1 } else { 1.0 };
        let likeness = self
            .appearance_distance
            .map_or(1.0, |appearance_distance| 1.0 / (1.0 + (appearance_distance / DISTANCE_OF_HALF_WEIGHT).powi(2)));
        let speaks = if self.speaks { SPEAKS } else { 1.0 };
        score * width * height * (1.0 - 0.5 * off) * alive * likeness * speaks
    }

    /// Whether this one was the wrong choice: the other speaks, is alive, or is so much more like the reference.
    fn gives_way_to(&self, other: &Self) -> bool {
        let is_likelier = || matches!((self.appearance_distance, other.appearance_distance), (Some(mine), Some(other)) if other < DISTANCE_OF_HALF_WEIGHT && mine > 2.0 * other.max(2.5));
        !self.speaks && (other.speaks || (self.is_picture() && other.outlives(self)) || is_likelier())
    }
}

/// Circumstances of an update of the track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackerStep {
    pub image_width: usize,
    /// Weight of a new box against the followed one; none: the box stays, and a missing one is not missed.
    pub follow: Option<f64>,
    /// A body was found in the followed box since the last look.
    pub body_seen: bool,
}

/// The box of the one speaker through a shot.
#[derive(Default)]
pub struct PersonTrack {
    /// x, y, width, height in px.
    pub place: Option<[f64; 4]>,
    pub score: f32,
    /// People of relevant size seen at the last look, pictures left out.
    pub n_people: u8,
    n_missed: usize,
    /// People taken so far; the one followed is the last of them.
    n_taken: i64,
}

impl PersonTrack {
    /// Takes in what was found in a picture.
    pub fn look(&mut self, found: &[Candidate], look: TrackerStep) {
        if let Some(place) = self.place {
            self.go_on(found, place, look);
        } else {
            self.choose(found, look.image_width);
        }
        let least = self.place.map_or(0.0, |[_, _, width, height]| RELEVANT * (width * height) as f32);
        let counts = |one: &&Candidate| one.person.width * one.person.height >= least && !one.is_picture();
        self.n_people = u8::try_from(found.iter().filter(counts).count()).unwrap_or(u8::MAX);
    }

    fn go_on(&mut self, found: &[Candidate], place: [f64; 4], look: TrackerStep) {
        let [x, y, width, height] = place.map(|px| px as f32);
        let followed = PersonBox { x, y, width, height, score: 0.0 };
        let nearest = found.iter().map(|one| (boxes::overlap(&one.person, &followed), one));
        match nearest.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((overlap, same)) if overlap >= SAME_PERSON => {
                let better: Vec<Candidate> = found.iter().filter(|other| same.gives_way_to(other)).copied().collect();
                if !better.is_empty() {
                    return self.choose(&better, look.image_width);
                }
                if let Some(weight) = look.follow {
                    let new = numbers(&same.person);
                    self.place = Some(std::array::from_fn(|at| (1.0 - weight) * place[at] + weight * new[at]));
                    (self.score, self.n_missed) = (same.person.score, 0);
                }
            }
            _ if look.follow.is_some() => {
                self.n_missed += 1;
                if self.n_missed >= MAX_MISSED && (!found.is_empty() || !look.body_seen) {
                    self.choose(found, look.image_width);
                }
            }
            _ => {}
        }
    }

    /// Takes the likeliest speaker of those found; none if there is nobody.
    pub fn choose(&mut self, found: &[Candidate], image_width: usize) {
        let best = found.iter().max_by(|a, b| a.weight(image_width).total_cmp(&b.weight(image_width)));
        self.place = best.map(|one| numbers(&one.person));
        self.n_taken += i64::from(best.is_some());
        self.score = best.map_or(0.0, |one| one.person.score);
        self.n_missed = 0;
    }

    /// Follows nobody; whoever is taken next is another person.
    pub fn begin_anew(&mut self) {
        *self = Self { n_taken: self.n_taken, ..Self::default() };
    }

    /// The one taken last is whom the one before was.
    pub fn is_the_same(&mut self) {
        self.n_taken = (self.n_taken - 1).max(1);
    }

    /// The number of people taken so far.
    pub fn n_taken(&self) -> i64 {
        self.n_taken
    }

    /// The number of the person followed, from 0.
    pub fn identity(&self) -> i64 {
        (self.n_taken - 1).max(0)
    }

    /// The box as it is written down; zeros if nobody is followed.
    pub fn person(&self) -> PersonBox {
        let Some([x, y, width, height]) = self.place.map(|place| place.map(|px| px as f32)) else {
            return PersonBox::default();
        };
        PersonBox { x, y, width, height, score: self.score }
    }
}

fn numbers(one: &PersonBox) -> [f64; 4] {
    [one.x, one.y, one.width, one.height].map(f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f32, width: f32, score: f32) -> Candidate {
        Candidate { person: PersonBox { x, y: 0.0, width, height: 100.0, score }, ..Candidate::default() }
    }

    fn moving(candidate: Candidate, most: f32) -> Candidate {
        Candidate { movement: Movement { n: 3, most }, ..candidate }
    }

    fn look(image_width: usize, body_seen: bool) -> TrackerStep {
        TrackerStep { image_width, follow: Some(0.3), body_seen }
    }

    #[test]
    fn the_first_choice_is_followed_past_a_better_one() {
        let mut followed = PersonTrack::default();
        followed.look(&[at(0.0, 100.0, 0.9), at(100.0, 110.0, 0.9)], look(300, false));
        assert_eq!((followed.person().x, followed.n_people), (100.0, 2));
        followed.look(&[at(0.0, 250.0, 0.9), at(120.0, 110.0, 0.5)], look(300, true));
        assert!((followed.person().x - 106.0).abs() < 1e-4 && followed.person().score == 0.5);
        followed.look(&[at(130.0, 110.0, 0.5)], TrackerStep { follow: None, ..look(300, true) });
        assert!((followed.person().x - 106.0).abs() < 1e-4 && followed.identity() == 0);
    }

    #[test]
    fn of_two_people_the_followed_one_stays_while_the_other_outgrows_it() {
        let mut followed = PersonTrack::default();
        for step in 0..30 {
            let grown = step as f32;
            let mut found = [at(40.0 + 0.5 * grown, 130.0 - grown, 0.9), at(180.0 - grown, 110.0 + 2.0 * grown, 0.95)];
            if step % 2 == 1 {
                found.reverse();
            }
            followed.look(&found, look(340, true));
            let PersonBox { x, width, score, .. } = followed.person();
            assert!(x + width / 2.0 < 120.0 && score == 0.9, "step {step}: the box has gone to {x} + {width}");
        }
        // A new follower would take the other by now.
        let mut anew = PersonTrack::default();
        anew.look(&[at(54.5, 101.0, 0.9), at(151.0, 168.0, 0.95)], look(340, true));
        assert_eq!((anew.person().x, anew.n_people, followed.identity()), (151.0, 2, 0));
    }

    #[test]
    fn a_lost_speaker_is_kept_while_the_body_is_seen_then_replaced() {
        let mut followed = PersonTrack::default();
        followed.look(&[at(100.0, 100.0, 0.9)], look(300, false));
        for _ in 0..5 {
            followed.look(&[], look(300, true));
        }
        assert_eq!((followed.person().x, followed.n_people, followed.identity()), (100.0, 0, 0));
        followed.look(&[at(0.0, 30.0, 0.9)], look(300, true));
        assert_eq!((followed.person().x, followed.identity()), (0.0, 1));
        followed.look(&[], look(300, false));
        followed.look(&[], look(300, false));
        assert_eq!(followed.place, None);
    }

    #[test]
    fn a_picture_gives_way_to_a_living_person() {
        let (large, small) = (at(80.0, 200.0, 0.9), at(0.0, 60.0, 0.8));
        let mut followed = PersonTrack::default();
        followed.look(&[large, small], look(300, false));
        assert_eq!(followed.person().x, 80.0);
        // A motionless person still shows sensor noise; a box without any is a printed or on-screen picture.
        followed.look(&[moving(large, 5.0), moving(small, 30.0)], look(300, true));
        assert_eq!((followed.person().x, followed.identity()), (80.0, 0));
        followed.look(&[moving(large, 1.0), moving(small, 30.0)], look(300, true));
        assert_eq!((followed.person().x, followed.identity(), followed.n_people), (0.0, 1, 1));
    }

    #[test]
    fn the_one_who_speaks_is_followed_whoever_is_larger_or_likelier() {
        let speaking = |candidate: Candidate| Candidate { speaks: true, appearance_distance: Some(90.0), ..candidate };
        let (large, small) = (Candidate { appearance_distance: Some(1.0), ..at(80.0, 200.0, 0.9) }, at(0.0, 30.0, 0.5));
        let mut followed = PersonTrack::default();
        followed.look(&[large, speaking(small)], look(300, false));
        followed.look(&[large, speaking(moving(small, 1.0))], look(300, true));
        assert_eq!((followed.person().x, followed.identity(), followed.n_people), (0.0, 0, 1));
        let mut late = PersonTrack::default();
        late.look(&[large, small], look(300, false));
        late.look(&[large, speaking(small)], look(300, true));
        assert_eq!((late.person().x, late.identity()), (0.0, 1));
    }

    #[test]
    fn a_reference_decides() {
        let like = |candidate: Candidate, appearance_distance: f32| Candidate {
            appearance_distance: Some(appearance_distance),
            ..candidate
        };
        let mut followed = PersonTrack::default();
        followed.look(&[like(at(80.0, 120.0, 0.9), 40.0), like(at(0.0, 60.0, 0.8), 4.0)], look(300, false));
        assert_eq!(followed.person().x, 0.0);
        let mut late = PersonTrack::default();
        late.look(&[like(at(80.0, 120.0, 0.9), 40.0)], look(300, false));
        late.look(&[like(at(80.0, 120.0, 0.9), 40.0), like(at(0.0, 60.0, 0.8), 4.0)], look(300, true));
        assert_eq!((late.person().x, late.identity()), (0.0, 1));
    }
}
