//! Whose definitions, and which figures each convention has: the one table. Where a convention was made for another
//! frame rate than the data's, what it counts in frames is turned into seconds and back into the nearest number of frames of
//! the data; the definitions say both.
//!
//! | convention | figures | what is peculiar |
//! |---|---|---|
//! | `orator` | PCK in space and in the plane, L1, MPJPE, P-MPJPE, acceleration error; speed, acceleration, jerk, diversity, pairwise distance, bone lengths, beat consistency of the made and of the real motion; Hellinger distance of speeds; Frechet distance of poses and of windows in two fixed spaces; CCA | this project's own |
//! | `speech2gesture` (Ginosar et al. 2019) | PCK in the plane | the 48 keypoints without the neck; `<=`; mean over keypoints, then over frames; the docstring speaks of 0.1, the default is 0.2; positions as they are, scaling cancels |
//! | `genea` (Kucherenko et al. 2020, 2022) | acceleration, jerk, Hellinger distance of speeds, CCA | centimetres; mean over the intervals of the intervals' means, 49 joints with the one that stands still; speeds of 49 cm/s and more are dropped; the first 8 joints are cut off before the histogram (`[:, 8:]`), here neck, arms and the left hand's root; one CCA over all. Their Frechet distance needs an encoder trained anew for every run, and is not given |
//! | `emage` (Liu et al. 2024) | L1div, beat consistency | speeds over their mean, local minima above a threshold (not below); positions are replaced by their distances from the mean before, since L1div overwrites them; the threshold is looked up 2 s early; first and last 2 s ignored. Their Frechet distance needs their encoder, and is not given |
//! | `trimodal` (Yoon et al. 2020; beats: its descendants) | MAJE, acceleration error, beat consistency | the first 4 frames, given as a seed, are left out; accelerations by coordinate and frame, without the frame rate; beats where the angle between bones changes slowly. Their Frechet distance needs their encoder (in which `LeakyReLU(True)` means slope 1, so that it is linear there), and is not given |
//! | `aist` (Li et al. 2021) | beat alignment | mean over the beats of the MOTION; an interval without any scores 0; every interval weighs the same |

use super::beat::{aist, angles, consistency};
use super::body_part::BodyPart;
use super::definition::MetricFamily;
use super::distribution::pairwise;
use super::distribution::{diversity, frechet_metrics};
use super::movement::hellinger;
use super::movement::{bone_change, cca, derivatives};
use super::position::acceleration;
use super::position::pck::PckAxes;
use super::position::{l1, mpjpe, p_mpjpe, pck};
use super::settings::Convention;
use super::settings::MetricSettings;

/// The metrics of the settings' convention.
pub(crate) fn metrics(settings: &MetricSettings) -> Vec<Box<dyn MetricFamily>> {
    let fps = settings.fps.per_sec();
    match settings.convention {
        Convention::Orator => own(settings),
        Convention::Speech2gesture => vec![pck::by_frame(&settings.alphas)],
        Convention::Genea => vec![
            derivatives::by_interval(derivatives::DerivativeOrder::Acceleration),
            derivatives::by_interval(derivatives::DerivativeOrder::Jerk),
            hellinger::genea(),
            cca::metric(BodyPart::WithNeck),
        ],
        Convention::Emage => vec![diversity::metric(BodyPart::All), consistency::emage(fps)],
        Convention::Trimodal => {
            vec![acceleration::maje(fps), acceleration::by_coordinate(), angles::metric(fps)]
        }
        Convention::Aist => vec![aist::metric(fps)],
    }
}

fn own(settings: &MetricSettings) -> Vec<Box<dyn MetricFamily>> {
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
    all.extend(measured.iter().map(|part| l1::metric(*part)));
    all.extend(measured.iter().map(|part| mpjpe::metric(*part)));
    all.extend(parts.iter().map(|part| p_mpjpe::metric(*part)));
    all.extend(measured.iter().map(|part| acceleration::metric(*part)));
    for order in derivatives::DerivativeOrder::ALL {
        all.extend(measured.iter().map(|part| derivatives::metric(order, *part)));
    }
    all.extend(parts.iter().map(|part| hellinger::metric(*part)));
    all.extend(parts.iter().map(|part| diversity::metric(*part)));
    all.extend(parts.iter().map(|part| pairwise::metric(*part)));
    all.push(bone_change::metric());
    all.push(consistency::metric(settings.fps.per_sec()));
    all.push(frechet_metrics::poses(BodyPart::All));
    all.push(frechet_metrics::poses(BodyPart::Body));
    all.push(frechet_metrics::basis());
    all.push(frechet_metrics::embedding());
    all.push(cca::metric(BodyPart::Body));
    all
}
