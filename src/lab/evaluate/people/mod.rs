//! Errors of the whole pipeline on rendered people, whose truth is known: `points` (2D keypoints), `hands` (missed,
//! invented, stolen, swapped), `head` (its angles), `kept` (what the intervals keep and the mask says), `joints` (3D),
//! `table` (all of it by condition and by model set), `grid` (the table as text) and `gap` (beside real clips).
//! `noise` and `hand_noise` with `bias_fit`: the errors as the noise by which lifters are trained.

pub mod bias_fit;
pub mod clips;
pub mod gap;
pub mod grid;
pub mod hand_noise;
pub mod hands;
pub mod head;
pub mod joints;
pub mod kept;
pub mod noise;
pub mod page;
pub mod points;
pub mod table;
