//! Training of the fixed spaces of movement: the linear basis and the embedding, on a corpus of captured motion.

pub mod auto_encoder;
pub mod basis;
pub mod corpus;
pub mod embedding;
