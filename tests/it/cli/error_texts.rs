//! Error texts of the program, stored in `tests/it/snapshots`: each states the position, the expected value and what to
//! do. Paths of the test are redacted.

use crate::fixtures::models::untrained::write_untrained_speaker;
use ndarray::Array3;
use ndarray_npy::NpzWriter;
use orator_test_support::project::Project;
use std::fs;
use std::fs::File;

/// Runs each command line in the project's folder; returns it with its error text and exit code.
fn texts(project: &Project, commands: &[&str]) -> String {
    let folder = project.dir().canonicalize().unwrap();
    let mut all = String::new();
    for command in commands {
        let answer = project.answer(&command.split_whitespace().collect::<Vec<_>>());
        let mut text = answer.errors;
        for path in [folder.as_path(), project.dir()] {
            text = text.replace(path.to_str().unwrap(), "[dir]");
        }
        all += &format!("$ orator {command}\n{}\nexit code {}\n\n", text.trim_end(), answer.code);
    }
    all
}

/// Compares with `tests/it/snapshots/NAME.snap`.
macro_rules! snapshot {
    ($name:literal, $text:expr) => {
        insta::with_settings!({
            snapshot_path => "../snapshots", prepend_module_to_snapshot => false, omit_expression => true
        }, { insta::assert_snapshot!($name, $text) })
    };
}

#[test]
fn invalid_configurations() {
    let project = Project::with_clips("errors-config", 0, 1.0);
    fs::write(project.dir().join("two.toml"), "[segment]\nmin_framez = 3\n\n[lift]\nsmooth_arms = \"much\"\n").unwrap();
    fs::write(project.dir().join("no.toml"), "[segment\n").unwrap();
    fs::write(project.dir().join("section.toml"), "[segments]\nmin_frames = 64\n").unwrap();
    let commands = [
        "run --set segment.min_framez=3",
        "run --set segment.min_frames=many",
        "run --set segment.min_frames=0",
        "run --set gan.representation=anything",
        "run --set gan.preset=huge",
        "run --set gan.adversarial=none",
        "run -c two.toml",
        "run -c no.toml",
        "run -c section.toml",
        "run -c absent.toml",
    ];
    snapshot!("configuration", texts(&project, &commands));
}

#[test]
fn missing_models_and_unreadable_videos() {
    let project = Project::with_clips("errors-run", 0, 1.0);
    fs::write(project.video("broken.mp4"), "no film").unwrap();
    fs::write(project.dir().join("other.safetensors"), "no weights").unwrap();
    let commands = [
        "run --to extract",
        "run --set pose2d.body=nobody",
        "run --set models.dir=elsewhere",
        "run --set lift.body_weights=absent.safetensors",
        "run --set lift.body_weights=other.safetensors",
        "models fetch nobody",
    ];
    snapshot!("models_and_videos", texts(&project, &commands));
}

#[test]
fn unreadable_files() {
    let project = Project::with_clips("errors-files", 0, 1.0);
    let dir = project.dir();
    fs::write(dir.join("text.npz"), "no numbers").unwrap();
    for (name, shape) in [("few.npz", (4, 16, 3)), ("nothing.npz", (0, 17, 3))] {
        let mut npz = NpzWriter::new(File::create(dir.join(name)).unwrap());
        npz.add_array("body", &Array3::<f32>::zeros(shape)).unwrap();
        npz.finish().unwrap();
    }
    fs::create_dir(dir.join("captured")).unwrap();
    fs::write(dir.join("captured/bad.bvh"), "HIERARCHY\nROOT Hips\n{\n OFFSET 0 0\n}\n").unwrap();
    fs::write(dir.join("short.txt"), "0 0 0 1\n").unwrap();
    let commands = [
        "lift text.npz --out j.npy",
        "lift few.npz --out j.npy",
        "lift nothing.npz --out j.npy",
        "lift absent.npz --out j.npy",
        "animate captured/bad.bvh --out a.glb",
        "animate short.txt --out a.glb",
        "import captured --speaker host --out imported",
        "dataset verify captured",
    ];
    snapshot!("files", texts(&project, &commands));
}

#[test]
fn invalid_arguments_and_tables() {
    let project = Project::with_clips("errors-arguments", 0, 1.0);
    let dir = project.dir();
    write_untrained_speaker(&dir.join("host.safetensors"));
    fs::write(dir.join("columns.csv"), "audio,colour\nspeech.wav,red\n").unwrap();
    fs::write(dir.join("rows.csv"), "audio,name\nabsent.wav,a\n,b\n").unwrap();
    fs::write(dir.join("empty.csv"), "").unwrap();
    let commands = [
        "rnu",
        "run --from nowhere",
        "evaluate --dataset work/dataset/host --checkpoint host.safetensors --split nonsense",
        "evaluate --dataset work/dataset/host --checkpoint host.safetensors --split test",
        "train gan",
        "generate --checkpoint host.safetensors --batch columns.csv --out-folder made --out .npy",
        "generate --checkpoint host.safetensors --batch rows.csv --out-folder made --out .npy",
        "generate --checkpoint host.safetensors --batch empty.csv --out-folder made --out .npy",
    ];
    snapshot!("arguments_and_tables", texts(&project, &commands));
}
