//! The frames of one interval within the arrays of a whole video.

use ndarray::{ArrayViewMut2, ArrayViewMut3};

/// The frames of one interval of a `Lifted`.
pub struct IntervalView<'a> {
    pub joints: ArrayViewMut3<'a, f32>,
    pub extra: ArrayViewMut3<'a, f32>,
    pub mask: ArrayViewMut2<'a, bool>,
}
