//! Joints in metres from the features of poses: un-normalisation, bone lengths and forward kinematics; and
//! their smoothing.

use super::graph::NetworkGraph;
use crate::generate::normalisation::{N_FEATURES, Normalisation};
use crate::generate::representation::Representation;
use anyhow::Result;
use orator_base::math::savitzky_golay::SavitzkyGolay;
use orator_base::math::vec3::Vec3;
use orator_base::types::skeleton::{N_BONES, N_JOINTS, NECK, is_duplicate, parent};
use orator_formats::bvh::exponential_maps::SMOOTHING;
use orator_onnx::convert::AttributeValue;

/// Shortest bone that has a direction, metres.
const MIN_LENGTH: f32 = 1e-9;

/// Adds the output `joints` [T, 49, 3] for features [T, 144], as [`SpeakerMetadata::motion`] computes them.
///
/// [`SpeakerMetadata::motion`]: crate::generate::model::SpeakerMetadata::motion
pub fn add_joints(
    g: &mut NetworkGraph,
    features: &str,
    representation: &Representation,
    normal: &Normalisation,
) -> Result<()> {
    let (mean, std) = match representation {
        Representation::Positions => (&normal.mean, &normal.std),
        Representation::Bones { mean, std } => (mean, std),
    };
    let [mean, std] = [g.graph.floats(&[N_FEATURES], mean)?, g.graph.floats(&[N_FEATURES], std)?];
    let values = g.op("Mul", &[features, &std]);
    let values = g.op("Add", &[&values, &mean]);
    let values = g.shaped("Reshape", &values, &[-1, N_BONES as i64, 3])?;
    let directions = match representation {
        Representation::Bones { .. } => values,
        Representation::Positions => {
            let differences = g.graph.floats(&[N_BONES, N_BONES], &differences())?;
            g.op("MatMul", &[&differences, &values])
        }
    };
    let lengths = normal.lengths();
    let length = |bone: usize| if is_duplicate(bone + 1) { 0.0 } else { lengths[bone] };
    // A bone that was never measured has the length that the network gives it.
    let free = |bone: usize| match representation {
        Representation::Positions if length(bone) == 0.0 => 1.0,
        _ => 0.0,
    };
    let column = |of: &dyn Fn(usize) -> f32| (0..N_BONES).map(of).collect::<Vec<f32>>();
    let targets = g.graph.floats(&[N_BONES, 1], &column(&length))?;
    let free = g.graph.floats(&[N_BONES, 1], &column(&free))?;
    let squares = g.op("Mul", &[&directions, &directions]);
    let axis = g.graph.ints(&[2])?;
    let own = g.graph.op("ReduceSum", &[&squares, &axis], &[("keepdims", AttributeValue::Int(1))]);
    let own = g.op("Sqrt", &[&own]);
    let divisor = g.by_float("Max", &own, MIN_LENGTH)?;
    let scale = g.op("Div", &[&targets, &divisor]);
    let scale = g.op("Add", &[&scale, &free]);
    let bones = g.op("Mul", &[&directions, &scale]);
    // A bone without direction hangs straight down.
    let down: Vec<f32> = (0..N_BONES).flat_map(|bone| [0.0, length(bone), 0.0]).collect();
    let down = g.graph.floats(&[N_BONES, 3], &down)?;
    let has_direction = g.by_float("Greater", &own, MIN_LENGTH)?;
    let bones = g.op("Where", &[&has_direction, &bones, &down]);
    let paths = g.graph.floats(&[N_JOINTS, N_BONES], &paths())?;
    g.graph.output("joints", "MatMul", &[&paths, &bones], &[]);
    Ok(())
}

/// Matrix [48, 48] from the positions of joints 1 to 48 to their differences to their parents. The hand roots have the
/// positions of the wrists.
fn differences() -> Vec<f32> {
    let mut matrix = vec![0.0; N_BONES * N_BONES];
    let source = |joint: usize| if is_duplicate(joint) { parent(joint).unwrap_or(NECK) } else { joint };
    for joint in 1..N_JOINTS {
        let mut add = |of: usize, value: f32| {
            if of != NECK {
                matrix[(joint - 1) * N_BONES + of - 1] += value;
            }
        };
        add(source(joint), 1.0);
        add(source(parent(joint).unwrap_or(NECK)), -1.0);
    }
    matrix
}

/// Matrix [49, 48] that is 1 at every bone on the path from the neck to a joint.
fn paths() -> Vec<f32> {
    let mut matrix = vec![0.0; N_JOINTS * N_BONES];
    for joint in 1..N_JOINTS {
        let mut at = joint;
        while at != NECK {
            matrix[joint * N_BONES + at - 1] = 1.0;
            at = parent(at).unwrap_or(NECK);
        }
    }
    matrix
}

/// Smooths `poses` [T, C] over time like `orator_formats::bvh::exponential_maps::smooth`.
pub fn smoothed(g: &mut NetworkGraph, poses: &str) -> Result<String> {
    let (half, order) = SMOOTHING;
    let window = 2 * half + 1;
    // For every length up to that of the window: the window that fits, and its weights for each position in it.
    let (mut windows, mut weights) = (Vec::new(), vec![0.0; (window + 1) * window * window]);
    for n in 0..=window {
        let half = n.saturating_sub(1) / 2;
        let fitting = if 2 * half > order { 2 * half + 1 } else { 1 };
        let filter = SavitzkyGolay::new(half, order.min(2 * half));
        for k in 0..fitting {
            let impulse: Vec<Vec3> = (0..fitting).map(|i| [f64::from(u8::from(i == k)), 0.0, 0.0]).collect();
            for (i, value) in filter.run(&impulse).iter().enumerate() {
                weights[(n * window + i) * window + k] = value[0] as f32;
            }
        }
        windows.push(fitting as i64);
    }
    let n = g.size(poses, 0)?;
    let length = g.by("Min", &n, window as i64)?;
    let windows = g.graph.ints(&windows)?;
    let weights = g.graph.floats(&[window + 1, window, window], &weights)?;
    let [fitting, weights] = [windows, weights].map(|table| g.op("Gather", &[&table, &length]));
    let t = g.range(&n)?;
    let behind = g.by("Div", &fitting, 2)?;
    let start = g.op("Sub", &[&t, &behind]);
    let start = g.by("Max", &start, 0)?;
    let last = g.op("Sub", &[&n, &fitting]);
    let start = g.op("Min", &[&start, &last]);
    let place = g.op("Sub", &[&t, &start]);
    let weights = g.op("Gather", &[&weights, &place]);
    let weights = g.shaped("Unsqueeze", &weights, &[2])?;
    let start = g.shaped("Unsqueeze", &start, &[1])?;
    let offsets = g.graph.ints(&(0..window as i64).collect::<Vec<_>>())?;
    let at = g.op("Add", &[&start, &offsets]);
    let end = g.by("Sub", &n, 1)?;
    let at = g.op("Min", &[&at, &end]);
    let values = g.op("Gather", &[poses, &at]);
    let products = g.op("Mul", &[&values, &weights]);
    let axis = g.graph.ints(&[1])?;
    Ok(g.graph.op("ReduceSum", &[&products, &axis], &[("keepdims", AttributeValue::Int(0))]))
}
