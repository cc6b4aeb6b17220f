//! Options of `orator animate` for retargeting to a user's own skeleton.

use crate::cli::outputs::OutputFiles;
use crate::cli::ui::Ui;
use anyhow::{Context as _, Result};
use orator_avatar::animate::Performance;
use orator_avatar::animate::retarget::bone_map::BoneMap;
use orator_avatar::animate::retarget::retargeted::RetargetRig;
use orator_base::input;
use orator_base::stage::progress::Progress as _;
use orator_base::stage::workdir;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(super) struct RetargetArgs {
    /// Retarget the motion to the skeleton of this file: from a .bvh, a .bvh is written; from a .glb or .vrm, that file
    /// with an added animation. Bones are matched by name or structure, and the matches are printed.
    #[arg(long, value_name = "RIG.glb|RIG.vrm|RIG.bvh", conflicts_with = "names")]
    retarget: Option<PathBuf>,
    /// Bone map to use instead of matching by name, with lines such as LeftArm = "upperarm_l".
    #[arg(long, value_name = "FILE", requires = "retarget")]
    bone_map: Option<PathBuf>,
    /// Write the bone map that was found to this file, to edit and pass to --bone-map; a draft if bones are missing.
    #[arg(long, value_name = "FILE", requires = "retarget", conflicts_with = "bone_map")]
    write_bone_map: Option<PathBuf>,
}

/// The opened skeleton of a user.
pub(super) struct OpenedRig {
    rig: RetargetRig,
    /// Text of the bone map and its path; `None` to match bones by name.
    map: Option<(String, PathBuf)>,
    write_map: Option<PathBuf>,
}

impl RetargetArgs {
    /// Files that are read.
    pub(super) fn reads(&self) -> impl Iterator<Item = &Path> {
        [&self.retarget, &self.bone_map].into_iter().flatten().map(PathBuf::as_path)
    }

    /// Files that are written in addition to the outputs.
    pub(super) fn writes(&self) -> Option<&Path> {
        self.write_bone_map.as_deref()
    }

    /// Opens the skeleton, if one is given.
    pub(super) fn open(&self) -> Result<Option<OpenedRig>> {
        let Some(path) = &self.retarget else { return Ok(None) };
        let rig = RetargetRig::open(path)?;
        let read = |path: &PathBuf| {
            let text =
                input::read_text(path, input::MAX_TEXT).with_context(|| format!("cannot read {}", path.display()))?;
            Ok::<_, anyhow::Error>((text, path.clone()))
        };
        let map = self.bone_map.as_ref().map(read).transpose()?;
        Ok(Some(OpenedRig { rig, map, write_map: self.write_bone_map.clone() }))
    }
}

impl OpenedRig {
    /// Writes the performance on the skeleton, prints which bones were found, and returns notes on them.
    pub(super) fn write(&self, performance: &Performance, outputs: &OutputFiles, ui: &Ui) -> Result<Vec<String>> {
        outputs.iter().try_for_each(|(path, _)| self.rig.check_output(path))?;
        let ours = &performance.rig.skeleton;
        let map = match &self.map {
            Some((text, path)) => BoneMap::parse(text, self.rig.rig(), ours)
                .with_context(|| format!("invalid bone map {}", path.display()))?,
            None => BoneMap::draft(self.rig.rig()),
        };
        let text = map.text(self.rig.rig(), ours);
        if let Some(path) = &self.write_map {
            workdir::write_file(path, text.as_bytes())?;
            ui.say(&format!("wrote {}", path.display()));
        }
        ui.say(text.trim_end());
        map.check(self.rig.rig())?;
        for (path, _) in outputs {
            self.rig.write(path, performance, &map).with_context(|| format!("cannot write {}", path.display()))?;
        }
        Ok(map.notes())
    }
}
