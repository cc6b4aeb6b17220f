//! Mean per-joint position error, millimetres, from the neck, or from the own wrist.

use crate::math::vec3;
use crate::metrics::body_part::BodyPart;
use crate::metrics::definition::{Better, Definition, MetricFamily};
use crate::metrics::per_frame::FrameMean;
use serde_json::json;

pub(crate) fn metric(part: BodyPart) -> Box<dyn MetricFamily> {
    let definition = Definition {
        name: "mpjpe",
        part: part.name(),
        unit: "mm",
        better: Better::Lower,
        formula: "1000 times the mean over t and j of the distance |p - g|, positions from the neck (part \
                  fingers_from_wrist: from the wrist of the same side)",
        undefined: "no joint of the part is seen",
        parameters: json!({}),
    };
    FrameMean::over(definition, part, 1, |window| 1000.0 * vec3::norm(window.apart(0)))
}
