//! Labels of the people in a rendered picture.

use crate::demo::people::scene::PeopleScene;
use crate::demo::people::truth::{FrameTruth, N_POINTS};
use crate::formats::coco_wholebody::{LabelledPoint, PersonPoints, PointLabel, labelled};
use crate::formats::rendered_truth::Visibility;
use crate::render::Renderer;
use crate::types::pose2d::{N_BODY, N_HAND};
use std::ops::Range;

/// Pixels that show somebody.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownPerson {
    /// x, y, width, height, px.
    pub bbox: [f64; 4],
    /// Number of pixels.
    pub area: f64,
}

/// The people of the picture that the renderer drew last, in the scene's order, what they hold left out; `None`: of
/// somebody nothing is seen.
pub fn shown(scene: &PeopleScene, renderer: &Renderer) -> Vec<Option<ShownPerson>> {
    let mut start = 0;
    let bodies = scene.actors.iter().map(|actor| {
        let body = start..start + actor.n_body_meshes();
        start = body.end + usize::from(actor.held.is_some());
        body
    });
    let bodies: Vec<Range<usize>> = bodies.collect();
    let mut found: Vec<Option<([usize; 4], usize)>> = vec![None; bodies.len()];
    let [width, height] = scene.camera.size;
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let Some((mesh, ..)) = renderer.label_at([x as f64, y as f64]) else { continue };
        if let Some(who) = bodies.iter().position(|body| body.contains(&mesh)) {
            let ([left, top, right, bottom], n) = found[who].unwrap_or(([x, y, x, y], 0));
            found[who] = Some(([left.min(x), top.min(y), right.max(x), bottom.max(y)], n + 1));
        }
    }
    let person = |([left, top, right, bottom], n): ([usize; 4], usize)| ShownPerson {
        bbox: [left, top, right + 1 - left, bottom + 1 - top].map(|px| px as f64),
        area: n as f64,
    };
    found.into_iter().map(|pixels| pixels.map(person)).collect()
}

/// Points of the person whose truth it is: one outside the picture has no label.
pub fn points(truth: &FrameTruth) -> PersonPoints {
    let all: [LabelledPoint; N_POINTS] = std::array::from_fn(|point| {
        let label = match truth.seen[point] {
            Visibility::Seen => PointLabel::Seen,
            Visibility::Outside => PointLabel::None,
            _ => PointLabel::Hidden,
        };
        labelled(truth.px[point], label)
    });
    let hand = |side: usize| std::array::from_fn(|point| all[N_BODY + side * N_HAND + point]);
    PersonPoints { body: std::array::from_fn(|point| all[point]), hands: [hand(0), hand(1)] }
}

/// Points of somebody who is not labelled.
pub const UNLABELLED: PersonPoints = PersonPoints { body: [[0.0; 3]; N_BODY], hands: [[[0.0; 3]; N_HAND]; 2] };
