//! An opened model whose file was checked against the manifest (present, correct hash, names and shapes). It owns its
//! input buffer and measures the time spent inside ONNX Runtime.

use super::convert::BATCH;
use super::{ModelEntry, ModelRole, Port, Runtime};
use anyhow::{Context, Result, anyhow};
use orator_base::input;
use ort::session::builder::GraphOptimizationLevel;
use ort::session::{Session, SessionOutputs};
use ort::value::{Outlet, TensorElementType, TensorRef, ValueType};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Reason why a model cannot be used: `id` is the model, `path` its file, `found` the value instead of `expected`.
#[derive(Clone, Debug, thiserror::Error, Serialize, Deserialize)]
pub enum ModelError {
    /// The file does not exist.
    #[error(
        "the model {id} is missing: {path} does not exist; download it with `orator models fetch` or correct models.dir"
    )]
    Missing { id: String, path: PathBuf },
    /// The file cannot be read.
    #[error("cannot read the model {id}: {path}: {error}")]
    Unreadable { id: String, path: PathBuf, error: String },
    /// The hash of the file differs from the pinned one.
    #[error(
        "the model {id} differs from its description: {path} has sha256 {found}, expected {expected}; download it again with \
         `orator models fetch` or register this file with `orator models add`"
    )]
    HashMismatch { id: String, path: PathBuf, expected: String, found: String },
    /// ONNX Runtime cannot open the file.
    #[error("ONNX Runtime cannot open the model {id}: {path}: {error}")]
    NotOnnx { id: String, path: PathBuf, error: String },
    /// An input or output, `port`, has another name, type or shape than described.
    #[error(
        "the tensors of the model {id} differ from its description: {path}, {port}: expected {expected}, found {found}; \
         correct manifest.toml or register the file with `orator models add FILE --like ID`"
    )]
    LayoutMismatch { id: String, path: PathBuf, port: String, expected: String, found: String },
}

/// A model that is ready to run, on one thread.
pub struct Model {
    entry: ModelEntry,
    session: Session,
    shape: Vec<i64>,
    input: Vec<f32>,
    inside: Duration,
    n_runs: u64,
}

impl Model {
    /// Opens the file of `entry` in the folder `dir`. Errors are documented in [`ModelError`].
    pub fn open(runtime: &Runtime, entry: &ModelEntry, dir: &Path) -> Result<Self, ModelError> {
        let session = open_session(runtime, entry, dir)?;
        let shape = entry.inputs.first().map(|port| port.shape.clone()).unwrap_or_default();
        let size = shape.iter().map(|side| usize::try_from(*side).unwrap_or(0)).product();
        let input = vec![0.0; size];
        Ok(Self { entry: entry.clone(), session, shape, input, inside: Duration::ZERO, n_runs: 0 })
    }

    pub fn entry(&self) -> &ModelEntry {
        &self.entry
    }

    /// The input tensor, row-major, with the values of the last run; fill it before `run`.
    pub fn input_mut(&mut self) -> &mut [f32] {
        &mut self.input
    }

    pub fn run(&mut self) -> Result<Outputs<'_>> {
        let input = TensorRef::from_array_view((self.shape.as_slice(), self.input.as_slice()))?;
        let start = Instant::now();
        let outputs = self.session.run(ort::inputs![input]);
        self.inside += start.elapsed();
        self.n_runs += 1;
        let outputs = outputs.map_err(|error| anyhow!("the model {} failed: {error}", self.entry.id))?;
        Ok(Outputs { id: &self.entry.id, outputs })
    }

    /// Total time spent in `Session::run`, seconds.
    pub fn secs_inside(&self) -> f64 {
        self.inside.as_secs_f64()
    }

    pub fn n_runs(&self) -> u64 {
        self.n_runs
    }
}

/// Outputs of a run; borrowed from the model until the next run.
pub struct Outputs<'m> {
    pub(super) id: &'m str,
    pub(super) outputs: SessionOutputs<'m>,
}

impl Outputs<'_> {
    /// Shape and values of a float output.
    pub fn floats(&self, name: &str) -> Result<(&[i64], &[f32])> {
        self.read(name)
    }

    /// Shape and values of an integer output.
    pub fn integers(&self, name: &str) -> Result<(&[i64], &[i64])> {
        self.read(name)
    }

    fn read<T: ort::value::PrimitiveTensorElementType>(&self, name: &str) -> Result<(&[i64], &[T])> {
        let value = self.outputs.get(name).with_context(|| format!("the model {} has no output {name:?}", self.id))?;
        let (shape, numbers) = value
            .try_extract_tensor::<T>()
            .map_err(|error| anyhow!("the output {name:?} of the model {}: {error}", self.id))?;
        Ok((shape, numbers))
    }
}

/// SHA-256 of a file, in hex.
pub fn sha256_of(path: &Path) -> Result<String> {
    let mut hash = Sha256::new();
    let copied = input::open(path).and_then(|mut file| std::io::copy(&mut file, &mut hash));
    copied.with_context(|| format!("cannot read {}", path.display()))?;
    Ok(format!("{:x}", hash.finalize()))
}

/// Opens the file of `entry` in the folder `dir` after checking its hash, names and shapes.
pub(super) fn open_session(runtime: &Runtime, entry: &ModelEntry, dir: &Path) -> Result<Session, ModelError> {
    // The sample rate input of a speech model is an integer; inputs of image models are floats.
    let is_speech = entry.role == ModelRole::Speech;
    let path = dir.join(&entry.file);
    let id = || entry.id.clone();
    if !path.exists() {
        return Err(ModelError::Missing { id: id(), path });
    }
    let bytes = match input::read(&path, input::MAX_DATA) {
        Ok(bytes) => bytes,
        Err(error) => return Err(ModelError::Unreadable { id: id(), path, error: error.to_string() }),
    };
    let found = format!("{:x}", Sha256::digest(&bytes));
    if !found.eq_ignore_ascii_case(&entry.sha256) {
        return Err(ModelError::HashMismatch { id: id(), path, expected: entry.sha256.clone(), found });
    }
    let session = session(runtime, &bytes).map_err(|error| ModelError::NotOnnx {
        id: id(),
        path: path.clone(),
        error: error.to_string(),
    })?;
    let differs = mismatch("input", session.inputs(), &entry.inputs, !is_speech)
        .or_else(|| mismatch("output", session.outputs(), &entry.outputs, false));
    if let Some((port, expected, found)) = differs {
        return Err(ModelError::LayoutMismatch { id: id(), path, port, expected, found });
    }
    Ok(session)
}

/// Creates a session for one picture per run with one thread, no spinning, full optimisation and deterministic results.
pub fn session(runtime: &Runtime, bytes: &[u8]) -> Result<Session> {
    fn to_anyhow<T>(error: ort::Error<T>) -> anyhow::Error {
        anyhow!("{error}")
    }
    Session::builder(runtime.environment())?
        .with_intra_threads(1)
        .map_err(to_anyhow)?
        .with_inter_threads(1)
        .map_err(to_anyhow)?
        .with_intra_op_spinning(false)
        .map_err(to_anyhow)?
        .with_optimization_level(GraphOptimizationLevel::Level3)
        .map_err(to_anyhow)?
        .with_deterministic_compute(true)
        .map_err(to_anyhow)?
        .with_log_level(ort::logging::LogLevel::Error)
        .map_err(to_anyhow)?
        .with_dimension_override(BATCH, 1)
        .map_err(to_anyhow)?
        .commit_from_memory(bytes)
        .map_err(to_anyhow)
}

/// The first difference between the file and the manifest: port, expected value, found value. `all`: the manifest
/// must list all ports of the file.
fn mismatch(what: &str, found: &[Outlet], expected: &[Port], all: bool) -> Option<(String, String, String)> {
    let names = |ports: &mut dyn Iterator<Item = &str>| ports.collect::<Vec<_>>().join(", ");
    if all && found.len() != expected.len() {
        let expected = names(&mut expected.iter().map(|port| port.name.as_str()));
        return Some((format!("{what}s"), expected, names(&mut found.iter().map(Outlet::name))));
    }
    for port in expected {
        let named = || format!("{what} {:?}", port.name);
        let Some(outlet) = found.iter().find(|outlet| outlet.name() == port.name) else {
            return Some((named(), format!("an {what} of this name"), names(&mut found.iter().map(Outlet::name))));
        };
        let (element, shape) = match outlet.dtype() {
            ValueType::Tensor { ty, shape, .. } => (*ty, shape.to_vec()),
            other => return Some((named(), "a tensor".into(), format!("{other:?}"))),
        };
        let is_supported = if all {
            element == TensorElementType::Float32
        } else {
            matches!(element, TensorElementType::Float32 | TensorElementType::Int64)
        };
        if !is_supported {
            return Some((named(), "float32".into(), format!("{element:?}")));
        }
        let is_same_size = |(a, b): (&i64, &i64)| *a < 0 || *b < 0 || a == b;
        if shape.len() != port.shape.len() || !shape.iter().zip(&port.shape).all(is_same_size) {
            return Some((named(), format!("{:?}", port.shape), format!("{shape:?}")));
        }
    }
    None
}
