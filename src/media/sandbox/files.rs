//! Landlock rules: files can be read and written only as `FileAccess` states; TCP and signals to others are blocked.

use super::FileAccess;
use landlock::{
    ABI, Access, AccessFs, AccessNet, BitFlags, CompatLevel, Compatible, LandlockStatus, Ruleset, RulesetAttr,
    RulesetCreatedAttr, RulesetError, RulesetStatus, Scope, make_bitflags, path_beneath_rules,
};
use std::path::PathBuf;

/// System libraries and data, and the files from which the C library and ONNX Runtime query the machine.
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

/// Read access, without execution.
const READ: BitFlags<AccessFs> = make_bitflags!(AccessFs::{ReadFile | ReadDir});
/// Write access to regular files and folders only: a link or a pipe could mislead a later reader.
const WRITE: BitFlags<AccessFs> = make_bitflags!(AccessFs::{
    ReadFile | ReadDir | WriteFile | Truncate | MakeReg | MakeDir | RemoveFile | RemoveDir
});

/// Restricts this thread and the threads that it starts. Returns the Landlock version enforced, or why it is not.
pub(crate) fn restrict(access: &FileAccess) -> Result<String, String> {
    let status = enforce(access).map_err(|error| format!("Landlock: {error}"))?;
    let abi = match status.landlock {
        LandlockStatus::NotImplemented => {
            return Err("this kernel does not support Landlock (requires Linux 5.13)".to_owned());
        }
        LandlockStatus::NotEnabled => {
            return Err("Landlock is not enabled in this kernel (boot parameter lsm=landlock,...)".to_owned());
        }
        LandlockStatus::Available { effective_abi, .. } => effective_abi as i32,
    };
    match status.ruleset {
        RulesetStatus::NotEnforced => {
            Err(format!("Landlock ABI {abi} cannot move files between folders (requires Linux 5.19)"))
        }
        RulesetStatus::FullyEnforced | RulesetStatus::PartiallyEnforced => Ok(format!("Landlock ABI {abi}")),
    }
}

fn enforce(access: &FileAccess) -> Result<landlock::RestrictionStatus, RulesetError> {
    let abi = ABI::V7;
    let (reads, moves): (Vec<PathBuf>, BitFlags<AccessFs>) = match &access.reads {
        Some(reads) => (SYSTEM.iter().map(PathBuf::from).chain(reads.iter().cloned()).collect(), BitFlags::EMPTY),
        // A process with full read access may also move finished files between its folders.
        None => (vec!["/".into()], AccessFs::Refer.into()),
    };
    let mut ruleset = Ruleset::default();
    if !moves.is_empty() {
        // The first Landlock version blocks every such move, so Landlock is not used there.
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

/// The symbolic links in a folder, which may point outside it.
fn linked_files(folder: &PathBuf) -> Vec<PathBuf> {
    if folder.parent().is_none() || SYSTEM.iter().any(|system| folder.as_os_str() == *system) {
        return Vec::new();
    }
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_symlink())).map(|entry| entry.path()).collect()
}
