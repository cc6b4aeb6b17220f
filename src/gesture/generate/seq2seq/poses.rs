//! Output formats of the sequence networks: exponential maps of captured joints, or bone directions of the 49 joints.

use crate::generate::normalisation::{N_FEATURES, Normalisation};
use crate::generate::representation::Representation;
use anyhow::{Result, bail, ensure};
use ndarray::ArrayView2;
use orator_base::motion::bones;
use orator_base::types::pose3d::Motion;
use orator_base::types::time::FrameRate;
use orator_formats::bvh::exponential_maps::{ExponentialMaps, FPS};
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PoseFormat {
    /// Exponential maps for the skeleton of BVH files, 20 frames per second.
    Captured(ExponentialMaps),
    /// The 49 joints of this program's datasets.
    Joints {
        normalisation: Normalisation,
        /// Bone directions.
        representation: Representation,
    },
}

impl PoseFormat {
    pub fn n_features(&self) -> usize {
        match self {
            Self::Captured(maps) => maps.n_columns(),
            Self::Joints { .. } => N_FEATURES,
        }
    }

    /// Normalisation of the 49 joints; `None` for a captured skeleton.
    pub fn normalisation(&self) -> Option<&Normalisation> {
        match self {
            Self::Captured(_) => None,
            Self::Joints { normalisation, .. } => Some(normalisation),
        }
    }

    /// Fails unless the tables of a checkpoint are consistent with each other and with the frame rate.
    pub fn check(&self, fps: FrameRate) -> Result<()> {
        match self {
            Self::Captured(maps) => {
                ensure!(fps == FPS, "the frame rate of a captured skeleton is {fps}, expected {FPS}");
                maps.check()
            }
            Self::Joints { normalisation, representation } => {
                ensure!(representation.keeps_lengths(), "the poses are not bone directions");
                representation.check()?;
                normalisation.check()
            }
        }
    }

    /// BVH text in the captured skeleton for features [T, C]. Fails for poses of the 49 joints.
    pub fn bvh(&self, features: ArrayView2<f32>) -> Result<String> {
        match self {
            Self::Captured(maps) => Ok(maps.to_bvh(features)),
            Self::Joints { .. } => bail!("the network generates poses of 49 joints, not of a BVH skeleton"),
        }
    }

    /// Motion of the 49 joints with the speaker's bone lengths for features [T, C]. Fails for a captured skeleton.
    pub fn motion(&self, features: ArrayView2<f32>, fps: FrameRate) -> Result<Motion> {
        let Self::Joints { normalisation, representation } = self else {
            bail!("the network animates the BVH skeleton it was trained on: only .bvh files can be written");
        };
        let mut motion = Motion::from_joints(fps, representation.joints(features.t(), normalisation));
        bones::with_lengths(&mut motion, &normalisation.lengths());
        Ok(motion)
    }
}
