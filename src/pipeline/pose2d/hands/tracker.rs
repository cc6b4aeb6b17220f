//! Both hands from frame to frame: each from where it was, else from its arm, else from a detected palm; then guards
//! against the other hand, one hand found twice and hands that look like one of the other side. What was searched in
//! vain is searched more rarely.

use super::visibility::{distance, middle};
use crate::pose2d::decode::ScoredPoint;
use crate::pose2d::detector::PalmDetector;
use crate::pose2d::hand::{DetectedHand, HandModel};
use crate::pose2d::region;
use anyhow::Result;
use orator_base::types::image::Image;
use orator_base::types::pose2d::coco;
use orator_dataset::config::Pose2dConfig;
use orator_media::opencv::warp::Region;

/// Elbow and wrist of the left and the right arm.
const ARMS: [(usize, usize); 2] = [(coco::L_ELBOW, coco::L_WRIST), (coco::R_ELBOW, coco::R_WRIST)];
/// A hand begins no further from its arm's wrist than this, in shoulder widths; half as far where the other arm's wrist
/// is nearer, since where hands overlap a hand model may follow the other one.
const SAME_WRIST: f64 = 0.5;
/// Two hands whose middles are nearer than this, in shoulder widths, are one.
const SAME_HAND: f64 = 0.08;
/// A palm whose square lies this near to a found hand, in sides of the square, is that hand's.
const SAME_PALM: f64 = 0.25;
/// A hand whose side the model gives a lower probability than this is mostly of wrong shape: thumb and little finger
/// exchanged, or another hand's points. On rendered people 5.7 % of the found hands are below it, among them half of
/// those that are wrong by more than 0.4 palms and 1.4 % of the others. 0.5 gave fingers 1 to 2 % less error, but took
/// more than twice as many of the others, and many hands of real clips between the two look right.
const LEAST_SIDE: f64 = 0.3;
/// Searches in vain along an arm after which a search no longer follows in the next frame.
const PROMPT: u32 = 3;
/// The longest pause is the shortest one, doubled so often.
const MOST_DOUBLINGS: u32 = 2;
/// An arm whose wrist has moved so far since the last search in vain, in shoulder widths, is searched at once.
const MOVED: f64 = 0.15;

/// When to search again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct SearchPause {
    n_failed: u32,
    /// Frame of the next search.
    next: usize,
}

impl SearchPause {
    /// A search in frame `now` was in vain: a pause of `shortest` frames, doubled by each one beyond `prompt`.
    fn fail(&mut self, now: usize, shortest: usize, prompt: u32) {
        self.n_failed = self.n_failed.saturating_add(1);
        let doublings = self.n_failed.saturating_sub(prompt).min(MOST_DOUBLINGS);
        self.next = now.saturating_add(shortest.saturating_mul(1 << doublings));
    }
}

/// One hand between two frames.
#[derive(Clone, Copy, Default)]
struct HandTrack {
    /// The square around it; none: it is lost.
    region: Option<Region>,
    pause: SearchPause,
    /// The arm's wrist at the last search in vain.
    wrist: Option<ScoredPoint>,
}

/// Follows the left and the right hand of one person.
pub struct HandTracker {
    pub model: HandModel,
    pub palm: Option<PalmDetector>,
    tracks: [HandTrack; 2],
    palm_pause: SearchPause,
    /// Frames since the hands were followed anew.
    n_frames: usize,
}

impl HandTracker {
    pub fn new(model: HandModel, palm: Option<PalmDetector>) -> Self {
        Self { model, palm, tracks: [HandTrack::default(); 2], palm_pause: SearchPause::default(), n_frames: 0 }
    }

    /// Forgets the hands and what was searched in vain.
    pub fn begin_anew(&mut self) {
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
        let lost = |hand: &Option<DetectedHand>| hand.as_ref().is_none_or(|hand| hand.score < settings.hand_score);
        let (mut hands, mut searched) = ([None, None], [false; 2]);
        for (side, (elbow, wrist)) in ARMS.into_iter().enumerate() {
            let track = &self.tracks[side];
            if let Some(region) = &track.region {
                hands[side] = self.model.find(image, region)?;
            }
            let is_due = now >= track.pause.next
                || track.wrist.is_none_or(|before| distance(before, body[wrist]) > MOVED * shoulder_px(body));
            let is_wrong = hands[side].as_ref().is_some_and(|hand| !is_of_side(hand, side));
            if (lost(&hands[side]) || is_wrong) && is_due && body[wrist][2] > settings.joint_score {
                let [from, to] = [elbow, wrist].map(|at| [body[at][0], body[at][1]]);
                let found = self.beyond_wrist(image, &region::beyond_wrist(from, to, shoulder_px(body)), settings)?;
                hands[side] = better(hands[side].take(), found, |hand| {
                    hand.score >= settings.hand_score && is_of_side(hand, side)
                });
                searched[side] = true;
            }
        }
        if hands.iter().any(lost) && now.is_multiple_of(settings.palm_every.max(1)) && now >= self.palm_pause.next {
            self.at_palms(image, body, &mut hands, settings, now)?;
        }
        guard(&mut hands, body, settings);
        for (side, (track, hand)) in self.tracks.iter_mut().zip(&mut hands).enumerate() {
            // A hand of wrong shape is followed further, since the next look often finds it as it is.
            track.region = hand.as_ref().map(DetectedHand::next_region);
            hand.take_if(|hand| !is_of_side(hand, side));
            if hand.is_some() {
                *track = HandTrack { region: track.region, ..HandTrack::default() };
            } else if searched[side] {
                track.pause.fail(now, 1, PROMPT);
                track.wrist = Some(body[ARMS[side].1]);
            }
        }
        Ok(hands)
    }

    /// The hand in the rough square at the end of an arm, looked at again where its own square is another.
    fn beyond_wrist(
        &mut self,
        image: &Image,
        square: &Region,
        settings: &Pose2dConfig,
    ) -> Result<Option<DetectedHand>> {
        let Some(rough) = self.model.find(image, square)? else { return Ok(None) };
        let own = rough.next_region();
        if rough.score >= settings.hand_score && region::are_alike(square, &own) {
            return Ok(Some(rough));
        }
        self.model.find(image, &own)
    }

    /// Puts hands at detected palms where one is lost.
    fn at_palms(
        &mut self,
        image: &Image,
        body: &[ScoredPoint; 17],
        hands: &mut [Option<DetectedHand>; 2],
        settings: &Pose2dConfig,
        now: usize,
    ) -> Result<()> {
        let Some(palm) = self.palm.as_mut() else { return Ok(()) };
        let enough = |hand: &DetectedHand| hand.score >= settings.hand_score;
        let shortest = settings.palm_every.max(1);
        self.palm_pause.fail(now, shortest, 1);
        for region in palm.find(image)? {
            let [x, y] = region.centre;
            let is_found =
                |hand: &DetectedHand| enough(hand) && distance(middle(hand), [x, y, 0.0]) < SAME_PALM * region.side;
            if hands.iter().flatten().any(is_found) {
                continue;
            }
            let Some(hand) = self.model.find(image, &region)?.filter(enough) else { continue };
            let place = &mut hands[usize::from(is_right(&hand, body))];
            if !place.as_ref().is_some_and(enough) {
                *place = Some(hand);
                self.palm_pause = SearchPause { n_failed: 0, next: now + shortest };
            }
        }
        Ok(())
    }
}

/// Takes out a hand that is not sure, that is not at its arm, or that is the other one again.
pub fn guard(hands: &mut [Option<DetectedHand>; 2], body: &[ScoredPoint; 17], settings: &Pose2dConfig) {
    let [left, right] = ARMS.map(|(_, wrist)| body[wrist]);
    for (hand, [own, other]) in hands.iter_mut().zip([[left, right], [right, left]]) {
        hand.take_if(|hand| {
            let [to_own, to_other] = [own, other].map(|wrist| distance(hand.points[0], wrist));
            let is_others = other[2] > settings.joint_score && to_other < to_own;
            let most = if is_others { SAME_WRIST / 2.0 } else { SAME_WRIST };
            let is_away = own[2] > settings.joint_score && to_own > most * shoulder_px(body);
            hand.score < settings.hand_score || is_away
        });
    }
    if let [Some(left), Some(right)] = &hands
        && distance(middle(left), middle(right)) < SAME_HAND * shoulder_px(body)
    {
        let is_right = is_right(left, body);
        hands[usize::from(!is_right)] = None;
    }
}

/// Whether it is a right hand: as the model says, else by the nearer wrist.
fn is_right(hand: &DetectedHand, body: &[ScoredPoint; 17]) -> bool {
    let to_wrist = |at: usize| distance(hand.points[0], body[at]);
    hand.right.map_or_else(|| to_wrist(coco::R_WRIST) < to_wrist(coco::L_WRIST), |right| right > 0.5)
}

/// Whether the model takes it for a hand of that side (0 left, 1 right), or does not say.
fn is_of_side(hand: &DetectedHand, side: usize) -> bool {
    hand.right.is_none_or(|right| [1.0 - right, right][side] >= LEAST_SIDE)
}

/// The only one of two hands that is as it should be, else the surer one; the first of two equally sure.
fn better(
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

    /// Shoulders 100 px apart, wrists at x 190 (left) and 110 (right).
    fn body() -> [ScoredPoint; 17] {
        let mut body = [[0.0, 0.0, 0.9]; 17];
        let places =
            [(coco::L_SHOULDER, 200.0), (coco::R_SHOULDER, 100.0), (coco::L_WRIST, 190.0), (coco::R_WRIST, 110.0)];
        for (joint, x) in places {
            body[joint][0] = x;
        }
        body
    }

    fn hand(x: f64, right: f64) -> Option<DetectedHand> {
        Some(DetectedHand { points: [[x, 0.0, 0.9]; 21], score: 0.9, right: Some(right) })
    }

    fn kept(mut hands: [Option<DetectedHand>; 2], body: &[ScoredPoint; 17]) -> [bool; 2] {
        guard(&mut hands, body, &Pose2dConfig::default());
        hands.map(|hand| hand.is_some())
    }

    #[test]
    fn a_hand_at_the_other_wrist_is_not_seen() {
        assert_eq!(kept([hand(192.0, 0.1), hand(110.0, 0.9)], &body()), [true, true]);
        assert_eq!(kept([hand(152.0, 0.1), hand(110.0, 0.9)], &body()), [true, true], "nearer to its own wrist");
        assert_eq!(kept([hand(148.0, 0.1), hand(110.0, 0.9)], &body()), [false, true], "nearer to the other");
        assert_eq!(kept([hand(241.0, 0.1), hand(110.0, 0.9)], &body()), [false, true], "at no wrist");
        let mut crossed = body();
        crossed[coco::L_WRIST][0] = 120.0;
        assert_eq!(kept([hand(130.0, 0.1), hand(110.0, 0.9)], &crossed), [true, true]);
        let mut unseen = body();
        unseen[coco::L_WRIST][2] = 0.1;
        assert_eq!(kept([hand(148.0, 0.1), hand(110.0, 0.9)], &unseen), [true, true], "its wrist is not known");
        let mut unsure = [hand(192.0, 0.1), None];
        unsure[0].as_mut().unwrap().score = 0.4;
        assert_eq!(kept(unsure, &body()), [false, false]);
    }

    #[test]
    fn one_hand_found_twice_stays_on_the_side_the_model_says() {
        let mut crossed = body();
        crossed[coco::L_WRIST][0] = 110.0;
        assert_eq!(kept([hand(112.0, 0.9), hand(110.0, 0.9)], &crossed), [false, true]);
        assert_eq!(kept([hand(112.0, 0.1), hand(110.0, 0.9)], &crossed), [true, false]);
    }

    #[test]
    fn a_hand_of_the_other_sides_shape_gives_way_to_one_of_its_own() {
        let [left, other, sure_left] = [hand(190.0, 0.2), hand(191.0, 0.9), hand(192.0, 0.1)];
        let chosen = |a: &Option<DetectedHand>, b: &Option<DetectedHand>| {
            better(a.clone(), b.clone(), |hand| is_of_side(hand, 0)).map(|hand| hand.points[0][0])
        };
        assert_eq!((chosen(&other, &left), chosen(&left, &other)), (Some(190.0), Some(190.0)));
        assert_eq!((chosen(&left, &sure_left), chosen(&other, &None)), (Some(190.0), Some(191.0)));
        let of = |right: f64, side: usize| is_of_side(&hand(0.0, right).unwrap(), side);
        assert_eq!([of(0.1, 0), of(0.69, 0), of(0.75, 0), of(0.75, 1), of(0.2, 1)], [true, true, false, true, false]);
        let silent = DetectedHand { right: None, ..hand(0.0, 0.0).unwrap() };
        assert!(is_of_side(&silent, 0) && is_of_side(&silent, 1));
    }

    #[test]
    fn what_is_searched_in_vain_is_searched_more_rarely() {
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
        assert_eq!(pauses(1, PROMPT), [1, 1, 1, 2, 4, 4]);
        assert_eq!(pauses(5, 1), [5, 10, 20, 20, 20, 20]);
        SearchPause { n_failed: u32::MAX, next: 0 }.fail(usize::MAX, usize::MAX, 0);
    }
}
