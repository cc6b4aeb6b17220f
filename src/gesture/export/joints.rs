//! Joints in metres from the features of poses: un-normalisation, bone lengths and forward kinematics; and smoothing.

use super::graph::NetworkGraph;
use crate::generate::normalisation::{N_FEATURES, Normalisation};
use crate::generate::representation::Representation;
use anyhow::Result;
use orator_base::math::savitzky_golay::SavitzkyGolay;
use orator_base::types::skeleton::{N_BONES, N_JOINTS, NECK, is_duplicate, parent};
use orator_formats::bvh::exponential_maps::SMOOTHING;

/// Shortest bone that has a direction, metres.
const MIN_LENGTH: f32 = 1e-9;

/// Adds the output `joints` [T, 49, 3] for features [T, 144], as `SpeakerMetadata::motion` computes them.
pub(super) fn add_joints(
    g: &NetworkGraph,
    features: &str,
    representation: &Representation,
    normal: &Normalisation,
) -> Result<()> {
    let (mean, std) = match representation {
        Representation::Positions => (&normal.mean, &normal.std),
        Representation::Bones { mean, std } => (mean, std),
    };
    let scaled = g.op("Mul", &[features, &g.floats(&[N_FEATURES], std)?]);
    let values = g.op("Add", &[&scaled, &g.floats(&[N_FEATURES], mean)?]);
    let mut directions = g.reshaped("Reshape", &values, &[-1, N_BONES as i64, 3])?;
    let is_position = !representation.keeps_lengths();
    if is_position {
        directions = g.op("MatMul", &[&g.floats(&[N_BONES, N_BONES], &differences())?, &directions]);
    }
    let lengths = normal.lengths();
    let length = |bone: usize| if is_duplicate(bone + 1) { 0.0 } else { lengths[bone] };
    // The network determines the length of a bone that was never measured.
    let free = |bone: usize| f32::from(u8::from(is_position && length(bone) == 0.0));
    let column = |of: &dyn Fn(usize) -> f32| g.floats(&[N_BONES, 1], &(0..N_BONES).map(of).collect::<Vec<_>>());
    let own = g.op("Sqrt", &[&g.sum(&g.op("Mul", &[&directions, &directions]), 2, true)?]);
    let least = g.floats(&[], &[MIN_LENGTH])?;
    let scale = g.op("Div", &[&column(&length)?, &g.op("Max", &[&own, &least])]);
    let bones = g.op("Mul", &[&directions, &g.op("Add", &[&scale, &column(&free)?])]);
    // A bone without direction hangs straight down.
    let down: Vec<f32> = (0..N_BONES).flat_map(|bone| [0.0, length(bone), 0.0]).collect();
    let has_direction = g.op("Greater", &[&own, &least]);
    let bones = g.op("Where", &[&has_direction, &bones, &g.floats(&[N_BONES, 3], &down)?]);
    g.output("joints", "MatMul", &[&g.floats(&[N_JOINTS, N_BONES], &paths())?, &bones]);
    Ok(())
}

/// Matrix [48, 48] from the positions of joints 1 to 48 to their differences to their parents. The hand roots have the
/// positions of the wrists.
fn differences() -> Vec<f32> {
    let mut matrix = vec![0.0; N_BONES * N_BONES];
    let source = |joint: usize| if is_duplicate(joint) { parent(joint).unwrap_or(NECK) } else { joint };
    for joint in 1..N_JOINTS {
        for (of, sign) in [(source(joint), 1.0), (source(parent(joint).unwrap_or(NECK)), -1.0)] {
            if of != NECK {
                matrix[(joint - 1) * N_BONES + of - 1] += sign;
            }
        }
    }
    matrix
}

/// Matrix [49, 48] that is 1 at every bone on the path from the neck to a joint.
fn paths() -> Vec<f32> {
    let mut matrix = vec![0.0; N_JOINTS * N_BONES];
    for joint in 1..N_JOINTS {
        let bones = std::iter::successors(Some(joint), |at| parent(*at)).filter(|at| *at != NECK);
        bones.for_each(|at| matrix[joint * N_BONES + at - 1] = 1.0);
    }
    matrix
}

/// Smooths `poses` [T, C] over time like `orator_formats::bvh::exponential_maps::smooth`.
pub(super) fn smooth(g: &NetworkGraph, poses: &str) -> Result<String> {
    let (half, order) = SMOOTHING;
    let window = 2 * half + 1;
    // For every length up to that of the window: the window that fits, and its weights for each position in it.
    let (mut windows, mut weights) = (Vec::new(), vec![0.0; (window + 1) * window * window]);
    for n in 0..=window {
        let half = n.saturating_sub(1) / 2;
        let fitting = if 2 * half > order { 2 * half + 1 } else { 1 };
        let filter = SavitzkyGolay::new(fitting / 2, order.min(fitting - 1));
        for k in 0..fitting {
            let impulse: Vec<_> = (0..fitting).map(|i| [f64::from(u8::from(i == k)), 0.0, 0.0]).collect();
            for (i, value) in filter.run(&impulse).iter().enumerate() {
                weights[(n * window + i) * window + k] = value[0] as f32;
            }
        }
        windows.push(fitting as i64);
    }
    let n = g.size(poses, 0)?;
    let length = g.chain(&n, &[("Min", window as i64)])?;
    let fitting = g.op("Gather", &[&g.integers(&windows)?, &length]);
    let weights = g.op("Gather", &[&g.floats(&[window + 1, window, window], &weights)?, &length]);
    let t = g.range(&n)?;
    let start = g.op("Sub", &[&t, &g.chain(&fitting, &[("Div", 2)])?]);
    let last = g.op("Sub", &[&n, &fitting]);
    let start = g.op("Min", &[&g.chain(&start, &[("Max", 0)])?, &last]);
    let weights = g.op("Gather", &[&weights, &g.op("Sub", &[&t, &start])]);
    let offsets = g.integers(&(0..window as i64).collect::<Vec<_>>())?;
    let at = g.op("Add", &[&g.reshaped("Unsqueeze", &start, &[1])?, &offsets]);
    let at = g.op("Min", &[&at, &g.chain(&n, &[("Sub", 1)])?]);
    let products = g.op("Mul", &[&g.op("Gather", &[poses, &at]), &g.reshaped("Unsqueeze", &weights, &[2])?]);
    g.sum(&products, 1, false)
}
