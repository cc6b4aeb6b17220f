//! The only room that knows OpenCV: warps, letterboxes, colour, heat-map filters, drawing.

pub mod draw;
