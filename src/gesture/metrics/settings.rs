//! Parameters of the metrics, and the table of the metrics of each convention. Numbers of frames that a convention
//! defines for its own frame rate are converted to seconds, and back to the nearest number of frames of the data; the
//! definitions state both. Peculiarities of each convention are documented in the guide (`evaluation`).

use super::beat;
use super::definition::{BodyPart, MetricFamily};
use super::distribution::frechet_metrics;
use super::movement::{angles as angles_of_posture, bone_change, cca, derivatives, hellinger};
use super::position::errors;
use super::position::pck::{self, PckAxes};
use orator_base::types::posture::PostureChannel;
use orator_base::types::time::FrameRate;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MetricSettings {
    pub convention: Convention,
    /// Tolerances of PCK as shares of the largest extent of the pose, each > 0.
    pub alphas: Vec<f64>,
    pub fps: FrameRate,
    /// Whether errors and speeds are also measured over all 49 joints, including the neck.
    pub with_neck: bool,
    /// Whether any finger is visible; otherwise metrics of complete poses are restricted to the arms.
    pub has_fingers: bool,
    /// Posture channels that are measured in addition to the joints.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub channels: Vec<PostureChannel>,
}

impl Default for MetricSettings {
    fn default() -> Self {
        Self {
            convention: Convention::default(),
            alphas: vec![0.2, 0.1],
            fps: FrameRate::new(15, 1),
            with_neck: false,
            has_fingers: true,
            channels: Vec::new(),
        }
    }
}

/// Convention, named after the publication or project that defines it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Convention {
    /// Definitions of this project.
    #[default]
    Orator,
    /// Ginosar et al. 2019.
    Speech2gesture,
    /// The GENEA challenges.
    Genea,
    /// Liu et al. 2024.
    Emage,
    /// Yoon et al. 2020.
    Trimodal,
    /// Li et al. 2021.
    Aist,
}

pub(crate) fn metrics(settings: &MetricSettings) -> Vec<MetricFamily> {
    let fps = settings.fps.per_sec();
    match settings.convention {
        Convention::Orator => own(settings),
        Convention::Speech2gesture => vec![pck::by_frame(&settings.alphas)],
        Convention::Genea => vec![
            derivatives::by_interval(derivatives::DerivativeOrder::Acceleration),
            derivatives::by_interval(derivatives::DerivativeOrder::Jerk),
            hellinger::genea(settings.has_fingers),
            cca::metric(if settings.has_fingers { BodyPart::WithNeck } else { BodyPart::Body }),
        ],
        Convention::Emage => vec![frechet_metrics::l1div(BodyPart::All), beat::emage(fps)],
        Convention::Trimodal => {
            vec![errors::maje(fps), errors::acceleration_by_coordinate(), beat::trimodal(fps)]
        }
        Convention::Aist => vec![beat::aist(fps)],
    }
}

fn own(settings: &MetricSettings) -> Vec<MetricFamily> {
    let parts = [BodyPart::All, BodyPart::Body, BodyPart::Hands];
    let mut measured =
        vec![BodyPart::All, BodyPart::Body, BodyPart::Hands, BodyPart::Wrists, BodyPart::FingersFromWrist];
    if settings.with_neck {
        measured.push(BodyPart::WithNeck);
    }
    let mut all = vec![pck::metric(&[PckAxes::Xyz, PckAxes::Xy], &parts, &settings.alphas)];
    if settings.with_neck {
        all.push(pck::neck_in_box(&settings.alphas));
    }
    all.extend(measured.iter().map(|part| errors::l1(*part)));
    all.extend(measured.iter().map(|part| errors::mpjpe(*part)));
    all.extend(parts.iter().map(|part| errors::p_mpjpe(*part)));
    all.extend(measured.iter().map(|part| errors::acceleration(*part)));
    for order in derivatives::DerivativeOrder::ALL {
        all.extend(measured.iter().map(|part| derivatives::metric(order, *part)));
    }
    all.extend(parts.iter().map(|part| hellinger::metric(*part)));
    all.extend(parts.iter().map(|part| frechet_metrics::l1div(*part)));
    all.extend(parts.iter().map(|part| frechet_metrics::pairwise(*part)));
    all.push(bone_change::metric());
    all.push(beat::metric(settings.fps.per_sec()));
    all.push(frechet_metrics::poses(BodyPart::All));
    all.push(frechet_metrics::poses(BodyPart::Body));
    all.push(frechet_metrics::basis());
    all.push(frechet_metrics::embedding());
    all.push(cca::metric(BodyPart::Body));
    all.extend(settings.channels.iter().flat_map(|channel| angles_of_posture::metrics(*channel)));
    all
}
