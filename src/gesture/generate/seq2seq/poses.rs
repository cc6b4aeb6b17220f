//! What the numbers of a pose mean: exponential maps of captured joints, or directions of the bones of the 49 joints.

use crate::generate::normalisation::{N_FEATURES, Normalisation};
use crate::generate::representation::Representation;
use anyhow::{Result, bail, ensure};
use ndarray::ArrayView2;
use orator_base::motion::bones;
use orator_base::types::pose3d::Motion;
use orator_base::types::time::FrameRate;
use orator_formats::bvh::exponential_maps::{ExponentialMaps, FPS};
use serde::{Deserialize, Serialize};

/// Meaning of the numbers of a pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PoseNumbers {
    /// Of the skeleton of BVH files, 20 frames a second.
    Captured(ExponentialMaps),
    /// Of this program's datasets.
    Joints {
        normalisation: Normalisation,
        /// Directions of bones.
        representation: Representation,
    },
}

impl PoseNumbers {
    /// Numbers of a pose.
    pub fn n_numbers(&self) -> usize {
        match self {
            Self::Captured(maps) => maps.n_columns(),
            Self::Joints { .. } => N_FEATURES,
        }
    }

    /// Normalisation of the 49 joints; `None`: poses of a captured skeleton.
    pub fn normalisation(&self) -> Option<&Normalisation> {
        match self {
            Self::Captured(_) => None,
            Self::Joints { normalisation, .. } => Some(normalisation),
        }
    }

    /// Errors unless the tables fit each other and the rate, as those of a checkpoint may not.
    pub fn check(&self, fps: FrameRate) -> Result<()> {
        match self {
            Self::Captured(maps) => {
                ensure!(fps == FPS, "it moves a captured skeleton at {fps}, not at {FPS}");
                maps.check()
            }
            Self::Joints { normalisation, representation } => {
                ensure!(representation.keeps_lengths(), "its poses are no directions of bones");
                representation.check()?;
                normalisation.check()
            }
        }
    }

    /// BVH text in the captured skeleton for numbers [T, C]. Errors for poses of the 49 joints.
    pub fn bvh(&self, numbers: ArrayView2<f32>) -> Result<String> {
        match self {
            Self::Captured(maps) => Ok(maps.to_bvh(numbers)),
            Self::Joints { .. } => bail!("its poses are those of the 49 joints, of no BVH skeleton"),
        }
    }

    /// Motion of the 49 joints, bones of the speaker's lengths, for numbers [T, C]. Errors for poses of a captured skeleton.
    pub fn motion(&self, numbers: ArrayView2<f32>, fps: FrameRate) -> Result<Motion> {
        let Self::Joints { normalisation, representation } = self else {
            bail!("it moves the skeleton of the BVH files it was trained on, which is written as .bvh alone");
        };
        let mut motion = Motion::from_joints(fps, representation.joints(numbers.t(), normalisation));
        bones::with_lengths(&mut motion, &normalisation.lengths());
        Ok(motion)
    }
}
