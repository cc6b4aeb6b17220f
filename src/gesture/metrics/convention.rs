//! Table of the metrics of each convention. Numbers of frames that a convention defines for its own frame rate are
//! converted to seconds, and back to the nearest number of frames of the data; the definitions state both.
//! Peculiarities of each convention are documented in the guide (`evaluation`).

use super::beat::{aist, angles, consistency};
use super::body_part::BodyPart;
use super::definition::MetricFamily;
use super::distribution::{diversity, frechet_metrics};
use super::movement::{angles as angles_of_posture, bone_change, cca, derivatives, hellinger};
use super::position::pck::{self, PckAxes};
use super::position::{errors, p_mpjpe};
use super::settings::{Convention, MetricSettings};

/// Metrics of the convention in the settings.
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
        Convention::Emage => vec![diversity::l1div(BodyPart::All), consistency::emage(fps)],
        Convention::Trimodal => {
            vec![errors::maje(fps), errors::acceleration_by_coordinate(), angles::metric(fps)]
        }
        Convention::Aist => vec![aist::metric(fps)],
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
    all.extend(parts.iter().map(|part| p_mpjpe::metric(*part)));
    all.extend(measured.iter().map(|part| errors::acceleration(*part)));
    for order in derivatives::DerivativeOrder::ALL {
        all.extend(measured.iter().map(|part| derivatives::metric(order, *part)));
    }
    all.extend(parts.iter().map(|part| hellinger::metric(*part)));
    all.extend(parts.iter().map(|part| diversity::l1div(*part)));
    all.extend(parts.iter().map(|part| diversity::pairwise(*part)));
    all.push(bone_change::metric());
    all.push(consistency::metric(settings.fps.per_sec()));
    all.push(frechet_metrics::poses(BodyPart::All));
    all.push(frechet_metrics::poses(BodyPart::Body));
    all.push(frechet_metrics::basis());
    all.push(frechet_metrics::embedding());
    all.push(cca::metric(BodyPart::Body));
    all.extend(settings.channels.iter().flat_map(|channel| angles_of_posture::metrics(*channel)));
    all
}
