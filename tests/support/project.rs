//! A temporary project folder for a test, with clips of the drawn speaker, in which the program is run.

use crate::drawn::folder::{self, DemoPlan};
use orator_base::stage::progress::Silent;
use orator_base::types::time::FrameRate;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Draws one clip of the synthetic speaker, 640x480 at 15 fps with audio, into `dir`, with the other files that
/// `orator-lab demo draw` writes (ground truth, marker models, pipeline.toml). Returns the video. Takes about 0.2 s
/// per second of video.
pub fn speaker_clip(dir: &Path, secs: f64, seed: u64) -> PathBuf {
    let plan = DemoPlan { n_videos: 1, secs, fps: FrameRate::new(15, 1), size: [640, 480], seed };
    folder::draw(dir, &plan, &Silent).unwrap().remove(0)
}

/// Path of a built program, located relative to the running test.
///
/// # Panics
/// If it is not built: `cargo test -p PACKAGE` builds only the programs of that package.
pub fn program(name: &str) -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let program = test.ancestors().nth(2).unwrap().join(name);
    assert!(program.is_file(), "{} is not built; run `cargo build --workspace` first", program.display());
    program
}

/// A temporary project folder with clips of the synthetic speaker, processed by the program itself.
pub struct Project {
    dir: tempfile::TempDir,
}

/// Result of the program: exit code, JSON from standard output, and standard error.
pub struct ProgramAnswer {
    pub code: i32,
    pub json: serde_json::Value,
    pub errors: String,
}

impl Project {
    /// Creates a project with `n_clips` clips of `secs` seconds; with 0, only the configuration and an empty video
    /// folder.
    pub fn with_clips(name: &str, n_clips: usize, secs: f64) -> Self {
        let plan = DemoPlan { n_videos: n_clips.max(1), secs: secs.max(1.0), ..DemoPlan::default() };
        let project = Self::drawn(name, &plan);
        if n_clips == 0 {
            project.clips().iter().for_each(|clip| std::fs::remove_file(clip).unwrap());
        }
        project
    }

    /// Creates a project with clips as `plan` describes.
    pub fn drawn(name: &str, plan: &DemoPlan) -> Self {
        let dir = tempfile::Builder::new().prefix(&format!("orator-{name}-")).tempdir().unwrap();
        folder::draw(dir.path(), plan, &Silent).unwrap();
        Self { dir }
    }

    /// Path of an output file of a stage, for the video with the file name `stem`.
    pub fn written(&self, stage: &str, stem: &str, file: &str) -> PathBuf {
        let videos =
            std::fs::read_dir(self.work().join(stage).join("host")).unwrap().map(|entry| entry.unwrap().path());
        let matches_stem = |path: &PathBuf| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            path.is_dir() && name.rsplit_once('-').is_some_and(|(slug, _)| slug == stem)
        };
        videos.into_iter().find(matches_stem).expect(stem).join(file)
    }

    pub fn dir(&self) -> &Path {
        self.dir.path()
    }

    pub fn work(&self) -> PathBuf {
        self.dir().join("work")
    }

    /// Path of the video `name`.
    pub fn video(&self, name: &str) -> PathBuf {
        self.dir().join("videos/host").join(name)
    }

    /// Paths of the clips, sorted.
    pub fn clips(&self) -> Vec<PathBuf> {
        let mut clips: Vec<PathBuf> =
            std::fs::read_dir(self.video("")).unwrap().map(|entry| entry.unwrap().path()).collect();
        clips.sort();
        clips
    }

    /// Replaces the `videos` entries of the configuration.
    pub fn name_videos(&self, entries: &[&str]) {
        let file = self.dir().join("pipeline.toml");
        let text = std::fs::read_to_string(&file).unwrap();
        let renamed =
            |line: &str| if line.starts_with("videos") { format!("videos = {entries:?}") } else { line.to_owned() };
        std::fs::write(&file, text.lines().map(renamed).collect::<Vec<_>>().join("\n")).unwrap();
    }

    /// Runs `orator run` in the project folder.
    pub fn run(&self, args: &[&str]) -> ProgramAnswer {
        self.answer(&[&["run"], args].concat())
    }

    /// Runs a verb of `orator` in the project folder to completion.
    pub fn answer(&self, args: &[&str]) -> ProgramAnswer {
        Self::answer_to(self.command(args))
    }

    /// Runs a verb of another program in the project folder to completion.
    pub fn answer_of(&self, program: &str, args: &[&str]) -> ProgramAnswer {
        Self::answer_to(self.command_of(Path::new(program), args))
    }

    fn answer_to(mut command: Command) -> ProgramAnswer {
        let output = command.output().unwrap();
        let json = serde_json::from_slice(&output.stdout).unwrap_or_default();
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        ProgramAnswer { code: output.status.code().unwrap_or(-1), json, errors }
    }

    /// Starts a verb without waiting for it.
    pub fn start(&self, args: &[&str]) -> Child {
        self.command(args).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    }

    /// Command that runs a verb.
    pub fn command(&self, args: &[&str]) -> Command {
        self.command_of(&program("orator"), args)
    }

    fn command_of(&self, program: &Path, args: &[&str]) -> Command {
        let mut command = Command::new(program);
        command.current_dir(self.dir()).arg("--json").args(args).stdin(Stdio::null());
        command
    }
}

/// All files under `folder`, with their names relative to it.
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
