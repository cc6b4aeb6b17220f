//! Options of `orator animate` for trunk, head and legs, and for smoothing.

use super::input::InputMotion;
use anyhow::{Result, ensure};
use orator_avatar::animate::solve::legs::Legs;
use orator_avatar::animate::{AnimationOptions, Smoothing, Yaw};
use orator_base::types::posture::Posture;

#[derive(clap::Args)]
pub(super) struct BodyArgs {
    /// Leave the head at rest though the face is known.
    #[arg(long, conflicts_with = "keypoints")]
    neutral_head: bool,
    /// The turn of the shoulders about the vertical: of spine and chest, or removed, so that the figure faces ahead.
    #[arg(long, value_enum, default_value = "spine")]
    shoulder_yaw: ShoulderYaw,
    /// Lower body: feet planted under hips that follow the trunk, or legs and hips at rest. Without: seated where hips and
    /// knees are seen and the thighs hang less than 0.55 of the height from hips to shoulders, else standing.
    #[arg(long, value_enum)]
    legs: Option<LegsName>,
    /// Leave the chest still: it moves the neck by 3 mm, and no joint against it.
    #[arg(long)]
    no_breath: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ShoulderYaw {
    Spine,
    Removed,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum LegsName {
    Seated,
    Standing,
    None,
}

impl BodyArgs {
    pub(super) fn yaw(&self) -> Yaw {
        if self.shoulder_yaw == ShoulderYaw::Removed { Yaw::Removed } else { Yaw::Spine }
    }

    pub(super) fn has_breath(&self) -> bool {
        !self.no_breath
    }

    /// Options with the legs that were requested, or else those of the person in the input.
    pub(super) fn of(&self, input: &InputMotion, options: &AnimationOptions) -> AnimationOptions {
        let legs = match self.legs {
            Some(LegsName::Seated) => Legs::Seated,
            Some(LegsName::Standing) => Legs::Standing,
            Some(LegsName::None) => Legs::None,
            None if input.is_seated == Some(true) => Legs::Seated,
            None => Legs::Standing,
        };
        AnimationOptions { legs, ..*options }
    }

    /// The parts of the posture that the options retain.
    pub(super) fn posture(&self, posture: Option<Posture>) -> Option<Posture> {
        let mut posture = posture?;
        if self.neutral_head {
            posture.head.fill(f32::NAN);
        }
        Some(posture)
    }
}

#[derive(clap::Args)]
pub(super) struct SmoothingArgs {
    /// As much as the noise of each bone in this clip asks for; cubics over 0.6 s (arms) and 1 s (hands), without delay;
    /// or none.
    #[arg(long, value_enum, default_value = "adaptive")]
    smoothing: SmoothingKind,
    /// Adaptive: factor of the noise that is taken away, 0 for none.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    smoothing_strength: f64,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum SmoothingKind {
    Adaptive,
    SavitzkyGolay,
    None,
}

impl SmoothingArgs {
    /// The requested smoothing.
    ///
    /// # Errors
    /// A strength that is out of range or does not belong to the kind of smoothing.
    pub(super) fn smoothing(&self) -> Result<Smoothing> {
        let strength = self.smoothing_strength;
        ensure!(
            strength == 1.0 || self.smoothing == SmoothingKind::Adaptive,
            "--smoothing-strength is for --smoothing adaptive"
        );
        ensure!((0.0..=100.0).contains(&strength), "--smoothing-strength is {strength}, expected 0 to 100");
        Ok(match self.smoothing {
            SmoothingKind::None => Smoothing::None,
            SmoothingKind::Adaptive => Smoothing::Adaptive { strength },
            SmoothingKind::SavitzkyGolay => Smoothing::SavitzkyGolay,
        })
    }
}
