//! Strengths of conditions from votes that put one above another.

use super::outcome::Numbering;
use super::result::{FigureSettings, StrengthFigure};
use crate::study::stats::error::StatisticsError;
use crate::study::vote::StudyVote;

/// Strengths of the conditions; none are estimated yet.
pub fn strengths(
    _votes: &[&StudyVote],
    _numbering: &Numbering,
    _conditions: &[String],
    _settings: &FigureSettings,
) -> Result<Vec<StrengthFigure>, StatisticsError> {
    Ok(Vec::new())
}
