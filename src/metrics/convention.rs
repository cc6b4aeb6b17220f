//! Metrics of each convention: the one table. What a convention counts in frames of its own frame rate is turned into
//! seconds and back into the nearest number of frames of the data; the definitions say both. What is peculiar to each
//! convention stands in the guide (`evaluation`).

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
