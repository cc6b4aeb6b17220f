//! What a validation says of a generator: metrics beside those of the pose that never moves from the mean, the one
//! score that chooses the best checkpoint, and the alarm of a collapse.

use orator_base::types::posture::PostureChannel;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Generated motion with less than this share of the data's energy hardly moves.
const LEAST_ENERGY: f64 = 0.3;
/// Windows of generated motion that differ by less than this share of what real windows differ by are alike.
const LEAST_SPREAD: f64 = 0.1;

/// A predictor's metrics on the held-out windows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ValidationMetrics {
    /// Mean absolute error of normalised coordinates.
    pub l1: f64,
    /// Share of correct keypoints, 0..1: all, of shoulders, elbows and wrists, of the fingers.
    pub pck: f64,
    pub pck_body: f64,
    pub pck_hands: f64,
    /// Frechet distance of single poses to the real ones, square centimetres; too few poses make it too large.
    pub frechet: Option<f64>,
    /// Mean squared speed of the joints as a share of the data's.
    pub energy: f64,
}

/// Mean absolute error of the angles of a channel, degrees, where they are seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelError {
    pub generator: f64,
    /// Of the mean posture in every frame.
    pub mean_pose: f64,
}

/// Share by which an error is below another, 1: there is none left, with the ends of the interval of 95 % over blocks;
/// `None`: too few blocks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorReduction {
    pub value: f64,
    pub low: Option<f64>,
    pub high: Option<f64>,
}

impl ErrorReduction {
    /// Whether the whole interval is above 0.
    pub fn is_sure(&self) -> bool {
        self.low.is_some_and(|low| low > 0.0)
    }
}

/// The generator beside the mean pose, on the same windows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Validation {
    /// The split they were measured on.
    pub split: String,
    pub n_windows: usize,
    /// Poses behind the Frechet distance.
    pub n_poses: usize,
    pub generator: ValidationMetrics,
    pub mean_pose: ValidationMetrics,
    /// L1 error of the generator's poses for another sound of the same speaker.
    #[serde(default)]
    pub other_sound: f64,
    /// How far the generator's L1 error is below the mean pose's, and below that for another sound.
    #[serde(default)]
    pub below_mean_pose: Option<ErrorReduction>,
    #[serde(default)]
    pub below_other_sound: Option<ErrorReduction>,
    /// Of what is learnt beside the joints.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub channels: BTreeMap<PostureChannel, ChannelError>,
    /// Mean change of a bone's length from frame to frame in the network's own output, mm.
    pub bone_change_mm: f64,
    /// How much windows of different sound differ from each other, as a share of what real windows differ by.
    pub spread: f64,
    /// What chooses the best checkpoint, see [`score`].
    pub score: f64,
    /// Why this generator has collapsed, if it has.
    pub alarm: Option<String>,
}

impl Validation {
    /// The figures in a line, those of the mean pose in brackets.
    pub fn words(&self) -> String {
        let (own, still) = (&self.generator, &self.mean_pose);
        let share = |share: f64| format!("{:.0} %", 100.0 * share);
        let frechet = match (own.frechet, still.frechet) {
            (Some(own), Some(still)) => format!(", Frechet {own:.0} cm2 ({still:.0})"),
            _ => String::new(),
        };
        format!(
            "{} L1 {:.3} (mean pose {:.3}), PCK {} ({}){frechet}, energy {}",
            self.split,
            own.l1,
            still.l1,
            share(own.pck),
            share(still.pck),
            share(own.energy)
        )
    }
}

/// Weight of the motion energy in the score.
const ENERGY_WEIGHT: f64 = 0.15;

/// The score, lower is better: the L1 error as a share of the mean pose's, the same error as a share of that of the motion
/// for another sound, the Frechet distance as a share of the mean pose's, and the distance of the motion energy from the
/// data's, 0.15 |ln(energy)|. The first asks for the right pose at the right time, the second for motion that comes from
/// what is heard, the third for poses like the speaker's, the fourth for as much motion. Energy weighs little: a network
/// that learns its windows by heart moves ever more like the data and hears ever less. The adversarial loss has no part in
/// it: it measures the two networks against each other. Without a Frechet distance its share is 1.
pub fn score(generator: &ValidationMetrics, mean_pose: &ValidationMetrics, other_sound: f64) -> f64 {
    let frechet = match (generator.frechet, mean_pose.frechet) {
        (Some(own), Some(still)) if still > 0.0 => own / still,
        _ => 1.0,
    };
    let hearing = generator.l1 / other_sound.max(1e-9);
    let energy = generator.energy.max(1e-6).ln().abs();
    generator.l1 / mean_pose.l1.max(1e-9) + hearing + frechet + ENERGY_WEIGHT * energy
}

/// Says that a model is below the mean pose, if it is: by the L1 error or by the share of correct keypoints, each `[model,
/// mean pose]`, where measured. Shares are in 0..1.
pub fn below_mean_pose(l1: [f64; 2], pck: Option<[f64; 2]>) -> Option<String> {
    let error = (l1[0] > l1[1]).then(|| format!("L1 {:.3} against {:.3}", l1[0], l1[1]));
    let share = pck.filter(|[model, still]| model < still);
    let share = share.map(|[model, still]| format!("PCK {:.1} % against {:.1} %", 100.0 * model, 100.0 * still));
    let what: Vec<String> = error.into_iter().chain(share).collect();
    let what = (!what.is_empty()).then(|| what.join(", "))?;
    Some(format!(
        "The model is below the mean pose: a pose that never moves is nearer to where the speaker is ({what})."
    ))
}

/// Says what is wrong with a generator that hardly moves, or moves alike whatever it hears.
pub fn alarm(energy: f64, spread: f64) -> Option<String> {
    if energy < LEAST_ENERGY {
        let percent = 100.0 * energy;
        Some(format!("the motion has collapsed towards the mean pose: it has {percent:.0} % of the data's energy"))
    } else if spread < LEAST_SPREAD {
        let percent = 100.0 * spread;
        Some(format!("the motion is alike whatever the sound: windows differ by {percent:.0} % of what real ones do"))
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_score_wants_all_three() {
        let still =
            ValidationMetrics { l1: 0.8, pck: 0.3, pck_body: 0.3, pck_hands: 0.3, frechet: Some(200.0), energy: 0.0 };
        let good = ValidationMetrics { l1: 0.4, frechet: Some(50.0), energy: 1.0, ..still };
        assert!((score(&good, &still, 0.8) - 1.25).abs() < 1e-12);
        assert!(score(&good, &still, 0.5) > score(&good, &still, 0.8), "another sound does as well");
        for worse in [
            ValidationMetrics { l1: 0.5, ..good },
            ValidationMetrics { frechet: Some(90.0), ..good },
            ValidationMetrics { energy: 0.5, ..good },
            ValidationMetrics { energy: 2.0, ..good },
            ValidationMetrics { frechet: None, ..good },
            still,
        ] {
            assert!(score(&worse, &still, 0.8) > score(&good, &still, 0.8), "{worse:?}");
        }
    }

    #[test]
    fn a_model_below_the_mean_pose_is_named() {
        assert_eq!(below_mean_pose([0.4, 0.5], Some([0.6, 0.3])), None);
        assert_eq!(below_mean_pose([0.4, 0.5], None), None);
        assert_eq!(below_mean_pose([f64::NAN, 0.5], Some([f64::NAN, 0.3])), None);
        let said = below_mean_pose([0.8, 0.5], Some([0.25, 0.3])).unwrap();
        assert!(said.ends_with("(L1 0.800 against 0.500, PCK 25.0 % against 30.0 %)."), "{said}");
        assert!(below_mean_pose([0.4, 0.5], Some([0.2, 0.3])).is_some_and(|said| !said.contains("L1")));
        assert!(below_mean_pose([0.6, 0.5], None).is_some_and(|said| !said.contains("PCK")));
    }

    #[test]
    fn collapses_are_named() {
        assert!(alarm(0.29, 1.0).is_some_and(|text| text.contains("29 %")));
        assert!(alarm(1.0, 0.05).is_some_and(|text| text.contains("alike")));
        assert_eq!(alarm(0.7, 0.5), None);
    }
}
