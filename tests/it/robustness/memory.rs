//! Peak memory does not grow with the length of a video, and lifting allocates little more than its arrays.
//! `ORATOR_LONG=1` (`make prove`) compares a 10-minute video with a 1-minute one, and an hour of keypoints with a
//! minute; the default inputs are shorter.

use crate::fixtures::clips;
use crate::fixtures::clips::ffmpeg;
use crate::fixtures::keypoints::keypoints;
use crate::fixtures::media::recogniser::write_recogniser;
use crate::fixtures::models::untrained::write_untrained_speaker;
use ndarray::{Array3, s};
use ndarray_npy::NpzWriter;
use orator_formats::wav;
use orator_lab::train::scene::body::{FilmedScene, Filming};
use orator_test_support::project::Project;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Peak resident memory in MiB of a process so far.
fn high_water_mib(id: &str) -> f64 {
    let text = std::fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kib.unwrap_or(0.0) / 1024.0
}

/// Waits until a program succeeds, and returns its peak resident memory in MiB, including its child processes.
pub(crate) fn peak_mib(mut child: Child) -> f64 {
    let id = child.id().to_string();
    let mut peak = 0.0_f64;
    while child.try_wait().unwrap().is_none() {
        let tasks = std::fs::read_dir(format!("/proc/{id}/task")).into_iter().flatten().flatten();
        let children = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("children")).ok());
        let of_children: f64 = children.map(|ids| ids.split_whitespace().map(high_water_mib).sum::<f64>()).sum();
        peak = peak.max(high_water_mib(&id) + of_children);
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(child.wait().unwrap().success());
    peak
}

/// Peak resident memory in MiB of a run over one video.
fn peak_of_run(project: &Project) -> f64 {
    peak_mib(project.start(&["run", "--jobs", "1", "--to", "lift"]))
}

#[test]
fn peak_memory_is_independent_of_video_length() {
    let (secs, times) = if std::env::var("ORATOR_LONG").is_ok() { (60.0, 10) } else { (4.0, 6) };
    let short = Project::with_clips("short", 1, secs);
    let long = Project::with_clips("long", 0, 0.0);
    let clip = short.clips().remove(0);
    let (clip, out) = (clip.to_string_lossy(), long.video("long.mp4"));
    assert!(ffmpeg(long.dir(), &format!("-stream_loop {} -i {clip} -c copy {}", times - 1, out.display())));
    let (short, long) = (peak_of_run(&short), peak_of_run(&long));
    eprintln!(
        "peak memory {short:.0} MiB at {secs} s, {long:.0} MiB at {} s: ratio {:.2}",
        secs * f64::from(times),
        long / short
    );
    assert!(short > 10.0 && long <= 1.2 * short, "{short:.0} MiB became {long:.0} MiB");
}

/// Peak resident memory in MiB of `orator lift` for `n_frames`, and size of the arrays that it reads and writes.
fn peak_of_lift(n_frames: usize) -> (f64, f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let minute = keypoints(&FilmedScene::from_rule(Filming::Training, 900, &mut rng), &mut rng);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("k.npz");
    let mut npz = NpzWriter::new(std::fs::File::create(&path).unwrap());
    for (name, points) in [("body", &minute.body), ("left_hand", &minute.left_hand), ("right_hand", &minute.right_hand)]
    {
        let mut all = Array3::<f32>::zeros((n_frames, points.dim().1, 3));
        all.outer_iter_mut().enumerate().for_each(|(t, mut frame)| frame.assign(&points.slice(s![t % 900, .., ..])));
        npz.add_array(name, &all).unwrap();
    }
    npz.finish().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.arg("lift").arg(&path).arg("--out").arg(dir.path().join("j.npy"));
    let peak = peak_mib(command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    let bytes_a_frame = 4 * 3 * (17 + 21 + 21 + 49 + 3) + 49;
    (peak, (n_frames * bytes_a_frame) as f64 / f64::from(1 << 20))
}

#[test]
fn lifting_allocates_little_more_than_its_arrays() {
    let n_frames = if std::env::var("ORATOR_LONG").is_ok() { 54_000 } else { 9_000 };
    let ((short, short_arrays), (long, long_arrays)) = (peak_of_lift(900), peak_of_lift(n_frames));
    let (growth, arrays) = (long - short, long_arrays - short_arrays);
    eprintln!(
        "900 frames {short:.0} MiB, {n_frames} frames {long:.0} MiB: {growth:.0} MiB more, the arrays {arrays:.0}"
    );
    assert!(short > 10.0 && growth <= 1.4 * arrays + 32.0, "{growth:.0} MiB more for {arrays:.0} MiB of arrays");
}

#[test]
fn a_folder_of_frames_needs_memory_only_for_its_persons() {
    let (dir, n_frames) = (tempfile::tempdir().unwrap(), 2_000);
    let numbers = |n: usize| vec![5.5; 3 * n];
    let person = serde_json::json!({ "pose_keypoints_2d": numbers(25), "hand_left_keypoints_2d": numbers(21),
        "hand_right_keypoints_2d": numbers(21) });
    let text = serde_json::json!({ "people": [person] }).to_string();
    (0..n_frames).for_each(|t| std::fs::write(dir.path().join(format!("a_{t:012}_keypoints.json")), &text).unwrap());
    let memory = allocation_counter::measure(|| drop(orator_formats::keypoints::read(dir.path()).unwrap()));
    // A person has 59 points of 12 bytes.
    let bytes = memory.bytes_max / n_frames;
    assert!(bytes < 1_400, "{bytes} bytes a frame");
}

/// Peak resident memory in MiB of `orator generate` for `secs` of audio, and size of the generated joints.
fn peak_of_generate(secs: f64) -> (f64, f64) {
    let dir = tempfile::tempdir().unwrap();
    write_untrained_speaker(&dir.path().join("host.safetensors"));
    wav::write(&dir.path().join("speech.wav"), &clips::tone(16_000, secs, 220.0)).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(["generate", "--checkpoint", "host.safetensors", "--audio", "speech.wav", "--out", "a.npy"]);
    let peak = peak_mib(command.current_dir(dir.path()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    (peak, secs * 15.0 * 49.0 * 3.0 * 4.0 / f64::from(1 << 20))
}

#[test]
fn long_audio_needs_memory_only_for_its_motion() {
    let secs = if std::env::var("ORATOR_LONG").is_ok() { 10_800.0 } else { 900.0 };
    let ((short, short_joints), (long, long_joints)) = (peak_of_generate(150.0), peak_of_generate(secs));
    let (growth, joints) = (long - short, long_joints - short_joints);
    let audio = (secs - 150.0) * 16_000.0 * 4.0 / f64::from(1 << 20);
    eprintln!(
        "150 s {short:.0} MiB, {secs} s {long:.0} MiB: {growth:.0} MiB more, joints {joints:.0}, audio {audio:.0}"
    );
    assert!(short > 10.0 && growth <= 2.2 * joints + 24.0, "{growth:.0} MiB more for {joints:.0} MiB of joints");
}

/// Peak resident memory in MiB of `orator transcribe` with one thread (each needs memory of its own) for `secs` of a
/// tone, in every window of which the network recognises two words.
fn peak_of_transcribe(secs: f64) -> f64 {
    let dir = tempfile::tempdir().unwrap();
    write_recogniser(&dir.path().join("whisper"));
    wav::write(&dir.path().join("tone.wav"), &clips::tone(16_000, secs, 220.0)).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(["transcribe", "tone.wav", "--model", "whisper", "--set", "models.dir=models", "--out", "words.json"]);
    command.env("RAYON_NUM_THREADS", "1");
    peak_mib(command.current_dir(dir.path()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap())
}

#[test]
fn recognition_of_long_audio_needs_no_more_memory() {
    let secs = if std::env::var("ORATOR_LONG").is_ok() { 10_800.0 } else { 240.0 };
    let (short, long) = (peak_of_transcribe(60.0), peak_of_transcribe(secs));
    eprintln!("60 s {short:.0} MiB, {secs} s {long:.0} MiB");
    assert!(short > 10.0 && long <= short + 32.0, "{short:.0} MiB became {long:.0} MiB");
}
