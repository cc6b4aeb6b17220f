//! Mixed-effects logistic regression of votes with crossed random intercepts of participants and clips: `fit` is the
//! model, `laplace` its likelihood, `minimum` the optimiser.

mod laplace;
mod minimum;

pub mod fit;
