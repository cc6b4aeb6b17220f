//! ONNX Runtime: its shared library is located and loaded on first use, once per process.

use super::Inference;
use anyhow::{Result, anyhow, bail};
use ort::environment::Environment;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// File name of the library; a version suffix may follow.
pub const LIBRARY: &str = "libonnxruntime.so";
/// Environment variable with the path of the library, which bypasses the search.
const VARIABLE: &str = "ORT_DYLIB_PATH";

/// Environment variable that disables ONNX Runtime telemetry. The library reads it while loading; its API switch
/// takes effect only after the first report. The program sets it before its first thread starts, and other programs
/// that use this crate must do the same.
pub const TELEMETRY_OFF: &str = "ORT_DISABLE_TELEMETRY";

#[derive(Clone)]
pub struct Runtime {
    environment: Environment,
    library: PathBuf,
    /// Runs the models that accept batches; `None`: each opened model runs on its own, on the CPU.
    pub inference: Option<Inference>,
}

/// One runtime per process: the first library loaded is used from then on.
static LOADED: Mutex<Option<Runtime>> = Mutex::new(None);

impl Runtime {
    /// Loads the library `explicit` (if empty, that of [`find_library`]). Later calls return the first library.
    ///
    /// # Errors
    ///
    /// No library was found, or it cannot be loaded; the message says how to get one.
    pub fn load(explicit: &Path, models_dir: &Path) -> Result<Self> {
        let mut loaded = LOADED.lock().map_err(|_| anyhow!("cannot load ONNX Runtime: an earlier attempt panicked"))?;
        if let Some(runtime) = loaded.as_ref() {
            return Ok(runtime.clone());
        }
        let library = find_library(explicit, models_dir)?;
        let environment = ort::init_from(&library)
            .map_err(|error| anyhow!("{error}"))
            .and_then(|builder| Ok(builder.with_telemetry(false).build()?))
            .map_err(|error| {
                anyhow!(
                    "cannot load ONNX Runtime from {}: {error}; `make runtime` downloads a compatible version",
                    library.display()
                )
            })?;
        environment.set_log_level(ort::logging::LogLevel::Error);
        let runtime = Self { environment, library, inference: None };
        *loaded = Some(runtime.clone());
        Ok(runtime)
    }

    /// Runs the models that accept batches with `inference`.
    pub fn with_inference(self, inference: Inference) -> Self {
        Self { inference: Some(inference), ..self }
    }

    pub fn library(&self) -> &Path {
        &self.library
    }

    /// Library version, taken from its file name (`libonnxruntime.so.1.31.1`).
    pub fn version(&self) -> String {
        let file = std::fs::canonicalize(&self.library).unwrap_or_else(|_| self.library.clone());
        let name = file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let version = name.strip_prefix(LIBRARY).unwrap_or_default().trim_start_matches('.');
        if version.is_empty() { "version unknown".to_owned() } else { version.to_owned() }
    }

    pub(crate) fn environment(&self) -> &Environment {
        &self.environment
    }
}

/// Path of the library: `explicit`, or else the variable ORT_DYLIB_PATH, or else a folder `lib/orator` (of `make dist`)
/// or `lib` in the program's folder or one of its ancestors, or else the `lib` folder of the models.
pub fn find_library(explicit: &Path, models_dir: &Path) -> Result<PathBuf> {
    if !explicit.as_os_str().is_empty() {
        if explicit.is_file() {
            return Ok(explicit.to_owned());
        }
        bail!("models.onnxruntime: {} is not a file; `make runtime` downloads the library", explicit.display());
    }
    if let Some(named) = std::env::var_os(VARIABLE).map(PathBuf::from) {
        if named.is_file() {
            return Ok(named);
        }
        bail!("{VARIABLE}: {} is not a file; set it to the path of {LIBRARY}", named.display());
    }
    let program = std::env::current_exe().and_then(std::fs::canonicalize).unwrap_or_default();
    let lib_folders = program.ancestors().skip(1).flat_map(|folder| ["lib/orator", "lib"].map(|lib| folder.join(lib)));
    lib_folders.chain([models_dir.join("lib")]).find_map(|folder| library_in(&folder)).ok_or_else(|| {
        anyhow!(
            "the ONNX Runtime library ({LIBRARY}) was not found; download it with `orator models fetch`, or set \
             models.onnxruntime or {VARIABLE} to its path"
        )
    })
}

/// The library in a folder; among several versions the last by name.
pub fn library_in(folder: &Path) -> Option<PathBuf> {
    let files = std::fs::read_dir(folder).ok()?.flatten().map(|file| file.path());
    let named = |path: &PathBuf| path.file_name().and_then(OsStr::to_str).is_some_and(|name| name.starts_with(LIBRARY));
    files.filter(|path| named(path) && path.is_file()).max()
}
