//! Joints in metres from the features of poses: un-normalisation, bone lengths and forward kinematics.

use super::graph::NetworkGraph;
use crate::generate::normalisation::{N_FEATURES, Normalisation};
use crate::generate::representation::Representation;
use anyhow::Result;
use orator_base::types::skeleton::{N_BONES, N_JOINTS, NECK, is_duplicate, parent};
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
