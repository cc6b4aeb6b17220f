//! What the numbers a model gives mean, one file a kind of output. Slices in, places in pixels of the model's input out;
//! no model, no picture, nothing remembered. Numbers that are not finite are not found, never a panic.

/// The longest axis of an output that is believed.
pub(crate) const LARGEST: i64 = 1 << 20;

/// A keypoint in pixels of the model's input: x, y, score. All zero where it is not finite.
pub type ScoredPoint = [f64; 3];

/// The point, or zeros where one of its numbers is not finite.
pub(crate) fn finite(point: ScoredPoint) -> ScoredPoint {
    if point.iter().all(|number| number.is_finite()) { point } else { [0.0; 3] }
}

/// Index and value of the first largest number; numbers that are not finite are passed over. None: there is none.
pub(crate) fn peak(numbers: &[f32]) -> Option<(usize, f32)> {
    let mut best: Option<(usize, f32)> = None;
    for (at, value) in numbers.iter().copied().enumerate() {
        if value.is_finite() && best.is_none_or(|(_, largest)| value > largest) {
            best = Some((at, value));
        }
    }
    best
}
