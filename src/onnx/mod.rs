//! The only room that knows ONNX Runtime: sessions, the model manifest, checks of names and shapes.
