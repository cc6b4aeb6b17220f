//! Synthetic inputs with known ground truth for tests and benchmarks: a drawn speaker in a suit of coloured markers
//! with three small models that detect them (`drawn`), speakers whose gestures follow a known rule (`rule`), and checks
//! of operators and their gradients (`gradcheck`).

pub mod drawn;
pub mod gradcheck;
pub mod project;
pub mod rule;
pub mod skip;
pub mod spoken_video;
