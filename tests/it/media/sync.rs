//! Audio-video synchronisation of the output of `extract`, on the time axis by which shards are cut: |motion - audio|
//! is at most 1 ms plus half a frame period of the slower of the source rate and the dataset rate.
//!
//! Two errors are measured. For a frame: its time in the dataset against the time of its content in the audio. For the
//! start or end of a flash: the midpoint between the last frame before and the first frame after it, against the
//! begin of its chirp.

use crate::fixtures::media::sync_clips::{Clip, Kind, PLAIN, Pace, chirp_begins, make, read_picture};
use ndarray::Array1;
use ndarray_npy::NpzReader;
use orator_base::stage::progress::Silent;
use orator_base::stage::{Stage, Unit};
use orator_base::types::sound::{SAMPLE_RATE, sample_at};
use orator_base::types::time::FrameRate;
use orator_dataset::config;
use orator_media::ffmpeg::frames::FrameReader;
use orator_pipeline::extract::ExtractStage;
use std::fs::{self, File};
use std::path::Path;

/// Maximum rounding of frame and audio times by a container, seconds.
const ROUNDING_SECS: f64 = 0.001;

/// Largest errors in one clip, ms.
#[derive(Debug, Default)]
struct Worst {
    n_edges: usize,
    /// |motion - audio| and its bound, where their ratio is largest.
    offset: f64,
    bound: f64,
    /// |frame time reported by `extract` - truth|.
    frame: f64,
    /// |begin of a chirp in audio.wav - truth|.
    audio: f64,
    /// Smallest and largest value of begin of a chirp - truth.
    audio_from: f64,
    audio_to: f64,
}

impl Worst {
    fn update(&mut self, offset_secs: f64, slower_secs: f64) {
        let (offset, bound) = (1e3 * offset_secs.abs(), 1.0 + 500.0 * slower_secs);
        if offset / bound > self.offset / self.bound.max(1e-9) {
            (self.offset, self.bound) = (offset, bound);
        }
    }
}

fn measure(dir: &Path, kind: &Kind, clip: &Clip, fps: u32) -> Worst {
    let out = dir.join(format!("out_{}_{fps}", kind.name));
    fs::create_dir(&out).unwrap();
    let settings = config::ExtractConfig { fps, ..Default::default() };
    let rate = settings.rate();
    let unit = Unit { speaker: "host".into(), video: "clip".into(), source: clip.path.clone() };
    ExtractStage::new(&settings).run(&unit, &out, &Silent).unwrap();
    let mut timeline = NpzReader::new(File::open(out.join("timeline.npz")).unwrap()).unwrap();
    let source_secs: Array1<f64> = timeline.by_name("source_secs").unwrap();
    let wav = hound::WavReader::open(out.join("audio.wav")).unwrap();
    assert_eq!((wav.spec().sample_rate, wav.spec().channels), (SAMPLE_RATE, 1));
    let samples: Vec<f32> = wav.into_samples::<i16>().map(|s| f32::from(s.unwrap()) / 32_768.0).collect();
    let shown: Vec<(usize, bool)> =
        FrameReader::open(&clip.path, rate).unwrap().map(|frame| read_picture(&frame.unwrap().image)).collect();
    assert_eq!(shown.len(), source_secs.len());
    compare(clip, rate, &shown, source_secs.as_slice().unwrap(), &samples)
}

/// `shown`: source number and brightness of each dataset frame; `source_secs`: its time reported by `extract`.
fn compare(clip: &Clip, rate: FrameRate, shown: &[(usize, bool)], source_secs: &[f64], samples: &[f32]) -> Worst {
    // Dataset time is 0 at the first frame.
    let zero = clip.pictures[shown[0].0];
    let dataset_secs = rate.secs(1);
    // Begin of frame n in the audio, as in a shard.
    let begins = |n: usize| sample_at(rate, SAMPLE_RATE, n) as f64 / f64::from(SAMPLE_RATE);
    let gap = |k: usize| clip.pictures[k] - clip.pictures[k - 1];
    let mut worst = Worst { audio_from: f64::MAX, audio_to: f64::MIN, ..Worst::default() };
    let is_complete = |on: f64, off: f64| on - zero > 0.1 && off - zero < begins(shown.len() - 1) - 0.1;
    for flash in clip.flashes.iter().filter(|flash| is_complete(flash.on_secs, flash.off_secs)) {
        let late = chirp_begins(samples, SAMPLE_RATE, flash.on_secs - zero) - (flash.on_secs - zero);
        worst.audio = worst.audio.max(1e3 * late.abs());
        (worst.audio_from, worst.audio_to) = (worst.audio_from.min(1e3 * late), worst.audio_to.max(1e3 * late));
        let first = shown.iter().position(|(number, _)| *number >= flash.first).unwrap();
        let end = shown.iter().position(|(number, _)| *number >= flash.end).unwrap();
        assert!(
            shown[first - 1..=end]
                .iter()
                .map(|(_, bright)| *bright)
                .eq((first..=end + 1).map(|n| n > first && n <= end))
        );
        for (n, k, at) in [(first, flash.first, flash.on_secs), (end, flash.end, flash.off_secs)] {
            let motion = (begins(n - 1) + begins(n)) / 2.0;
            worst.update(motion - (at - zero + late), dataset_secs.max(gap(k)));
            worst.n_edges += 1;
        }
        // Frames from a second before the flash to a second after it.
        let around = first.saturating_sub(rate.num as usize)..(end + rate.num as usize).min(shown.len());
        for n in around {
            let k = shown[n].0;
            if k == 0 || k + 1 >= clip.pictures.len() {
                continue;
            }
            let truth = clip.pictures[k] - zero;
            worst.frame = worst.frame.max(1e3 * (source_secs[n] - truth).abs());
            worst.update(begins(n) - (truth + late), dataset_secs.max(gap(k)).max(gap(k + 1)));
        }
    }
    worst
}

/// Writes and measures each clip at its dataset rate, prints its errors and checks their bounds.
fn check_sync(kinds: &[(Kind, u32)]) {
    let dir = tempfile::tempdir().unwrap();
    let mut failed = Vec::new();
    for (kind, fps) in kinds {
        let Some(clip) = make(dir.path(), kind) else { continue };
        let worst = measure(dir.path(), kind, &clip, *fps);
        eprintln!(
            "{:24} -> {fps} fps: {:3} edges, |motion - audio| {:6.3} ms of {:6.3}; frame {:.3} ms, audio {:+.3} to {:+.3} ms",
            kind.name, worst.n_edges, worst.offset, worst.bound, worst.frame, worst.audio_from, worst.audio_to
        );
        let rounding_ms = 1e3 * (ROUNDING_SECS + kind.jitter_secs);
        let enough = worst.n_edges >= 2 * (kind.secs / 2.37) as usize - 6;
        if !enough || worst.offset > worst.bound || worst.frame > rounding_ms || worst.audio > rounding_ms {
            failed.push((kind.name, worst));
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

const fn at(num: u32, den: u32) -> Pace {
    Pace::Constant(num, den)
}

const X264_B: &str = "-c:v libx264 -preset faster -crf 20 -g 50 -bf 3";
const X265: &str = "-c:v libx265 -preset ultrafast -crf 20 -x265-params log-level=none:bframes=3";

const VP9: &str = "-c:v libvpx-vp9 -deadline realtime -cpu-used 8 -b:v 1M";
/// ffmpeg's WebM muxer does not compensate the pre-skip of Opus, which every reader removes (CodecDelay in Matroska).
const WEBM_EARLY_SECS: f64 = -312.0 / 48_000.0;

#[test]
fn constant_rates_are_synchronised() {
    check_sync(&[
        (Kind { name: "25.mp4", pace: at(25, 1), ..PLAIN }, 15),
        (Kind { name: "30.mp4", ..PLAIN }, 15),
        (Kind { name: "29.97.mp4", pace: at(30_000, 1_001), sound_rate: 44_100, ..PLAIN }, 15),
        (Kind { name: "60.mp4", pace: at(60, 1), ..PLAIN }, 15),
        (Kind { name: "10.mp4", pace: at(10, 1), ..PLAIN }, 15),
        (Kind { name: "23.976.mp4", pace: at(24_000, 1_001), ..PLAIN }, 25),
    ]);
}

#[test]
fn variable_rates_are_synchronised() {
    let variable = Kind { pace: Pace::Variable, secs: 40.0, ..PLAIN };
    check_sync(&[
        (Kind { name: "variable.mp4", ..variable }, 15),
        (Kind { name: "variable.mkv", ..variable }, 15),
        (Kind { name: "variable_b.mp4", video: X264_B, ..variable }, 25),
        (Kind { name: "variable_hevc.mp4", video: X265, ..variable }, 15),
    ]);
}

#[test]
fn all_codecs_and_containers_are_synchronised() {
    let hevc = Kind { video: X265, ..PLAIN };
    let b = Kind { video: X264_B, sound_rate: 44_100, ..PLAIN };
    check_sync(&[
        (Kind { name: "hevc.mp4", ..hevc }, 15),
        (Kind { name: "hevc.mkv", ..hevc }, 15),
        (Kind { name: "hevc.mov", sound: "-c:a pcm_s16le", sound_rate: 44_100, ..hevc }, 15),
        (Kind { name: "vp9_opus.webm", video: VP9, sound: "-c:a libopus", sound_at: WEBM_EARLY_SECS, ..PLAIN }, 15),
        (Kind { name: "vp9_opus.mp4", video: VP9, sound: "-c:a libopus", ..PLAIN }, 15),
        (Kind { name: "bframes.mp4", ..b }, 15),
        (Kind { name: "bframes.mkv", ..b }, 15),
        (Kind { name: "bframes.mov", ..b }, 15),
        (Kind { name: "vorbis.mkv", sound: "-c:a libvorbis", ..PLAIN }, 15),
        (Kind { name: "mp3.mkv", sound: "-c:a libmp3lame", sound_rate: 44_100, ..PLAIN }, 15),
        (Kind { name: "mp3.mp4", sound: "-c:a libmp3lame", sound_rate: 44_100, ..PLAIN }, 15),
        (Kind { name: "mpeg4_pcm.avi", video: "-c:v mpeg4 -q:v 3", sound: "-c:a pcm_s16le", ..PLAIN }, 15),
        (Kind { name: "ac3.ts", video: X264_B, sound: "-c:a ac3", ..PLAIN }, 15),
    ]);
}

#[test]
fn offsets_and_edit_lists_are_synchronised() {
    let b = Kind { video: X264_B, ..PLAIN };
    let late = Kind { before: ["", "-itsoffset 0.1"], sound_at: 0.1, ..PLAIN };
    let early = Kind { before: ["-itsoffset 0.3", ""], sound_at: -0.3, ..b };
    let cut = Kind { then: ["-ss 3.21", "-c copy"], ..b };
    check_sync(&[
        (Kind { name: "begins_at_3.5_s.mp4", container: "-output_ts_offset 3.5", ..PLAIN }, 15),
        (Kind { name: "begins_at_3.5_s.mkv", container: "-output_ts_offset 3.5", ..PLAIN }, 15),
        (Kind { name: "begins_at_1.4_s.ts", container: "-muxdelay 1.4", ..b }, 15),
        (Kind { name: "sound_100_ms_late.mp4", ..late }, 15),
        (Kind { name: "sound_100_ms_late.mkv", ..late }, 15),
        (Kind { name: "sound_100_ms_late.mov", sound: "-c:a pcm_s16le", ..late }, 15),
        (Kind { name: "sound_300_ms_early.mp4", ..early }, 15),
        (Kind { name: "sound_300_ms_early.mkv", ..early }, 15),
        (Kind { name: "cut.mp4", ..cut }, 15),
        (Kind { name: "cut.mkv", ..cut }, 15),
        (Kind { name: "no_edit_list.mp4", container: "-use_editlist 0", ..b }, 15),
        (Kind { name: "negative_offsets.mp4", container: "-movflags +negative_cts_offsets", ..b }, 15),
        (Kind { name: "fragments.mp4", container: "-movflags +frag_keyframe+delay_moov", ..b }, 15),
    ]);
}

#[test]
fn audio_gaps_drift_and_jitter_are_compensated() {
    let lossy = Kind { then: ["", "-c copy -bsf:a noise=amount=-1:drop=eq(mod(n\\,113)\\,60)"], secs: 40.0, ..PLAIN };
    let pcm = Kind {
        sound: "-c:a pcm_s16le -af asetpts=PTS*1.0005",
        secs: 40.0,
        sound_pace: 1.0005,
        jitter_secs: 0.0005,
        ..PLAIN
    };
    let fast = Kind { sound: "-c:a flac -af asetpts=PTS*0.9999", sound_pace: 0.9999, sound_rate: 44_100, ..pcm };
    let jitter = "-c:a pcm_s16le -af asetpts=PTS+(random(0)-0.5)*0.01/TB";
    check_sync(&[
        (Kind { name: "lost_packets.mp4", ..lossy }, 15),
        (Kind { name: "lost_packets.mkv", ..lossy }, 15),
        (Kind { name: "sound_500_ppm_slow.mkv", ..pcm }, 15),
        (Kind { name: "sound_100_ppm_fast.mkv", ..fast }, 15),
        (Kind { name: "jitter_10_ms.mkv", sound: jitter, sound_pace: 1.0, jitter_secs: 0.005, ..pcm }, 15),
    ]);
}

#[test]
fn all_audio_rates_are_synchronised() {
    let pcm = Kind { sound: "-c:a pcm_s16le", ..PLAIN };
    check_sync(&[
        (Kind { name: "8000.mov", sound_rate: 8_000, ..pcm }, 15),
        (Kind { name: "16000.mov", sound_rate: 16_000, ..pcm }, 15),
        (Kind { name: "22050.mov", sound_rate: 22_050, ..pcm }, 15),
        (Kind { name: "44100.mov", sound_rate: 44_100, ..pcm }, 15),
        (Kind { name: "48000.mov", ..pcm }, 15),
        (Kind { name: "96000.mov", sound_rate: 96_000, ..pcm }, 15),
    ]);
}

/// `ORATOR_LONG=1` (`make prove`) tests ten minutes, otherwise 40 s.
#[test]
fn no_drift_over_ten_minutes() {
    let secs = if std::env::var("ORATOR_LONG").is_ok() { 600.0 } else { 40.0 };
    let long = Kind { secs, ..PLAIN };
    check_sync(&[
        (Kind { name: "long_29.97.mp4", pace: at(30_000, 1_001), sound_rate: 44_100, ..long }, 15),
        (Kind { name: "long_variable.mkv", pace: Pace::Variable, ..long }, 15),
    ]);
}
