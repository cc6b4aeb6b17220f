//! SMPL-X and SMPL-H motion in `.npz` files: axis-angle rotations in radians as `poses` [T, 165] or [T, 156] (BEAT2,
//! EMAGE, AMASS), by part (`root_orient`, `pose_body`, `pose_hand`: AMASS), or `smplh:*` (Seamless Interaction, in the
//! axes of a camera, 30 fps). Written are the arrays of BEAT2, and `orator_rest_joints` [65, 3]: joints and tips at
//! rest. `betas` are not read, because their meaning is in the files of the body model.

use super::body::{self, FINGERS, LEGS, N_BODY, N_POINTS, N_SMPLX, RestPose};
use crate::bvh::read::Bvh;
use crate::bvh::write::BvhClip;
use crate::npy;
use crate::npz::{Npz, NpzOutput};
use anyhow::{Context, Result, ensure};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add};
use orator_base::types::time::FrameRate;
use std::io::Write as _;
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Key, first joint and number of joints of an array of rotations.
type Part = (&'static str, usize, usize);
const POSES: [Part; 1] = [("poses", 0, N_SMPLX)];
const AMASS: [Part; 3] = [("root_orient", 0, 1), ("pose_body", 1, 21), ("pose_hand", FINGERS[0], 30)];
const SEAMLESS: [Part; 4] = [
    ("smplh:global_orient", 0, 1),
    ("smplh:body_pose", 1, 21),
    ("smplh:left_hand_pose", FINGERS[0], 15),
    ("smplh:right_hand_pose", FINGERS[1], 15),
];
/// Frames of Seamless Interaction in which the person was detected.
const VALID_KEY: &str = "smplh:is_valid";
/// Frame rate of Seamless Interaction, whose files do not state it.
const SEAMLESS_FPS: FrameRate = FrameRate::new(30, 1);
/// Joints of SMPL-H: those of SMPL-X without jaw and eyes.
const N_SMPLH: usize = N_SMPLX - (FINGERS[0] - N_BODY);
const RATE_KEYS: [&str; 2] = ["mocap_frame_rate", "mocap_framerate"];
const REST_KEY: &str = "orator_rest_joints";
/// Lengths of `betas` and `expressions` in BEAT2.
const N_BETAS: usize = 300;
const N_EXPRESSIONS: usize = 100;

/// Motion of the 55 joints in the axes of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct SmplxMotion {
    pub fps: FrameRate,
    pub rest: RestPose,
    /// Translation of the body by frame, metres: the pelvis is at this point plus its rest position. `None` if it is
    /// not known relative to the floor.
    pub translation: Option<Vec<Vec3>>,
    /// Rotations relative to the parents; not a number in frames without a person.
    pub rotations: Vec<[Rotation; N_SMPLX]>,
}

/// Whether the file contains rotations of SMPL-X or SMPL-H.
pub fn is_smplx(npz: &Npz) -> bool {
    ["poses", AMASS[1].0, SEAMLESS[1].0].iter().any(|key| npz.has(key))
}

/// Whether the frame rate of such a file is known.
pub fn states_rate(npz: &Npz) -> bool {
    npz.has(SEAMLESS[1].0) || RATE_KEYS.iter().any(|key| npz.has(key))
}

impl SmplxMotion {
    /// Reads a file; `fps` is the frame rate of one that does not state it.
    ///
    /// # Errors
    ///
    /// A missing array or frame rate, another shape (such as coefficients of hands), a number that is not finite.
    pub fn read(path: &Path, fps: Option<FrameRate>) -> Result<Self> {
        let mut npz = Npz::open(path)?;
        Self::from_npz(&mut npz, fps).with_context(|| format!("cannot read {} as SMPL-X motion", path.display()))
    }

    fn from_npz(npz: &mut Npz, fps: Option<FrameRate>) -> Result<Self> {
        let is_camera = !npz.has("poses") && npz.has(SEAMLESS[1].0);
        let is_valid = if is_camera && npz.has(VALID_KEY) { Some(flags(npz, VALID_KEY)?) } else { None };
        let parts: &[Part] = match npz.has("poses") {
            true => &POSES,
            false if is_camera => &SEAMLESS,
            false => &AMASS,
        };
        let mut vectors = Vec::new();
        for part in parts {
            read_part(npz, *part, is_valid.as_deref(), &mut vectors)?;
        }
        let n_frames = vectors.len();
        let has_translation = !is_camera && npz.has("trans");
        let translation = if has_translation { Some(points(npz, "trans", n_frames)?) } else { None };
        let rest = if npz.has(REST_KEY) { points(npz, REST_KEY, N_POINTS)?.try_into().ok() } else { None };
        let fps = match RATE_KEYS.into_iter().find(|key| npz.has(key)) {
            Some(key) => npz.frame_rate(key)?,
            None if is_camera => SEAMLESS_FPS,
            None => fps.context(
                "no frame rate: expected an array `mocap_frame_rate` or `mocap_framerate`, frames per second; add it, \
                 or give --input-fps to `orator animate` or `orator evaluate`",
            )?,
        };
        let rotations = vectors.iter().map(|frame| frame.map(Rotation::from_rotation_vector)).collect();
        Ok(Self { fps, rest: rest.unwrap_or_else(body::rest), translation, rotations })
    }

    /// Gives frames without a person the rotations of the frame before, or of the first frame with a person.
    pub fn hold_missing(&mut self) {
        let is_present = |frame: &[Rotation; N_SMPLX]| frame.iter().all(|rotation| rotation.w.is_finite());
        let Some(mut held) = self.rotations.iter().copied().find(is_present) else { return };
        for frame in &mut self.rotations {
            if is_present(frame) {
                held = *frame;
            }
            *frame = held;
        }
    }

    /// The motion as a BVH file in metres. Without a known floor the legs have names that no reader matches.
    pub fn bvh(&self) -> Bvh {
        let mut skeleton = body::skeleton(&self.rest);
        if self.translation.is_none() {
            LEGS.iter().for_each(|&joint| skeleton.joints[joint].name = format!("unused{joint}"));
        }
        let travel = self.translation.clone().unwrap_or_default();
        let local = self.rotations.iter().map(body::local).collect();
        BvhClip { skeleton, fps: self.fps, root: self.rest[0], travel, local }.to_file()
    }

    /// Positions of joints and tips in a frame, in the axes of the file.
    pub fn positions(&self, frame_idx: usize) -> Vec<Vec3> {
        let translation = self.translation.as_ref().map_or([0.0; 3], |translation| translation[frame_idx]);
        let local = body::local(&self.rotations[frame_idx]);
        body::skeleton(&self.rest).positions(add(self.rest[0], translation), &local)
    }

    /// Writes the arrays of BEAT2 in float32. This writes in place, so call it inside `stage::workdir::replace`.
    pub fn write(&self, path: &Path) -> Result<()> {
        let n_frames = self.rotations.len();
        let zeros = |n: usize| vec![0.0f32; n];
        let floats = |points: &[Vec3]| points.iter().flatten().map(|&v| v as f32).collect::<Vec<f32>>();
        let vectors = self.rotations.iter().flatten().map(|rotation| rotation.rotation_vector());
        let poses: Vec<f32> = vectors.flatten().map(|v| v as f32).collect();
        let trans = self.translation.as_deref().map_or_else(|| zeros(3 * n_frames), floats);
        let arrays: [(&str, &[usize], Vec<f32>); 6] = [
            ("betas", &[N_BETAS], zeros(N_BETAS)),
            ("poses", &[n_frames, 3 * N_SMPLX], poses),
            ("expressions", &[n_frames, N_EXPRESSIONS], zeros(n_frames * N_EXPRESSIONS)),
            ("trans", &[n_frames, 3], trans),
            (RATE_KEYS[0], &[], vec![self.fps.per_sec() as f32]),
            (REST_KEY, &[N_POINTS, 3], floats(&self.rest)),
        ];
        let arrays = arrays.iter().map(|(key, shape, values)| (*key, npy::write_f32(shape, values.iter())));
        let texts = [("model", "smplx2020"), ("gender", "neutral")].map(|(key, text)| (key, npy::write_text(text)));
        let mut zip = ZipWriter::new(NpzOutput::create(path)?);
        for (key, bytes) in arrays.chain(texts) {
            let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
            zip.start_file(format!("{key}.npy"), options)?;
            zip.write_all(&bytes)?;
        }
        zip.finish()?.finish().with_context(|| format!("cannot write {}", path.display()))
    }
}

/// Reads the rotation vectors of a part into those of all frames, which the first part creates; in frames that are not
/// valid, they are not a number.
fn read_part(
    npz: &mut Npz,
    (key, first, n_joints): Part,
    is_valid: Option<&[bool]>,
    frames: &mut Vec<[Vec3; N_SMPLX]>,
) -> Result<()> {
    let array = npz.numbers(key, &[])?;
    let shape = array.shape();
    let fits = |n: &usize| matches!(*shape, [_, width] if width == 3 * n) || matches!(*shape, [_, m, 3] if m == *n);
    let accepted = if n_joints == N_SMPLX { vec![N_SMPLX, N_SMPLH] } else { vec![n_joints] };
    let expected: Vec<String> = accepted.iter().map(|n| format!("[T, {}]", 3 * n)).collect();
    let n = accepted.into_iter().find(fits).with_context(|| {
        format!(
            "array `{key}` has shape {shape:?}, expected {}, axis-angle rotations in radians; coefficients of hands \
             (PCA) cannot be converted without the files of the body model: save rotations (`use_pca=False`)",
            expected.join(" or ")
        )
    })?;
    if first == 0 {
        frames.resize(shape[0], [[0.0; 3]; N_SMPLX]);
    }
    let n_expected = is_valid.map_or(frames.len(), <[bool]>::len);
    ensure!(
        shape[0] == frames.len() && shape[0] == n_expected,
        "array `{key}` has shape {shape:?}, expected {n_expected} frames as the other arrays have"
    );
    let values: Vec<f64> = array.iter().copied().collect();
    for (t, (frame, row)) in frames.iter_mut().zip(values.chunks_exact(3 * n)).enumerate() {
        let is_valid = is_valid.is_none_or(|is_valid| is_valid[t]);
        let is_finite = row.iter().all(|v| v.is_finite());
        ensure!(is_finite || !is_valid, "array `{key}`, shape {shape:?}: frame {t} has a number that is not finite");
        for (joint, vector) in frame[first..].iter_mut().zip(row.chunks_exact(3)) {
            *joint = std::array::from_fn(|k| if is_valid { vector[k] } else { f64::NAN });
        }
        if n == N_SMPLH {
            frame.copy_within(N_BODY..N_SMPLH, FINGERS[0]);
            frame[N_BODY..FINGERS[0]].fill([0.0; 3]);
        }
    }
    Ok(())
}

/// Finite points [n, 3].
fn points(npz: &mut Npz, key: &str, n: usize) -> Result<Vec<Vec3>> {
    let array = npz.numbers(key, &[Some(n), Some(3)])?;
    ensure!(array.iter().all(|v| v.is_finite()), "array `{key}`, shape [{n}, 3]: a number is not finite");
    Ok((0..n).map(|row| std::array::from_fn(|k| array[[row, k]])).collect())
}

/// Truth values of any numeric type.
fn flags(npz: &mut Npz, key: &str) -> Result<Vec<bool>> {
    if let Ok(flags) = npz.bools(key, &[]) {
        return Ok(flags.iter().copied().collect());
    }
    Ok(npz.numbers(key, &[])?.iter().map(|&v| v > 0.0).collect())
}
