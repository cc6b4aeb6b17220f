//! `orator evaluate --truth --prediction`: metrics of files, errors and notes for invalid ones, and comparisons limited
//! to comparable values.

use crate::fixtures::motion_folders::{folders, spoken, write_npy};
use ndarray::{Array3, s};
use orator_base::types::pose3d::Motion;
use orator_base::types::time::FrameRate;
use orator_formats::wav;
use orator_formats::{authors_txt, joints_npz};
use orator_test_support::project::{ProgramAnswer, Project};
use orator_test_support::skip::real_data;
use serde_json::Value;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

/// A convention with one metric, which is fast.
const SMALL: [&str; 2] = ["--convention", "speech2gesture"];

fn value(answer: &ProgramAnswer, name: &str, part: &str, row: &str) -> f64 {
    let metrics = answer.json["metrics"].as_array().unwrap();
    let matches = |metric: &&Value| metric["name"] == name && metric["part"] == part;
    metrics.iter().find(matches).unwrap()["values"][row]["value"].as_f64().unwrap()
}

#[test]
fn folders_are_evaluated_with_baselines_and_intervals() {
    let project = Project::with_clips("judged", 0, 1.0);
    folders(project.dir(), &[24, 20]);
    let args = ["evaluate", "--truth", "truth", "--prediction", "prediction", "--audio", "audio"];
    let answer = project.answer(&args);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let result = &answer.json;
    assert_eq!((&result["n_clips"], &result["fps"]["num"]), (&2.into(), &15.into()));
    // 44 s: blocks of a sixteenth, or longer for slowly decorrelating errors.
    let [n_blocks, secs, slow] =
        ["n_blocks", "block_secs", "decorrelation_secs"].map(|key| result[key].as_f64().unwrap());
    assert!((7.0..=16.0).contains(&n_blocks) && secs >= 2.75 && secs >= 1.5 * slow, "{n_blocks} {secs} {slow}");
    for row in
        ["prediction", "mean_pose", "median_pose", "nearest_neighbour", "mismatched_prediction", "mismatched_truth"]
    {
        let metric = &result["metrics"][0]["values"][row];
        let [low, value, high] = ["low", "value", "high"].map(|key| metric[key].as_f64().unwrap());
        assert!(low <= value && value <= high, "{row}: {metric}");
    }
    assert_eq!((value(&answer, "pck_3d", "all", "truth"), value(&answer, "mpjpe", "all", "truth")), (1.0, 0.0));
    assert!(value(&answer, "frechet_pose", "all", "truth") < 1e-3);
    assert!(value(&answer, "frechet_pose", "all", "truth_halves") > 0.0);
    assert!(value(&answer, "mpjpe", "all", "prediction") < value(&answer, "mpjpe", "all", "mismatched_prediction"));
    assert!(value(&answer, "beat_consistency", "arms", "prediction") > 0.0);
    for metric in result["metrics"].as_array().unwrap() {
        assert!(metric["hash"].as_str().is_some_and(|hash| hash.len() == 16), "{metric}");
        assert!(metric["parameters"].is_object() && !metric["definition"].as_str().unwrap().is_empty(), "{metric}");
    }
    let sentence = |of: &str| result[of]["sentence"].as_str().unwrap().to_owned();
    assert!(sentence("better_than_constant_pose").starts_with("Is the prediction better than a constant pose? "));
    assert_eq!(result["depends_on_audio"]["word"], "yes", "{}", sentence("depends_on_audio"));
    for vote in result["depends_on_audio"]["votes"].as_array().unwrap() {
        let is_called = vote["answer"] != "inconclusive";
        assert_eq!(vote["p"].as_f64().unwrap() <= 0.025, is_called, "{vote}");
        let [low, high] = ["low", "high"].map(|key| vote["gain"][key].as_f64().unwrap());
        assert_eq!(low > 0.0 || high < 0.0, is_called, "{vote}");
    }
    // One thread gives the same result.
    let again = std::process::Command::new(env!("CARGO_BIN_EXE_orator"))
        .current_dir(project.dir())
        .env("RAYON_NUM_THREADS", "1")
        .arg("--json")
        .args(args)
        .output()
        .unwrap();
    assert_eq!(serde_json::from_slice::<Value>(&again.stdout).unwrap(), *result);
}

#[test]
fn only_values_with_equal_hashes_are_compared() {
    let project = Project::with_clips("compared", 0, 1.0);
    folders(project.dir(), &[8]);
    let save = |name: &str, more: &[&str]| {
        let args = [&["evaluate", "--truth", "truth", "--prediction", "prediction"], &SMALL[..], more].concat();
        let answer = project.answer(&args);
        assert_eq!(answer.code, 0, "{}", answer.errors);
        fs::write(project.dir().join(name), answer.json.to_string()).unwrap();
    };
    save("a.json", &[]);
    save("b.json", &["--alpha", "0.2"]);
    save("c.json", &["--input-fps", "30"]);
    let same = project.answer(&["evaluate", "compare", "a.json", "b.json"]);
    assert_eq!(same.code, 0, "{}", same.errors);
    let of = |answer: &ProgramAnswer, key: &str| answer.json["compared"][key].as_array().unwrap().clone();
    assert!(!of(&same, "pairs").is_empty() && of(&same, "rejected").is_empty());
    assert!(of(&same, "only_in_a").iter().all(|name| name.as_str().unwrap().contains("at 0.1")));
    let other = project.answer(&["evaluate", "compare", "a.json", "c.json"]);
    assert_eq!(other.code, 1, "{}", other.errors);
    let rejected = of(&other, "rejected");
    let reason = rejected.iter().find(|reason| reason.as_str().unwrap().starts_with("pck_2d (all)")).unwrap();
    assert!(reason.as_str().unwrap().contains("fps is 15.0 in A and 30.0 in B"), "{reason}");
    fs::write(project.dir().join("d.json"), "{}").unwrap();
    let invalid = project.answer(&["evaluate", "compare", "a.json", "d.json"]);
    assert!(invalid.code == 1 && invalid.errors.contains("is not an evaluation result"), "{}", invalid.errors);
}

#[test]
fn static_or_late_motion_is_not_rated_as_better() {
    let project = Project::with_clips("praised", 0, 1.0);
    folders(project.dir(), &[24, 20]);
    for (number, secs) in [(0, 24), (1, 20)] {
        let real = spoken(number, secs).motion().joints;
        let mean = real.mean_axis(ndarray::Axis(0)).unwrap();
        write_npy(&project.dir().join(format!("still/{number}.npy")), &mean.broadcast(real.dim()).unwrap().to_owned());
        let n = real.shape()[0];
        let late = Array3::from_shape_fn(real.dim(), |(t, j, k)| real[[(t + n / 3) % n, j, k]]);
        write_npy(&project.dir().join(format!("late/{number}.npy")), &late);
    }
    for kind in ["still", "late"] {
        let answer = project.answer(&[&["evaluate", "--truth", "truth", "--prediction", kind], &SMALL[..]].concat());
        assert_eq!(answer.code, 0, "{}", answer.errors);
        assert_ne!(answer.json["better_than_constant_pose"]["word"], "yes", "{kind}");
        assert_ne!(answer.json["depends_on_audio"]["word"], "yes", "{kind}: {}", answer.json["depends_on_audio"]);
        assert!(value(&answer, "pck_2d", "all", "late_prediction") > 0.0);
    }
    let args = ["evaluate", "--truth", "truth", "--prediction", "late", "--report", "truth/0.npy"];
    let answer = project.answer(&[&args[..], &SMALL].concat());
    assert!(answer.code == 1 && answer.errors.contains("ends in .html"), "{}", answer.errors);
}

/// A project with a clip of 8 s, and invalid or unusual files.
fn unusual_files() -> Project {
    let project = Project::with_clips("bad-motion", 0, 1.0);
    let clip = spoken(0, 8);
    let (motion, sound, predicted) = (clip.motion(), clip.sound(), clip.predictable().joints);
    let at = |name: &str| project.dir().join(name);
    let joints = &motion.joints;
    write_npy(&at("t.npy"), joints);
    write_npy(&at("long.npy"), &clip_joints(12));
    write_npy(&at("longer.npy"), &clip_joints(8).slice(s![..114, .., ..]).to_owned());
    write_npy(&at("wrong.npy"), &Array3::zeros((120, 43, 3)));
    write_npy(&at("missing.npy"), &Array3::from_elem((120, 49, 3), f32::NAN));
    let with_hole = |n: usize| {
        let mut holed = predicted.clone();
        holed.slice_mut(s![..n, 20..30, ..]).fill(f32::NAN);
        holed
    };
    write_npy(&at("few-nan.npy"), &with_hole(10));
    write_npy(&at("many-nan.npy"), &with_hole(110));
    write_npy(&at("mm.npy"), &(&predicted * 1000.0));
    let away = predicted.mapv(|v| v + 0.5);
    write_npy(&at("away.npy"), &away);
    fs::write(at("empty.npy"), "").unwrap();
    fs::create_dir_all(at("nobody")).unwrap();
    fs::create_dir_all(at("one")).unwrap();
    write_npy(&at("one/a.npy"), joints);
    fs::create_dir_all(at("other")).unwrap();
    write_npy(&at("other/b.npy"), joints);
    let fps = FrameRate::new(30, 1);
    let doubled = Array3::from_shape_fn((240, 49, 3), |(t, j, k)| predicted[[t / 2, j, k]]);
    joints_npz::write(&at("30.npz"), &Motion::from_joints(fps, doubled)).unwrap();
    fs::write(at("t.txt"), authors_txt::format(&motion)).unwrap();
    wav::write(&at("t.wav"), &sound).unwrap();
    fs::write(at("none.mp3"), [b"ID3\x03\0\0\0\0\0\x0a".as_slice(), &[0; 10]].concat()).unwrap();
    wav(&at("phone.wav"), 8000, sound.samples.iter().step_by(2).copied());
    wav(&at("short.wav"), 16_000, sound.samples[..32_000].iter().copied());
    silent_hours(&at("hours.wav"));
    project
}

fn clip_joints(secs: usize) -> Array3<f32> {
    spoken(0, secs).motion().joints
}

fn wav(path: &Path, rate: u32, samples: impl Iterator<Item = f32>) {
    let spec =
        hound::WavSpec { channels: 1, sample_rate: rate, bits_per_sample: 16, sample_format: hound::SampleFormat::Int };
    let mut wav = hound::WavWriter::create(path, spec).unwrap();
    samples.for_each(|sample| wav.write_sample((sample * 32_000.0) as i16).unwrap());
    wav.finalize().unwrap();
}

/// Writes three silent hours of 44.1 kHz stereo as a sparse file.
fn silent_hours(path: &Path) {
    let n_bytes = 3 * 3600 * 44_100 * 4u32;
    let head = [
        b"RIFF".as_slice(),
        &(36 + n_bytes).to_le_bytes(),
        b"WAVEfmt ",
        &16u32.to_le_bytes(),
        &1u16.to_le_bytes(),
        &2u16.to_le_bytes(),
        &44_100u32.to_le_bytes(),
        &176_400u32.to_le_bytes(),
        &4u16.to_le_bytes(),
        &16u16.to_le_bytes(),
        b"data",
        &n_bytes.to_le_bytes(),
    ];
    fs::write(path, head.concat()).unwrap();
    File::options().write(true).open(path).unwrap().set_len(44 + u64::from(n_bytes)).unwrap();
}

#[test]
fn invalid_input_gives_clear_errors() {
    let project = unusual_files();
    let cases: [(&[&str], &str); 17] = [
        (&["t.npy", "gone.npy"], "gone.npy does not exist"),
        (&["t.npy", "t.npy"], "give two different motions"),
        (&["t.npy", "empty.npy"], "empty.npy is empty"),
        (&["t.npy", "wrong.npy"], "[120, 43, 3], expected [frames, 49, 3]"),
        (&["t.npy", "missing.npy"], "all joints of all 120 frames are missing"),
        (&["missing.npy", "t.npy"], "missing.npy: all joints"),
        (&["t.npy", "many-nan.npy"], "for 18.7 % of the joints"),
        (&["t.npy", "long.npy"], "8.00 s (120 frames at 15 fps) and the prediction 12.00 s"),
        (&["t.npy", "mm.npy"], "seems to be in millimetres; multiply every coordinate by 0.001"),
        (&["t.npy", "one"], "two files or two folders"),
        (&["one", "other"], "has the name of one in"),
        (&["nobody", "one"], "has the name of one in"),
        (&["t.npy", "away.npy", "--audio", "none.mp3"], "none.mp3"),
        (&["t.npy", "away.npy", "--audio", "t.npy"], "t.npy"),
        (&["t.npy", "away.npy", "--audio", "short.wav"], "is it the audio of another clip?"),
        (&["t.npy", "away.npy", "--alpha", "0"], "invalid alpha 0 of PCK"),
        (&["t.npy", "away.npy", "--input-fps", "0"], "expected 1 to 1000 fps"),
    ];
    for (args, expected) in cases {
        let (sides, more) = args.split_at(2);
        let args = [&["evaluate", "--truth", sides[0], "--prediction", sides[1]], &SMALL[..], more].concat();
        let answer = project.answer(&args);
        assert_eq!(answer.code, 1, "{args:?}");
        assert!(answer.errors.contains(expected) && !answer.errors.contains("panicked"), "{args:?}: {}", answer.errors);
    }
    let empty = project.answer(&["evaluate"]);
    assert!(empty.code == 1 && empty.errors.contains("give --truth and --prediction"), "{}", empty.errors);
}

#[test]
fn correctable_input_is_evaluated_with_a_note() {
    let project = unusual_files();
    let noted = |truth: &str, prediction: &str, more: &[&str], note: &str| {
        let more = if more.is_empty() { &SMALL[..] } else { more };
        let answer = project.answer(&[&["evaluate", "--truth", truth, "--prediction", prediction], more].concat());
        assert_eq!(answer.code, 0, "{prediction}: {}", answer.errors);
        let notes = answer.json["notes"].to_string();
        assert!(notes.contains(note), "{prediction}: {notes}");
        answer
    };
    noted("t.npy", "few-nan.npy", &[], "is NaN for 100 of");
    noted("t.npy", "longer.npy", &[], "the truth has 120 frames, the prediction 114: both were cut to 114");
    noted("t.npy", "away.npy", &[], "is up to 0.87 m from the origin");
    noted("t.npy", "30.npz", &[], "at 30 fps was resampled to 15 fps");
    let exact = noted("t.txt", "t.npy", &[], "has no frame rate");
    assert_eq!(value(&exact, "pck_2d", "all", "prediction"), 1.0);
    // Audio of telephone quality has onsets, and three hours of audio for eight seconds of motion are accepted.
    let phone = noted("t.npy", "few-nan.npy", &["--audio", "phone.wav", "--convention", "aist"], "NaN");
    assert!(phone.json["metrics"][0]["values"]["truth"]["value"].as_f64().unwrap() > 0.0);
    let hours = noted("t.npy", "few-nan.npy", &["--audio", "hours.wav", "--convention", "aist"], "NaN");
    assert_eq!(hours.json["with_sound"], true);
}

#[test]
fn released_clips_have_the_published_baselines() {
    let Some(clips) = real_data("data/released_clips") else { return };
    let project = Project::with_clips("released", 0, 1.0);
    let path = |name: &str| clips.join(name).to_string_lossy().into_owned();
    // PCK@0.2 in the image plane: of the prediction, and of the median pose of the clip.
    for (clip, prediction, median) in [("1845", 0.3690, 0.1543), ("3821", 0.2553, 0.5201), ("3838", 0.1136, 0.4998)] {
        let [truth, predicted] = ["gt", "prediction"].map(|side| path(&format!("{side}_interval_{clip}.txt")));
        let sound = path(&format!("{clip}.wav"));
        let args = ["evaluate", "--truth", &truth, "--prediction", &predicted, "--audio", &sound];
        let answer = project.answer(&[&args, &SMALL[..]].concat());
        assert_eq!(answer.code, 0, "{}", answer.errors);
        for (row, expected, tolerance) in [("prediction", prediction, 1e-4), ("median_pose", median, 1e-3)] {
            let found = value(&answer, "pck_2d", "all", row);
            assert!((found - expected).abs() < tolerance, "{clip} {row}: {found}, expected {expected}");
        }
        let sentence = answer.json["better_than_constant_pose"]["sentence"].as_str().unwrap();
        assert!(sentence.contains("too few for a conclusion"), "{sentence}");
    }
    // The three clips of one speaker: the mean pose is that of the other two.
    let folder = project.dir().join("gruber");
    fs::create_dir_all(&folder).unwrap();
    let links: Vec<PathBuf> = ["1845", "3821", "3838"]
        .iter()
        .flat_map(|clip| {
            [format!("gt_interval_{clip}.txt"), format!("prediction_interval_{clip}.txt"), format!("{clip}.wav")]
        })
        .map(|name| clips.join(name))
        .collect();
    for link in links {
        fs::copy(&link, folder.join(link.file_name().unwrap())).unwrap();
    }
    let args = ["evaluate", "--truth", "gruber", "--prediction", "gruber", "--audio", "gruber"];
    let answer = project.answer(&[&args, &SMALL[..]].concat());
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let found = value(&answer, "pck_2d", "all", "mean_pose");
    // 17.2, 14.6 and 34.0 % of 254, 242 and 284 frames.
    let expected = (17.2 * 254.0 + 14.6 * 242.0 + 34.0 * 284.0) / 78_000.0;
    assert!((found - expected).abs() < 0.001, "{found}, expected {expected}");
    assert_eq!(answer.json["predictors"][3]["name"], "nearest_neighbour");
}
