//! Shot boundaries in videos composed of the synthetic speaker and test images: transitions that end a shot, their
//! times, and changes that do not end one.

use crate::fixtures::clips::ffmpeg;
use ndarray::Array1;
use ndarray_npy::NpzReader;
use orator_base::stage::progress::Silent;
use orator_base::stage::{Stage, Unit};
use orator_dataset::config;
use orator_pipeline::extract::ExtractStage;
use orator_test_support::project::speaker_clip;
use orator_test_support::skip::real_data;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Frames at `fps` that begin a shot.
fn cuts(video: &Path, fps: u32) -> Vec<usize> {
    let out = video.with_extension(fps.to_string());
    std::fs::create_dir(&out).unwrap();
    let unit = Unit { speaker: "host".into(), video: "clip".into(), source: video.to_owned() };
    let settings = config::ExtractConfig { fps, ..Default::default() };
    ExtractStage::new(&settings).run(&unit, &out, &Silent).unwrap();
    let mut npz = NpzReader::new(File::open(out.join("timeline.npz")).unwrap()).unwrap();
    let scores: Array1<f64> = npz.by_name("shot_score").unwrap();
    let threshold = config::SegmentConfig::default().shot_threshold;
    (0..scores.len()).filter(|n| scores[*n] >= threshold).collect()
}

/// Writes a video of `inputs` through a filter graph with the output `[v]` to `dir`.
fn write_video(dir: &Path, name: &str, inputs: &str, graph: &str) -> PathBuf {
    let out = dir.join(format!("{name}.mp4"));
    let args = format!(
        "{inputs} -filter_complex {graph} -map [v] -c:v libx264 -preset ultrafast -crf 20 -pix_fmt yuv420p {}",
        out.display()
    );
    assert!(ffmpeg(dir, &args), "{name}");
    out
}

/// Checks videos with a transition of each kind that starts at 2 s and takes `secs`, at each rate.
fn check_transitions(dir: &Path, inputs: &str, kinds: &[(&str, f64)], rates: &[u32]) {
    let fmt = "fps=30,scale=320:240,setsar=1,settb=1/30,setpts=PTS-STARTPTS";
    for (kind, secs) in kinds {
        let graph = format!(
            "[0:v]{fmt},trim=0:4[a];[1:v]{fmt},trim=0:3.5[b];[a][b]xfade=transition={kind}:duration={secs}:offset=2[v]"
        );
        let video = write_video(dir, &format!("{kind}-{secs}"), inputs, &graph);
        for &fps in rates {
            let found = cuts(&video, fps);
            let [first, last] = [2.0, 2.0 + secs].map(|at| at * f64::from(fps));
            let slack = f64::from(fps) * (0.25 * secs + 0.15);
            eprintln!("{kind} of {secs} s at {fps}: shots begin at {found:?}, transition {first:.0} to {last:.0}");
            assert!(!found.is_empty(), "{kind} of {secs} s at {fps}");
            let inside = |n: &usize| (first - slack..=last + slack + 1.0).contains(&(*n as f64));
            assert!(found.iter().all(inside), "{kind} of {secs} s at {fps}: {found:?}");
        }
    }
}

#[test]
fn dissolves_wipes_and_fades_end_a_shot_at_their_time() {
    let dir = tempfile::tempdir().unwrap();
    let speaker = speaker_clip(dir.path(), 5.0, 3);
    let inputs = format!("-i {} -f lavfi -i testsrc2=size=320x240:rate=30:duration=5", speaker.display());
    let kinds =
        [("fade", 0.4), ("fade", 1.0), ("dissolve", 0.6), ("wipeleft", 0.6), ("circleopen", 0.6), ("fadeblack", 1.0)];
    check_transitions(dir.path(), &inputs, &kinds, &[15]);
    check_transitions(dir.path(), &inputs, &kinds[1..4], &[10]);
}

#[test]
fn transitions_between_real_clips_end_a_shot() {
    let Some(videos) = real_data("data/videos") else { return };
    let dir = tempfile::tempdir().unwrap();
    let clip = |name: &str, from: f64| format!("-ss {from} -t 5 -i {}", videos.join(name).display());
    let tyson = clip("talk_tyson_2cam_17s_720p.mp4", 1.0);
    let phone = clip("talk_phoneman_33s_1080p_UNSURE.mp4", 4.0);
    let seth = clip("generated/mdd_showcase_seth1.mp4", 1.0);
    let kinds = [("fade", 0.5), ("fade", 2.0), ("wipeleft", 1.0), ("fadeblack", 1.0)];
    for (n, pair) in [[&tyson, &phone], [&phone, &seth], [&seth, &tyson]].into_iter().enumerate() {
        let dir = dir.path().join(n.to_string());
        std::fs::create_dir(&dir).unwrap();
        check_transitions(&dir, &format!("{} {}", pair[0], pair[1]), &kinds[n..n + 2], &[15]);
    }
}

/// Camera movements and light changes that do not end a shot.
const MOVES: [(&str, &str); 9] = [
    ("pan", "scale=1280:960,crop=640:480:x=t*100:y=200,scale=320:240"),
    ("fast-pan", "scale=1280:960,crop=640:480:x=t*200:y=100+t*50,scale=320:240"),
    ("shake", "scale=1280:960,crop=1000:750:x=140+100*sin(t*9):y=100+80*cos(t*13),scale=320:240"),
    ("zoom", "scale=1280:960,zoompan=z=1+0.012*in:d=1:x=iw/2-iw/zoom/2:y=ih/2-ih/zoom/2:s=320x240:fps=30"),
    ("scroll", "scale=320:240,scroll=h=0.008"),
    ("brighter-and-darker", "scale=320:240,eq=brightness=0.2*sin(t*2):eval=frame"),
    ("lamp", "scale=320:240,eq=brightness=0.2*gte(t\\,1.5):eval=frame"),
    ("contrast", "scale=320:240,eq=contrast=1-0.6*clip((t-1)*2\\,0\\,1):eval=frame"),
    ("flash", "scale=320:240,eq=brightness=0.9*between(mod(n\\,30)\\,14\\,16):eval=frame"),
];

fn check_moves(dir: &Path, input: &str, rates: &[u32]) {
    for (name, filter) in MOVES {
        let video = write_video(dir, name, input, &format!("[0:v]fps=30,{filter},setsar=1[v]"));
        for &fps in rates {
            let found = cuts(&video, fps);
            assert!(found.is_empty(), "{name} of {input} at {fps}: {found:?}");
        }
    }
}

#[test]
fn camera_movements_and_light_changes_do_not_end_a_shot() {
    let dir = tempfile::tempdir().unwrap();
    let speaker = speaker_clip(dir.path(), 3.0, 3);
    check_moves(dir.path(), &format!("-i {}", speaker.display()), &[15, 10]);
}

#[test]
fn movements_and_light_changes_of_real_clips_do_not_end_a_shot() {
    let Some(videos) = real_data("data/videos") else { return };
    for name in ["talk_tyson_2cam_17s_720p.mp4", "talk_oliver_wan_3.5s_1080p.mp4", "talk_kim_7s_1080p.mp4"] {
        let dir = tempfile::tempdir().unwrap();
        check_moves(dir.path(), &format!("-ss 1 -t 2.4 -i {}", videos.join(name).display()), &[15]);
    }
}
