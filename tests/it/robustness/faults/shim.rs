//! The preloaded library that makes one call fail, built by the C compiler that Rust links with.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const SOURCE: &str = include_str!("shim.c");
/// Bytes of the counters that the shim shares between processes.
const STATE_BYTES: usize = 65_536 * 4;

/// What happens at a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// EIO: the device is broken.
    InputOutput,
    /// ENOSPC: the disk is full.
    NoSpace,
    /// The program is killed, with all its processes.
    Kill,
}

impl Fault {
    fn number(self) -> &'static str {
        match self {
            Self::Kill => "0",
            Self::InputOutput => "5",
            Self::NoSpace => "28",
        }
    }
}

/// A call of the program: its call site, the how manieth of it (from 1), what it does to which file.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Call {
    pub site: String,
    pub nth: usize,
    pub operation: String,
    /// Relative to the watched folder.
    pub path: String,
}

/// The compiled library.
pub struct Shim {
    folder: tempfile::TempDir,
}

impl Shim {
    /// None: no C compiler.
    pub fn build() -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("shim.c"), SOURCE).unwrap();
        let mut cc = Command::new("cc");
        cc.args(["-shared", "-fPIC", "-O1", "-o", "shim.so", "shim.c", "-ldl"]).current_dir(folder.path());
        let built = cc.status().ok()?;
        assert!(built.success(), "the shim does not compile");
        Some(Self { folder })
    }

    /// Runs the program in `dir` and lists its calls beneath it, in their order.
    pub fn calls(&self, dir: &Path, args: &[&str]) -> (Output, Vec<Call>) {
        let log = dir.with_extension("log");
        let mut command = self.command(dir, args);
        command.env("FAULT_LOG", &log);
        let output = command.output().unwrap();
        let text = std::fs::read_to_string(&log).unwrap_or_default();
        let _ = std::fs::remove_file(log);
        let mut counts = BTreeMap::new();
        let calls = text.lines().filter_map(|line| {
            let (site, rest) = line.split_once(' ')?;
            let (operation, path) = rest.split_once(' ')?;
            let nth = counts.entry(site.to_owned()).or_insert(0_usize);
            *nth += 1;
            let path = path.strip_prefix(dir.to_str()?)?.trim_start_matches('/').to_owned();
            Some(Call { site: site.to_owned(), nth: *nth, operation: operation.to_owned(), path })
        });
        let calls = calls.collect();
        (output, calls)
    }

    /// Runs the program in `dir` with a fault at a call; also says whether the call was reached.
    pub fn run(&self, dir: &Path, args: &[&str], call: &Call, fault: Fault) -> (Output, bool) {
        let mut command = self.command(dir, args);
        command.envs([("FAULT_SITE", call.site.as_str()), ("FAULT_ACTION", fault.number())]);
        let output = command.env("FAULT_NTH", call.nth.to_string()).output().unwrap();
        let at = usize::from_str_radix(&call.site, 16).unwrap();
        let counts = std::fs::read(state(dir)).unwrap();
        let count = u32::from_le_bytes(counts[4 * at..4 * at + 4].try_into().unwrap());
        (output, count as usize >= call.nth)
    }

    fn command(&self, dir: &Path, args: &[&str]) -> Command {
        use std::os::unix::process::CommandExt as _;
        std::fs::write(state(dir), vec![0; STATE_BYTES]).unwrap();
        let mut command = orator(dir, args);
        command.env("LD_PRELOAD", self.folder.path().join("shim.so")).env("FAULT_ROOT", dir);
        command.env("FAULT_STATE", state(dir)).process_group(0);
        command
    }
}

/// The program in the folder `dir`, on one worker.
pub fn orator(dir: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(args).current_dir(dir).env("RAYON_NUM_THREADS", "1");
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn state(dir: &Path) -> PathBuf {
    dir.with_extension("state")
}
