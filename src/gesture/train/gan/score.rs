//! Validation of a generator: its metrics beside those of a constant mean pose, the score that selects the best
//! checkpoint, and the detection of a collapse.

use orator_base::types::posture::PostureChannel;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Motion energy relative to the data below which the generator has collapsed to the mean pose.
const MIN_ENERGY: f64 = 0.3;
/// Spread relative to real windows below which the generator has collapsed to one motion.
const MIN_SPREAD: f64 = 0.1;

/// Metrics of a predictor on the held-out windows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ValidationMetrics {
    /// Mean absolute error of normalised coordinates.
    pub l1: f64,
    /// Percentage of correct keypoints (PCK) of all joints, 0..1.
    pub pck: f64,
    /// PCK of shoulders, elbows and wrists, 0..1.
    pub pck_body: f64,
    /// PCK of the fingers, 0..1.
    pub pck_hands: f64,
    /// Frechet distance between single predicted and real poses, cm2; few poses bias it upwards.
    pub frechet: Option<f64>,
    /// Mean squared speed of the joints relative to the data.
    pub energy: f64,
}

/// Mean absolute error of the visible angles of a posture channel, degrees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelError {
    pub generator: f64,
    /// Error of a constant mean posture.
    pub mean_pose: f64,
}

/// Relative reduction of an error compared with another one (1: no error left), and the ends of its 95 % confidence
/// interval over blocks; `None` if there are too few blocks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorReduction {
    pub value: f64,
    pub low: Option<f64>,
    pub high: Option<f64>,
}

/// Metrics of the generator and of the mean pose on the same windows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Validation {
    pub split: String,
    pub n_windows: usize,
    /// Number of poses in the Frechet distance.
    pub n_poses: usize,
    pub generator: ValidationMetrics,
    pub mean_pose: ValidationMetrics,
    /// L1 error of the poses generated for mismatched sound of the same speaker.
    #[serde(default)]
    pub other_sound: f64,
    /// Reduction of the generator's L1 error compared with the mean pose.
    #[serde(default)]
    pub below_mean_pose: Option<ErrorReduction>,
    /// Reduction of the generator's L1 error compared with mismatched sound.
    #[serde(default)]
    pub below_other_sound: Option<ErrorReduction>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub channels: BTreeMap<PostureChannel, ChannelError>,
    /// Mean absolute change of the bone lengths between consecutive frames of the raw network output, mm.
    pub bone_change_mm: f64,
    /// Mean distance between windows of different sound, relative to real windows.
    pub spread: f64,
    /// Score that selects the best checkpoint, see [`score`].
    pub score: f64,
    /// Message if this generator has collapsed.
    pub alarm: Option<String>,
}

impl Validation {
    /// The main metrics in one line, those of the mean pose in brackets.
    pub fn summary(&self) -> String {
        let (own, mean_pose) = (&self.generator, &self.mean_pose);
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let frechet = match (own.frechet, mean_pose.frechet) {
            (Some(own), Some(mean_pose)) => format!(", Frechet {own:.0} cm\u{b2} ({mean_pose:.0})"),
            _ => String::new(),
        };
        format!(
            "{} L1 {:.3} (mean pose {:.3}), PCK {} ({}){frechet}, energy {}",
            self.split,
            own.l1,
            mean_pose.l1,
            percent(own.pck),
            percent(mean_pose.pck),
            percent(own.energy)
        )
    }
}

/// Weight of the motion energy in the score.
const ENERGY_WEIGHT: f64 = 0.15;

/// Score of a validation, lower is better. The sum of
/// - the L1 error relative to the mean pose: the right pose at the right time,
/// - the L1 error relative to that for mismatched sound: motion that depends on the audio,
/// - the Frechet distance relative to the mean pose (1 if it is missing): poses like the speaker's,
/// - 0.15 |ln(energy)|: as much motion as the data. Its weight is small, because the energy of a network that overfits
///   approaches that of the data while its motion depends less and less on the audio.
///
/// The adversarial loss is not part of it, since it compares the two networks with each other.
pub fn score(generator: &ValidationMetrics, mean_pose: &ValidationMetrics, other_sound: f64) -> f64 {
    let frechet = match (generator.frechet, mean_pose.frechet) {
        (Some(own), Some(mean)) if mean > 0.0 => own / mean,
        _ => 1.0,
    };
    let audio_dependence = generator.l1 / other_sound.max(1e-9);
    let energy = generator.energy.max(1e-6).ln().abs();
    generator.l1 / mean_pose.l1.max(1e-9) + audio_dependence + frechet + ENERGY_WEIGHT * energy
}

/// Message if a model is worse than the mean pose in the L1 error or in the PCK (0..1, if measured), each given as
/// `[model, mean pose]`.
pub fn below_mean_pose(l1: [f64; 2], pck: Option<[f64; 2]>) -> Option<String> {
    let error = (l1[0] > l1[1]).then(|| format!("L1 {:.3} against {:.3}", l1[0], l1[1]));
    let share = pck.filter(|[model, mean]| model < mean);
    let share = share.map(|[model, mean]| format!("PCK {:.1} % against {:.1} %", 100.0 * model, 100.0 * mean));
    let metrics: Vec<String> = error.into_iter().chain(share).collect();
    let metrics = (!metrics.is_empty()).then(|| metrics.join(", "))?;
    Some(format!("The model is worse than the mean pose: a constant pose is closer to the truth ({metrics})."))
}

/// Message if a generator hardly moves, or moves alike for any audio; arguments as in [`Validation`].
pub fn alarm(energy: f64, spread: f64) -> Option<String> {
    if energy < MIN_ENERGY {
        let percent = 100.0 * energy;
        Some(format!("the motion has collapsed towards the mean pose: it has {percent:.0} % of the data's energy"))
    } else if spread < MIN_SPREAD {
        let percent = 100.0 * spread;
        Some(format!(
            "the motion hardly depends on the audio: windows differ by {percent:.0} % of the difference between real \
             windows"
        ))
    } else {
        None
    }
}
