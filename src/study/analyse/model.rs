//! Mixed logistic regression of a share.

use super::figure::{FigureMethod, TestFigure};
use super::figures::FigureSet;
use super::result::ModelFigure;
use crate::stats::cluster::votes::ClipVote;
use crate::stats::error::StatisticsError;
use crate::stats::glmm::fit::MixedLogit;

/// Fits the model of an intercept with random participants and clips to votes with scores 0 and 1. Its interval is of
/// the share over all participants and clips, its test of the intercept against log odds of 0, with one degree of
/// freedom less than the smaller number of participants and clips.
pub fn fitted(votes: &[ClipVote], found: &mut FigureSet, confidence: f64) -> Option<ModelFigure> {
    let figures = |model: MixedLogit| -> Result<_, StatisticsError> {
        let (intercept, marginal) = (model.containment(0)?, model.marginal_share(&[1.0], confidence)?);
        Ok((model, intercept, marginal))
    };
    let (model, intercept, marginal) =
        found.known(FigureMethod::MixedModel, MixedLogit::of_share(votes).and_then(figures))?;
    if !model.converged {
        found.missing.push(format!("{}: the search for its maximum did not end", FigureMethod::MixedModel.name()));
        return None;
    }
    found.add_interval(FigureMethod::MixedModel, Ok(marginal.interval));
    found.tests.push(TestFigure {
        statistic: Some(intercept.statistic(0.0)),
        degrees_of_freedom: Some(intercept.degrees_of_freedom),
        ..TestFigure::new(FigureMethod::MixedModel, intercept.p_value(0.0))
    });
    Some(ModelFigure {
        exploratory: true,
        share: marginal.share,
        log_odds: intercept.value,
        standard_error: intercept.standard_error,
        sd_participants: model.sd_participants,
        sd_clips: model.sd_clips,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{CrossedDesign, CrossedEffects, crossed_votes};

    #[test]
    fn the_share_of_a_simulated_study_is_found() {
        let design = CrossedDesign { n_participants: 60, n_trials: 10, n_clips: 30 };
        let effects = CrossedEffects { share: 0.65, sd_participants: 0.5, sd_clips: 0.3 };
        let votes = crossed_votes(&design, &effects, 4, 0);
        let mut found = FigureSet::default();
        let model = fitted(&votes, &mut found, 0.95).unwrap();
        let interval = found.interval(FigureMethod::MixedModel).unwrap();
        assert!(interval.low < 0.65 && 0.65 < interval.high, "{interval:?}");
        assert!((model.share - 0.65).abs() < 0.06 && model.log_odds > 0.3, "{model:?}");
        assert!(found.test(FigureMethod::MixedModel).unwrap().p < 0.01);
        // Equal votes have no finite log odds.
        let equal: Vec<_> = votes.iter().map(|vote| ClipVote { score: 1.0, ..*vote }).collect();
        let mut found = FigureSet::default();
        assert_eq!(fitted(&equal, &mut found, 0.95), None);
        assert_eq!((found.missing.len(), found.tests.len()), (1, 0));
    }
}
