//! Why a model, or ONNX Runtime itself, cannot be used.

use std::path::PathBuf;

/// Why a model cannot be used: `id` is the model, `path` its file, `found` what is there instead of `expected`.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// ONNX Runtime itself is not there.
    #[error(
        "the ONNX Runtime library ({library}) was not found; `orator models fetch` gets it, models.onnxruntime or {variable} names \
         another"
    )]
    NoLibrary { library: &'static str, variable: &'static str },
    /// The file is not there.
    #[error(
        "the model {id} is missing: {path} is not there; `orator models fetch` gets it, models.dir names another folder"
    )]
    Missing { id: String, path: PathBuf },
    /// The file cannot be read.
    #[error("the model {id} cannot be read: {path}: {error}")]
    Unreadable { id: String, path: PathBuf, error: String },
    /// The file has other bytes than those pinned.
    #[error(
        "the model {id} is not the one described: {path} has sha256 {found}, expected {expected}; `orator models fetch` gets the \
         right one, `orator models add` registers this one"
    )]
    WrongHash { id: String, path: PathBuf, expected: String, found: String },
    /// ONNX Runtime does not open the file.
    #[error("the model {id} is no ONNX model this ONNX Runtime can open: {path}: {error}")]
    NotOnnx { id: String, path: PathBuf, error: String },
    /// An input or output, `port`, has another name, type or shape.
    #[error(
        "the model {id} has another layout than described: {path}: {port}: expected {expected}, found {found}; describe it in \
         manifest.toml (`orator models add FILE --like ID`)"
    )]
    WrongLayout { id: String, path: PathBuf, port: String, expected: String, found: String },
}
