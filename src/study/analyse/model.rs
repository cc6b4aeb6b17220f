//! Mixed logistic regression of a share.

use super::figures::FigureSet;
use super::result::ModelFigure;
use crate::study::stats::cluster::votes::ClipVote;

/// Estimates of the model; none are made yet.
pub fn fitted(_votes: &[ClipVote], _found: &mut FigureSet, _confidence: f64) -> Option<ModelFigure> {
    None
}
