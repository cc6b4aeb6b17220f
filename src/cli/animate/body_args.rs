//! Options of `orator animate` for trunk, head and legs, and for smoothing.

use super::input::InputMotion;
use anyhow::{Result, ensure};
use orator_avatar::animate::retarget::captured_body::{CapturedBody, CapturedPart};
use orator_avatar::animate::solve::legs::Legs;
use orator_avatar::animate::{AnimationOptions, Performance, Smoothing, Yaw, perform, perform_captured};
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;

#[derive(clap::Args)]
pub(super) struct BodyArgs {
    /// Keep the head at rest even if the face was detected or the head was captured.
    #[arg(long, conflicts_with = "keypoints")]
    neutral_head: bool,
    /// Rotation of the shoulders about the vertical axis: applied to spine and chest, or removed, so that the figure
    /// faces forward.
    #[arg(long, value_enum, value_name = "MODE", default_value = "spine")]
    shoulder_yaw: ShoulderYaw,
    /// Lower body: `seated` and `standing` plant the feet under hips that follow the trunk, `none` keeps legs and
    /// hips at rest. Defaults to `seated` if hips and knees were detected and the thighs extend downwards by less
    /// than 0.4 of the height from hips to shoulders, else to `standing`; captured legs keep their motion.
    #[arg(long, value_enum, value_name = "POSE")]
    legs: Option<LegsName>,
    /// Do not animate breathing, which moves the neck by 3 mm and no joint relative to it.
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

    /// Animates a motion with the parts of its captured body that the options retain, or else with its posture.
    pub(super) fn perform(
        &self,
        motion: &Motion,
        posture: Option<&Posture>,
        body: Option<CapturedBody>,
        options: &AnimationOptions,
    ) -> Performance {
        let Some(body) = body.filter(|_| self.shoulder_yaw == ShoulderYaw::Spine) else {
            return perform(motion, posture, options);
        };
        let body = if self.neutral_head { body.without(CapturedPart::Head) } else { body };
        let body = if self.legs.is_some() { body.without(CapturedPart::Legs) } else { body };
        perform_captured(motion, &body, options)
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
    /// Smoothing: adapted to the noise of each bone in this clip, cubic filters over 0.6 s (arms) and 1 s (hands)
    /// without delay, or none.
    #[arg(long, value_enum, value_name = "METHOD", default_value = "adaptive")]
    smoothing: SmoothingKind,
    /// Multiplier of the noise level that adaptive smoothing removes, 0 to 100; 0 disables smoothing.
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
            "--smoothing-strength applies to --smoothing adaptive only"
        );
        ensure!((0.0..=100.0).contains(&strength), "--smoothing-strength {strength}: expected 0 to 100");
        Ok(match self.smoothing {
            SmoothingKind::None => Smoothing::None,
            SmoothingKind::Adaptive => Smoothing::Adaptive { strength },
            SmoothingKind::SavitzkyGolay => Smoothing::SavitzkyGolay,
        })
    }
}
