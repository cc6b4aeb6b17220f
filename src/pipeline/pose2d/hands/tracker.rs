//! Hand tracking: each hand is searched at its previous position, else at its arm, else at detected palms; then hands
//! that are the other hand, duplicates, or of the wrong handedness are rejected. Repeated unsuccessful searches become
//! less frequent.

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

/// Elbow and wrist of the left and right arm.
const ARMS: [(usize, usize); 2] = [(coco::L_ELBOW, coco::L_WRIST), (coco::R_ELBOW, coco::R_WRIST)];
/// Largest distance of a hand from the wrist of its arm, in shoulder widths; half as much if the other arm's wrist is
/// closer, since a hand model may switch hands where they overlap.
const MAX_WRIST_DISTANCE: f64 = 0.5;
/// Two hands whose centres are closer than this, in shoulder widths, are one.
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
/// An arm whose wrist moved by more than this since the last unsuccessful search, in shoulder widths, is searched at
/// once.
const MIN_WRIST_MOVEMENT: f64 = 0.15;

/// Backoff after unsuccessful searches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct SearchPause {
    n_failed: u32,
    /// Frame of the next search.
    next: usize,
}

impl SearchPause {
    /// Records an unsuccessful search in frame `now`: a pause of `shortest` frames, doubled by each failure beyond
    /// `prompt`.
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

    /// Resets tracks and pauses.
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
        let is_lost = |hand: &Option<DetectedHand>| hand.as_ref().is_none_or(|hand| hand.score < settings.hand_score);
        let (mut hands, mut searched) = ([None, None], [false; 2]);
        for (side, (elbow, wrist)) in ARMS.into_iter().enumerate() {
            let track = &self.tracks[side];
            if let Some(region) = &track.region {
                hands[side] = self.model.find(image, region)?;
            }
            let is_due = now >= track.pause.next
                || track
                    .wrist
                    .is_none_or(|before| distance(before, body[wrist]) > MIN_WRIST_MOVEMENT * shoulder_px(body));
            let is_wrong = hands[side].as_ref().is_some_and(|hand| !matches_side(hand, side));
            if (is_lost(&hands[side]) || is_wrong) && is_due && body[wrist][2] > settings.joint_score {
                let [from, to] = [elbow, wrist].map(|at| [body[at][0], body[at][1]]);
                let found = self.beyond_wrist(image, &region::beyond_wrist(from, to, shoulder_px(body)), settings)?;
                hands[side] = better_of(hands[side].take(), found, |hand| {
                    hand.score >= settings.hand_score && matches_side(hand, side)
                });
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

    /// Hand in the estimated square at the end of an arm; the model runs again if the square around the result
    /// differs.
    fn beyond_wrist(
        &mut self,
        image: &Image,
        square: &Region,
        settings: &Pose2dConfig,
    ) -> Result<Option<DetectedHand>> {
        let Some(rough) = self.model.find(image, square)? else { return Ok(None) };
        let own = rough.next_region();
        if rough.score >= settings.hand_score && region::are_similar(square, &own) {
            return Ok(Some(rough));
        }
        self.model.find(image, &own)
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
    for (hand, [own, other]) in hands.iter_mut().zip([[left, right], [right, left]]) {
        hand.take_if(|hand| {
            let [to_own, to_other] = [own, other].map(|wrist| distance(hand.points[0], wrist));
            let is_nearer_other = other[2] > settings.joint_score && to_other < to_own;
            let most = if is_nearer_other { MAX_WRIST_DISTANCE / 2.0 } else { MAX_WRIST_DISTANCE };
            let is_detached = own[2] > settings.joint_score && to_own > most * shoulder_px(body);
            hand.score < settings.hand_score || is_detached
        });
    }
    if let [Some(left), Some(right)] = &hands
        && distance(centre(left), centre(right)) < MIN_HAND_DISTANCE * shoulder_px(body)
    {
        let is_right = is_right(left, body);
        hands[usize::from(!is_right)] = None;
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

/// The acceptable one of two hands, else the one with the higher score; the first on a tie.
fn better_of(
    a: Option<DetectedHand>,
    b: Option<DetectedHand>,
    is_fine: impl Fn(&DetectedHand) -> bool,
) -> Option<DetectedHand> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if (is_fine(&b), b.score) > (is_fine(&a), a.score) { b } else { a }),
        (a, b) => a.or(b),
    }
}

fn shoulder_px(body: &[ScoredPoint; 17]) -> f64 {
    distance(body[coco::L_SHOULDER], body[coco::R_SHOULDER])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shoulders 100 px apart, wrists at x = 190 (left) and 110 (right).
    fn body() -> [ScoredPoint; 17] {
        let mut body = [[0.0, 0.0, 0.9]; 17];
        let positions =
            [(coco::L_SHOULDER, 200.0), (coco::R_SHOULDER, 100.0), (coco::L_WRIST, 190.0), (coco::R_WRIST, 110.0)];
        for (joint, x) in positions {
            body[joint][0] = x;
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
    fn a_duplicate_hand_is_assigned_by_handedness() {
        let mut crossed = body();
        crossed[coco::L_WRIST][0] = 110.0;
        assert_eq!(accepted([hand(112.0, 0.9), hand(110.0, 0.9)], &crossed), [false, true]);
        assert_eq!(accepted([hand(112.0, 0.1), hand(110.0, 0.9)], &crossed), [true, false]);
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
