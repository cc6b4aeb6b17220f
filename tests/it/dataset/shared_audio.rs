//! Audio shared by two videos, with real encoders: detected after cutting, re-encoding and a change of level; another
//! speech by the same speaker is not matched.

use crate::fixtures::clips::ffmpeg;
use orator_base::audio::fingerprint::Fingerprinter;
use orator_dataset::shared_sound::find;
use orator_media::ffmpeg::audio::read_mono;
use orator_test_support::project::speaker_clip;
use orator_test_support::skip::real_data;
use std::path::{Path, PathBuf};

fn codes(path: &Path) -> Vec<u32> {
    let mut fingerprinter = Fingerprinter::default();
    fingerprinter.push(&read_mono(path, 16_000).unwrap().unwrap().samples);
    fingerprinter.finish()
}

/// A re-upload of `source` after an intro of `intro` seconds: without its first `cut` seconds, quieter, at 40 kbit/s.
fn reupload(source: &Path, dir: &Path, cut: f64, intro: f64) -> PathBuf {
    let out = dir.join("again.mp4");
    let filter = format!(
        "anoisesrc=d={intro}:c=pink:a=0.2:r=16000:seed=3[i];[0:a]atrim=start={cut},asetpts=PTS-STARTPTS,volume=0.4,aresample=16000[s];[i][s]concat=n=2:v=0:a=1"
    );
    let command =
        format!("-i {} -filter_complex {filter} -ar 44100 -c:a aac -b:a 40k {}", source.display(), out.display());
    assert!(ffmpeg(dir, &command));
    out
}

fn assert_reupload_is_matched(source: &Path, other: &Path) {
    let dir = tempfile::tempdir().unwrap();
    let videos = [codes(source), codes(other), codes(&reupload(source, dir.path(), 2.013, 4.0))];
    let names: Vec<String> = ["a", "b", "c"].map(str::to_owned).to_vec();
    let found = find(&names, |n| Ok(videos[n].clone()), 5.0).unwrap();
    let secs = videos[0].len() as f64 * 512.0 / 16_000.0 - 2.0;
    eprintln!("{}: {secs:.1} s shared, found {found:?}", source.display());
    assert_eq!(found.len(), 1);
    let one = &found[0];
    assert_eq!((one.a.as_str(), one.b.as_str()), ("a", "c"));
    assert!((one.b_secs - one.a_secs - (4.0 - 2.013)).abs() < 0.1, "{one:?}");
    assert!(one.secs > 0.8 * secs && one.secs < secs + 1.0, "{one:?}");
    assert!(find(&names, |n| Ok(videos[n].clone()), secs + 1.0).unwrap().is_empty());
}

#[test]
fn a_reupload_is_matched_and_another_speech_is_not() {
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    assert_reupload_is_matched(&speaker_clip(one.path(), 14.0, 1), &speaker_clip(two.path(), 14.0, 2));
}

#[test]
fn reuploads_of_real_speech_are_matched() {
    let (Some(jfk), Some(scott), Some(other)) = (
        real_data("data/audio/jfk_whisper_11s.flac"),
        real_data("data/audio/beat2_2_scott_0_2_2_16k.wav"),
        real_data("data/audio/beat2_2_scott_0_3_3_16k.wav"),
    ) else {
        return;
    };
    assert_reupload_is_matched(&scott, &other);
    assert_reupload_is_matched(&jfk, &scott);
}
