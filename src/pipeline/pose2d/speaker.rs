//! Tracking of the speaker: when to run the person detector, whom to follow (`tracker`), and whether the tracked
//! person is still the same where people cross, by colours (`appearance`).

use super::appearance::BodyColours;
use super::body::BodyModel;
use super::chosen_person::ChosenPath;
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

/// Extra detection frames at the start of a shot, so that a wrong choice is corrected early.
const EARLY_FRAMES: [usize; 3] = [2, 5, 10];
/// Factor by which the detector runs more often while several people are visible.
const CROWD_FACTOR: usize = 3;
/// A body whose colours differ by more than this from the speaker's, in 8-bit steps, for this many frames, is another.
const MAX_COLOUR_DISTANCE: f32 = 7.0;
const MAX_DEVIATING_FRAMES: i32 = 2;
/// Frames for which a confirmed speaker is not re-examined.
const TRUSTED_FRAMES: i32 = 6;
/// Least overlap of a box with the tracked one to remain the speaker, unless another candidate's appearance is closer
/// by the factor `CLOSER_FACTOR`.
const MIN_OVERLAP: f32 = 0.6;
const CLOSER_FACTOR: f32 = 0.6;
/// Largest colour distance and least box overlap for a person after a restart to be the one before it.
const MAX_SAME_COLOUR_DISTANCE: f32 = 5.0;
const MIN_SAME_OVERLAP: f32 = 0.5;
/// Weight of a frame in the moving average of the speaker's colours.
const COLOUR_WEIGHT: f32 = 0.05;

/// Whether the detector runs in frame `idx` of a shot: at intervals, more often with several people, and at the start.
pub fn is_detection_frame(idx: usize, every: usize, is_crowd: bool) -> bool {
    let every = if is_crowd { (every / CROWD_FACTOR).max(1) } else { every };
    idx.is_multiple_of(every) || EARLY_FRAMES.contains(&idx)
}

/// Position and colours of a person.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackedPerson {
    bbox: PersonBox,
    colours: BodyColours,
}

/// Whether the person tracked before a restart is the one tracked after it.
pub fn is_same_person(before: &TrackedPerson, after: &TrackedPerson) -> bool {
    boxes::overlap(&before.bbox, &after.bbox) >= MIN_SAME_OVERLAP
        && before.colours.distance(&after.colours) <= MAX_SAME_COLOUR_DISTANCE
}

#[derive(Default)]
pub struct SpeakerTracker {
    pub detector: Option<Detector>,
    pub track: PersonTrack,
    tracks: LivenessTracks,
    reference: Option<BodyColours>,
    colours: Option<BodyColours>,
    /// Consecutive frames with deviating colours; negative: remaining frames without re-examination.
    n_deviating: i32,
    /// More than one person was visible in this shot.
    several: bool,
    /// Person at the end of the previous shot.
    before: Option<TrackedPerson>,
    /// Person of the first shot, when first recognised.
    first: Option<TrackedPerson>,
    /// Path of the active speaker in this shot, if known; `idx` is the current frame of the shot.
    talker: Option<TalkerPath>,
    idx: usize,
    /// Path of the person whom a user chose.
    chosen: Option<ChosenPath>,
}

impl SpeakerTracker {
    /// Creates a tracker. Without a detector, the full picture is the speaker's box.
    pub fn new(detector: Option<Detector>) -> Self {
        Self { detector, ..Self::default() }
    }

    /// Sets the reference picture: its largest person is the speaker.
    ///
    /// # Errors
    /// No person with visible shoulders is found in the picture.
    pub fn set_reference(&mut self, image: &Image, body: &mut BodyModel, least: f64) -> Result<()> {
        let found = self.detector.as_mut().map(|detector| detector.find(image)).transpose()?.unwrap_or_default();
        let area = |one: &PersonBox| one.width * one.height;
        let largest = found.iter().max_by(|a, b| area(a).total_cmp(&area(b)));
        let colours = largest.map(|one| colours_of(image, one, body, least)).transpose()?.flatten();
        self.reference =
            Some(colours.context("no person with visible shoulders was detected in the reference picture")?);
        Ok(())
    }

    /// Ends the track. `talker` is the path of the person to follow next, if known.
    pub fn reset(&mut self, talker: Option<TalkerPath>) {
        (self.talker, self.chosen) = (talker, None);
        self.before = self.last();
        self.colours = None;
        self.track.reset();
        self.tracks = LivenessTracks::default();
        (self.n_deviating, self.several) = (0, false);
    }

    /// Follows the person at pixel `point` of the next picture; `None`: chooses a person again, if one was given before.
    pub fn follow(&mut self, point: Option<[f32; 2]>) {
        if self.chosen.is_some() && point.is_none() {
            self.track.reset();
        }
        self.chosen = point.map(ChosenPath::new);
    }

    /// Runs the detector in frame `idx` of a shot, if it is due.
    pub fn update(
        &mut self,
        image: &Image,
        idx: usize,
        body: &mut BodyModel,
        body_visible: bool,
        settings: &config::Pose2dConfig,
    ) -> Result<()> {
        self.idx = idx;
        let every = settings.person_every.max(1);
        let regular = idx.is_multiple_of(every);
        let is_awaited = self.chosen.as_ref().is_some_and(|chosen| !chosen.is_found());
        if !regular
            && !is_awaited
            && !is_detection_frame(idx, every, self.track.n_persons > 1)
            && self.track.bbox.is_some()
        {
            return Ok(());
        }
        let Some(mut found) = self.find(image)? else { return Ok(()) };
        if let Some(reference) = self.reference.as_ref().filter(|_| found.len() > 1) {
            measure(&mut found, reference, image, body, settings.joint_score)?;
        }
        if is_awaited && self.chosen.as_ref().is_some_and(ChosenPath::is_found) {
            self.track.reset();
        }
        let follow = regular.then_some(settings.box_smoothing);
        let was = self.track.identity();
        self.track.update(&found, TrackerStep { image_width: image.width, follow, body_visible });
        self.several |= self.track.n_persons > 1;
        if self.track.identity() != was {
            self.colours = None;
        }
        Ok(())
    }

    /// Compares the body found in the tracked box with the speaker. Returns true if another person is followed from
    /// now on, so that the body must be detected again.
    pub fn recognise(
        &mut self,
        image: &Image,
        points: &[ScoredPoint; 17],
        body: &mut BodyModel,
        settings: &config::Pose2dConfig,
    ) -> Result<bool> {
        let Some(current_colours) = BodyColours::measure(image, points, settings.joint_score) else { return Ok(false) };
        let current = TrackedPerson { bbox: self.track.person(), colours: current_colours.clone() };
        if self.before.take().is_some_and(|before| is_same_person(&before, &current)) {
            self.track.merge_with_previous();
        }
        if self.first.is_none() && self.track.n_identities() <= 1 {
            self.first = Some(current);
        }
        let Some(colours) = self.colours.as_mut() else {
            self.colours = Some(current_colours);
            return Ok(false);
        };
        if !self.several || colours.distance(&current_colours) <= MAX_COLOUR_DISTANCE {
            colours.move_towards(&current_colours, COLOUR_WEIGHT);
            self.n_deviating = self.n_deviating.min(0);
            return Ok(false);
        }
        self.n_deviating += 1;
        if self.n_deviating < MAX_DEVIATING_FRAMES {
            return Ok(false);
        }
        let colours = colours.clone();
        let Some(mut found) = self.find(image)? else { return Ok(false) };
        measure(&mut found, &colours, image, body, settings.joint_score)?;
        if is_still_speaker(&found, &self.track.person()) {
            self.n_deviating = -TRUSTED_FRAMES;
            return Ok(false);
        }
        (self.n_deviating, self.colours) = (0, None);
        self.track.choose(&found, image.width);
        Ok(true)
    }

    /// Number of identities, the first of them when first recognised, and the person followed now.
    pub fn identities(&self) -> (i64, [Option<TrackedPerson>; 2]) {
        (self.track.n_identities(), [self.first.clone(), self.last()])
    }

    /// The person followed now.
    fn last(&self) -> Option<TrackedPerson> {
        let bbox = self.track.bbox.map(|_| self.track.person());
        bbox.zip(self.colours.clone()).map(|(bbox, colours)| TrackedPerson { bbox, colours })
    }

    /// All candidates in the picture; `None` without a detector.
    fn find(&mut self, image: &Image) -> Result<Option<Vec<Candidate>>> {
        let Some(detector) = self.detector.as_mut() else {
            self.track.bbox = Some([0.0, 0.0, image.width as f64, image.height as f64]);
            (self.track.score, self.track.n_persons) = (1.0, 1);
            return Ok(None);
        };
        let found = detector.find(image)?;
        let movements = self.tracks.update(image, &found);
        let talker = match &mut self.chosen {
            Some(chosen) => chosen.find(self.idx, &found),
            None => self.talker.as_ref().and_then(|path| path.find(self.idx, found.iter().copied())),
        };
        let candidate = |(at, (person, movement))| {
            let speaks = talker == Some(at);
            Candidate { person, movement, appearance_distance: None, speaks }
        };
        Ok(Some(found.into_iter().zip(movements).enumerate().map(candidate).collect()))
    }
}

/// Whether the candidate in the tracked box is still the speaker: known to speak, or no other looks much closer.
fn is_still_speaker(found: &[Candidate], followed: &PersonBox) -> bool {
    let overlap = |one: &Candidate| boxes::overlap(&one.person, followed);
    let Some(tracked) = found.iter().max_by(|a, b| overlap(a).total_cmp(&overlap(b))) else { return false };
    let appearance_distance = |one: &Candidate| one.appearance_distance.unwrap_or(f32::INFINITY);
    let is_likeliest =
        || found.iter().all(|one| appearance_distance(one) >= CLOSER_FACTOR * appearance_distance(tracked));
    overlap(tracked) >= MIN_OVERLAP && (tracked.speaks || is_likeliest())
}

/// Measures the colour distance of every candidate.
fn measure(
    found: &mut [Candidate],
    colours: &BodyColours,
    image: &Image,
    body: &mut BodyModel,
    least: f64,
) -> Result<()> {
    for one in found {
        // A box without a detectable body gets the largest distance.
        let measured = colours_of(image, &one.person, body, least)?;
        one.appearance_distance = Some(measured.map_or(f32::from(u8::MAX), |measured| measured.distance(colours)));
    }
    Ok(())
}

fn colours_of(image: &Image, one: &PersonBox, body: &mut BodyModel, least: f64) -> Result<Option<BodyColours>> {
    let found = body.find(image, [one.x, one.y, one.width, one.height].map(f64::from))?;
    Ok(found.and_then(|found| BodyColours::measure(image, &found.points, least)))
}
