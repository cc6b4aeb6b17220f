//! An opened model whose file was checked against the manifest (present, correct hash, names and shapes). It owns its
//! input buffer and measures the time spent inside ONNX Runtime.

use super::convert::BATCH;
use super::{Inference, ModelEntry, ModelRole, Port, Runtime};
use anyhow::{Context, Result, anyhow, bail};
use orator_base::input;
use ort::ep::CUDA;
use ort::ep::cuda::ConvAlgorithmSearch;
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

/// A model that is ready to run: on one thread, or shared with other workers.
pub struct Model {
    entry: ModelEntry,
    runner: ModelRunner,
    input: Vec<f32>,
    inside: Duration,
    n_runs: u64,
}

enum ModelRunner {
    Session(Session),
    /// The runs, the folder of the model, and the values of all outputs of the last run.
    Shared(Inference, PathBuf, Vec<f32>),
}

impl Model {
    /// Opens the file of `entry` in the folder `dir`, unless the model is shared. Errors are documented in
    /// [`ModelError`].
    pub fn open(runtime: &Runtime, entry: &ModelEntry, dir: &Path) -> Result<Self, ModelError> {
        let runner = match &runtime.inference {
            Some(shared) if entry.accepts_batches() => ModelRunner::Shared(shared.clone(), dir.to_owned(), Vec::new()),
            _ => ModelRunner::Session(open_session(runtime, entry, dir, SessionKind::OnePicture)?),
        };
        let input = vec![0.0; entry.input_len()];
        Ok(Self { entry: entry.clone(), runner, input, inside: Duration::ZERO, n_runs: 0 })
    }

    pub fn entry(&self) -> &ModelEntry {
        &self.entry
    }

    /// The input tensor, row-major, with the values of the last run; fill it before `run`.
    pub fn input_mut(&mut self) -> &mut [f32] {
        &mut self.input
    }

    pub fn run(&mut self) -> Result<Outputs<'_>> {
        let (id, start) = (&self.entry.id, Instant::now());
        let outputs = match &mut self.runner {
            ModelRunner::Session(session) => {
                let shape = self.entry.inputs.first().map(|port| port.shape.as_slice()).unwrap_or_default();
                let input = TensorRef::from_array_view((shape, self.input.as_slice()))?;
                let outputs = session.run(ort::inputs![input]);
                let outputs = outputs.map_err(|error| anyhow!("the model {id} failed: {error}"))?;
                Outputs::Session(id, outputs)
            }
            ModelRunner::Shared(inference, dir, values) => {
                *values = inference(&self.entry, dir, &self.input)?;
                Outputs::Shared(&self.entry, values)
            }
        };
        self.inside += start.elapsed();
        self.n_runs += 1;
        Ok(outputs)
    }

    /// Total time of the runs, seconds.
    pub fn secs_inside(&self) -> f64 {
        self.inside.as_secs_f64()
    }

    pub fn n_runs(&self) -> u64 {
        self.n_runs
    }
}

/// Outputs of a run; borrowed from the model until the next run.
pub enum Outputs<'m> {
    /// Those of the model with this id.
    Session(&'m str, SessionOutputs<'m>),
    /// The values of all outputs of a shared model, in the order of its description.
    Shared(&'m ModelEntry, &'m [f32]),
}

impl Outputs<'_> {
    /// Shape and values of a float output.
    pub fn floats(&self, name: &str) -> Result<(&[i64], &[f32])> {
        let Self::Shared(entry, values) = self else { return self.read(name) };
        let mut rest = *values;
        for Port { name: known, shape } in &entry.outputs {
            let size = shape.iter().map(|side| usize::try_from(*side).unwrap_or(0)).product();
            let too_few = || format!("the model {} returned too few values", entry.id);
            let (own, following) = rest.split_at_checked(size).with_context(too_few)?;
            if known == name {
                return Ok((shape, own));
            }
            rest = following;
        }
        bail!("the model {} has no output {name:?}", entry.id)
    }

    /// Shape and values of an integer output.
    pub fn integers(&self, name: &str) -> Result<(&[i64], &[i64])> {
        self.read(name)
    }

    fn read<T: ort::value::PrimitiveTensorElementType>(&self, name: &str) -> Result<(&[i64], &[T])> {
        let Self::Session(id, outputs) = self else { bail!("shared models have no integer output {name:?}") };
        let value = outputs.get(name).with_context(|| format!("the model {id} has no output {name:?}"))?;
        let (shape, numbers) = value
            .try_extract_tensor::<T>()
            .map_err(|error| anyhow!("the output {name:?} of the model {id}: {error}"))?;
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
pub(super) fn open_session(
    runtime: &Runtime,
    entry: &ModelEntry,
    dir: &Path,
    kind: SessionKind,
) -> Result<Session, ModelError> {
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
    let session = session(runtime, &bytes, kind).map_err(|error| ModelError::NotOnnx {
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

/// Pictures per run of a session, and its processor.
#[derive(Clone, Copy)]
pub enum SessionKind {
    OnePicture,
    Batches,
    /// Batches on the NVIDIA GPU of this number.
    Gpu(usize),
}

/// Creates a session with one thread, no spinning, full optimisation and deterministic results.
pub fn session(runtime: &Runtime, bytes: &[u8], kind: SessionKind) -> Result<Session> {
    fn to_anyhow<T>(error: ort::Error<T>) -> anyhow::Error {
        anyhow!("{}", error.to_string().trim_end())
    }
    let builder = Session::builder(runtime.environment())?
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
        .map_err(to_anyhow)?;
    // Products in TF32 have the precision of float16.
    let cuda = |gpu| {
        CUDA::default().with_device_id(gpu).with_tf32(false).with_conv_algorithm_search(ConvAlgorithmSearch::Heuristic)
    };
    let builder = match kind {
        SessionKind::OnePicture => builder.with_dimension_override(BATCH, 1),
        SessionKind::Batches => Ok(builder),
        SessionKind::Gpu(gpu) => builder.with_execution_providers([cuda(gpu as i32).build().error_on_failure()]),
    };
    builder.map_err(to_anyhow)?.commit_from_memory(bytes).map_err(to_anyhow)
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
