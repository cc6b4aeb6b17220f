//! Changes of bone lengths, which are constant in reality: between consecutive frames, and over time.

use crate::metrics::definition::{Better, BodyPart, Definition, MetricFamily};
use crate::metrics::pair::PairedFrames;
use crate::metrics::sums::BlockSums;
use orator_base::math::vec3::{self, Vec3};
use orator_base::types::skeleton::{N_JOINTS, parent};
use serde_json::json;

/// Layout of the sums of a bone: lengths, squared lengths and changes between frames of both motions, then the numbers
/// of lengths and of changes.
const LENGTH: usize = 0;
const SQUARE: usize = 1;
const CHANGE: usize = 2;
const N_OF_MOTION: usize = 3;
const N_LENGTHS: usize = 2 * N_OF_MOTION;
const N_CHANGES: usize = N_LENGTHS + 1;
const N_OF_BONE: usize = N_CHANGES + 1;

const PARTS: [BodyPart; 2] = [BodyPart::Body, BodyPart::Hands];

pub(crate) fn metric() -> MetricFamily {
    // Far joint of each bone, and its parent.
    let joints = PARTS.iter().flat_map(|part| part.joints());
    let bones: Vec<(usize, usize)> = joints.filter_map(|joint| Some((joint, parent(joint)?))).collect();
    let n_sums = bones.len() * N_OF_BONE;
    let measure = move |pair: &PairedFrames, blocks: &mut BlockSums| {
        for t in 0..pair.n_frames() {
            let sums = blocks.at(t);
            for (sums, &(joint, parent)) in sums.chunks_exact_mut(N_OF_BONE).zip(&bones) {
                let visible = |n| pair.is_visible(t, n, joint) && pair.is_visible(t, n, parent);
                if !visible(1) {
                    continue;
                }
                for (i, poses) in [&pair.predicted, &pair.ground_truth].into_iter().enumerate() {
                    let length = |pose: &[Vec3; N_JOINTS]| vec3::norm(vec3::sub(pose[joint], pose[parent]));
                    let own = &mut sums[i * N_OF_MOTION..(i + 1) * N_OF_MOTION];
                    own[LENGTH] += length(&poses[t]);
                    own[SQUARE] += length(&poses[t]).powi(2);
                    if visible(2) {
                        own[CHANGE] += (length(&poses[t + 1]) - length(&poses[t])).abs();
                    }
                }
                sums[N_LENGTHS] += 1.0;
                sums[N_CHANGES] += f64::from(u8::from(visible(2)));
            }
        }
    };
    MetricFamily::new(PARTS.into_iter().flat_map(definitions).collect(), n_sums, measure, |sums| {
        let (body, hands) = sums.split_at(BodyPart::Body.joints().len() * N_OF_BONE);
        [values(body), values(hands)].concat()
    })
}

fn definitions(part: BodyPart) -> Vec<Definition> {
    let both = |(name, of_real, unit, formula)| {
        let definition = Definition {
            formula,
            undefined: "no bone of the part is visible (for changes: in 2 frames in a row), or one has no length",
            parameters: json!({"bones": part.joints()}),
            ..Definition::new(name, part.name(), unit, Better::Lower)
        };
        definition.with_truth(of_real)
    };
    METRICS.into_iter().flat_map(both).collect()
}

/// Values of one part from the sums of its bones.
fn values(part: &[f64]) -> Vec<f64> {
    let mean = |of: &dyn Fn(&[f64]) -> f64, needs: usize| {
        let all: Vec<f64> = part.chunks_exact(N_OF_BONE).filter(|bone| bone[needs] != 0.0).map(of).collect();
        all.iter().sum::<f64>() / all.len() as f64
    };
    let mean_length = |bone: &[f64], i: usize| bone[i + LENGTH] / bone[N_LENGTHS];
    let mean_change = |bone: &[f64], i: usize| bone[i + CHANGE] / bone[N_CHANGES];
    let deviation = |bone: &[f64], i: usize| {
        let variance = bone[i + SQUARE] / bone[N_LENGTHS] - mean_length(bone, i).powi(2);
        variance.max(0.0).sqrt() / mean_length(bone, i)
    };
    let both = [0, N_OF_MOTION];
    let changes = both.map(|i| 1000.0 * mean(&|bone| mean_change(bone, i), N_CHANGES));
    let shares = both.map(|i| 100.0 * mean(&|bone| mean_change(bone, i) / mean_length(bone, i), N_CHANGES));
    [changes, shares, both.map(|i| 100.0 * mean(&|bone| deviation(bone, i), N_LENGTHS))].concat()
}

/// Name, name for the ground truth, unit, formula.
const METRICS: [(&str, &str, &str, &str); 3] = [
    (
        "bone_change",
        "bone_change_of_real",
        "mm",
        "1000 times the mean over the bones of the part of the mean over t of |l(t+1) - l(t)|, l the length in frames in \
         which both ends are seen; bones end in joints 1-6 (body), 8-48 without 28 (hands)",
    ),
    (
        "bone_change_share",
        "bone_change_share_of_real",
        "%",
        "100 times the mean over the bones of the part of (mean over t of |l(t+1) - l(t)|) / (mean over t of l), l the \
         length in frames in which both ends are seen; bones end in joints 1-6 (body), 8-48 without 28 (hands)",
    ),
    (
        "bone_deviation",
        "bone_deviation_of_real",
        "%",
        "100 times the mean over the bones of the part of (standard deviation over t of l, all frames of all intervals, \
         divided by their number) / (mean over t of l), l the length in frames in which both ends are seen; bones end in \
         joints 1-6 (body), 8-48 without 28 (hands)",
    ),
];
