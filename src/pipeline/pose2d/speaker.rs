//! The one speaker in frame after frame: when to look for people, whom of them to follow (`tracker`), and whether it
//! still is the same person, which his or her colours tell (`appearance`) where two people cross.

use super::appearance::BodyColours;
use super::body::BodyModel;
use super::decode::{ScoredPoint, boxes};
use super::detector::Detector;
use super::liveness::LivenessTracks;
use super::talker::TalkerPath;
use super::tracker::{Candidate, PersonTrack, TrackerStep};
use anyhow::{Context, Result};
use orator_base::types::image::Image;
use orator_base::types::pose2d::PersonBox;
use orator_dataset::config;
use serde::{Deserialize, Serialize};

/// Frames of a shot at which people are looked for beside the regular ones, so that a wrong choice is soon mended.
const EARLY: [usize; 3] = [2, 5, 10];
/// With several people in view, looks come so many times as often.
const CROWD_LOOKS: usize = 3;
/// A body whose colours are this far from the speaker's, in 8-bit steps, for so many frames, is another person.
const STRANGER: f32 = 7.0;
const STRANGE_FRAMES: i32 = 2;
/// Frames for which a body found to be the speaker's after all is not doubted again.
const TRUSTED_FRAMES: i32 = 6;
/// Least overlap of a box with the tracked one to be the speaker's, unless the appearance of another is nearer by the factor
/// `MUCH_NEARER`.
const HERE: f32 = 0.6;
const MUCH_NEARER: f32 = 0.6;
/// Colours and box after a restart that are no further from those before are the same person's.
const SAME_COLOURS: f32 = 5.0;
const SAME_BOX: f32 = 0.5;
/// Weight of a frame's colours in the speaker's.
const FOLLOW_COLOURS: f32 = 0.05;

/// Whether people are looked for in frame `idx` of a shot: every so many frames, more often in a crowd, and early on.
pub fn is_look(idx: usize, every: usize, is_crowd: bool) -> bool {
    let every = if is_crowd { (every / CROWD_LOOKS).max(1) } else { every };
    idx.is_multiple_of(every) || EARLY.contains(&idx)
}

/// A person, and where he or she is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeenPerson {
    place: PersonBox,
    colours: BodyColours,
}

/// Whether the one seen before tracking began anew is the one seen after.
pub fn is_same_person(before: &SeenPerson, after: &SeenPerson) -> bool {
    boxes::overlap(&before.place, &after.place) >= SAME_BOX && before.colours.distance(&after.colours) <= SAME_COLOURS
}

/// Follows one person.
#[derive(Default)]
pub struct SpeakerTracker {
    pub detector: Option<Detector>,
    pub track: PersonTrack,
    tracks: LivenessTracks,
    reference: Option<BodyColours>,
    /// Colours of the tracked person.
    colours: Option<BodyColours>,
    /// Frames in a row that showed a stranger; below 0: frames for which that is not believed.
    n_strange: i32,
    /// More than one person was in view in this shot.
    several: bool,
    /// Whom the shot before showed.
    before: Option<SeenPerson>,
    /// Whom the first shot showed, when first recognised.
    first: Option<SeenPerson>,
    /// The way of the one who speaks in this shot, where that is known, and the frame of the shot.
    talker: Option<TalkerPath>,
    idx: usize,
}

impl SpeakerTracker {
    /// Without a detector the whole picture is the speaker's.
    pub fn new(detector: Option<Detector>) -> Self {
        Self { detector, ..Self::default() }
    }

    /// A picture that shows the speaker, as its largest person. Errors: nobody is found in it.
    pub fn set_reference(&mut self, image: &Image, body: &mut BodyModel, least: f64) -> Result<()> {
        let found = self.detector.as_mut().map(|detector| detector.find(image)).transpose()?.unwrap_or_default();
        let area = |one: &PersonBox| one.width * one.height;
        let largest = found.iter().max_by(|a, b| area(a).total_cmp(&area(b)));
        let colours = largest.map(|one| colours_of(image, one, body, least)).transpose()?.flatten();
        self.reference = Some(colours.context("nobody with visible shoulders is found in the reference picture")?);
        Ok(())
    }

    /// Ends the track; `talker`: the way of the one to follow next, where it is known.
    pub fn begin_anew(&mut self, talker: Option<TalkerPath>) {
        self.talker = talker;
        self.before = self.last();
        self.colours = None;
        self.track.begin_anew();
        self.tracks = LivenessTracks::default();
        (self.n_strange, self.several) = (0, false);
    }

    /// Looks for people in frame `idx` of a shot, if it is time to.
    pub fn look(
        &mut self,
        image: &Image,
        idx: usize,
        body: &mut BodyModel,
        body_seen: bool,
        settings: &config::Pose2dConfig,
    ) -> Result<()> {
        self.idx = idx;
        let every = settings.person_every.max(1);
        let regular = idx.is_multiple_of(every);
        if !regular && !is_look(idx, every, self.track.n_people > 1) && self.track.place.is_some() {
            return Ok(());
        }
        let Some(mut found) = self.find(image)? else { return Ok(()) };
        if let Some(reference) = self.reference.as_ref().filter(|_| found.len() > 1) {
            measure(&mut found, reference, image, body, settings.joint_score)?;
        }
        let follow = regular.then_some(settings.person_follow);
        let was = self.track.identity();
        self.track.look(&found, TrackerStep { image_width: image.width, follow, body_seen });
        self.several |= self.track.n_people > 1;
        if self.track.identity() != was {
            self.colours = None;
        }
        Ok(())
    }

    /// Takes in the body found in the followed box; true if it is another person's, who is followed from now on, so
    /// that the body must be found again.
    pub fn recognise(
        &mut self,
        image: &Image,
        points: &[ScoredPoint; 17],
        body: &mut BodyModel,
        settings: &config::Pose2dConfig,
    ) -> Result<bool> {
        let Some(seen) = BodyColours::measure(image, points, settings.joint_score) else { return Ok(false) };
        let here = SeenPerson { place: self.track.person(), colours: seen.clone() };
        if self.before.take().is_some_and(|before| is_same_person(&before, &here)) {
            self.track.is_the_same();
        }
        if self.first.is_none() && self.track.n_taken() <= 1 {
            self.first = Some(here);
        }
        let Some(colours) = self.colours.as_mut() else {
            self.colours = Some(seen);
            return Ok(false);
        };
        if !self.several || colours.distance(&seen) <= STRANGER {
            colours.follow(&seen, FOLLOW_COLOURS);
            self.n_strange = self.n_strange.min(0);
            return Ok(false);
        }
        self.n_strange += 1;
        if self.n_strange < STRANGE_FRAMES {
            return Ok(false);
        }
        let colours = colours.clone();
        let Some(mut found) = self.find(image)? else { return Ok(false) };
        measure(&mut found, &colours, image, body, settings.joint_score)?;
        if is_here(&found, &self.track.person()) {
            self.n_strange = -TRUSTED_FRAMES;
            return Ok(false);
        }
        (self.n_strange, self.colours) = (0, None);
        self.track.choose(&found, image.width);
        Ok(true)
    }

    /// The number of people taken, the first of them as first recognised, and the one followed now.
    pub fn people(&self) -> (i64, [Option<SeenPerson>; 2]) {
        (self.track.n_taken(), [self.first.clone(), self.last()])
    }

    /// Whom is followed now.
    fn last(&self) -> Option<SeenPerson> {
        let place = self.track.place.map(|_| self.track.person());
        place.zip(self.colours.clone()).map(|(place, colours)| SeenPerson { place, colours })
    }

    /// Everybody in the picture; `None` without a detector.
    fn find(&mut self, image: &Image) -> Result<Option<Vec<Candidate>>> {
        let Some(detector) = self.detector.as_mut() else {
            self.track.place = Some([0.0, 0.0, image.width as f64, image.height as f64]);
            (self.track.score, self.track.n_people) = (1.0, 1);
            return Ok(None);
        };
        let found = detector.find(image)?;
        let movements = self.tracks.look(image, &found);
        let talker = self.talker.as_ref().and_then(|path| path.goer(self.idx, found.iter().copied()));
        let candidate = |(at, (person, movement))| {
            let speaks = talker == Some(at);
            Candidate { person, movement, appearance_distance: None, speaks }
        };
        Ok(Some(found.into_iter().zip(movements).enumerate().map(candidate).collect()))
    }
}

/// Whether the one in the followed box still is the speaker: known to speak, or nobody else found is much more like the
/// speaker.
fn is_here(found: &[Candidate], followed: &PersonBox) -> bool {
    let overlap = |one: &Candidate| boxes::overlap(&one.person, followed);
    let Some(here) = found.iter().max_by(|a, b| overlap(a).total_cmp(&overlap(b))) else { return false };
    let appearance_distance = |one: &Candidate| one.appearance_distance.unwrap_or(f32::INFINITY);
    let is_likeliest = || found.iter().all(|one| appearance_distance(one) >= MUCH_NEARER * appearance_distance(here));
    overlap(here) >= HERE && (here.speaks || is_likeliest())
}

/// How far the colours of everybody found are from those given.
fn measure(
    found: &mut [Candidate],
    colours: &BodyColours,
    image: &Image,
    body: &mut BodyModel,
    least: f64,
) -> Result<()> {
    for one in found {
        // A box without a body is nobody.
        let seen = colours_of(image, &one.person, body, least)?;
        one.appearance_distance = Some(seen.map_or(f32::from(u8::MAX), |seen| seen.distance(colours)));
    }
    Ok(())
}

fn colours_of(image: &Image, one: &PersonBox, body: &mut BodyModel, least: f64) -> Result<Option<BodyColours>> {
    let found = body.find(image, [one.x, one.y, one.width, one.height].map(f64::from))?;
    Ok(found.and_then(|found| BodyColours::measure(image, &found.points, least)))
}
