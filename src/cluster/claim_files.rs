//! The files of claims: their names, and what stands in them.

use super::shared_folder::SharedFolder;
use anyhow::Result;
use serde::{Deserialize, Serialize};

/// Units whose files share a folder: a listing stays short.
pub const PER_FOLDER: usize = 1000;

/// Folder of the files of so many units.
pub fn folder_name(folder: usize) -> String {
    format!("claims/{folder:04}")
}

/// A unit in a worker's hands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Claim {
    /// Its number in the plan.
    pub unit: usize,
    /// 1; more where others had it before.
    pub epoch: u32,
}

impl Claim {
    /// The claim of who takes the unit over.
    pub fn later(self) -> Self {
        Self { epoch: self.epoch + 1, ..self }
    }

    /// Its file of a kind: `claim` or `end`.
    pub fn file(self, kind: &str) -> String {
        let Self { unit, epoch } = self;
        format!("{}/{unit:06}.{kind}.{epoch:04}", folder_name(unit / PER_FOLDER))
    }

    /// The worker that made it; `None`: it is not seen yet.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read_owner(self, folder: &impl SharedFolder) -> Result<Option<String>> {
        let bytes = folder.read(&self.file("claim"))?;
        let claim: Option<ClaimFile> = bytes.and_then(|bytes| serde_json::from_slice(&bytes).ok());
        Ok(claim.map(|claim| claim.worker))
    }

    /// How the unit ended under it; `None`: it has not, as far as is seen.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read_end(self, folder: &impl SharedFolder) -> Result<Option<UnitEnd>> {
        let bytes = folder.read(&self.file("end"))?;
        Ok(bytes.and_then(|bytes| serde_json::from_slice(&bytes).ok()))
    }
}

/// What stands in a claim.
#[derive(Serialize, Deserialize)]
pub struct ClaimFile {
    /// Who has the unit.
    pub worker: String,
    /// Its number in the plan.
    pub unit: usize,
    /// As in [`Claim`].
    pub epoch: u32,
}

/// How a unit ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnitEnd {
    /// Who worked on it.
    pub worker: String,
    /// Why it failed; none: it is done.
    pub error: Option<String>,
    /// Seconds of work.
    pub secs: f64,
}

/// Unit, whether it is an end, and epoch, of the name of a file in its folder; none: another file.
pub fn parsed(name: &str) -> Option<(usize, bool, u32)> {
    let mut parts = name.split('.');
    let (unit, kind, epoch) = (parts.next()?, parts.next()?, parts.next()?);
    let is_end = match kind {
        "end" => true,
        "claim" => false,
        _ => return None,
    };
    Some((unit.parse().ok()?, is_end, epoch.parse().ok()?)).filter(|_| parts.next().is_none())
}
