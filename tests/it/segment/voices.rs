//! Own voices are distinguished from other voices on real clips, and audio shifts are estimated. `ORATOR_LONG=1` (`make
//! prove`) uses all clips, otherwise two of them. Clips with generated lips are measured separately.

use crate::fixtures::media::voices::{TalkingClip, WINDOW_SECS, area, openness, rejected};
use orator_base::audio::openness::Openness;
use orator_test_support::project::{Project, files_under};
use orator_test_support::skip::{fetched_model, fetched_models, real_data};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Clips of talking persons, with the frame rate of the file.
const TALKING: [(&str, f64); 5] = [
    ("talk_tyson_2cam_17s_720p", 30.0),
    ("talk_kim_7s_1080p", 30.0),
    ("talk_latentsync_demo1_1080x1920_hevc", 25.0),
    ("talk_oliver_wan_3.5s_1080p", 30.0),
    ("talk_phoneman_33s_1080p_UNSURE", 30.0),
];
/// Clips whose lips are certainly not generated.
const REAL: [&str; 2] = ["talk_tyson_2cam_17s_720p", "talk_kim_7s_1080p"];
const GENERATED: [&str; 10] = [
    "mdd_long_chemistry",
    "mdd_long_seth",
    "mdd_showcase_chemistry1",
    "mdd_showcase_chemistry2",
    "mdd_showcase_jon1",
    "mdd_showcase_jon2",
    "mdd_showcase_oliver1",
    "mdd_showcase_oliver2",
    "mdd_showcase_seth1",
    "mdd_showcase_seth2",
];
/// Recordings of a speaker who is in none of the clips.
const VOICES: [&str; 2] = ["beat2_2_scott_0_2_2_16k.wav", "beat2_2_scott_0_4_4_16k.wav"];

/// Speaker of the clip of that name.
fn speaker(name: &str) -> &str {
    let name = name.trim_start_matches("talk_").trim_start_matches("mdd_");
    let name = name.trim_start_matches("long_").trim_start_matches("showcase_");
    name.split('_').next().unwrap().trim_end_matches(|c: char| c.is_ascii_digit())
}

/// Area under the curve over all clips, and its bootstrap 95 % interval over clips.
fn with_interval(clips: &[(Vec<f64>, Vec<f64>)], rng: &mut ChaCha8Rng) -> [f64; 3] {
    let roc = |drawn: &[usize]| {
        let own: Vec<f64> = drawn.iter().flat_map(|k| clips[*k].0.clone()).collect();
        let others: Vec<f64> = drawn.iter().flat_map(|k| clips[*k].1.clone()).collect();
        area(&own, &others)
    };
    let mut drawn: Vec<f64> = (0..400)
        .map(|_| roc(&(0..clips.len()).map(|_| rng.random_range(0..clips.len())).collect::<Vec<_>>()))
        .collect();
    drawn.sort_by(f64::total_cmp);
    [roc(&(0..clips.len()).collect::<Vec<_>>()), drawn[10], drawn[389]]
}

#[test]
fn own_voices_are_distinguished_from_others_and_shifts_estimated() {
    let (Some(videos), Some(audio), Some(models), Some(_)) =
        (real_data("data/videos"), real_data("data/audio"), fetched_models(), fetched_model("face_landmark_192.onnx"))
    else {
        return;
    };
    let is_long = std::env::var("ORATOR_LONG").is_ok();
    let talking = TALKING.iter().filter(|(name, _)| is_long || REAL.contains(name));
    let mut named: Vec<(String, f64)> = talking.map(|(name, fps)| ((*name).to_owned(), *fps)).collect();
    if is_long {
        named.extend(GENERATED.iter().map(|name| (format!("generated/{name}"), 25.0)));
    }
    named.retain(|(name, _)| videos.join(format!("{name}.mp4")).is_file());

    let project = Project::with_clips("voices", 0, 0.0);
    let files: Vec<String> = named.iter().map(|(name, _)| format!("{}/{name}.mp4", videos.display())).collect();
    let text = format!("[models]\ndir = {models:?}\n[[speaker]]\nname = \"host\"\nvideos = {files:?}\n");
    std::fs::write(project.dir().join("pipeline.toml"), text).unwrap();
    let answer = project.run(&["--to", "segment"]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let work = files_under(&project.work());
    let output = |name: &str, ending: &str| {
        let slug = name.rsplit('/').next().unwrap().to_lowercase().replace(['_', '.'], "-");
        let is_match = |file: &&(String, std::path::PathBuf)| file.0.contains(&slug) && file.0.ends_with(ending);
        work.iter().find(is_match).unwrap_or_else(|| panic!("no {ending} of {name}")).1.clone()
    };
    let clips: Vec<TalkingClip> = named
        .iter()
        .map(|(name, source_fps)| {
            let ledger = std::fs::read_to_string(output(name, "ledger.json")).unwrap();
            assert!(!ledger.contains("voice of another"), "{name}: the own voice is rejected");
            let mut clip =
                TalkingClip::read(&output(name, "keypoints.npz"), &output(name, "audio.wav"), *source_fps).unwrap();
            clip.name = name.trim_start_matches("generated/").to_owned();
            clip
        })
        .collect();
    let recorded: Vec<(Openness, f64)> =
        VOICES.iter().map(|name| audio.join(name)).filter(|path| path.is_file()).map(|path| openness(&path)).collect();

    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut scored, mut n_found, mut n_shifts) = (Vec::new(), [0, 0], [0, 0]);
    // Probabilities of talking and of generated clips, with their own and with other voices.
    let mut of_frames = [0; 2].map(|_| [Vec::new(), Vec::new()]);
    for clip in &clips {
        let offset = clip.offset();
        let own = clip.windows(&clip.voice, 0.0);
        let of_clips = clips.iter().filter(|other| speaker(&other.name) != speaker(&clip.name));
        let others = of_clips.map(|other| (&other.voice, other.secs)).chain(recorded.iter().map(|(v, s)| (v, *s)));
        let (mut other, mut others_of_clip) = (Vec::new(), Vec::new());
        for (voice, secs) in others {
            for _ in 0..4 {
                let slack = secs - clip.secs;
                let shift = rng.random_range(slack.min(0.0)..=slack.max(0.0));
                other.extend(clip.windows(voice, shift));
                others_of_clip.extend(clip.own_voice(voice, shift));
            }
        }
        let is_generated = clip.name.starts_with("mdd");
        let mut worst: f64 = 0.0;
        for error in clip.shift_errors(10.0, 7.3) {
            n_shifts[usize::from(is_generated)] += 1;
            n_found[usize::from(is_generated)] += usize::from(error <= 1.0 / clip.source_fps + 1e-9);
            worst = worst.max(error);
        }
        let area = area(&own, &other);
        eprintln!(
            "{:<38} {offset}, correlation {:.2}, confidence {:.4}; area {area:.3} ({} own, {} other windows); shifts \
             of 10 s within {:.0} ms",
            clip.name,
            offset.correlation,
            offset.confidence,
            own.len(),
            other.len(),
            1000.0 * worst
        );
        scored.push((clip.name.clone(), (own, other)));
        let frames = &mut of_frames[usize::from(is_generated)];
        frames[0].extend(clip.own_voice(&clip.voice, 0.0));
        frames[1].extend(others_of_clip);
    }
    let group = |is_in: &dyn Fn(&str) -> bool| -> Vec<(Vec<f64>, Vec<f64>)> {
        scored.iter().filter(|(name, _)| is_in(name)).map(|(_, scores)| scores.clone()).collect()
    };
    let is_generated = |name: &str| name.starts_with("mdd");
    let groups: [(&str, Vec<_>); 3] = [
        ("clips with certainly real lips", group(&|name| REAL.contains(&name))),
        ("talking clips", group(&|name| !is_generated(name))),
        ("generated clips", group(&is_generated)),
    ];
    for (name, clips) in groups.iter().filter(|(_, clips)| !clips.is_empty()) {
        let [area, low, high] = with_interval(clips, &mut rng);
        eprintln!("{name}: area under the curve at {WINDOW_SECS} s {area:.3} (95 %: {low:.3} to {high:.3})");
        // With two clips alone there are few other voices.
        let min_area = if *name == "generated clips" { 0.85 } else { 0.95 };
        assert!(area >= if is_long { min_area } else { 0.9 }, "{name}: {area}");
    }
    for (name, [own, others]) in ["talking clips", "generated clips"].into_iter().zip(&of_frames) {
        let [own, _] = rejected(name, own, others);
        assert!(own <= 0.01, "{name}: {own}");
    }
    check_shifts(n_found, n_shifts);
}

/// Checks the shares of talking and of generated clips whose shifts are estimated within one source frame.
fn check_shifts(n_found: [usize; 2], n_shifts: [usize; 2]) {
    for (name, k) in [("talking", 0), ("generated", 1)] {
        let share = n_found[k] as f64 / n_shifts[k].max(1) as f64;
        eprintln!(
            "{name}: {} of {} shifts estimated within a frame of the source ({:.1} %)",
            n_found[k],
            n_shifts[k],
            100.0 * share
        );
        assert!(n_shifts[k] == 0 || share >= 0.95, "{name}: {share}");
    }
}
