//! A project folder of its own for a test, with clips of the drawn speaker, and the program run in it.

use crate::drawn::folder::{self, DemoPlan};
use orator_base::stage::progress::Silent;
use orator_base::types::time::FrameRate;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Draws one clip of the synthetic speaker, 640x480 at 15 frames a second with sound, and all that `orator-lab demo draw`
/// puts beside it (truth, marker models, pipeline.toml), into `dir`; gives the video. About 0.2 s a second of clip.
pub fn speaker_clip(dir: &Path, secs: f64, seed: u64) -> PathBuf {
    let plan = DemoPlan { n_videos: 1, secs, fps: FrameRate::new(15, 1), size: [640, 480], seed };
    folder::draw(dir, &plan, &Silent).unwrap().remove(0)
}

/// The built program of that name, beside the folder of the running test.
///
/// # Panics
/// When it is not built: `cargo test -p PACKAGE` builds only the programs of that package.
pub fn program(name: &str) -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let program = test.ancestors().nth(2).unwrap().join(name);
    assert!(program.is_file(), "{} is not built; run `cargo build --workspace` first", program.display());
    program
}

/// A project folder of its own with clips of the synthetic speaker, worked on by the program itself.
pub struct Project {
    dir: tempfile::TempDir,
}

/// How the program ended: exit code, its JSON, and what it said on standard error.
pub struct ProgramAnswer {
    pub code: i32,
    pub json: serde_json::Value,
    pub errors: String,
}

impl Project {
    /// `n_clips` clips of `secs` seconds; none: only the configuration and an empty video folder.
    pub fn with_clips(name: &str, n_clips: usize, secs: f64) -> Self {
        let plan = DemoPlan { n_videos: n_clips.max(1), secs: secs.max(1.0), ..DemoPlan::default() };
        let project = Self::drawn(name, &plan);
        if n_clips == 0 {
            project.clips().iter().for_each(|clip| std::fs::remove_file(clip).unwrap());
        }
        project
    }

    /// Clips drawn as `plan` says.
    pub fn drawn(name: &str, plan: &DemoPlan) -> Self {
        let dir = tempfile::Builder::new().prefix(&format!("orator-{name}-")).tempdir().unwrap();
        folder::draw(dir.path(), plan, &Silent).unwrap();
        Self { dir }
    }

    /// A file that the stage of that name wrote of the video whose file is called `stem`.
    pub fn written(&self, stage: &str, stem: &str, file: &str) -> PathBuf {
        let videos =
            std::fs::read_dir(self.work().join(stage).join("host")).unwrap().map(|entry| entry.unwrap().path());
        let is_it = |path: &PathBuf| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            path.is_dir() && name.rsplit_once('-').is_some_and(|(slug, _)| slug == stem)
        };
        videos.into_iter().find(is_it).expect(stem).join(file)
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
    pub fn run(&self, args: &[&str]) -> ProgramAnswer {
        self.answer(&[&["run"], args].concat())
    }

    /// Any verb of `orator` in the project's folder, to its end.
    pub fn answer(&self, args: &[&str]) -> ProgramAnswer {
        Self::answer_to(self.command(args))
    }

    /// Any verb of another program in the project's folder, to its end.
    pub fn answer_of(&self, program: &str, args: &[&str]) -> ProgramAnswer {
        Self::answer_to(self.command_of(Path::new(program), args))
    }

    fn answer_to(mut command: Command) -> ProgramAnswer {
        let output = command.output().unwrap();
        let json = serde_json::from_slice(&output.stdout).unwrap_or_default();
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        ProgramAnswer { code: output.status.code().unwrap_or(-1), json, errors }
    }

    /// Starts a verb without waiting.
    pub fn start(&self, args: &[&str]) -> Child {
        self.command(args).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    }

    /// A verb to be started.
    pub fn command(&self, args: &[&str]) -> Command {
        self.command_of(&program("orator"), args)
    }

    fn command_of(&self, program: &Path, args: &[&str]) -> Command {
        let mut command = Command::new(program);
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
