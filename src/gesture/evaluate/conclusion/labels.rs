//! Human-readable labels of metrics: name, unit, rounded value, interval in brackets.

use crate::metrics::catalogue::{Better, Definition};
use orator_base::math::estimate::Estimate;
use std::fmt::Write as _;

/// Names of metric families by prefix; the longest matching prefix applies.
const NAMES: [(&str, &str); 25] = [
    ("pck_3d", "correct keypoints"),
    ("pck_2d", "correct keypoints, front view"),
    ("l1div", "diversity within a clip"),
    ("l1", "mean coordinate error"),
    ("mpjpe", "joint error"),
    ("p_mpjpe", "joint error after alignment"),
    ("acceleration_error", "acceleration error"),
    ("acceleration", "acceleration"),
    ("jerk", "jerk"),
    ("speed", "speed"),
    ("hellinger", "speed distribution (Hellinger distance)"),
    ("average_pairwise_distance", "distance between poses"),
    ("bone_change", "bone length change per frame"),
    ("bone_deviation", "bone length deviation"),
    ("maje", "mean coordinate error after the seed frames"),
    ("beat_consistency", "beat consistency"),
    ("beat_alignment", "beat alignment"),
    ("frechet_pose", "Frechet distance, poses"),
    ("frechet_window", "Frechet distance, windows of a second"),
    ("frechet_embedding", "Frechet distance, embedded windows"),
    ("cca", "canonical correlation"),
    ("angle_error", "angle error"),
    ("angular_speed", "angular speed"),
    ("hellinger_angular_speed", "distribution of angular speeds (Hellinger distance)"),
    ("angle_correlation", "correlation of angles"),
];

/// Name with the part of the body, like `correct keypoints at 0.2, fingers`.
pub fn name(definition: &Definition) -> String {
    match part(definition) {
        "" => name_without_part(definition),
        part => format!("{}, {part}", name_without_part(definition)),
    }
}

pub fn name_without_part(definition: &Definition) -> String {
    let known =
        NAMES.iter().filter(|(start, _)| definition.name.starts_with(start)).max_by_key(|(start, _)| start.len());
    let mut name = match known {
        Some((_, plain)) => (*plain).to_owned(),
        None => definition.name.replace('_', " "),
    };
    if definition.better == Better::Neither {
        name += " of the truth";
    }
    if let Some(alpha) = definition.parameters.get("alpha") {
        let _ = write!(name, " at {alpha}");
    }
    if definition.unit == "%" && definition.name.starts_with("bone") {
        name += ", relative";
    }
    name
}

/// Part of the body; empty for the whole body.
pub fn part(definition: &Definition) -> &'static str {
    match definition.part {
        "all" => "",
        "all_and_neck" => "with the neck",
        "body" => "arms",
        "hands" => "fingers",
        "fingers_from_wrist" => "fingers from the wrist",
        "from_joint_8" => "from joint 8 on",
        other => other,
    }
}

/// Short text for the better direction: higher, lower, or close to the ground truth.
pub const fn direction(better: Better) -> &'static str {
    match better {
        Better::Higher => "higher is better",
        Better::Lower => "lower is better",
        Better::NearerTruth => "closest to the truth is best",
        Better::Neither => "",
    }
}

/// Unit of a metric; shares are shown in percent.
pub fn unit(definition: &Definition) -> &str {
    if is_share(definition) {
        return "%";
    }
    match definition.unit {
        "1" => "",
        "m/s^2" => "m/s\u{b2}",
        "m/s^3" => "m/s\u{b3}",
        "cm^2" => "cm\u{b2}",
        "cm/s^2" => "cm/s\u{b2}",
        "cm/s^3" => "cm/s\u{b3}",
        unit => unit,
    }
}

fn is_share(definition: &Definition) -> bool {
    definition.name.starts_with("pck")
}

/// Value without interval; `-` if it is not finite.
pub fn number(definition: &Definition, value: f64) -> String {
    let value = if is_share(definition) { 100.0 * value } else { value };
    if !value.is_finite() {
        return "-".to_owned();
    }
    // Three significant digits.
    let digits = match value.abs() {
        _ if is_share(definition) => 1,
        n if n >= 100.0 => usize::from(n < 1000.0),
        n if n >= 10.0 => 1,
        n if n >= 1.0 => 2,
        n if n >= 0.001 => (2.0 - n.log10().floor()) as usize,
        // Smaller values are rounding errors.
        _ => 4,
    };
    let text = format!("{value:.digits$}");
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') { "0".to_owned() } else { text }
}

/// Value with interval, like `41.2 [38.0, 44.1]`.
pub fn bracketed(definition: &Definition, estimate: &Estimate) -> String {
    let number = |value: f64| number(definition, value);
    let Estimate { value, interval } = *estimate;
    if interval.is_finite() {
        format!("{} [{}, {}]", number(value), number(interval.low), number(interval.high))
    } else {
        number(value)
    }
}
