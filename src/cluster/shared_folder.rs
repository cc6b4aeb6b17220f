//! Operations on the folder that workers on many machines share: create a file once, read, list and replace. No locks
//! are used, so that NFS with its caches is sufficient.

use anyhow::{Context, Result};
use orator_base::stage::workdir;
use rustix::io::Errno;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

/// A folder of small files that is visible to several machines. Names use `/` as separator.
pub trait SharedFolder {
    /// Creates the file with these bytes; returns `false` if the name exists. If several callers try, one succeeds. The
    /// bytes must be unique to the caller.
    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool>;
    /// The bytes of a file, possibly outdated; `None` if the file does not exist or is not visible yet. Anything other
    /// than a readable file (a folder, a pipe, a dangling link) is read as empty.
    fn read(&self, name: &str) -> Result<Option<Vec<u8>>>;
    /// Names of the files of a folder, possibly without the newest; entries other than regular files end in `/`.
    fn list(&self, folder: &str) -> Result<Vec<String>>;
    /// Replaces a file that only this worker writes.
    fn replace(&self, name: &str, bytes: &[u8]) -> Result<()>;
}

#[derive(Clone, Debug)]
pub struct DiskFolder(pub PathBuf);

impl SharedFolder for DiskFolder {
    /// Hard-links a complete file, which every network file system does atomically.
    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let path = self.0.join(name);
        let folder = path.parent().context("the file has no parent folder")?;
        fs::create_dir_all(folder).with_context(|| format!("cannot write to {}", folder.display()))?;
        let token = blake3::hash(bytes).to_hex();
        let draft =
            folder.join(format!(".{}-{}-{}", &token[..16], std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed)));
        let written = fs::File::create_new(&draft).and_then(|mut file| {
            file.write_all(bytes)?;
            file.sync_all()
        });
        let linked = written.and_then(|()| fs::hard_link(&draft, &path));
        let removed = fs::remove_file(&draft);
        match linked {
            Ok(()) => {
                removed.with_context(|| format!("cannot remove {}", draft.display()))?;
                Ok(true)
            }
            // If the reply to a link request was lost, the system repeats the request and finds the link already there.
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(self.read(name)?.as_deref() == Some(bytes)),
            Err(error) => Err(workdir::full_disk(error.into()))
                .with_context(|| format!("cannot link {}: workers need a file system with hard links", path.display())),
        }
    }

    fn read(&self, name: &str) -> Result<Option<Vec<u8>>> {
        let path = self.0.join(name);
        match workdir::read_file(&path) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if is_gone(&error) && !path.is_symlink() => Ok(None),
            Err(error) if is_gone(&error) || is_not_regular(&error) => Ok(Some(Vec::new())),
            // A live worker of another user wrote it: this is no foreign file, and must not be removed.
            Err(error) if error.kind() == ErrorKind::PermissionDenied => Err(error).with_context(|| {
                format!(
                    "cannot read {}: the workers of a plan need a common group and a umask such as 002",
                    path.display()
                )
            }),
            Err(error) => Err(error).with_context(|| format!("cannot read {}", path.display())),
        }
    }

    fn list(&self, folder: &str) -> Result<Vec<String>> {
        let path = self.0.join(folder);
        let entries = match fs::read_dir(&path) {
            Ok(entries) => entries,
            Err(error) if is_gone(&error) => return Ok(Vec::new()),
            Err(error) => return Err(error).with_context(|| format!("cannot list {}", path.display())),
        };
        let name = |entry: fs::DirEntry| {
            let name = entry.file_name().into_string().ok().filter(|name| !name.starts_with('.'))?;
            let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
            Some(if is_file { name } else { name + "/" })
        };
        Ok(entries.filter_map(|entry| name(entry.ok()?)).collect())
    }

    fn replace(&self, name: &str, bytes: &[u8]) -> Result<()> {
        workdir::write_file(&self.0.join(name), bytes)
    }
}

/// The file does not exist, or was removed on another machine while this one had it open.
fn is_gone(error: &std::io::Error) -> bool {
    error.kind() == ErrorKind::NotFound || error.kind() == ErrorKind::StaleNetworkFileHandle
}

/// The name belongs to a folder, a pipe, a socket, or a cycle of links.
fn is_not_regular(error: &std::io::Error) -> bool {
    let is_other = |errno: Errno| error.raw_os_error() == Some(errno.raw_os_error());
    let kinds = [ErrorKind::IsADirectory, ErrorKind::InvalidInput];
    kinds.contains(&error.kind()) || is_other(Errno::NXIO) || is_other(Errno::LOOP)
}
