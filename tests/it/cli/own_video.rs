//! README's way of one's own video, as it stands there, in an empty home with nothing but the program.

use crate::fixtures::clips::ffmpeg;
use crate::fixtures::skip::{real_data, skip};
use std::path::Path;
use std::process::Command;

const README: &str = include_str!("../../../README.md");

/// The lines of the block under the heading, for a program in `folder` and a training of a few steps.
fn lines(folder: &Path) -> String {
    let block = README.split("in five lines\n").nth(1).unwrap().split("```").nth(1).unwrap();
    let block = block.trim_start_matches("sh\n").to_owned();
    assert_eq!(block.lines().count(), 5, "{block}");
    let (program, training) = ("$PWD/target/release", "orator train gan\n");
    assert!(block.contains(program) && block.contains(training), "{block}");
    block.replace(program, folder.to_str().unwrap()).replace(training, "orator train gan --steps 3\n")
}

#[test]
fn the_five_lines_of_the_readme_work_on_a_bare_machine() {
    let Some(clip) = real_data("data/videos/talk_phoneman_33s_1080p_UNSURE.mp4") else { return };
    let home = tempfile::tempdir().unwrap();
    let within = |name: &str| home.path().join(name);
    std::fs::create_dir(within("bin")).unwrap();
    // Away from the build folder no library lies beside it.
    std::fs::copy(env!("CARGO_BIN_EXE_orator"), within("bin/orator")).unwrap();
    let cuts = [
        format!("-t 16 -i {} -c copy my-talk-1.mp4", clip.display()),
        "-t 3 -i my-talk-1.mp4 -vn -ac 1 speech.wav".into(),
    ];
    if !cuts.iter().all(|cut| ffmpeg(home.path(), cut)) {
        return;
    }
    let mut command = Command::new("bash");
    command.args(["-eo", "pipefail", "-c", &lines(&within("bin"))]).current_dir(home.path());
    command.env("HOME", home.path()).env_remove("ORT_DYLIB_PATH");
    let ended = command.output().unwrap();
    let said = format!("{}{}", String::from_utf8_lossy(&ended.stdout), String::from_utf8_lossy(&ended.stderr));
    if !ended.status.success() && said.contains("NOT HAD") {
        return skip(&format!("the packages of the models cannot be reached:\n{said}"));
    }
    assert!(ended.status.success(), "{said}");
    for made in ["motion.bvh", "motion.glb", "motion.mp4"] {
        let size = std::fs::metadata(within("my-speaker").join(made)).map_or(0, |file| file.len());
        assert!(size > 10_000, "{made} has {size} bytes\n{said}");
    }
    let models = within("my-speaker/models");
    assert!(models.join("lib").is_dir() && models.join("hand_landmark_lite_224.licence.txt").is_file());
}
