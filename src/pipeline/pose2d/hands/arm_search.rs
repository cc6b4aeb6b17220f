//! Search of a hand beyond the wrist of its arm, with a second attempt where the first one fails.

use crate::pose2d::hand::DetectedHand;
use crate::pose2d::region;
use anyhow::Result;
use orator_media::opencv::warp::Region;

/// Second attempt of a search: enlargement of the square around a hand of the wrong handedness, and rotations of the
/// arm's square (radians) for a bent wrist or a forearm along the line of sight.
const ENLARGEMENT: f64 = 1.25;
const BENT_WRIST: [f64; 2] = [1.2, -1.2];
/// A square in which the model has a lower score contains no hand, and the model does not run again.
const MIN_ROUGH_SCORE: f64 = 0.1;

/// Searches a hand in the square beyond the wrist of its arm; if none is fine, around the best one so far, enlarged,
/// and at a bent wrist. Returns the best hand, including `tracked`.
pub(super) fn search_arm(
    tracked: Option<DetectedHand>,
    square: &Region,
    min_score: f64,
    is_fine: impl Fn(&DetectedHand) -> bool,
    mut find: impl FnMut(&Region) -> Result<Option<DetectedHand>>,
) -> Result<Option<DetectedHand>> {
    let mut best = better_of(tracked, search_square(square, min_score, &mut find)?, &is_fine);
    let enlarged = best.as_ref().filter(|hand| hand.score >= min_score).map(|hand| {
        let own = hand.next_region();
        Region { side: ENLARGEMENT * own.side, ..own }
    });
    let bent = BENT_WRIST.map(|angle| Region { rotation: square.rotation + angle, ..*square });
    for region in enlarged.into_iter().chain(bent) {
        if best.as_ref().is_some_and(&is_fine) {
            break;
        }
        best = better_of(best, search_square(&region, min_score, &mut find)?, &is_fine);
    }
    Ok(best)
}

/// Hand in a square; the model runs again if the square around the result differs.
fn search_square(
    square: &Region,
    min_score: f64,
    find: &mut impl FnMut(&Region) -> Result<Option<DetectedHand>>,
) -> Result<Option<DetectedHand>> {
    let Some(rough) = find(square)? else { return Ok(None) };
    let own = rough.next_region();
    let is_final = rough.score >= min_score && region::are_similar(square, &own);
    if is_final || rough.score < MIN_ROUGH_SCORE {
        return Ok(Some(rough));
    }
    find(&own)
}

/// The acceptable one of two hands, else the one with the higher score; the first on a tie.
pub(super) fn better_of(
    a: Option<DetectedHand>,
    b: Option<DetectedHand>,
    is_fine: impl Fn(&DetectedHand) -> bool,
) -> Option<DetectedHand> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if (is_fine(&b), b.score) > (is_fine(&a), a.score) { b } else { a }),
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hand with the given handedness that points along the rotation of a square.
    fn hand_along(rotation: f64, score: f64, right: f64) -> DetectedHand {
        let (sin, cos) = rotation.sin_cos();
        let point = |at: usize| {
            let [x, y] = match at {
                0 => [0.0, 0.0],
                5 | 9 | 13 => [at as f64 - 9.0, -40.0],
                _ => [0.0, -20.0],
            };
            [x * cos - y * sin, x * sin + y * cos, score]
        };
        DetectedHand { points: std::array::from_fn(point), score, right: Some(right), depth: None }
    }

    /// Searches a left hand with a model that maps the number of the call and the square to a hand; returns the score
    /// and the searched squares.
    fn searched(model: impl Fn(usize, &Region) -> DetectedHand) -> (f64, Vec<Region>) {
        let mut squares: Vec<Region> = Vec::new();
        let square = Region { centre: [0.0, -20.0], side: 200.0, rotation: 0.0 };
        let is_fine = |hand: &DetectedHand| hand.score >= 0.5 && hand.right.is_some_and(|right| right < 0.5);
        let found = search_arm(None, &square, 0.5, is_fine, |region| {
            squares.push(*region);
            Ok(Some(model(squares.len(), region)))
        });
        (found.unwrap().map_or(0.0, |hand| hand.score), squares)
    }

    #[test]
    fn a_hand_at_a_bent_wrist_is_found_in_the_second_attempt() {
        let (score, squares) = searched(|_, region| hand_along(region.rotation, 0.9, 0.1));
        assert_eq!((score, squares.len()), (0.9, 2), "a hand beyond the wrist needs no second attempt");
        let is_bent = |region: &Region| (region.rotation - 1.2).abs() < 0.1;
        let (score, squares) =
            searched(|_, region| hand_along(region.rotation, if is_bent(region) { 0.9 } else { 0.1 }, 0.1));
        assert_eq!((score, squares.len()), (0.9, 4));
        assert!(is_bent(&squares[2]) && squares[2].side == squares[0].side && is_bent(&squares[3]));
        let n_searched = |score: f64| searched(|_, region| hand_along(region.rotation, score, 0.1)).1.len();
        assert_eq!([n_searched(0.3), n_searched(0.05)], [6, 3], "the cost of a miss is bounded");
    }

    #[test]
    fn a_hand_of_the_wrong_handedness_is_searched_in_a_larger_square() {
        let (score, squares) = searched(|n, _| hand_along(0.0, 0.9, if n <= 2 { 0.9 } else { 0.1 }));
        assert_eq!((score, squares.len()), (0.9, 4));
        let own = hand_along(0.0, 0.9, 0.1).next_region();
        assert_eq!((squares[1].side, squares[2].side), (own.side, 1.25 * own.side));
        assert!(squares[2].centre == own.centre && squares[2].rotation == own.rotation);
    }
}
