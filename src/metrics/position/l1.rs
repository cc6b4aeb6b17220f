//! Mean absolute difference of coordinates, metres: what the L1 loss of training measures.

use crate::metrics::body_part::BodyPart;
use crate::metrics::definition::{Better, Definition, MetricFamily};
use crate::metrics::per_frame::FrameMean;
use serde_json::json;

pub(crate) fn metric(part: BodyPart) -> Box<dyn MetricFamily> {
    let definition = Definition {
        name: "l1",
        part: part.name(),
        unit: "m",
        better: Better::Lower,
        formula: "mean over t, j and the coordinates x, y, z of |p - g|",
        undefined: "no joint of the part is seen",
        parameters: json!({}),
    };
    FrameMean::over(definition, part, 1, |window| window.apart(0).iter().map(|v| v.abs()).sum::<f64>() / 3.0)
}
