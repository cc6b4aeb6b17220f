//! Recognition of words: the stage and the verb.

mod stage;
mod verb;
