//! ONNX Runtime itself: its shared library is looked for and loaded when it is first needed, once a process.

use anyhow::{Result, anyhow, bail};
use ort::environment::Environment;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// What the library is called; a version may follow.
pub const LIBRARY: &str = "libonnxruntime.so";
/// Names a library outright, before any search.
const VARIABLE: &str = "ORT_DYLIB_PATH";

/// The variable that stops ONNX Runtime from reporting its use to its maker, read by the library when it is loaded:
/// its own switch comes after the first report. The program sets it before its first thread starts; a program that
/// uses this crate does so itself.
pub const TELEMETRY_OFF: &str = "ORT_DISABLE_TELEMETRY";

/// ONNX Runtime, loaded.
#[derive(Clone)]
pub struct Runtime {
    environment: Environment,
    library: PathBuf,
}

/// There is one a process: the first library loaded stays.
static LOADED: Mutex<Option<Runtime>> = Mutex::new(None);

impl Runtime {
    /// Loads the library `explicit` (empty: see `find_library`). Later calls give the library of the first. Errors: no
    /// library, or one that cannot be loaded; the message says how to get it.
    pub fn load(explicit: &Path, models_dir: &Path) -> Result<Self> {
        let mut loaded = LOADED.lock().map_err(|_| anyhow!("loading ONNX Runtime failed before"))?;
        if let Some(runtime) = loaded.as_ref() {
            return Ok(runtime.clone());
        }
        let library = find_library(explicit, models_dir)?;
        let environment = ort::init_from(&library)
            .map_err(|error| anyhow!("{error}"))
            .and_then(|builder| Ok(builder.with_telemetry(false).build()?))
            .map_err(|error| {
                anyhow!(
                    "ONNX Runtime at {} cannot be used: {error}; `make runtime` gets a right one",
                    library.display()
                )
            })?;
        environment.set_log_level(ort::logging::LogLevel::Error);
        let runtime = Self { environment, library };
        *loaded = Some(runtime.clone());
        Ok(runtime)
    }

    /// The library that was loaded.
    pub fn library(&self) -> &Path {
        &self.library
    }

    /// Its version, as the library's file name carries it (`libonnxruntime.so.1.31.1`).
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

/// Where the library is: `explicit`, else the variable ORT_DYLIB_PATH, else a `lib` folder beside the program or one
/// of the folders above it, else the `lib` folder of the models.
pub fn find_library(explicit: &Path, models_dir: &Path) -> Result<PathBuf> {
    if !explicit.as_os_str().is_empty() {
        if explicit.is_file() {
            return Ok(explicit.to_owned());
        }
        bail!("models.onnxruntime names {}, which is not a file; `make runtime` gets the library", explicit.display());
    }
    if let Some(named) = std::env::var_os(VARIABLE).map(PathBuf::from) {
        if named.is_file() {
            return Ok(named);
        }
        bail!("{VARIABLE} names {}, which is not a file", named.display());
    }
    let program = std::env::current_exe().and_then(std::fs::canonicalize).unwrap_or_default();
    let beside = program.ancestors().skip(1).map(|folder| folder.join("lib"));
    beside.chain([models_dir.join("lib")]).find_map(|folder| library_in(&folder)).ok_or_else(|| {
        anyhow!(
            "the ONNX Runtime library ({LIBRARY}) was not found; `orator models fetch` gets it, models.onnxruntime or {VARIABLE} \
             names another"
        )
    })
}

/// The library in a folder; of several versions the last by name.
fn library_in(folder: &Path) -> Option<PathBuf> {
    let files = std::fs::read_dir(folder).ok()?.flatten().map(|file| file.path());
    let named = |path: &PathBuf| path.file_name().and_then(OsStr::to_str).is_some_and(|name| name.starts_with(LIBRARY));
    files.filter(|path| named(path) && path.is_file()).max()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_is_found_beside_the_models_and_missed_with_advice() {
        let dir = tempfile::tempdir().unwrap();
        let lost = find_library(&dir.path().join("gone.so"), dir.path()).unwrap_err();
        assert!(lost.to_string().contains("gone.so") && lost.to_string().contains("make runtime"));
        std::fs::create_dir(dir.path().join("lib")).unwrap();
        for version in ["1.9.0", "1.31.1"] {
            std::fs::write(dir.path().join(format!("lib/{LIBRARY}.{version}")), b"").unwrap();
        }
        assert!(library_in(&dir.path().join("lib")).is_some());
        assert!(library_in(&dir.path().join("nothing")).is_none());
    }
}
