//! Mixed-effects logistic regression of votes with crossed random intercepts of participants and clips: `fit` is the
//! model with its optimiser, `laplace` its likelihood.

mod laplace;

pub mod fit;
