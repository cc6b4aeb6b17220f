//! Training of the model that sees a body: `people` (who is learnt from, read from a labelled set), `crop` (a person in
//! the network's picture), `disturb` (light, blur, noise), `body` (the training task), `measure` (errors on held-out
//! people), `export` (the network as an ONNX file).

pub mod body;
pub mod crop;
pub mod disturb;
pub mod export;
pub mod measure;
pub mod people;
