//! Models shared by several workers: each runs in a thread of its own on batches of the pictures that workers send, on
//! an NVIDIA GPU (ONNX Runtime's CUDA provider) or, for tests, on the CPU.

use super::convert::OnnxGraph;
use super::model::{Outputs, SessionKind, open_session, session};
use super::{ModelEntry, Runtime};
use anyhow::{Context, Result, anyhow, ensure};
use ort::ep::{CUDA, ExecutionProvider, cuda};
use ort::session::Session;
use ort::value::TensorRef;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// Pictures per run on a GPU. Every run has this size, padded if needed, so that the values of a picture do not depend on
/// the others.
pub const PICTURES_ON_GPU: usize = 32;
const N_ON_CPU: usize = 4;
/// Time for which a batch waits for more pictures.
const MAX_WAIT: Duration = Duration::from_millis(3);

/// Runs a model of a folder on one picture. Returns the values of all outputs, in the order of the description.
pub type Inference = Arc<dyn Fn(&ModelEntry, &Path, &[f32]) -> Result<Vec<f32>> + Send + Sync>;

/// A picture in the queue of a model.
struct Picture {
    input: Vec<f32>,
    answer: SyncSender<Result<Vec<f32>, String>>,
}

impl Runtime {
    /// Runs the models that accept batches on the NVIDIA GPU of this number, `n` pictures at a time; later calls return
    /// the first GPU.
    ///
    /// # Errors
    /// The library has no CUDA provider, or it does not start.
    pub fn on_gpu(self, gpu: usize, n: usize) -> Result<Self> {
        static GPU: OnceLock<Result<Inference, String>> = OnceLock::new();
        let started = GPU.get_or_init(|| {
            let kind = SessionKind::Gpu(gpu);
            let started = start(&self, kind).map(|()| shared(self.clone(), kind, n));
            started.map_err(|error| format!("{error:#}"))
        });
        Ok(self.with_inference(started.clone().map_err(|error| anyhow!(error))?))
    }

    /// Runs the models that accept batches in batches on the CPU.
    pub fn in_batches(self) -> Self {
        let inference = shared(self.clone(), SessionKind::Batches, N_ON_CPU);
        self.with_inference(inference)
    }
}

/// Runs a small graph on the GPU.
fn start(runtime: &Runtime, kind: SessionKind) -> Result<()> {
    let library = runtime.library().display();
    let remedy = "install the Python package onnxruntime-gpu[cuda,cudnn] (its libraries are for CUDA 13) and set \
                  models.onnxruntime to its libonnxruntime.so, or set models.provider = \"cpu\"";
    let has_provider = CUDA::is_available().unwrap_or(false);
    ensure!(has_provider, "the ONNX Runtime library {library} has no CUDA provider: {remedy}");
    preload(runtime.library());
    let mut graph = OnnxGraph::new(0);
    graph.output("y", "Relu", &["x"], &[]);
    let run = || -> Result<()> {
        let mut session = session(runtime, &graph.model(&[("x", &[1])], &[("y", &[1])]), kind)?;
        let input = TensorRef::from_array_view(([1_i64], [1.0_f32].as_slice()))?;
        session.run(ort::inputs![input])?;
        Ok(())
    };
    run().with_context(|| {
        format!("the CUDA provider of {library} does not start: check the driver (nvidia-smi); {remedy}")
    })
}

/// Loads the libraries of CUDA and cuDNN from the folder of ONNX Runtime or NVIDIA's Python packages: those in the folder
/// `ORATOR_CUDA`, or in a folder above ONNX Runtime or in its `cuda`. Others may be installed in the system.
fn preload(library: &Path) {
    let above = library.ancestors().skip(1).flat_map(|folder| [folder.join("nvidia"), folder.join("cuda/nvidia")]);
    let chosen = std::env::var_os("ORATOR_CUDA").map(|folder| Path::new(&folder).join("nvidia"));
    let packages = chosen.into_iter().chain(above).filter_map(|folder| std::fs::read_dir(folder).ok()).flatten();
    let packages = packages.flatten().map(|package| package.path().join("lib"));
    for folder in library.parent().map(Path::to_owned).into_iter().chain(packages) {
        // A folder has some of them; the error of the provider names a library that is missing.
        let _ = (cuda::preload_dylibs(Some(&folder), None), cuda::preload_dylibs(None, Some(&folder)));
    }
}

/// Runs each model in its own thread, on batches of `n` pictures.
fn shared(runtime: Runtime, kind: SessionKind, n: usize) -> Inference {
    let queues = Mutex::new(BTreeMap::<String, SyncSender<Picture>>::new());
    Arc::new(move |entry, dir, input| {
        let is_valid = input.len() == entry.input_len() && entry.accepts_batches();
        ensure!(is_valid, "the model {} cannot run in batches on {} values", entry.id, input.len());
        let queue = {
            let mut queues = queues.lock().unwrap_or_else(PoisonError::into_inner);
            if !queues.contains_key(&entry.sha256) {
                let (session, (queue, pictures)) = (open_session(&runtime, entry, dir, kind)?, sync_channel(n));
                let served = entry.clone();
                std::thread::Builder::new().spawn(move || serve(session, &served, n, &pictures))?;
                queues.insert(entry.sha256.clone(), queue);
            }
            queues.get(&entry.sha256).cloned()
        };
        let (answer, values) = sync_channel(1);
        let picture = Picture { input: input.to_vec(), answer };
        let sent = queue.is_some_and(|queue| queue.send(picture).is_ok());
        let values = sent.then(|| values.recv().ok()).flatten().context("the thread of the model has ended")?;
        values.map_err(|error| anyhow!("the model {}: {error}", entry.id))
    })
}

/// Answers the pictures of a model until all senders are dropped.
fn serve(mut session: Session, entry: &ModelEntry, n: usize, pictures: &Receiver<Picture>) {
    let size = entry.input_len();
    let mut input = vec![0.0; n * size];
    while let Ok(first) = pictures.recv() {
        let (end, mut batch) = (Instant::now() + MAX_WAIT, vec![first]);
        while batch.len() < n
            && let Ok(next) = pictures.recv_timeout(end.saturating_duration_since(Instant::now()))
        {
            batch.push(next);
        }
        for (to, picture) in input.chunks_exact_mut(size).zip(&batch) {
            to.copy_from_slice(&picture.input);
        }
        let outputs = run(&mut session, entry, n, &input).map_err(|error| format!("{error:#}"));
        for (at, picture) in batch.into_iter().enumerate() {
            let own = |values: &Vec<f32>| values[at * values.len() / n..(at + 1) * values.len() / n].to_vec();
            let values = outputs.as_ref().map(|outputs| outputs.iter().map(own).collect::<Vec<_>>().concat());
            // The worker may have ended.
            let _ = picture.answer.send(values.map_err(String::clone));
        }
    }
}

/// Values of each output for `n` pictures.
fn run(session: &mut Session, entry: &ModelEntry, n: usize, input: &[f32]) -> Result<Vec<Vec<f32>>> {
    let mut shape = entry.inputs.first().map(|port| port.shape.clone()).unwrap_or_default();
    shape.iter_mut().take(1).for_each(|size| *size = n as i64);
    let input = TensorRef::from_array_view((shape.as_slice(), input))?;
    let outputs = Outputs::Session(&entry.id, session.run(ort::inputs![input])?);
    entry.outputs.iter().map(|port| Ok(outputs.floats(&port.name)?.1.to_vec())).collect()
}
