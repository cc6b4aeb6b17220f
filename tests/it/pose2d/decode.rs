//! Outputs of models: heatmaps, points, anchors, boxes.

use orator_base::types::pose2d::PersonBox;
use orator_media::opencv::blur::GaussianBlur;
use orator_onnx::Refine;
use orator_pipeline::pose2d::decode::boxes::{detections, from_corners, non_max_suppression, overlap};
use orator_pipeline::pose2d::decode::points::{depths, regression, simcc};
use orator_pipeline::pose2d::decode::ssd_anchors::{self, anchors};
use orator_pipeline::pose2d::decode::{heatmap, yolox_grid};

fn gaussian_map(columns: usize, rows: usize, [x, y]: [f64; 2]) -> Vec<f32> {
    let value = |at: usize| {
        let (dx, dy) = ((at % columns) as f64 - x, (at / columns) as f64 - y);
        (0.9 * (-(dx * dx + dy * dy) / (2.0 * 2.0 * 2.0)).exp()) as f32
    };
    (0..columns * rows).map(value).collect()
}

#[test]
fn dark_locates_a_peak_between_cells() {
    for position in [[20.3, 30.8], [10.0, 12.5], [5.49, 40.1]] {
        let map = gaussian_map(48, 64, position);
        let points = heatmap::decode(&[1, 1, 64, 48], &map, [256, 192], Refine::Dark, &GaussianBlur::new(3)).unwrap();
        let [x, y, score] = points[0];
        assert!((x / 4.0 - position[0]).abs() <= 0.05 && (y / 4.0 - position[1]).abs() <= 0.05, "{position:?} {x} {y}");
        assert!(score > 0.8 && score <= 0.9);
    }
}

#[test]
fn other_refinements_and_edges() {
    let map = gaussian_map(48, 64, [20.3, 30.8]);
    let found = |map: &[f32], refine| {
        heatmap::decode(&[1, 1, 64, 48], map, [64, 48], refine, &GaussianBlur::new(3)).unwrap()[0]
    };
    assert_eq!(found(&map, Refine::None)[..2], [20.0, 31.0]);
    assert_eq!(found(&map, Refine::Quarter)[..2], [20.25, 30.75]);
    assert_eq!(found(&gaussian_map(48, 64, [0.2, 63.0]), Refine::Dark)[..2], [0.0, 63.0]);
    assert_eq!(found(&[f32::NAN; 48 * 64], Refine::Dark), [0.0; 3]);
    let mut holed = map.clone();
    holed[30 * 48 + 21] = f32::NAN;
    assert!(found(&holed, Refine::Dark).iter().all(|number| number.is_finite()));
    assert!(heatmap::decode(&[1, 1, 64], &map, [64, 48], Refine::Dark, &GaussianBlur::new(3)).is_err());
    assert!(heatmap::decode(&[1, 1, 60, 48], &map[1..], [64, 48], Refine::Dark, &GaussianBlur::new(3)).is_err());
}

#[test]
fn simcc_positions_are_the_peaks() {
    let mut x = vec![0.0; 2 * 384];
    let mut y = vec![0.0; 2 * 512];
    (x[101], y[77]) = (0.8, 0.6);
    (x[384 + 3], y[512 + 500]) = (0.2, f32::NAN);
    let points = simcc((&[1, 2, 384], &x), (&[1, 2, 512], &y), 2.0).unwrap();
    assert_eq!(points[0], [50.5, 38.5, f64::from(0.6_f32)]);
    assert_eq!(points[1], [1.5, 0.0, 0.0]);
    assert!(simcc((&[1, 2, 384], &x), (&[1, 3, 512], &y), 2.0).is_err());
    assert!(simcc((&[2, 384], &x), (&[1, 2, 512], &y), 2.0).is_err());
}

#[test]
fn regression_accepts_rows_of_any_length() {
    let rows = [1.0, 2.0, 9.0, 3.0, 4.0, 9.0];
    assert_eq!(regression(&rows, 0.5, 2).unwrap(), [[1.0, 2.0, 0.5], [3.0, 4.0, 0.5]]);
    assert_eq!((depths(&rows, 2), depths(&rows, 3)), (Some(vec![9.0, 9.0]), None));
    assert_eq!(depths(&[1.0, 2.0, 0.0, 3.0, 4.0, 0.0], 2), None);
    assert_eq!(regression(&rows, f32::NAN, 2).unwrap(), [[0.0; 3]; 2]);
    assert!(
        regression(&rows, 0.5, 4).is_err() && regression(&rows, 0.5, 0).is_err() && regression(&rows, 0.5, 6).is_err()
    );
}

#[test]
fn anchors_match_those_of_the_models() {
    assert_eq!(anchors(192, &[8, 16, 16, 16]).len(), 2016);
    assert_eq!(anchors(224, &[8, 16, 32, 32, 32]).len(), 2254);
    let palm = anchors(192, &[8, 16, 16, 16]);
    assert_eq!((palm[0], palm[1], palm[2]), ([0.5 / 24.0; 2], [0.5 / 24.0; 2], [1.5 / 24.0, 0.5 / 24.0]));
    assert_eq!(palm[24 * 24 * 2 + 6], [1.5 / 12.0, 0.5 / 12.0]);
}

#[test]
fn overlapping_detections_are_averaged() {
    let anchors = anchors(32, &[16]);
    let mut rows = vec![0.0; anchors.len() * 6];
    let mut logits = vec![-50.0; anchors.len()];
    for (at, (dx, logit)) in [(0, (0.0, 2.0)), (1, (1.0, 2.0)), (6, (0.0, 0.5))] {
        rows[at * 6..at * 6 + 6].copy_from_slice(&[dx, 0.0, 10.0, 8.0, dx + 2.0, 3.0]);
        logits[at] = logit;
    }
    let found = ssd_anchors::decode(&rows, &logits, &anchors, 32, 0.5, 0.3).unwrap();
    assert_eq!(found.len(), 2);
    assert_eq!(found[0].points, [[3.5, 4.0], [13.5, 12.0], [10.5, 11.0]]);
    assert!((found[1].points[2][0] - 26.0).abs() < 1e-9 && (found[1].points[2][1] - 27.0).abs() < 1e-9);
    rows[0] = f32::NAN;
    assert_eq!(ssd_anchors::decode(&rows, &logits, &anchors, 32, 0.5, 0.3).unwrap().len(), 2);
    assert!(ssd_anchors::decode(&rows[6..], &logits, &anchors, 32, 0.5, 0.3).is_err());
}

#[test]
fn the_better_of_overlapping_boxes_is_retained() {
    let at = |x: f32, score: f32| from_corners([x, 0.0, x + 10.0, 10.0], score).unwrap();
    assert!((overlap(&at(0.0, 1.0), &at(5.0, 1.0)) - 1.0 / 3.0).abs() < 1e-6);
    let accepted = non_max_suppression(vec![at(0.0, 0.5), at(1.0, 0.9), at(8.0, 0.7)], 0.45);
    assert_eq!(accepted.iter().map(|b| b.score).collect::<Vec<_>>(), [0.9, 0.7]);
    assert_eq!(from_corners([0.0, 0.0, f32::NAN, 1.0], 1.0), None);
    assert_eq!(from_corners([5.0, 0.0, 5.0, 1.0], 1.0), None);
}

#[test]
fn only_persons_with_a_score_and_an_area_are_returned() {
    let rows = [
        [10.0, 20.0, 30.0, 60.0, 0.8],
        [0.0; 5],
        [50.0, 20.0, 70.0, 60.0, 0.9],
        [90.0, 20.0, f32::NAN, 60.0, 0.9],
        [11.0, 20.0, 30.0, 60.0, 0.2],
    ]
    .concat();
    let found = detections(&rows, Some(&[0, 0, 7, 0, 0]), 0, 0.3, 0.6);
    assert_eq!(found, [PersonBox { x: 10.0, y: 20.0, width: 20.0, height: 40.0, score: 0.8 }]);
    assert_eq!(detections(&rows, None, 0, 0.3, 0.6).len(), 2);
}

#[test]
fn a_cell_becomes_a_box() {
    let mut rows = vec![0.0; (16 + 4) * 6];
    let at = |cell: usize| cell * 6..cell * 6 + 6;
    rows[at(6)].copy_from_slice(&[0.5, 0.25, 1.0_f32.ln(), 2.0_f32.ln(), 0.9, 0.9]);
    rows[at(16 + 3)].copy_from_slice(&[0.0, 0.0, 0.0, 0.0, 0.5, 0.1]);
    let found = yolox_grid::decode(&rows, 6, [32, 32], &[8, 16], 0.3, 0.45).unwrap();
    assert_eq!(found.len(), 1);
    let PersonBox { x, y, width, height, score } = found[0];
    let close = |a: f32, b: f32| (a - b).abs() < 1e-5;
    assert!(close(x, 16.0) && close(y, 2.0) && close(width, 8.0) && close(height, 16.0) && close(score, 0.81));
    assert!(yolox_grid::decode(&rows[6..], 6, [32, 32], &[8, 16], 0.3, 0.45).is_err());
}
