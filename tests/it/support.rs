//! Input that the project makes itself, for tests of more than one room.

use orator::demo::folder::{self, Plan};
use orator::stage::progress::Silent;
use orator::types::time::FrameRate;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Draws one clip of the synthetic speaker, 640x480 at 15 frames a second with sound, and all that `orator demo draw`
/// puts beside it (truth, marker models, pipeline.toml), into `dir`; gives the video. About 0.2 s a second of clip.
pub fn speaker_clip(dir: &Path, secs: f64, seed: u64) -> PathBuf {
    let plan = Plan { n_videos: 1, secs, fps: FrameRate::new(15, 1), size: [640, 480], seed };
    folder::draw(dir, &plan, &Silent).unwrap().remove(0)
}

/// A project folder of its own with clips of the synthetic speaker, worked on by the program itself.
pub struct Project {
    dir: tempfile::TempDir,
}

/// How the program ended: exit code, its JSON, and what it said on standard error.
pub struct Answer {
    pub code: i32,
    pub json: serde_json::Value,
    pub errors: String,
}

impl Project {
    /// `n_clips` clips of `secs` seconds; none: only the configuration and an empty video folder.
    pub fn with_clips(name: &str, n_clips: usize, secs: f64) -> Self {
        let dir = tempfile::Builder::new().prefix(&format!("orator-{name}-")).tempdir().unwrap();
        let project = Self { dir };
        std::fs::create_dir_all(project.video("")).unwrap();
        let folder = project.dir().to_string_lossy().into_owned();
        let (n, secs) = (n_clips.max(1).to_string(), secs.max(1.0).to_string());
        let drawn = project.answer(&["demo", "draw", &folder, "--videos", &n, "--secs", &secs]);
        assert_eq!(drawn.code, 0, "{}", drawn.errors);
        if n_clips == 0 {
            project.clips().iter().for_each(|clip| std::fs::remove_file(clip).unwrap());
        }
        project
    }

    pub fn dir(&self) -> &Path {
        self.dir.path()
    }

    pub fn work(&self) -> PathBuf {
        self.dir().join("work")
    }

    /// Where a video of that name belongs.
    pub fn video(&self, name: &str) -> PathBuf {
        self.dir().join("videos/host").join(name)
    }

    /// The clips there are, sorted.
    pub fn clips(&self) -> Vec<PathBuf> {
        let mut clips: Vec<PathBuf> =
            std::fs::read_dir(self.video("")).unwrap().map(|entry| entry.unwrap().path()).collect();
        clips.sort();
        clips
    }

    /// Writes other entries into the `videos` of the configuration.
    pub fn name_videos(&self, entries: &[&str]) {
        let file = self.dir().join("pipeline.toml");
        let text = std::fs::read_to_string(&file).unwrap();
        let renamed =
            |line: &str| if line.starts_with("videos") { format!("videos = {entries:?}") } else { line.to_owned() };
        std::fs::write(&file, text.lines().map(renamed).collect::<Vec<_>>().join("\n")).unwrap();
    }

    /// `orator run` in the project's folder.
    pub fn run(&self, args: &[&str]) -> Answer {
        self.answer(&[&["run"], args].concat())
    }

    /// Any verb in the project's folder, to its end.
    pub fn answer(&self, args: &[&str]) -> Answer {
        let output = self.command(args).output().unwrap();
        let json = serde_json::from_slice(&output.stdout).unwrap_or_default();
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        Answer { code: output.status.code().unwrap_or(-1), json, errors }
    }

    /// Starts a verb without waiting.
    pub fn start(&self, args: &[&str]) -> Child {
        self.command(args).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
        command.current_dir(self.dir()).arg("--json").args(args).stdin(Stdio::null());
        command
    }
}

/// Every file under `folder` by its name relative to it.
pub fn files_under(folder: &Path) -> Vec<(String, PathBuf)> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(&next).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else {
                files.push((path.strip_prefix(folder).unwrap().to_string_lossy().into_owned(), path));
            }
        }
    }
    files.sort();
    files
}

/// A file or folder of the shared real data; `None`, with a loud line, where it is absent.
pub fn shared(path: &str) -> Option<PathBuf> {
    let found = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(path).canonicalize().ok();
    if found.is_none() {
        eprintln!("SKIPPED: ../shared/{path} is not there");
    }
    found
}
