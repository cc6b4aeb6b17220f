//! Training of the fixed motion spaces of the metrics, the linear basis and the embedding, on a corpus of captured and
//! procedural motion.

pub mod auto_encoder;
pub mod basis;
pub mod corpus;
pub mod embedding;
