//! Statistics of clustered votes: votes of one participant and votes about one clip are not independent. Two hypotheses
//! must be distinguished: chance performance on these particular clips (`votes`), and chance performance on average
//! over the population of clips from which these are a sample (`crossed`, the headline; Clark 1973). The first is
//! rejected whenever some of the chosen clips happen to be easy, the second is not.

pub mod crossed;
pub mod sides;
pub mod votes;
