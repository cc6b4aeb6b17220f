//! Motion on the skeleton of a user's file, the implementation of `--retarget`.

use super::bone_map::BoneMap;
use super::bvh_rig::BvhRig;
use super::glb_rig::GlbRig;
use super::transfer::Transfer;
use super::user_rig::UserRig;
use crate::animate::performance::Performance;
use anyhow::{Context as _, Result, bail, ensure};
use orator_base::input;
use orator_base::math::rotation::Rotation;
use orator_base::stage::workdir;
use orator_formats::bvh::read::Bvh;
use std::path::Path;

/// The skeleton of a user's file.
#[derive(Clone, Debug)]
pub struct RetargetRig {
    file: RigFile,
    rig: UserRig,
    is_vrm: bool,
}

#[derive(Clone, Debug)]
enum RigFile {
    Bvh(BvhRig),
    Glb(GlbRig),
}

impl RetargetRig {
    /// Reads a .bvh, .glb or .vrm file.
    ///
    /// # Errors
    /// The file cannot be read, or contains no usable skeleton.
    pub fn open(path: &Path) -> Result<Self> {
        let invalid_rig = || format!("{} has no usable skeleton", path.display());
        let file = match extension(path).as_str() {
            "bvh" => RigFile::Bvh(BvhRig::new(&Bvh::read(path)?).with_context(invalid_rig)?),
            "glb" | "vrm" => {
                let bytes =
                    input::read(path, input::MAX_DATA).with_context(|| format!("cannot read {}", path.display()))?;
                RigFile::Glb(GlbRig::new(&bytes).with_context(invalid_rig)?)
            }
            _ => bail!("{}: unsupported skeleton format: expected .bvh, .glb or .vrm", path.display()),
        };
        let rig = match &file {
            RigFile::Bvh(bvh) => bvh.rig(),
            RigFile::Glb(glb) => glb.rig().clone(),
        };
        Ok(Self { file, rig, is_vrm: extension(path) == "vrm" })
    }

    /// Its joints at rest.
    pub fn rig(&self) -> &UserRig {
        &self.rig
    }

    /// Checks that `path` has the same extension as the skeleton's own file; a VRM avatar may also be written as .glb.
    ///
    /// # Errors
    /// The extensions differ.
    pub fn check_output(&self, path: &Path) -> Result<()> {
        let own = match self.file {
            RigFile::Bvh(_) => "bvh",
            RigFile::Glb(_) if self.is_vrm && extension(path) == "vrm" => "vrm",
            RigFile::Glb(_) => "glb",
        };
        ensure!(extension(path) == own, "{}: expected a .{own} file, the format of the skeleton", path.display());
        Ok(())
    }

    /// Local rotations of its joints in every frame of a performance, and which joints move.
    pub fn moved(&self, performance: &Performance, map: &BoneMap) -> Result<(Vec<Vec<Rotation>>, Vec<bool>)> {
        let transfer = Transfer::new(&performance.rig, &self.rig, map)?;
        let frames = (0..performance.clip.n_frames()).map(|frame| transfer.frame(&performance.clip, frame)).collect();
        Ok((frames, (0..self.rig.joints.len()).map(|joint| transfer.moves(joint)).collect()))
    }

    pub fn write(&self, path: &Path, performance: &Performance, map: &BoneMap) -> Result<()> {
        self.check_output(path)?;
        let (transfer, clip) = (Transfer::new(&performance.rig, &self.rig, map)?, &performance.clip);
        // Frames are streamed because a file may have many more joints than those that move.
        let frames = (0..clip.n_frames()).map(|frame| transfer.frame(clip, frame));
        match &self.file {
            RigFile::Bvh(bvh) => workdir::write_file(path, bvh.text(clip.fps, frames).as_bytes()),
            RigFile::Glb(glb) => workdir::write_file(path, &glb.file(clip.fps, frames, |joint| transfer.moves(joint))),
        }
    }
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}
