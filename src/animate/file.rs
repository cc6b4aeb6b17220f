//! A motion file of any kind we write, chosen by its name's extension, put in its place atomically.

use super::{bvh, video};
use crate::motion::{authors_txt, npy};
use crate::stage::progress::Progress;
use crate::stage::workdir;
use crate::types::{pose3d::Motion, sound::Sound};
use std::path::Path;

/// What a motion can be written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Joints [T, 49, 3] f32.
    Npy,
    /// The layout of Rebol et al. 2021.
    AuthorsTxt,
    /// Bone rotations of the whole figure.
    Bvh,
    /// A film of the figure with the sound.
    Mp4,
}

impl Format {
    /// The format of a file by its extension, upper or lower case.
    pub fn of(path: &Path) -> anyhow::Result<Self> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match extension.as_str() {
            "npy" => Ok(Self::Npy),
            "txt" => Ok(Self::AuthorsTxt),
            "bvh" => Ok(Self::Bvh),
            "mp4" => Ok(Self::Mp4),
            _ => anyhow::bail!(
                "{}: motion is written as .npy (joints), .txt (the authors' layout), .bvh or .mp4; \
                 give the file one of these endings",
                path.display()
            ),
        }
    }

    /// Writes the motion; only a film has use for the sound.
    pub fn write(
        self,
        path: &Path,
        motion: &Motion,
        sound: Option<&Sound>,
        progress: &dyn Progress,
    ) -> anyhow::Result<()> {
        match self {
            Self::Npy => workdir::replace(path, |attempt| npy::write(attempt, motion)),
            Self::AuthorsTxt => workdir::write_file(path, authors_txt::format(motion).as_bytes()),
            Self::Bvh => workdir::write_file(path, bvh::text(motion).as_bytes()),
            Self::Mp4 => workdir::replace(path, |attempt| video::write(attempt, motion, sound, progress)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_chooses() {
        assert_eq!(Format::of(Path::new("a/b.BVH")).unwrap(), Format::Bvh);
        assert_eq!(Format::of(Path::new("a.b/c.npy")).unwrap(), Format::Npy);
        for wrong in ["a.mov", "mp4", "a", ""] {
            assert!(Format::of(Path::new(wrong)).unwrap_err().to_string().contains(".bvh or .mp4"));
        }
    }
}
