//! The shared libraries of CUDA: found in `ORATOR_CUDA`, beside the program, in Python packages or by the system's
//! search, and loaded once, before the first GPU is opened.

use super::functions::{CudaLibrary, LIBRARIES};
use anyhow::{Result, ensure};
use libloading::os::unix::Library;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::Ordering;

/// Environment variable with a folder of libraries or of Python packages, which is searched first.
const VARIABLE: &str = "ORATOR_CUDA";
/// The driver's library, which must come from the installed driver.
const DRIVER: &str = "libcuda.so.1";

/// File name of a library, and its path or why it cannot be used.
pub type LibraryStatus = (&'static str, Result<PathBuf, String>);

/// Loads every library, at the first call.
pub fn status() -> &'static [LibraryStatus] {
    static STATUS: OnceLock<Vec<LibraryStatus>> = OnceLock::new();
    STATUS.get_or_init(|| {
        let folders = folders();
        LIBRARIES.iter().map(|library| (library.file, load_library(library, &folders))).collect()
    })
}

/// Loads every library; afterwards candle can open a GPU.
///
/// # Errors
/// A library is missing or too old.
pub fn load() -> Result<()> {
    let problems = status().iter().filter_map(|(_, found)| found.as_ref().err());
    // Without a driver, the first, the other libraries are of no use.
    let problems: Vec<&str> = problems.map(String::as_str).take(if status()[0].1.is_err() { 1 } else { 9 }).collect();
    ensure!(problems.is_empty(), "{}", problems.join("; "));
    Ok(())
}

/// Loads a library and sets the addresses of its functions. Returns its path.
fn load_library(library: &CudaLibrary, folders: &[PathBuf]) -> Result<PathBuf, String> {
    let is_driver = library.file == DRIVER;
    let in_folder = folders.iter().map(|folder| folder.join(library.file)).find(|path| path.is_file() && !is_driver);
    let named = in_folder.unwrap_or_else(|| library.file.into());
    // SAFETY: the initialisation of NVIDIA's libraries has no requirements.
    let loaded = unsafe { Library::new(&named) }.map_err(|error| match is_driver {
        _ if named.is_absolute() => format!("cannot load {}: {error}", named.display()),
        true => format!("no NVIDIA driver: {DRIVER} was not found; install release 580 or newer"),
        false => format!("{} was not found; `orator guide gpu` names the Python package that has it", library.file),
    })?;
    let path = loaded_path(&named);
    for (name, address) in library.functions {
        // SAFETY: only the address is used.
        let function = unsafe { loaded.get::<unsafe extern "C" fn()>(*name) };
        let function = function.map_err(|_| {
            let needed = if is_driver { "the driver must be release 580 or newer" } else { "CUDA 13 is needed" };
            format!("{} has no function {name}: {needed}", path.display())
        })?;
        address.store(function.into_raw(), Ordering::Release);
    }
    // The library remains loaded until the end of the process.
    let _ = loaded.into_raw();
    Ok(path)
}

/// Path of the file that the system loaded for `named`.
fn loaded_path(named: &Path) -> PathBuf {
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let stem = named.to_string_lossy().trim_end_matches(|c: char| c == '.' || c.is_ascii_digit()).to_owned();
    let mut paths = maps.lines().filter_map(|line| line.find('/').map(|start| Path::new(&line[start..])));
    let is_same = |path: &&Path| {
        named.is_relative()
            && path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(&format!("{stem}.")))
    };
    paths.find(is_same).unwrap_or(named).to_owned()
}

/// Folders in which libraries are searched for before the system's, in this order.
fn folders() -> Vec<PathBuf> {
    let program = std::env::current_exe().and_then(std::fs::canonicalize).unwrap_or_default();
    let chosen = std::env::var_os(VARIABLE).and_then(|folder| std::path::absolute(folder).ok()).into_iter();
    let chosen =
        chosen.flat_map(|folder| [vec![folder.join("lib"), folder.clone()], package_folders(&folder)].concat());
    let beside = program.ancestors().skip(1).flat_map(|folder| ["lib/orator", "lib"].map(|lib| folder.join(lib)));
    let prefixes = ["VIRTUAL_ENV", "CONDA_PREFIX"].into_iter().filter_map(std::env::var_os).map(PathBuf::from);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let pythons =
        std::env::split_paths(&path).filter(|folder| folder.is_absolute()).map(|folder| folder.join("python3"));
    let pythons = pythons.filter_map(|python| Some([python.clone(), python.canonicalize().ok()?]));
    let pythons = pythons.flatten().filter_map(|python| Some(python.parent()?.parent()?.to_owned()));
    let of_program = program.ancestors().skip(1).map(Path::to_owned);
    let mut folders: Vec<PathBuf> = chosen.chain(beside).collect();
    for prefix in of_program.chain(prefixes).chain(pythons) {
        let libs = entries(&prefix.join("lib"))
            .into_iter()
            .filter(|lib| lib.file_name().is_some_and(|name| name.to_string_lossy().starts_with("python3")));
        let packages = libs.flat_map(|lib| ["site-packages", "dist-packages"].map(|name| lib.join(name)));
        folders.extend(packages.flat_map(|packages| package_folders(&packages)));
    }
    folders.push("/usr/local/cuda/lib64".into());
    folders
}

/// The folders of libraries in NVIDIA's packages in this folder of Python packages.
fn package_folders(packages: &Path) -> Vec<PathBuf> {
    entries(&packages.join("nvidia")).into_iter().map(|package| package.join("lib")).collect()
}

/// Entries of a folder, sorted; none if it cannot be read.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    paths.sort();
    paths
}
