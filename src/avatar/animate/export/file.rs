//! Motion file of any format, selected by the file extension and written atomically.

use super::film_avatar::FilmCamera;
use super::{fbx, film, glb_scene, json, smplx, vrm};
use crate::animate::avatar::{Appearance, Avatar};
use crate::animate::performance::Performance;
use crate::animate::rig::file_skeleton::{FileSkeleton, RestAxes};
use crate::animate::rig::names::Names;
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_formats::mocap::motion_file::is_smplx_name;
use orator_formats::{authors_txt, joints_description, joints_npz, npy};
use std::fs::File;
use std::io::{self, BufWriter, Write as _};
use std::path::Path;

/// Optional content of a file in addition to the performance.
#[derive(Clone, Copy, Debug, Default)]
pub struct ExportContent<'a> {
    /// Audio track of a film.
    pub sound: Option<&'a Sound>,
    /// Naming convention of the bones, for formats with bone names.
    pub names: Names,
    /// What a film shows besides the avatar.
    pub second_panel: film::SecondPanel<'a>,
    pub camera: FilmCamera,
    /// Frame rate of a film; `None` interpolates to at least 30 fps (`film::smooth_rate`).
    pub film_fps: Option<FrameRate>,
    /// Generated angles of head and trunk, at their own rate, for JSON.
    pub posture: Option<(FrameRate, &'a Posture)>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FigureOptions {
    /// Naming convention of the bones, for formats with bone names.
    pub names: Names,
    /// Frame rate; `None` for that of the motion.
    pub fps: Option<FrameRate>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportFormat {
    /// Joints [T, 49, 3] f32, with the rate in a file next to it (`formats::joints_description`).
    Npy,
    /// Joints with rate and mask.
    Npz,
    /// Text layout of Rebol et al. (2021): 147 numbers per line, with the rate in a file next to it.
    AuthorsTxt,
    /// Bone rotations of the complete rig.
    Bvh,
    /// Rotations of SMPL-X, `.smplx.npz`.
    Smplx,
    /// Skinned avatar with its motion.
    Glb,
    /// Skinned avatar with its motion, binary FBX 7.4.
    Fbx,
    /// Skinned avatar as a VRM 1.0 humanoid, without motion.
    Vrm,
    /// Motion for VRM 1.0 humanoids.
    Vrma,
    /// Joints and rotations as JSON (`export::json`).
    Json,
    /// Film of the avatar with audio.
    Mp4,
}

impl ExportFormat {
    /// The format of a file by the end of its name, in upper or lower case.
    ///
    /// # Errors
    /// No or an unknown extension.
    pub fn from_path(path: &Path) -> anyhow::Result<Self> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match extension.as_str() {
            "npy" => Ok(Self::Npy),
            "npz" if is_smplx_name(path) => Ok(Self::Smplx),
            "npz" => Ok(Self::Npz),
            "txt" => Ok(Self::AuthorsTxt),
            "bvh" => Ok(Self::Bvh),
            "glb" => Ok(Self::Glb),
            "fbx" => Ok(Self::Fbx),
            "vrm" => Ok(Self::Vrm),
            "vrma" => Ok(Self::Vrma),
            "json" => Ok(Self::Json),
            "mp4" => Ok(Self::Mp4),
            _ => anyhow::bail!(
                "{}: unknown motion format: expected .npy (joints), .txt (the authors' layout), .npz (joints with rate \
                 and mask), .smplx.npz (SMPL-X), .json, .bvh, .fbx, .glb, .vrm, .vrma or .mp4",
                path.display()
            ),
        }
    }

    /// Whether the format has bone names that a user may choose.
    pub fn has_names(self) -> bool {
        matches!(self, Self::Bvh | Self::Glb | Self::Fbx | Self::Json)
    }

    /// Whether the format holds joint positions without a rig.
    pub fn holds_joints(self) -> bool {
        matches!(self, Self::Npy | Self::Npz | Self::AuthorsTxt)
    }

    /// Writes a performance; only a film uses the audio.
    pub fn write(
        self,
        path: &Path,
        performance: &Performance,
        sources: &ExportContent,
        progress: &dyn Progress,
    ) -> anyhow::Result<()> {
        match self {
            Self::Npy | Self::Npz | Self::AuthorsTxt => self.write_joints(path, &performance.motion()),
            Self::Bvh => {
                let skeleton = FileSkeleton::new(&performance.rig.skeleton, sources.names, RestAxes::World);
                let clip = skeleton.clip(&performance.clip);
                write_text(path, |text| clip.write_bvh(text))
            }
            Self::Smplx => workdir::replace(path, |attempt| smplx::motion(performance).write(attempt)),
            Self::Glb | Self::Fbx | Self::Vrm => {
                let (rig, clip) = (&performance.rig, &performance.clip);
                let avatar = Avatar::new(rig, &Appearance::plain());
                let bytes = match self {
                    Self::Fbx => fbx::scene::file(rig, clip, &avatar, sources.names),
                    Self::Vrm => vrm::avatar(rig, &avatar),
                    _ => glb_scene::file(rig, clip, &avatar, sources.names),
                };
                workdir::write_file(path, &bytes)
            }
            Self::Vrma => workdir::write_file(path, &vrm::motion(&performance.rig, &performance.clip)),
            Self::Json => write_text(path, |text| json::write(text, performance, sources.names, sources.posture)),
            Self::Mp4 => {
                let fps = sources.film_fps.unwrap_or_else(|| film::smooth_rate(performance.clip.fps));
                let resampled = (fps != performance.clip.fps).then(|| performance.resampled(fps));
                let performance = resampled.as_ref().unwrap_or(performance);
                let ExportContent { sound, second_panel, camera, .. } = *sources;
                let content = film::FilmSource { performance, camera, sound, second_panel };
                workdir::replace(path, |attempt| film::write(attempt, content, progress))
            }
        }
    }

    /// Writes joint positions unchanged, with their rate.
    ///
    /// # Errors
    /// The format does not hold joint positions, or the file cannot be written.
    pub fn write_joints(self, path: &Path, motion: &Motion) -> anyhow::Result<()> {
        let (fps, shape) = (motion.fps, motion.joints.shape());
        match self {
            Self::Npz => workdir::replace(path, |attempt| joints_npz::write(attempt, motion)),
            Self::Npy => joints_description::with(path, fps, shape, |attempt| npy::write(attempt, motion)),
            Self::AuthorsTxt => joints_description::with(path, fps, shape, |attempt| {
                Ok(std::fs::write(attempt, authors_txt::format(motion))?)
            }),
            _ => anyhow::bail!("{} is not a file of joint positions: expected .npy, .npz or .txt", path.display()),
        }
    }
}

fn write_text(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> anyhow::Result<()> {
    workdir::replace(path, |attempt| {
        let mut text = BufWriter::new(File::create(attempt)?);
        write(&mut text)?;
        Ok(text.flush()?)
    })
}
