//! Hand tracking: each hand is searched at its previous position, else at its arm (`search_arm`), else at detected
//! palms; then hands that are the other hand, duplicates, or of the wrong handedness are rejected. Repeated
//! unsuccessful searches become less frequent. "Body width" below is the result of `body_width`.

use super::arm_search::search_arm;
use super::visibility::{centre, distance};
use crate::pose2d::decode::ScoredPoint;
use crate::pose2d::detector::PalmDetector;
use crate::pose2d::hand::{DetectedHand, HandModel};
use crate::pose2d::region;
use anyhow::Result;
use orator_base::types::image::Image;
use orator_base::types::pose2d::coco;
use orator_dataset::config::Pose2dConfig;
use orator_media::opencv::warp::Region;

const ARMS: [(usize, usize); 2] = [(coco::L_ELBOW, coco::L_WRIST), (coco::R_ELBOW, coco::R_WRIST)];
/// Bones that bound the body width from below, and the ratios of body width to bone and to trunk length. They are low,
/// so that the shoulders decide in a frontal view: on rendered persons an arm bone measures up to 1.14 and the trunk
/// up to 1.7 shoulder widths.
const WIDTH_BONES: [(usize, usize); 4] = [
    (coco::L_SHOULDER, coco::L_ELBOW),
    (coco::R_SHOULDER, coco::R_ELBOW),
    (coco::L_ELBOW, coco::L_WRIST),
    (coco::R_ELBOW, coco::R_WRIST),
];
const WIDTH_PER_BONE: f64 = 0.9;
const WIDTH_PER_TRUNK: f64 = 0.6;
/// Largest distance of a hand from the wrist of its arm, in body widths; half as much if the other arm's wrist is
/// closer, since a hand model may switch hands where they overlap.
const MAX_WRIST_DISTANCE: f64 = 0.5;
/// Two hands whose centres are closer than this, in body widths, are one.
const MIN_HAND_DISTANCE: f64 = 0.08;
/// A palm whose square is closer than this to a detected hand, in sides of the square, belongs to that hand.
const MIN_PALM_DISTANCE: f64 = 0.25;
/// Least handedness probability. Below it the shape is mostly wrong: thumb and little finger exchanged, or points of
/// another hand. On rendered persons 5.7 % of the detected hands are below, among them half of those with an error of
/// more than 0.4 palms and 1.4 % of the others. 0.5 reduces the finger error by 1 to 2 %, but rejects more than twice
/// as many of the others, and many hands of real clips in between look right.
const MIN_SIDE_PROBABILITY: f64 = 0.3;
/// Unsuccessful searches along an arm after which the next frame is no longer searched.
const N_PROMPT_SEARCHES: u32 = 3;
/// Largest number of doublings of the pause.
const MAX_DOUBLINGS: u32 = 2;
/// An arm whose wrist moved by more than this since the last unsuccessful search, in body widths, is searched at once.
const MIN_WRIST_MOVEMENT: f64 = 0.15;

/// Backoff after unsuccessful searches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct SearchPause {
    n_failed: u32,
    next: usize,
}

impl SearchPause {
    /// Records a failed search in frame `now`: a pause of `shortest` frames, doubled by each failure beyond `prompt`.
    fn fail(&mut self, now: usize, shortest: usize, prompt: u32) {
        self.n_failed = self.n_failed.saturating_add(1);
        let doublings = self.n_failed.saturating_sub(prompt).min(MAX_DOUBLINGS);
        self.next = now.saturating_add(shortest.saturating_mul(1 << doublings));
    }
}

/// State of one hand between two frames.
#[derive(Clone, Copy, Default)]
struct HandTrack {
    /// Square around the hand; `None` if it is lost.
    region: Option<Region>,
    pause: SearchPause,
    /// Wrist of the arm at the last unsuccessful search.
    wrist: Option<ScoredPoint>,
}

/// Tracks the left and right hand of one person.
pub struct HandTracker {
    pub model: HandModel,
    pub palm: Option<PalmDetector>,
    tracks: [HandTrack; 2],
    palm_pause: SearchPause,
    /// Number of frames since the last reset.
    n_frames: usize,
}

impl HandTracker {
    pub fn new(model: HandModel, palm: Option<PalmDetector>) -> Self {
        Self { model, palm, tracks: [HandTrack::default(); 2], palm_pause: SearchPause::default(), n_frames: 0 }
    }

    pub fn reset(&mut self) {
        self.tracks = [HandTrack::default(); 2];
        (self.palm_pause, self.n_frames) = (SearchPause::default(), 0);
    }

    /// Left and right hand of a body in the next frame.
    pub fn find(
        &mut self,
        image: &Image,
        body: &[ScoredPoint; 17],
        settings: &Pose2dConfig,
    ) -> Result<[Option<DetectedHand>; 2]> {
        let now = self.n_frames;
        self.n_frames += 1;
        let width = body_width(body, settings.joint_score);
        let is_lost = |hand: &Option<DetectedHand>| hand.as_ref().is_none_or(|hand| hand.score < settings.hand_score);
        let (mut hands, mut searched) = ([None, None], [false; 2]);
        for (side, (elbow, wrist)) in ARMS.into_iter().enumerate() {
            let track = &self.tracks[side];
            if let Some(region) = &track.region {
                hands[side] = self.model.find(image, region)?;
            }
            let is_due = now >= track.pause.next
                || track.wrist.is_none_or(|before| distance(before, body[wrist]) > MIN_WRIST_MOVEMENT * width);
            let is_fine = |hand: &DetectedHand| hand.score >= settings.hand_score && matches_side(hand, side);
            if !hands[side].as_ref().is_some_and(is_fine) && is_due && body[wrist][2] > settings.joint_score {
                let [from, to] = [elbow, wrist].map(|at| [body[at][0], body[at][1]]);
                let square = region::beyond_wrist(from, to, width);
                let find = |region: &Region| self.model.find(image, region);
                hands[side] = search_arm(hands[side].take(), &square, settings.hand_score, is_fine, find)?;
                searched[side] = true;
            }
        }
        if hands.iter().any(is_lost) && now.is_multiple_of(settings.palm_every.max(1)) && now >= self.palm_pause.next {
            self.detect_at_palms(image, body, &mut hands, settings, now)?;
        }
        reject_implausible(&mut hands, body, settings);
        for (side, (track, hand)) in self.tracks.iter_mut().zip(&mut hands).enumerate() {
            // A hand with the wrong handedness is still tracked, because the next frame often corrects it.
            track.region = hand.as_ref().map(DetectedHand::next_region);
            hand.take_if(|hand| !matches_side(hand, side));
            if hand.is_some() {
                *track = HandTrack { region: track.region, ..HandTrack::default() };
            } else if searched[side] {
                track.pause.fail(now, 1, N_PROMPT_SEARCHES);
                track.wrist = Some(body[ARMS[side].1]);
            }
        }
        Ok(hands)
    }

    /// Detects palms and assigns hands where one is lost.
    fn detect_at_palms(
        &mut self,
        image: &Image,
        body: &[ScoredPoint; 17],
        hands: &mut [Option<DetectedHand>; 2],
        settings: &Pose2dConfig,
        now: usize,
    ) -> Result<()> {
        let Some(palm) = self.palm.as_mut() else { return Ok(()) };
        let is_confident = |hand: &DetectedHand| hand.score >= settings.hand_score;
        let shortest = settings.palm_every.max(1);
        self.palm_pause.fail(now, shortest, 1);
        for region in palm.find(image)? {
            let [x, y] = region.centre;
            let is_found = |hand: &DetectedHand| {
                is_confident(hand) && distance(centre(hand), [x, y, 0.0]) < MIN_PALM_DISTANCE * region.side
            };
            if hands.iter().flatten().any(is_found) {
                continue;
            }
            let Some(hand) = self.model.find(image, &region)?.filter(is_confident) else { continue };
            let slot = &mut hands[usize::from(is_right(&hand, body))];
            if !slot.as_ref().is_some_and(is_confident) {
                *slot = Some(hand);
                self.palm_pause = SearchPause { n_failed: 0, next: now + shortest };
            }
        }
        Ok(())
    }
}

/// Rejects hands with a low score, hands that are not at their arm, and duplicates of the other hand.
pub fn reject_implausible(hands: &mut [Option<DetectedHand>; 2], body: &[ScoredPoint; 17], settings: &Pose2dConfig) {
    let [left, right] = ARMS.map(|(_, wrist)| body[wrist]);
    let width = body_width(body, settings.joint_score);
    for (hand, [own, other]) in hands.iter_mut().zip([[left, right], [right, left]]) {
        hand.take_if(|hand| {
            let [to_own, to_other] = [own, other].map(|wrist| distance(hand.points[0], wrist));
            let is_nearer_other = other[2] > settings.joint_score && to_other < to_own;
            let most = if is_nearer_other { MAX_WRIST_DISTANCE / 2.0 } else { MAX_WRIST_DISTANCE };
            let is_detached = own[2] > settings.joint_score && to_own > most * width;
            hand.score < settings.hand_score || is_detached
        });
    }
    if let [Some(left), Some(right)] = &hands
        && distance(centre(left), centre(right)) < MIN_HAND_DISTANCE * width
    {
        let right_probability = |hand: &DetectedHand| hand.right.unwrap_or_else(|| f64::from(is_right(hand, body)));
        let is_left = left.score * (1.0 - right_probability(left)) >= right.score * right_probability(right);
        hands[usize::from(is_left)] = None;
    }
}

/// Whether the hand is a right hand: by the model's handedness, else by the closer wrist.
fn is_right(hand: &DetectedHand, body: &[ScoredPoint; 17]) -> bool {
    let to_wrist = |at: usize| distance(hand.points[0], body[at]);
    hand.right.map_or_else(|| to_wrist(coco::R_WRIST) < to_wrist(coco::L_WRIST), |right| right > 0.5)
}

/// Whether the handedness matches the side (0 left, 1 right) or is unknown.
fn matches_side(hand: &DetectedHand, side: usize) -> bool {
    hand.right.is_none_or(|right| [1.0 - right, right][side] >= MIN_SIDE_PROBABILITY)
}

/// Shoulder width as in a frontal view, px: at least what trunk and arms imply, since the distance between the
/// shoulders shrinks as the person turns.
fn body_width(body: &[ScoredPoint; 17], joint_score: f64) -> f64 {
    let is_visible = |joint: usize| body[joint][2] > joint_score;
    let middle = |a: usize, b: usize| [0, 1, 2].map(|k| (body[a][k] + body[b][k]) / 2.0);
    let trunk = [coco::L_HIP, coco::R_HIP].into_iter().all(is_visible).then(|| {
        let shoulders = middle(coco::L_SHOULDER, coco::R_SHOULDER);
        WIDTH_PER_TRUNK * distance(shoulders, middle(coco::L_HIP, coco::R_HIP))
    });
    let bones = WIDTH_BONES.into_iter().filter(|&(from, to)| is_visible(from) && is_visible(to));
    let lengths = bones.map(|(from, to)| WIDTH_PER_BONE * distance(body[from], body[to]));
    lengths.chain(trunk).fold(distance(body[coco::L_SHOULDER], body[coco::R_SHOULDER]), f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::arm_search::better_of;
    use super::*;

    /// Shoulders 100 px apart, wrists at x = 190 (left) and 110 (right).
    fn body() -> [ScoredPoint; 17] {
        let mut body = [[0.0; 3]; 17];
        let positions =
            [(coco::L_SHOULDER, 200.0), (coco::R_SHOULDER, 100.0), (coco::L_WRIST, 190.0), (coco::R_WRIST, 110.0)];
        for (joint, x) in positions {
            body[joint] = [x, 0.0, 0.9];
        }
        body
    }

    fn hand(x: f64, right: f64) -> Option<DetectedHand> {
        Some(DetectedHand { points: [[x, 0.0, 0.9]; 21], score: 0.9, right: Some(right), depth: None })
    }

    fn accepted(mut hands: [Option<DetectedHand>; 2], body: &[ScoredPoint; 17]) -> [bool; 2] {
        reject_implausible(&mut hands, body, &Pose2dConfig::default());
        hands.map(|hand| hand.is_some())
    }

    #[test]
    fn a_hand_at_the_other_wrist_is_rejected() {
        assert_eq!(accepted([hand(192.0, 0.1), hand(110.0, 0.9)], &body()), [true, true]);
        assert_eq!(accepted([hand(152.0, 0.1), hand(110.0, 0.9)], &body()), [true, true], "nearer to its own wrist");
        assert_eq!(accepted([hand(148.0, 0.1), hand(110.0, 0.9)], &body()), [false, true], "nearer to the other");
        assert_eq!(accepted([hand(241.0, 0.1), hand(110.0, 0.9)], &body()), [false, true], "at no wrist");
        let mut crossed = body();
        crossed[coco::L_WRIST][0] = 120.0;
        assert_eq!(accepted([hand(130.0, 0.1), hand(110.0, 0.9)], &crossed), [true, true]);
        let mut hidden = body();
        hidden[coco::L_WRIST][2] = 0.1;
        assert_eq!(accepted([hand(148.0, 0.1), hand(110.0, 0.9)], &hidden), [true, true], "its wrist is not known");
        let mut uncertain = [hand(192.0, 0.1), None];
        uncertain[0].as_mut().unwrap().score = 0.4;
        assert_eq!(accepted(uncertain, &body()), [false, false]);
    }

    #[test]
    fn the_body_width_of_a_turned_person_is_that_of_trunk_and_arms() {
        let mut turned = body();
        assert_eq!(body_width(&turned, 0.3), 100.0);
        turned[coco::L_SHOULDER][0] = 104.0;
        assert_eq!(body_width(&turned, 0.3), 4.0);
        turned[coco::L_ELBOW] = [104.0, 80.0, 0.9];
        assert_eq!(body_width(&turned, 0.3), 0.9 * 86.0_f64.hypot(80.0), "the forearm");
        turned[coco::L_ELBOW][2] = 0.1;
        turned[coco::L_HIP] = [104.0, 150.0, 0.9];
        turned[coco::R_HIP] = [100.0, 150.0, 0.9];
        assert_eq!(body_width(&turned, 0.3), 90.0);
        // A hand that is 40 px from its wrist, ten times the distance between the shoulders.
        assert_eq!(accepted([hand(230.0, 0.1), None], &turned), [true, false]);
    }

    #[test]
    fn a_duplicate_hand_is_assigned_by_handedness() {
        let mut crossed = body();
        crossed[coco::L_WRIST][0] = 110.0;
        assert_eq!(accepted([hand(112.0, 0.9), hand(110.0, 0.9)], &crossed), [false, true]);
        assert_eq!(accepted([hand(112.0, 0.1), hand(110.0, 0.9)], &crossed), [true, false]);
        let mut uncertain = hand(112.0, 0.4);
        uncertain.as_mut().unwrap().score = 0.6;
        assert_eq!(accepted([uncertain, hand(110.0, 0.9)], &crossed), [false, true], "the other hand is more certain");
    }

    #[test]
    fn a_hand_of_the_right_handedness_is_preferred() {
        let [left, other, sure_left] = [hand(190.0, 0.2), hand(191.0, 0.9), hand(192.0, 0.1)];
        let chosen = |a: &Option<DetectedHand>, b: &Option<DetectedHand>| {
            better_of(a.clone(), b.clone(), |hand| matches_side(hand, 0)).map(|hand| hand.points[0][0])
        };
        assert_eq!((chosen(&other, &left), chosen(&left, &other)), (Some(190.0), Some(190.0)));
        assert_eq!((chosen(&left, &sure_left), chosen(&other, &None)), (Some(190.0), Some(191.0)));
        let of = |right: f64, side: usize| matches_side(&hand(0.0, right).unwrap(), side);
        assert_eq!([of(0.1, 0), of(0.69, 0), of(0.75, 0), of(0.75, 1), of(0.2, 1)], [true, true, false, true, false]);
        let silent = DetectedHand { right: None, ..hand(0.0, 0.0).unwrap() };
        assert!(matches_side(&silent, 0) && matches_side(&silent, 1));
    }

    #[test]
    fn failed_searches_become_less_frequent() {
        let pauses = |shortest: usize, prompt: u32| {
            let mut pause = SearchPause::default();
            let mut now = 0;
            [0; 6].map(|_| {
                pause.fail(now, shortest, prompt);
                let waited = pause.next - now;
                now = pause.next;
                waited
            })
        };
        assert_eq!(pauses(1, N_PROMPT_SEARCHES), [1, 1, 1, 2, 4, 4]);
        assert_eq!(pauses(5, 1), [5, 10, 20, 20, 20, 20]);
        SearchPause { n_failed: u32::MAX, next: 0 }.fail(usize::MAX, usize::MAX, 0);
    }
}
