//! Named sources of the motion of rendered persons, and their files in the folder of real data.

use super::readers;
use super::split;
use super::take::CapturedTake;
use crate::demo::people::folder::SetPart;
use anyhow::{Context, Result, ensure};
use orator_formats::bvh::read::Bvh;
use orator_formats::search;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::str::FromStr;

/// Files relative to the data folder.
const CMU: &str = "mocap/cmu_gestures_joints38_mm.npz";
const BANDAI: &str = "mocap/bandai_namco_bvh.tar.xz";
const BEAT: &str = "speech_motion/beat2_2_scott_0_1_1_smplx30fps.npz";
const TED: &str = "speech_motion/ted_expressive";
/// Share of the talk between its two parts that belongs to neither.
const TALK_GAP: f64 = 0.06;

/// Source of the motion of rendered persons.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MotionSource {
    /// The procedural gestures of this program.
    Generated,
    /// CMU takes: basketball and its signals, directing traffic, washing a window; no fingers.
    Cmu,
    /// Bandai-Namco styles: raising and waving hands; no fingers.
    Bandai,
    /// A talk of BEAT2 with fingers.
    Beat,
    /// Upper bodies of TED speakers with fingers, estimated from videos.
    Ted,
    /// Motion files; the body has the bone lengths of the motion, trunk and head are generated.
    Files(PathBuf),
}

impl MotionSource {
    /// The captured sources.
    pub const CAPTURED: [Self; 4] = [Self::Cmu, Self::Bandai, Self::Beat, Self::Ted];

    /// Name on the command line, in lists of clips and in tables.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Generated => "generated",
            Self::Cmu => "cmu",
            Self::Bandai => "bandai",
            Self::Beat => "beat2",
            Self::Ted => "ted",
            Self::Files(_) => "files",
        }
    }

    /// Takes of a part of the captured sources, read from the data folder; none for other sources.
    ///
    /// # Errors
    /// A file that is missing or of another kind.
    pub fn takes(&self, data: &Path, part: SetPart) -> Result<Vec<CapturedTake>> {
        let is_wanted = |name: &str| split::is_in(self, part, name);
        match self {
            Self::Generated | Self::Files(_) => Ok(Vec::new()),
            Self::Cmu => readers::cmu(&data.join(CMU), is_wanted),
            Self::Bandai => {
                let texts = archived(&data.join(BANDAI), is_wanted)?;
                let read = |(name, text): &(String, String)| {
                    readers::bvh(name, &Bvh::parse(text).with_context(|| format!("invalid BVH file {name}"))?)
                };
                Ok(texts.iter().map(read).collect::<Result<Vec<_>>>()?.concat())
            }
            Self::Beat => {
                let takes = readers::smplx("talk", &data.join(BEAT))?;
                let parts = takes.iter().flat_map(halves).enumerate();
                let named = parts.map(|(k, take)| CapturedTake { name: format!("talk#{k}"), ..take });
                Ok(named.filter(|take| is_wanted(&take.name)).collect())
            }
            Self::Ted => {
                let files = search::below(&data.join(TED), &["npz"])?;
                let named = files.iter().map(|file| (file.file_stem().unwrap_or_default().to_string_lossy(), file));
                let takes = named.filter(|(name, _)| is_wanted(name)).map(|(name, file)| readers::ted(&name, file));
                Ok(takes.collect::<Result<Vec<_>>>()?.concat())
            }
        }
    }
}

/// Parses a name, or the path of a motion file or folder.
impl FromStr for MotionSource {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut named = [Self::Generated].into_iter().chain(Self::CAPTURED);
        if let Some(source) = named.find(|source| source.name() == text) {
            return Ok(source);
        }
        if Path::new(text).exists() {
            return Ok(Self::Files(PathBuf::from(text)));
        }
        let known: Vec<&str> = Self::CAPTURED.iter().map(Self::name).collect();
        Err(format!("unknown source of motion `{text}`: expected generated, {} or an existing path", known.join(", ")))
    }
}

/// The data folder: `data` in the folder named by `ORATOR_DATA`.
///
/// # Errors
/// The variable is not set.
pub fn data_folder() -> Result<PathBuf> {
    let folder = std::env::var_os("ORATOR_DATA").filter(|folder| !folder.is_empty());
    let folder = folder.context("captured motion needs ORATOR_DATA: set it to the folder that contains data/mocap")?;
    Ok(Path::new(&folder).join("data"))
}

/// First and second half of a take, with a gap between them.
fn halves(take: &CapturedTake) -> [CapturedTake; 2] {
    let n = take.frames.len();
    let half = (n as f64 * (1.0 - TALK_GAP) / 2.0) as usize;
    [&take.frames[..half], &take.frames[n - half..]]
        .map(|frames| CapturedTake { frames: frames.to_vec(), ..take.clone() })
}

/// Names (without ending) and texts of the wanted BVH files of a `.tar.xz` archive, sorted by name.
fn archived(path: &Path, is_wanted: impl Fn(&str) -> bool) -> Result<Vec<(String, String)>> {
    ensure!(path.is_file(), "cannot find {}: expected an archive of BVH files", path.display());
    let unpacked = Command::new("xz").arg("-dc").arg(path).stdin(Stdio::null()).stdout(Stdio::piped()).spawn();
    let mut unpacked = unpacked.context("cannot run `xz`, which unpacks .tar.xz: install xz-utils")?;
    let output = unpacked.stdout.take().context("the output of `xz` is missing")?;
    let mut archive = tar::Archive::new(output);
    let mut texts = Vec::new();
    for entry in archive.entries().with_context(|| format!("cannot read {}", path.display()))? {
        let mut entry = entry.with_context(|| format!("cannot read {}", path.display()))?;
        let name = entry.path()?.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let Some(name) = name.strip_suffix(".bvh").filter(|name| is_wanted(name)) else { continue };
        let mut text = String::new();
        entry.read_to_string(&mut text).with_context(|| format!("cannot read {name} in {}", path.display()))?;
        texts.push((name.to_owned(), text));
    }
    ensure!(unpacked.wait()?.success(), "{} is damaged: `xz` failed", path.display());
    texts.sort();
    Ok(texts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_parsed_by_name_or_path() {
        assert_eq!("beat2".parse(), Ok(MotionSource::Beat));
        assert_eq!("generated".parse(), Ok(MotionSource::Generated));
        let dir = tempfile::tempdir().unwrap();
        let text = dir.path().to_str().unwrap();
        assert_eq!(text.parse(), Ok(MotionSource::Files(dir.path().to_owned())));
        let error = "dance".parse::<MotionSource>().unwrap_err();
        assert!(error.contains("`dance`") && error.contains("cmu, bandai, beat2, ted"), "{error}");
    }
}
