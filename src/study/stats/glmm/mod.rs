//! Mixed-effects logistic regression of votes with participants and clips as crossed random intercepts: `fit` is the
//! model, `laplace` its likelihood, `minimum` the search for the best parameters.

mod laplace;
mod minimum;

pub mod fit;
