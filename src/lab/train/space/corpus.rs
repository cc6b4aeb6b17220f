//! Training corpus of the fixed motion spaces (`metrics::basis`, `metrics::embedding`): captured bodies with
//! procedural hands, procedural bodies, and procedural speakers given by the caller. 15 frames/s, all 49 joints, every
//! second clip mirrored.

use crate::mocap::upper_body::{BodyTake, Set};
use crate::train::scene::body_motion;
use crate::train::scene::hand_motion::HandMotion;
use anyhow::{Context, Result, ensure};
use ndarray::{Array2, Array3};
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::upper_body::{ARMS, L_SHOULDER, Pose, R_SHOULDER};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, N_JOINTS, R_HAND, mirror};
use orator_base::types::time::FrameRate;
use orator_gesture::metrics::space::fixed_rate::{FPS, Frames};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

/// Number of copies of each captured take, each with different hands.
const COPIES: usize = 4;
/// Number of clips of procedural bodies, and their length in frames.
const N_PROCEDURAL: usize = 120;
const PROCEDURAL_FRAMES: usize = 300;
/// Share of clips in which both hands move similarly.
const COPIED_HANDS: f64 = 0.4;
/// Half width in seconds of the window over which a captured person's yaw is averaged and removed.
const YAW_MEAN_SECS: f64 = 1.5;

/// Names of the procedural held-out sets.
const PROCEDURAL_BODIES: &str = "procedural bodies";
const PROCEDURAL_SPEAKERS: &str = "procedural speakers";

/// One continuous clip of motion.
pub struct CorpusClip {
    pub name: String,
    /// [T, 49, 3], metres, relative to the neck, 15 frames/s.
    pub joints: Array3<f32>,
}

/// Training clips, and held-out sets for evaluation.
pub struct Corpus {
    pub clips: Vec<CorpusClip>,
    pub held_out: Vec<(String, Vec<CorpusClip>)>,
    metadata: serde_json::Value,
}

impl Corpus {
    /// Builds the corpus of captured `takes`, procedural bodies and procedural `speakers`; `held_out` takes and
    /// `other_speakers` are used for evaluation only.
    ///
    /// # Errors
    /// A take without frames, or with a joint that is not finite.
    pub fn new(
        takes: &[BodyTake],
        held_out: &[Set],
        speakers: &[(String, Motion)],
        other_speakers: &[(String, Motion)],
        seed: u64,
    ) -> Result<Self> {
        let mut clips = Vec::new();
        for copy in 0..COPIES {
            for take in takes {
                let clip = captured(take, copy, seed)?;
                clips.push(if copy % 2 == 1 { clip.mirrored() } else { clip });
            }
        }
        clips.extend((0..N_PROCEDURAL).map(|n| procedural(n, seed)));
        clips.extend(speakers.iter().enumerate().map(|(n, (name, motion))| {
            let clip = CorpusClip::new(name.clone(), motion);
            if n / 2 % 2 == 1 { clip.mirrored() } else { clip }
        }));
        let mut sets = Vec::new();
        for (set, takes) in held_out {
            let takes: Result<Vec<CorpusClip>> = takes.iter().map(|take| captured(take, COPIES, seed)).collect();
            sets.push((set.clone(), takes?));
        }
        sets.push((
            PROCEDURAL_BODIES.into(),
            (N_PROCEDURAL..N_PROCEDURAL + N_PROCEDURAL / 6).map(|n| procedural(n, seed)).collect(),
        ));
        if !other_speakers.is_empty() {
            let clips = other_speakers.iter().map(|(name, motion)| CorpusClip::new(name.clone(), motion)).collect();
            sets.push((PROCEDURAL_SPEAKERS.into(), clips));
        }
        let metadata = metadata(&clips, &sets, seed);
        Ok(Self { clips, held_out: sets, metadata })
    }

    /// Number of training frames.
    pub fn n_frames(&self) -> usize {
        self.clips.iter().map(|clip| clip.joints.shape()[0]).sum()
    }

    /// Description of the corpus for the metadata of a weights file.
    pub fn metadata(&self) -> &serde_json::Value {
        &self.metadata
    }
}

fn metadata(clips: &[CorpusClip], held_out: &[(String, Vec<CorpusClip>)], seed: u64) -> serde_json::Value {
    let mut hash = blake3::Hasher::new();
    for clip in clips {
        hash.update(clip.name.as_bytes());
        hash.update(&clip.joints.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>());
    }
    serde_json::json!({
        "pieces": clips.len(), "frames": clips.iter().map(|clip| clip.joints.shape()[0]).sum::<usize>(), "seed": seed,
        "held_out": held_out.iter().map(|(set, _)| stored_name(set)).collect::<Vec<_>>(),
        "motion": hash.finalize().to_hex().as_str(),
    })
}

/// Name of a held-out set in the metadata of a weights file.
fn stored_name(set: &str) -> &str {
    match set {
        PROCEDURAL_BODIES => "bodies made by rule",
        PROCEDURAL_SPEAKERS => "speakers made by rule",
        set => set,
    }
}

impl CorpusClip {
    fn new(name: String, motion: &Motion) -> Self {
        let mask = Array2::from_elem((motion.n_frames(), N_JOINTS), true);
        Self { name, joints: Frames::new(motion.joints.view(), mask.view(), motion.fps).joints }
    }

    fn mirrored(self) -> Self {
        let at = |(t, joint, k): (usize, usize, usize)| {
            let value = self.joints[[t, mirror(joint), k]];
            if k == 0 { -value } else { value }
        };
        Self { joints: Array3::from_shape_fn(self.joints.raw_dim(), at), name: format!("{} mirrored", self.name) }
    }
}

/// Random number generator of a clip.
fn rng_for(seed: u64, name: &str, n: usize) -> ChaCha8Rng {
    ChaCha8Rng::from_seed(*blake3::hash(format!("{seed} {n} {name}").as_bytes()).as_bytes())
}

fn captured(take: &BodyTake, copy: usize, seed: u64) -> Result<CorpusClip> {
    ensure!(!take.poses.is_empty(), "the take {} has no frame", take.name);
    let (num, den) = ((take.fps * 1000.0).round() as u32, 1000);
    let poses = remove_slow_yaw(&take.poses, take.fps);
    let motion = with_hands(&poses, FrameRate::new(num, den), &mut rng_for(seed, &take.name, copy))
        .with_context(|| format!("cannot add hands to the take {}", take.name))?;
    Ok(CorpusClip::new(format!("{} {copy}", take.name), &motion))
}

fn procedural(n: usize, seed: u64) -> CorpusClip {
    let mut rng = rng_for(seed, "rule", n);
    let poses = body_motion::gesture(&mut rng, PROCEDURAL_FRAMES, FPS.secs(1));
    let motion = with_hands(&poses, FPS, &mut rng).unwrap_or(Motion::from_joints(FPS, Array3::zeros((0, N_JOINTS, 3))));
    let clip = CorpusClip::new(format!("rule {n}"), &motion);
    if n % 2 == 1 { clip.mirrored() } else { clip }
}

/// Removes the slow part of the yaw, so that the shoulders face the camera on average over a few seconds.
fn remove_slow_yaw(poses: &[Pose], fps: f64) -> Vec<Pose> {
    let side = |p: &Pose| vec3::sub(p[L_SHOULDER], p[R_SHOULDER]);
    let mut turned = 0.0;
    let mut last = 0.0;
    // Unwrapped beyond full turns, so that yaws can be averaged.
    let yaws: Vec<f64> = poses
        .iter()
        .map(|pose| {
            let [x, _, z] = side(pose);
            let yaw = z.atan2(x);
            turned += (yaw - last + PI).rem_euclid(2.0 * PI) - PI;
            last = yaw;
            turned
        })
        .collect();
    let radius = (YAW_MEAN_SECS * fps).ceil() as usize;
    let mean = |t: usize| {
        let (mut sum, mut weights) = (0.0, 0.0);
        for (s, yaw) in yaws.iter().enumerate().take(t + radius + 1).skip(t.saturating_sub(radius)) {
            let weight = 1.0 + (PI * (s as f64 - t as f64) / (radius as f64 + 1.0)).cos();
            (sum, weights) = (sum + weight * yaw, weights + weight);
        }
        sum / weights
    };
    let turn = |(t, pose): (usize, &Pose)| {
        let (sin, cos) = mean(t).sin_cos();
        pose.map(|[x, y, z]| [cos * x + sin * z, y, cos * z - sin * x])
    };
    poses.iter().enumerate().map(turn).collect()
}

/// Joins nine-point body poses with procedural hands into a motion of 49 joints.
fn with_hands(poses: &[Pose], fps: FrameRate, rng: &mut ChaCha8Rng) -> Result<Motion> {
    let secs = fps.secs(poses.len());
    let left = HandMotion::sample(rng, secs);
    let right = if rng.random_bool(COPIED_HANDS) { left.copied(rng) } else { HandMotion::sample(rng, secs) };
    let mut joints = Array3::zeros((poses.len(), N_JOINTS, 3));
    let mut put =
        |t: usize, joint: usize, position: Vec3| (0..3).for_each(|k| joints[[t, joint, k]] = position[k] as f32);
    for (t, pose) in poses.iter().enumerate() {
        ARMS.for_each(|joint| put(t, joint, pose[joint]));
    }
    for (hand, is_left, shoulder, root) in [(&left, true, L_SHOULDER, L_HAND), (&right, false, R_SHOULDER, R_HAND)] {
        let arm: Vec<[Vec3; 3]> = poses.iter().map(|p| [p[shoulder], p[shoulder + 1], p[shoulder + 2]]).collect();
        for (t, hand) in hand.along(&arm, is_left, fps.secs(1)).into_iter().enumerate() {
            hand.into_iter().enumerate().for_each(|(k, position)| put(t, root + k, position));
        }
    }
    ensure!(joints.iter().all(|v| v.is_finite()), "a joint position is not finite");
    Ok(Motion::from_joints(fps, joints))
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::types::skeleton::{L_WRIST, R_WRIST};

    #[test]
    fn bodies_face_the_camera_and_have_hands_on_their_wrists() {
        // A static pose that turns around twice in ten seconds.
        let still = body_motion::gesture(&mut ChaCha8Rng::seed_from_u64(1), 1, 0.1)[0];
        let turning = |t: usize| {
            let (sin, cos) = (4.0 * PI * t as f64 / 300.0).sin_cos();
            still.map(|[x, y, z]| [cos * x - sin * z, y, cos * z + sin * x])
        };
        let take =
            BodyTake { name: "turn#0".into(), fps: 30.0, poses: (0..300).map(turning).collect(), rendered: false };
        let corpus = Corpus::new(&[take], &[], &[], &[], 7).unwrap();
        assert_eq!(corpus.clips.len(), COPIES + N_PROCEDURAL);
        for clip in &corpus.clips {
            for frame in clip.joints.outer_iter() {
                assert!(frame[[L_SHOULDER, 0]] > 0.0, "{}", clip.name);
                assert_eq!(frame.row(L_HAND), frame.row(L_WRIST));
                assert_eq!(frame.row(R_HAND), frame.row(R_WRIST));
            }
        }
        assert_eq!(corpus.clips[0].joints.shape(), [150, N_JOINTS, 3]);
        let again = Corpus::new(&[], &[], &[], &[], 7).unwrap();
        assert_eq!(again.clips[3].joints, corpus.clips[COPIES + 3].joints);
        assert_ne!(again.metadata()["motion"], Corpus::new(&[], &[], &[], &[], 8).unwrap().metadata()["motion"]);
    }
}
