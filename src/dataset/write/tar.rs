//! Tar shards with reproducible bytes (ustar, no times, no owners). A sample is never divided between shards; its
//! location and hash are recorded while writing.

use crate::index::{ByteRange, SampleRef, ShardRef};
use crate::sample::{EXTENSIONS, OPTIONAL_EXTENSIONS, Sample};
use crate::split::Split;
use anyhow::{Context, Result};
use orator_base::types::file_name::FileName;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

const BLOCK: usize = 512;

/// Writer of a video's samples into the shards `<split>-<video>-0000.tar`, `<split>-<video>-0001.tar`, ... of a folder.
pub struct ShardWriter {
    dir: PathBuf,
    video: String,
    split: Split,
    max_bytes: u64,
    open: Option<OpenShard>,
    shards: Vec<ShardRef>,
    samples: Vec<SampleRef>,
}

struct OpenShard {
    file: BufWriter<File>,
    hasher: blake3::Hasher,
    bytes: u64,
    n_samples: usize,
}

impl ShardWriter {
    /// Creates a writer that closes a shard before it would exceed `max_bytes`; a larger sample gets its own shard.
    pub fn new(dir: &Path, video: &str, split: Split, max_bytes: u64) -> Self {
        let (dir, video) = (dir.to_owned(), video.to_owned());
        Self { dir, video, split, max_bytes, open: None, shards: Vec::new(), samples: Vec::new() }
    }

    fn file_name(&self) -> Result<FileName> {
        Ok(FileName::new(format!("{}-{}-{:04}.tar", self.split.name(), self.video, self.shards.len()))?)
    }

    /// Appends a sample with `members` as the bytes of its required members; the optional ones are encoded here.
    pub fn push_members(&mut self, sample: &Sample, members: &[Vec<u8>; 5]) -> Result<()> {
        let optional = sample.optional_members()?;
        let members = members.iter().map(Some).chain(optional.iter().map(Option::as_ref));
        let bytes: usize = members.clone().flatten().map(|m| BLOCK + m.len().next_multiple_of(BLOCK)).sum();
        if self.open.as_ref().is_some_and(|open| open.bytes + (bytes + 2 * BLOCK) as u64 > self.max_bytes) {
            self.close()?;
        }
        let shard = self.file_name()?;
        let path = self.dir.join(&shard);
        let open = match &mut self.open {
            Some(open) => open,
            None => {
                let file = File::create(&path).with_context(|| format!("cannot create {}", path.display()))?;
                let file = BufWriter::with_capacity(1 << 20, file);
                self.open.insert(OpenShard { file, hasher: blake3::Hasher::new(), bytes: 0, n_samples: 0 })
            }
        };
        let offset = open.bytes;
        let mut hasher = blake3::Hasher::new();
        let mut ranges = [None; EXTENSIONS.len() + OPTIONAL_EXTENSIONS.len()];
        let named = EXTENSIONS.iter().chain(&OPTIONAL_EXTENSIONS).zip(members);
        for (range, (extension, member)) in ranges.iter_mut().zip(named) {
            let Some(member) = member else { continue };
            let header = header(&format!("{}.{extension}", sample.key), member.len())?;
            let padding = [0; BLOCK];
            let padding = &padding[..member.len().next_multiple_of(BLOCK) - member.len()];
            *range = Some(ByteRange { offset: open.bytes + BLOCK as u64, size: member.len() as u64 });
            for chunk in [header.as_bytes().as_slice(), member, padding] {
                hasher.update(chunk);
                open.push(chunk).with_context(|| format!("cannot write {}", path.display()))?;
            }
        }
        open.n_samples += 1;
        let [json, mask, pose2d, pose3d, wav, words, head, trunk, interlocutor] = ranges;
        let [json, mask, pose2d, pose3d, wav] = [json, mask, pose2d, pose3d, wav].map(Option::unwrap_or_default);
        self.samples.push(SampleRef {
            key: FileName::new(&*sample.key)?,
            split: self.split,
            shard,
            offset,
            size: bytes as u64,
            n_frames: sample.n_frames(),
            blake3: hasher.finalize().to_hex().to_string(),
            json,
            mask,
            pose2d,
            pose3d,
            wav,
            words,
            head,
            trunk,
            interlocutor,
        });
        Ok(())
    }

    fn close(&mut self) -> Result<()> {
        let Some(mut open) = self.open.take() else { return Ok(()) };
        let file = self.file_name()?;
        let written =
            open.push(&[0; 2 * BLOCK]).and_then(|()| open.file.into_inner().map_err(|error| error.into_error()));
        let shard = written.with_context(|| format!("cannot write {}", self.dir.join(&file).display()))?;
        // All files are synced again when the folder is put in place; this thread only starts the disk writes early.
        drop(std::thread::spawn(move || shard.sync_all()));
        self.shards.push(ShardRef {
            file,
            bytes: open.bytes,
            n_samples: open.n_samples,
            blake3: open.hasher.finalize().to_hex().to_string(),
        });
        Ok(())
    }

    /// Closes the last shard; returns all shards and samples in order.
    pub fn finish(mut self) -> Result<(Vec<ShardRef>, Vec<SampleRef>)> {
        self.close()?;
        Ok((self.shards, self.samples))
    }
}

impl OpenShard {
    fn push(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.file.write_all(bytes)?;
        self.hasher.update(bytes);
        self.bytes += bytes.len() as u64;
        Ok(())
    }
}

/// Ustar header of a member: mode 0644, no owner, no time.
fn header(name: &str, size: usize) -> Result<tar::Header> {
    let mut header = tar::Header::new_ustar();
    header.set_path(name).with_context(|| format!("`{name}` does not fit a tar header"))?;
    header.set_size(size as u64);
    header.set_mode(0o644);
    header.set_uid(0);
    header.set_gid(0);
    header.set_mtime(0);
    header.set_cksum();
    Ok(header)
}
