//! Pose estimation for one frame: person box (detected every n-th frame, tracked in between), body, hands, face.

use super::body::{BodyModel, DetectedBody};
use super::decode::ScoredPoint;
use super::detector::{Detector, PalmDetector};
use super::face::FaceTrack;
use super::face::landmarks::FacePoint;
use super::face::model::FaceModel;
use super::hand::{DetectedHand, HandModel};
use super::hands::{self, HandTracker, VisibleHands};
use super::model_input::ModelInput;
use super::speaker::{SpeakerTracker, TrackedPerson};
use super::talker::TalkerPath;
use anyhow::{Context, Result, ensure};
use orator_base::types::image::Image;
use orator_base::types::pose2d::{Keypoint, Pose2d};
use orator_dataset::config;
use orator_onnx::{ModelRole, ModelStore, Runtime};

/// The models and the tracking state between frames. One instance per worker; runs on one thread.
pub struct Chain {
    settings: config::Pose2dConfig,
    speaker: SpeakerTracker,
    body: BodyModel,
    hands: Option<HandTracker>,
    face: Option<FaceModel>,
    face_track: FaceTrack,
    body_visible: bool,
    /// Number of frames since the start of the shot.
    n_frames: usize,
}

impl Chain {
    /// Opens the models that the settings name, from the folder of `store`.
    ///
    /// # Errors
    /// An id that is not in the manifest or has another role; a model that cannot be opened (`onnx::OpenError`).
    pub fn new(runtime: &Runtime, store: &ModelStore, settings: &config::Pose2dConfig) -> Result<Self> {
        let dir = store.dir();
        let named = |key: &str, id: &str, role| store.choose(id, role).with_context(|| format!("pose2d.{key}"));
        let entry = |key: &str, id: &str, role| (!id.is_empty()).then(|| named(key, id, role)).transpose();
        let body = BodyModel::open(runtime, named("body", &settings.body, ModelRole::Body)?, dir)?;
        let person = entry("person", &settings.person, ModelRole::Person)?;
        let hand = entry("hand", &settings.hand, ModelRole::Hand)?;
        let palm = entry("palm", &settings.palm, ModelRole::Palm)?.filter(|_| hand.is_some());
        let face = entry("face", &settings.face, ModelRole::Face)?;
        let hand = hand.map(|hand| HandModel::open(runtime, hand, dir)).transpose()?;
        let palm = palm.map(|palm| PalmDetector::open(runtime, palm, dir)).transpose()?;
        ensure!(
            hand.is_some() || body.gives_hands(),
            "pose2d.hand is empty, but the body model {:?} has no hand keypoints: set it to a hand model",
            settings.body
        );
        Ok(Self {
            settings: settings.clone(),
            speaker: SpeakerTracker::new(person.map(|person| Detector::open(runtime, person, dir)).transpose()?),
            body,
            hands: hand.map(|hand| HandTracker::new(hand, palm)),
            face: face.map(|face| FaceModel::open(runtime, face, dir)).transpose()?,
            face_track: FaceTrack::default(),
            body_visible: false,
            n_frames: 0,
        })
    }

    /// Sets the reference picture: candidates who look like its largest person are preferred.
    ///
    /// # Errors
    /// No person is found in the picture.
    pub fn set_reference(&mut self, image: &Image) -> Result<()> {
        self.speaker.set_reference(image, &mut self.body, self.settings.joint_score)
    }

    /// Starts a new shot and resets tracking. `talker` is the path of the person to follow, if known.
    pub fn begin_shot(&mut self, talker: Option<TalkerPath>) {
        self.speaker.reset(talker);
        self.body_visible = false;
        self.reset_details();
        self.n_frames = 0;
    }

    /// Follows the person whom a user chose, at pixel `point` of the next picture; `None` ends that.
    pub fn follow(&mut self, point: Option<[f32; 2]>) {
        self.speaker.follow(point);
        self.reset_details();
    }

    /// Face landmarks of the last frame, if a face was detected.
    pub fn face_points(&self) -> Option<&[FacePoint]> {
        self.face_track.points()
    }

    /// Number of identities so far, the first of them when first recognised, and the person followed now.
    pub fn identities(&self) -> (i64, [Option<TrackedPerson>; 2]) {
        self.speaker.identities()
    }

    /// Total inference time in ONNX Runtime so far, in seconds.
    pub fn secs_inside(&self) -> f64 {
        self.inputs().into_iter().flatten().map(ModelInput::secs_inside).sum()
    }

    /// Number of inferences of the person, body, hand, palm and face model.
    pub fn n_runs(&self) -> [u64; 5] {
        self.inputs().map(|input| input.map_or(0, ModelInput::n_runs))
    }

    /// Inputs of the person, body, hand, palm and face model.
    fn inputs(&self) -> [Option<&ModelInput>; 5] {
        let hands = self.hands.as_ref();
        [
            self.speaker.detector.as_ref().map(|detector| &detector.input),
            Some(&self.body.input),
            hands.map(|hands| &hands.model.input),
            hands.and_then(|hands| hands.palm.as_ref()).map(|palm| &palm.input),
            self.face.as_ref().map(|face| &face.input),
        ]
    }

    /// Resets the tracking of hands and face.
    fn reset_details(&mut self) {
        self.hands.iter_mut().for_each(HandTracker::reset);
        self.face_track = FaceTrack::default();
    }

    /// Estimates the pose of the speaker in the next frame of the shot.
    pub fn frame(&mut self, image: &Image) -> Result<Pose2d> {
        let idx = self.n_frames;
        self.n_frames += 1;
        self.speaker.update(image, idx, &mut self.body, self.body_visible, &self.settings)?;
        let mut found = self.detect_body(image)?;
        if let Some(body) = &found
            && self.speaker.recognise(image, &body.points, &mut self.body, &self.settings)?
        {
            self.reset_details();
            found = self.detect_body(image)?;
        }
        let followed = &self.speaker.track;
        let mut pose = Pose2d {
            person: followed.person(),
            n_persons: followed.n_persons,
            identity: followed.identity(),
            ..Pose2d::default()
        };
        let Some(mut body) = found else {
            self.reset_details();
            self.body_visible = false;
            return Ok(pose);
        };
        let mean = body.points.iter().map(|point| point[2]).sum::<f64>() / body.points.len() as f64;
        self.body_visible = mean >= self.settings.joint_score / 2.0;
        let hands = match (&mut self.hands, body.hands) {
            (Some(hands), _) => hands.find(image, &body.points, &self.settings)?,
            (None, Some(given)) => {
                let mut given = given.map(|points| Some(DetectedHand::from_points(points)));
                hands::reject_implausible(&mut given, &body.points, &self.settings);
                given
            }
            (None, None) => [None, None],
        };
        // Visibility is judged last: tracking continues from all that was found.
        let VisibleHands { hands: [left, right], others } = VisibleHands::judge(hands, &mut body.points, image);
        pose.other_hand = others;
        if let Some(face) = &mut self.face {
            pose.face = self.face_track.find(face, image, &body.points, self.settings.joint_score)?;
        }
        pose.body = body.points.map(keypoint);
        let depth = |hand: &Option<DetectedHand>| Some(hand.as_ref()?.depth?.map(|depth| depth as f32));
        pose.hand_depth = [depth(&left), depth(&right)];
        pose.left_hand = left.map_or(pose.left_hand, |hand| hand.points.map(keypoint));
        pose.right_hand = right.map_or(pose.right_hand, |hand| hand.points.map(keypoint));
        Ok(pose)
    }

    fn detect_body(&mut self, image: &Image) -> Result<Option<DetectedBody>> {
        self.speaker.track.bbox.map_or(Ok(None), |bbox| self.body.find(image, bbox))
    }
}

fn keypoint([x, y, score]: ScoredPoint) -> Keypoint {
    // A heatmap peak may slightly exceed 1.
    Keypoint { x: x as f32, y: y as f32, score: score.clamp(0.0, 1.0) as f32 }
}
