//! Landlock: files are read and written as the rules say, TCP and signals to other processes end at the process.

use super::FileAccess;
use landlock::{
    ABI, Access, AccessFs, AccessNet, BitFlags, CompatLevel, Compatible, LandlockStatus, Ruleset, RulesetAttr,
    RulesetCreatedAttr, RulesetError, RulesetStatus, Scope, make_bitflags, path_beneath_rules,
};
use std::path::PathBuf;

/// Libraries and data of the system, and what the C library and ONNX Runtime ask about the machine.
const SYSTEM: [&str; 10] = [
    "/usr",
    "/lib",
    "/lib64",
    "/etc/ld.so.cache",
    "/etc/localtime",
    "/proc/self",
    "/proc/cpuinfo",
    "/proc/meminfo",
    "/sys/devices/system",
    "/sys/fs/cgroup",
];

/// Reading; no program is executed.
const READ: BitFlags<AccessFs> = make_bitflags!(AccessFs::{ReadFile | ReadDir});
/// Writing of files and folders alone: a link or a pipe could lead whoever reads them astray.
const WRITE: BitFlags<AccessFs> = make_bitflags!(AccessFs::{
    ReadFile | ReadDir | WriteFile | Truncate | MakeReg | MakeDir | RemoveFile | RemoveDir
});

/// Restricts this thread and those it starts. Gives the version enforced, or why there is none.
pub(crate) fn restrict(access: &FileAccess) -> Result<String, String> {
    let status = enforce(access).map_err(|error| format!("Landlock: {error}"))?;
    let abi = match status.landlock {
        LandlockStatus::NotImplemented => {
            return Err("this kernel has no Landlock (Linux 5.13 has it)".to_owned());
        }
        LandlockStatus::NotEnabled => {
            return Err("Landlock is not enabled in this kernel (boot parameter lsm=landlock,...)".to_owned());
        }
        LandlockStatus::Available { effective_abi, .. } => effective_abi as i32,
    };
    match status.ruleset {
        RulesetStatus::NotEnforced => {
            Err(format!("Landlock ABI {abi} cannot let files move between folders (Linux 5.19)"))
        }
        RulesetStatus::FullyEnforced | RulesetStatus::PartiallyEnforced => Ok(format!("Landlock ABI {abi}")),
    }
}

fn enforce(access: &FileAccess) -> Result<landlock::RestrictionStatus, RulesetError> {
    let abi = ABI::V7;
    let (reads, moves): (Vec<PathBuf>, BitFlags<AccessFs>) = match &access.reads {
        Some(reads) => (SYSTEM.iter().map(PathBuf::from).chain(reads.iter().cloned()).collect(), BitFlags::EMPTY),
        // A process that reads everything moves finished files between its folders too.
        None => (vec!["/".into()], AccessFs::Refer.into()),
    };
    let mut ruleset = Ruleset::default();
    if !moves.is_empty() {
        // The first kernels with Landlock refuse every such move: no Landlock is better there.
        ruleset = ruleset.set_compatibility(CompatLevel::SoftRequirement).handle_access(moves)?;
        ruleset = ruleset.set_compatibility(CompatLevel::BestEffort);
    }
    let links = reads.iter().flat_map(linked_files).collect::<Vec<_>>();
    ruleset
        .handle_access(AccessFs::from_all(abi))?
        .handle_access(AccessNet::from_all(abi))?
        .scope(Scope::from_all(abi))?
        .create()?
        .add_rules(path_beneath_rules(reads.iter().chain(&links), READ))?
        .add_rules(path_beneath_rules(["/dev/null"], make_bitflags!(AccessFs::{ReadFile | WriteFile})))?
        .add_rules(path_beneath_rules(["/dev/urandom"], AccessFs::ReadFile))?
        .add_rules(path_beneath_rules(&access.writes, WRITE | moves))?
        .restrict_self()
}

/// The symbolic links of a folder, which may lead out of it.
fn linked_files(folder: &PathBuf) -> Vec<PathBuf> {
    if folder.parent().is_none() || SYSTEM.iter().any(|system| folder.as_os_str() == *system) {
        return Vec::new();
    }
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_symlink())).map(|entry| entry.path()).collect()
}
