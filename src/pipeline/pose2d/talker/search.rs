//! Mouth tracks of people in a shot: people are detected every few frames and associated by overlap; while several are
//! visible, the face model measures each mouth per frame. Only a value per frame and person and the boxes are kept.

use super::choice::{self, MouthOpening, ShotVoice};
use super::path::{MIN_OVERLAP, TalkerPath};
use crate::pose2d::body::BodyModel;
use crate::pose2d::decode::boxes;
use crate::pose2d::detector::Detector;
use crate::pose2d::face::FaceTrack;
use crate::pose2d::face::model::FaceModel;
use crate::pose2d::speaker;
use anyhow::Result;
use orator_base::types::image::Image;
use orator_base::types::pose2d::PersonBox;
use orator_dataset::config::Pose2dConfig;
use orator_onnx::{ModelRole, ModelStore, Runtime};

/// Persons smaller than this share of the largest are background.
const MIN_RELATIVE_AREA: f32 = 0.2;
/// Least score of a visible body point, whatever the configuration: without a detection all points score 0.
const MIN_SCORE: f64 = 1e-6;

/// Searches the active speaker, shot by shot.
pub struct TalkerSearch {
    detector: Detector,
    body: BodyModel,
    face: FaceModel,
    settings: Pose2dConfig,
    people: Vec<Talker>,
    /// Number of frames of the shot so far.
    n_frames: usize,
    several: bool,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShotTalker {
    /// More than one person was visible.
    pub several: bool,
    /// Path of the active speaker; `None` if nobody's mouth clearly matches the voice.
    pub path: Option<TalkerPath>,
}

#[derive(Default)]
struct Talker {
    path: TalkerPath,
    mouth: MouthOpening,
    face: FaceTrack,
    /// Found in the last detection.
    is_visible: bool,
}

impl TalkerSearch {
    /// Opens the person, body and face models that the settings name.
    ///
    /// # Errors
    /// An id that is not in the manifest or has another role; a model that cannot be opened.
    pub fn new(runtime: &Runtime, store: &ModelStore, settings: &Pose2dConfig) -> Result<Self> {
        let (dir, entry) = (store.dir(), |id: &str, role| store.choose(id, role));
        Ok(Self {
            detector: Detector::open(runtime, entry(&settings.person, ModelRole::Person)?, dir)?,
            body: BodyModel::open(runtime, entry(&settings.body, ModelRole::Body)?, dir)?,
            face: FaceModel::open(runtime, entry(&settings.face, ModelRole::Face)?, dir)?,
            settings: settings.clone(),
            people: Vec::new(),
            n_frames: 0,
            several: false,
        })
    }

    /// Processes the next frame of the shot; `None` if it repeats the previous one.
    pub fn frame(&mut self, image: Option<&Image>) -> Result<()> {
        let idx = self.n_frames;
        self.n_frames += 1;
        let Some(image) = image else {
            let visible = self.people.iter_mut().filter(|one| one.is_visible);
            visible.for_each(|one| one.mouth.repeat(idx));
            return Ok(());
        };
        let is_detection_frame = speaker::is_detection_frame(idx, self.settings.person_every.max(1), self.is_crowd());
        if is_detection_frame {
            let found = self.detector.find(image)?;
            associate(&mut self.people, idx, &found);
            self.several |= self.is_crowd();
        }
        if !self.is_crowd() {
            self.people.iter_mut().for_each(|one| one.face = FaceTrack::default());
            return Ok(());
        }
        let least = self.settings.joint_score.max(MIN_SCORE);
        for one in self.people.iter_mut().filter(|one| one.is_visible) {
            let bbox = one.path.last().filter(|_| is_detection_frame);
            let bbox = bbox.map(|at| [at.x, at.y, at.width, at.height].map(f64::from));
            let body = bbox.map(|bbox| self.body.find(image, bbox)).transpose()?.flatten();
            let points = body.map_or([[0.0; 3]; 17], |body| body.points);
            if let Some(face) = one.face.find(&mut self.face, image, &points, least)? {
                one.mouth.set(idx, face.opening);
            }
        }
        Ok(())
    }

    /// Ends the shot and returns its active speaker. The next frame begins another shot.
    pub fn end_shot(&mut self, shot: &ShotVoice) -> ShotTalker {
        let mut people = std::mem::take(&mut self.people);
        let speaking = choice::find_speaking(people.iter().map(|one| &one.mouth), shot);
        self.n_frames = 0;
        let several = std::mem::take(&mut self.several);
        ShotTalker { several, path: speaking.map(|at| people.swap_remove(at).path) }
    }

    fn is_crowd(&self) -> bool {
        self.people.iter().filter(|one| one.is_visible).count() > 1
    }
}

/// Associates detections with known people; a detection without overlap is a new person.
fn associate(people: &mut Vec<Talker>, idx: usize, found: &[PersonBox]) {
    let area = |one: &PersonBox| one.width * one.height;
    let largest = found.iter().map(area).fold(0.0, f32::max);
    for one in people.iter_mut() {
        one.is_visible = false;
    }
    for one in found.iter().filter(|one| area(one) >= MIN_RELATIVE_AREA * largest) {
        let overlap = |known: &Talker| known.path.last().map_or(0.0, |last| boxes::overlap(last, one));
        let free = (0..people.len()).filter(|&at| !people[at].is_visible);
        let nearest = free.max_by(|&a, &b| overlap(&people[a]).total_cmp(&overlap(&people[b])));
        let at = nearest.filter(|&at| overlap(&people[at]) >= MIN_OVERLAP).unwrap_or_else(|| {
            people.push(Talker::default());
            people.len() - 1
        });
        people[at].path.push(idx, *one);
        people[at].is_visible = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn persons_are_associated_by_overlap_and_the_background_is_ignored() {
        let at = |x: f32, width: f32| PersonBox { x, y: 0.0, width, height: 200.0, score: 0.9 };
        let mut people = Vec::new();
        associate(&mut people, 0, &[at(0.0, 100.0), at(300.0, 80.0), at(600.0, 10.0)]);
        associate(&mut people, 5, &[at(310.0, 80.0), at(20.0, 100.0)]);
        associate(&mut people, 10, &[at(330.0, 80.0), at(150.0, 90.0)]);
        let last: Vec<f32> = people.iter().map(|one| one.path.last().unwrap().x).collect();
        let visible: Vec<bool> = people.iter().map(|one| one.is_visible).collect();
        assert_eq!((last, visible), (vec![20.0, 330.0, 150.0], vec![false, true, true]));
    }
}
