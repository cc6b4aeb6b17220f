//! Mean absolute difference of coordinates, metres: what the L1 loss of training measures.

use crate::metrics::body_part::Part;
use crate::metrics::definition::{Better, Definition, Metric};
use crate::metrics::per_frame::Mean;
use serde_json::json;

pub(crate) fn metric(part: Part) -> Box<dyn Metric> {
    let definition = Definition {
        name: "l1",
        part: part.name(),
        unit: "m",
        better: Better::Lower,
        formula: "mean over t, j and the coordinates x, y, z of |p - g|",
        undefined: "no joint of the part is seen",
        parameters: json!({}),
    };
    Mean::over(definition, part, 1, |window| window.apart(0).iter().map(|v| v.abs()).sum::<f64>() / 3.0)
}
