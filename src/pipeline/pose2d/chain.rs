//! The way of one frame: person box (every n-th frame, followed between), body, and each hand from where it was, else
//! from the arm, else from a detected palm; then guards against the other hand and against one hand taken twice.

use super::body::{BodyModel, DetectedBody};
use super::decode::ScoredPoint;
use super::hand::{DetectedHand, HandModel};
use super::model_input::ModelInput;
use super::palm::PalmDetector;
use super::person::Detector;
use super::region;
use super::speaker::SpeakerTracker;
use crate::config;
use crate::external::onnx::{ModelRole, ModelStore, Runtime};
use crate::external::opencv::warp::Region;
use crate::types::image::Image;
use crate::types::pose2d::{Keypoint, Pose2d, coco};
use anyhow::{Context, Result, ensure};

/// Elbow and wrist of the left and the right arm.
const ARMS: [(usize, usize); 2] = [(coco::L_ELBOW, coco::L_WRIST), (coco::R_ELBOW, coco::R_WRIST)];
/// A hand's wrist is no further from the arm's than this, in shoulder widths.
const SAME_WRIST: f64 = 0.5;
/// Two hands whose middles are nearer than this, in shoulder widths, are one.
const SAME_HAND: f64 = 0.08;

/// The models that look at a frame, and what is followed from frame to frame. One a worker: it runs on one thread.
pub struct Chain {
    settings: config::Pose2dConfig,
    speaker: SpeakerTracker,
    body: BodyModel,
    hand: Option<HandModel>,
    palm: Option<PalmDetector>,
    body_seen: bool,
    hand_regions: [Option<Region>; 2],
    /// Frames since the shot began.
    n_frames: usize,
}

impl Chain {
    /// Opens the models the settings name, from the folder of `store`.
    ///
    /// # Errors
    /// An id that is not in the manifest or has another role; a model that cannot be opened (`onnx::OpenError`).
    pub fn new(runtime: &Runtime, store: &ModelStore, settings: &config::Pose2dConfig) -> Result<Self> {
        let models_dir = store.dir();
        let entry =
            |key: &str, id: &str, role: ModelRole| store.choose(id, role).with_context(|| format!("pose2d.{key}"));
        let named = |id: &str| !id.is_empty();
        let body = BodyModel::open(runtime, entry("body", &settings.body, ModelRole::Body)?, models_dir)?;
        let person = named(&settings.person)
            .then(|| Detector::open(runtime, entry("person", &settings.person, ModelRole::Person)?, models_dir));
        let hand = named(&settings.hand)
            .then(|| HandModel::open(runtime, entry("hand", &settings.hand, ModelRole::Hand)?, models_dir));
        let palm = (named(&settings.palm) && named(&settings.hand))
            .then(|| PalmDetector::open(runtime, entry("palm", &settings.palm, ModelRole::Palm)?, models_dir));
        ensure!(
            hand.is_some() || body.gives_hands(),
            "pose2d.hand is empty, but the model {:?} gives no hands: name a hand model",
            settings.body
        );
        Ok(Self {
            settings: settings.clone(),
            speaker: SpeakerTracker::new(person.transpose()?),
            body,
            hand: hand.transpose()?,
            palm: palm.transpose()?,
            body_seen: false,
            hand_regions: [None; 2],
            n_frames: 0,
        })
    }

    /// A picture that shows the speaker, as its largest person: who looks like that is preferred. Errors: nobody is
    /// found in it.
    pub fn set_reference(&mut self, image: &Image) -> Result<()> {
        self.speaker.set_reference(image, &mut self.body, self.settings.joint_score)
    }

    /// A new shot begins: nothing of the one before is followed.
    pub fn begin_shot(&mut self) {
        self.speaker.begin_anew();
        self.body_seen = false;
        self.hand_regions = [None; 2];
        self.n_frames = 0;
    }

    /// Seconds inside ONNX Runtime so far, over all models.
    pub fn secs_inside(&self) -> f64 {
        let feeds = [
            Some(&self.body.feed),
            self.speaker.detector.as_ref().map(|detector| &detector.feed),
            self.hand.as_ref().map(|hand| &hand.feed),
            self.palm.as_ref().map(|palm| &palm.feed),
        ];
        feeds.into_iter().flatten().map(ModelInput::secs_inside).sum()
    }

    /// What is seen of the speaker in the next frame of the shot.
    pub fn frame(&mut self, image: &Image) -> Result<Pose2d> {
        let idx = self.n_frames;
        self.n_frames += 1;
        self.speaker.look(image, idx, &mut self.body, self.body_seen, &self.settings)?;
        let mut found = self.look_for_body(image)?;
        if let Some(body) = &found
            && self.speaker.recognise(image, &body.points, &mut self.body, &self.settings)?
        {
            self.hand_regions = [None; 2];
            found = self.look_for_body(image)?;
        }
        let followed = &self.speaker.track;
        let mut pose = Pose2d {
            person: followed.person(),
            n_people: followed.n_people,
            identity: followed.identity(),
            ..Pose2d::default()
        };
        let Some(body) = found else {
            self.hand_regions = [None; 2];
            self.body_seen = false;
            return Ok(pose);
        };
        let mean = body.points.iter().map(|point| point[2]).sum::<f64>() / body.points.len() as f64;
        self.body_seen = mean >= self.settings.joint_score / 2.0;
        let mut hands = match body.hands {
            Some(hands) if self.hand.is_none() => hands.map(|points| Some(DetectedHand::from_points(points))),
            _ => self.look_for_hands(image, &body.points, idx)?,
        };
        self.guard(&mut hands, &body.points);
        self.hand_regions = [0, 1].map(|side| hands[side].as_ref().map(DetectedHand::next_region));
        pose.body = body.points.map(keypoint);
        let [left, right] = hands;
        pose.left_hand = left.map_or(pose.left_hand, |hand| hand.points.map(keypoint));
        pose.right_hand = right.map_or(pose.right_hand, |hand| hand.points.map(keypoint));
        Ok(pose)
    }

    fn look_for_body(&mut self, image: &Image) -> Result<Option<DetectedBody>> {
        self.speaker.track.place.map_or(Ok(None), |place| self.body.find(image, place))
    }

    fn look_for_hands(
        &mut self,
        image: &Image,
        body: &[ScoredPoint; 17],
        idx: usize,
    ) -> Result<[Option<DetectedHand>; 2]> {
        let Some(model) = self.hand.as_mut() else { return Ok([None, None]) };
        let enough = self.settings.hand_score;
        let lost = |hand: &Option<DetectedHand>| hand.as_ref().is_none_or(|hand| hand.score < enough);
        let shoulder_px = distance(body[coco::L_SHOULDER], body[coco::R_SHOULDER]);
        let mut hands = [None, None];
        for (side, (elbow, wrist)) in ARMS.into_iter().enumerate() {
            if let Some(region) = &self.hand_regions[side] {
                hands[side] = model.find(image, region)?;
            }
            if lost(&hands[side]) && body[wrist][2] > self.settings.joint_score {
                let [elbow, wrist] = [elbow, wrist].map(|at| [body[at][0], body[at][1]]);
                if let Some(rough) = model.find(image, &region::beyond_wrist(elbow, wrist, shoulder_px))? {
                    let fine = model.find(image, &rough.next_region())?;
                    hands[side] = better(hands[side].take(), fine);
                }
            }
        }
        let due = idx.is_multiple_of(self.settings.palm_every.max(1)) && hands.iter().any(lost);
        if let Some(palm) = self.palm.as_mut().filter(|_| due) {
            for region in palm.find(image)? {
                let Some(hand) = model.find(image, &region)?.filter(|hand| hand.score >= enough) else { continue };
                let place = &mut hands[usize::from(is_right(&hand, body))];
                if lost(place) {
                    *place = Some(hand);
                }
            }
        }
        Ok(hands)
    }

    /// Takes out a hand that is not sure, that is not at its arm, or that is the other one again.
    fn guard(&self, hands: &mut [Option<DetectedHand>; 2], body: &[ScoredPoint; 17]) {
        let shoulder_px = distance(body[coco::L_SHOULDER], body[coco::R_SHOULDER]);
        for (hand, (_, wrist)) in hands.iter_mut().zip(ARMS) {
            let guided = body[wrist][2] > self.settings.joint_score;
            hand.take_if(|hand| {
                let away = distance(hand.points[0], body[wrist]) > SAME_WRIST * shoulder_px;
                hand.score < self.settings.hand_score || (guided && away)
            });
        }
        if let [Some(left), Some(right)] = &hands {
            let middle = |hand: &DetectedHand| {
                let sum = hand.points.iter().fold([0.0; 2], |sum, point| [sum[0] + point[0], sum[1] + point[1]]);
                [sum[0] / 21.0, sum[1] / 21.0, 0.0]
            };
            if distance(middle(left), middle(right)) < SAME_HAND * shoulder_px {
                let is_right = is_right(left, body);
                hands[usize::from(!is_right)] = None;
            }
        }
    }
}

/// Whether it is a right hand: as the model says, else by the nearer wrist.
fn is_right(hand: &DetectedHand, body: &[ScoredPoint; 17]) -> bool {
    let to_wrist = |at: usize| distance(hand.points[0], body[at]);
    hand.right.map_or_else(|| to_wrist(coco::R_WRIST) < to_wrist(coco::L_WRIST), |right| right > 0.5)
}

/// The surer of two hands, the first of two equally sure.
fn better(a: Option<DetectedHand>, b: Option<DetectedHand>) -> Option<DetectedHand> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.score > a.score { b } else { a }),
        (a, b) => a.or(b),
    }
}

fn distance(a: ScoredPoint, b: ScoredPoint) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn keypoint([x, y, score]: ScoredPoint) -> Keypoint {
    // The peak of a heat-map may reach a little over 1.
    Keypoint { x: x as f32, y: y as f32, score: score.clamp(0.0, 1.0) as f32 }
}
