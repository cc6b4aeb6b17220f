//! Selection of one of several audio tracks.

use crate::fixtures::clips::{ffmpeg, write_numbered};
use orator_base::stage::progress::Silent;
use orator_base::stage::{Report, Stage, Unit};
use orator_base::types::time::FrameRate;
use orator_dataset::config;
use orator_media::ffmpeg::audio;
use orator_pipeline::extract::ExtractStage;
use std::path::Path;

fn run(video: &Path, out: &Path, audio_track: usize) -> anyhow::Result<Report> {
    std::fs::create_dir_all(out)?;
    let unit = Unit { speaker: "host".into(), video: "clip".into(), source: video.to_owned() };
    let settings = config::ExtractConfig { audio_track, ..Default::default() };
    ExtractStage::new(&settings).run(&unit, out, &Silent)
}

/// Pitch of a pure tone from its sign changes, Hz.
fn pitch(path: &Path) -> f64 {
    let audio = audio::read_mono(path, 16_000).unwrap().unwrap();
    let n = audio.samples.windows(2).filter(|pair| (pair[0] < 0.0) != (pair[1] < 0.0)).count();
    n as f64 / 2.0 / audio.secs()
}

#[test]
fn the_configured_track_is_used_or_else_the_default_track() {
    let dir = tempfile::tempdir().unwrap();
    write_numbered(dir.path(), "in.mp4", 60, FrameRate::new(30, 1), None);
    let tones = "-f lavfi -i sine=frequency=300:duration=2 -f lavfi -i sine=frequency=900:duration=2";
    let maps = "-map 0:v -map 1:a -map 2:a -c:v copy -metadata:s:a:0 language=deu -metadata:s:a:1 language=eng";
    for (name, default, hertz) in [
        ("second.mkv", "-disposition:a:0 0 -disposition:a:1 default", [900.0, 300.0, 900.0]),
        ("none.mkv", "-default_mode passthrough -disposition:a:0 0 -disposition:a:1 0", [300.0, 300.0, 900.0]),
        ("both.mkv", "-disposition:a:0 default -disposition:a:1 default", [300.0, 300.0, 900.0]),
    ] {
        if !ffmpeg(dir.path(), &format!("-i in.mp4 {tones} {maps} {default} {name}")) {
            continue;
        }
        let video = dir.path().join(name);
        for (track, expected) in hertz.into_iter().enumerate() {
            let out = dir.path().join(format!("{name}-{track}"));
            let report = run(&video, &out, track).unwrap();
            let found = pitch(&out.join("audio.wav"));
            assert!((found - expected).abs() < 20.0, "{name}, track {track}: {found} Hz");
            let number = if expected == 300.0 { 1 } else { 2 };
            let tracks = &report.facts["audio_tracks"];
            assert_eq!((&tracks["n_tracks"], &tracks["taken"]), (&2.into(), &number.into()), "{tracks}");
            let note = format!("2 audio tracks (deu, eng): number {number} is used (extract.audio_track)");
            assert!(report.line.contains(&note), "{}", report.line);
        }
        let error = format!("{:#}", run(&video, &dir.path().join("gone"), 3).unwrap_err());
        assert!(error.contains("no audio track 3, the file has 2") && error.contains(name), "{error}");
    }
    // A single track is used regardless of the setting, without a note.
    if ffmpeg(dir.path(), &format!("-i in.mp4 {tones} -map 0:v -map 1:a -c:v copy one.mkv")) {
        let report = run(&dir.path().join("one.mkv"), &dir.path().join("one"), 2).unwrap();
        assert!(
            report.facts.get("audio_tracks").is_none() && report.line.ends_with("2.0 s of audio"),
            "{}",
            report.line
        );
    }
}
