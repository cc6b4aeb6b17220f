//! Errors of predicted points on labelled people: the object keypoint similarity of COCO, and by group of points how
//! far off they are and how many are found.

use super::people::LabelledPerson;
use crate::math::order::Ordered;
use crate::types::pose2d::{N_BODY, SEEN_SCORE};

/// Standard deviations of COCO's annotators, shares of the root of a person's area.
const SIGMAS: [f64; N_BODY] = [
    0.026, 0.025, 0.025, 0.035, 0.035, 0.079, 0.079, 0.072, 0.072, 0.062, 0.062, 0.107, 0.107, 0.087, 0.087, 0.089,
    0.089,
];
/// Points that are told together.
const GROUPS: [(&str, std::ops::Range<usize>); 6] =
    [("face", 0..5), ("shoulders", 5..7), ("elbows", 7..9), ("wrists", 9..11), ("hips", 11..13), ("legs", 13..17)];

/// A predicted point: x, y px of the picture and score.
pub type PredictedPoint = [f64; 3];

/// Mean over the labelled points of exp(-d^2 / (2 area (2 sigma)^2)), 0..1; 1 without labels.
pub fn similarity(person: &LabelledPerson, points: &[PredictedPoint; N_BODY]) -> f64 {
    let labelled = (0..N_BODY).filter(|&point| person.points[point][2] > 0.0);
    let similar = labelled.map(|point| {
        let spread = 2.0 * SIGMAS[point];
        (-distance(person, points, point).powi(2) / (2.0 * person.area.max(1.0) * spread * spread)).exp()
    });
    let (sum, n) = similar.fold((0.0, 0), |(sum, n), one| (sum + one, n + 1));
    if n == 0 { 1.0 } else { sum / f64::from(n) }
}

fn distance(person: &LabelledPerson, points: &[PredictedPoint; N_BODY], point: usize) -> f64 {
    let ([x, y, _], [px, py, _]) = (person.points[point], points[point]);
    (x - px).hypot(y - py)
}

/// Lines of the table of errors; groups of points that nobody shows are left out.
pub fn lines(people: &[LabelledPerson], predicted: &[[PredictedPoint; N_BODY]]) -> Vec<String> {
    if people.is_empty() {
        return vec!["nobody is held out: no errors are measured".to_owned()];
    }
    let pairs = || people.iter().zip(predicted);
    let mean = pairs().map(|(person, points)| similarity(person, points)).sum::<f64>() / people.len() as f64;
    let mut lines = vec![format!("{} people, mean similarity (OKS) {mean:.3}", people.len())];
    for (name, group) in GROUPS {
        let (mut off, mut n_found, mut n_other, mut n_invented) = (Vec::new(), 0, 0, 0);
        for ((person, points), point) in pairs().flat_map(|pair| group.clone().map(move |point| (pair, point))) {
            let is_found = points[point][2] > f64::from(SEEN_SCORE);
            if person.points[point][2] == 2.0 {
                off.push(distance(person, points, point) / person.area.max(1.0).sqrt());
                n_found += usize::from(is_found);
            } else {
                n_other += 1;
                n_invented += usize::from(is_found);
            }
        }
        let (n_seen, percent) = (off.len(), |part: usize, of: usize| 100.0 * part as f64 / of.max(1) as f64);
        if n_seen == 0 {
            continue;
        }
        let off = Ordered::new(off);
        let at = |share: f64| 100.0 * off.quantile(share).unwrap_or(f64::NAN);
        lines.push(format!(
            "{name:10} median {:5.1} % and 95 % below {:5.1} % of the root of the area; {:5.1} % of {n_seen} seen found, \
             {:5.1} % of {n_other} others",
            at(0.5),
            at(0.95),
            percent(n_found, n_seen),
            percent(n_invented, n_other)
        ));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn right_points_are_wholly_similar_and_far_ones_not() {
        let mut person = LabelledPerson {
            picture: Default::default(),
            bbox: [0.0, 0.0, 100.0, 100.0],
            area: 10_000.0,
            points: std::array::from_fn(|k| [5.0 * k as f64, 50.0, 2.0]),
        };
        person.points[16] = [0.0; 3];
        let right = person.points.map(|[x, y, _]| [x, y, 0.9]);
        assert_eq!(similarity(&person, &right), 1.0);
        let mut one_off = right;
        one_off[9][0] += 2.0 * 0.062 * 100.0;
        let expected = (15.0 + (-0.5f64).exp()) / 16.0;
        assert!((similarity(&person, &one_off) - expected).abs() < 1e-12);
        let lines = lines(&[person], &[right]);
        assert!(lines[0].contains("1.000") && lines[4].starts_with("wrists") && lines[4].contains("100.0 % of 2 seen"));
        assert!(lines[6].contains("of 1 others"), "{}", lines[6]);
        assert!(super::lines(&[], &[])[0].starts_with("nobody"));
    }
}
