//! Dataset card `README.md`: a YAML header in the format of dataset hubs, and a description for readers.

use super::info::{DatasetInfo, ModelUsed};
use super::leakage::Leakage;
use super::split::{Split, SplitRule};
use super::stats::DatasetStats;
use crate::config::choices::SplitUnit;
use orator_base::stage::ledger::WordCount;
use orator_base::stage::rejection::Rejection;
use orator_base::text::{counted, length, percent};
use std::fmt::Write;

/// Parts of notes in `info.json`, whose wording is part of the fingerprint of a dataset, and their text in the card.
const NOTES: [(&str, &str); 6] = [
    (
        "Where the lips showed surely that the sound of a video was late or early, it was shifted.",
        "Audio that is late or early relative to the lips by a reliable measurement was shifted.",
    ),
    ("Kept sound is speech as the model", "Accepted audio is speech according to the model"),
    (" tells it, at least", " in at least"),
    ("told by loudness alone: kept sound", "detected by loudness only: accepted audio"),
    (
        "silence stands in its place. The motion serves lifters and evaluation, not speech to gesture.",
        "it was replaced by silence. The motion suits lifters and evaluation, not training on speech.",
    ),
    (
        "was captured, not seen in a video: pose2d is 0 everywhere. The bones of a take have their median lengths; by \
         how much that moved its joints is in a sample's json",
        "does not come from a video: pose2d is 0. Bones have their median length in the take; the json of a sample \
         states how far this moved its joints",
    ),
];

/// Shapes and meanings of shard members in `info.json`, and their text in the card.
const MEMBERS: [(&str, &str); 3] = [
    (
        "whether the joint was seen; false where it is missing or was filled in",
        "whether the joint was detected; false where it is missing or interpolated",
    ),
    ("T seconds times the sound rate", "T \u{d7} `sound_rate` / `fps`"),
    (
        "mono sound from the first frame's beginning to the last's end",
        "mono audio from the start of the first frame to the end of the last",
    ),
];

pub fn text(info: &DatasetInfo, stats: &DatasetStats, leakage: &Leakage) -> String {
    let mut text = header(info);
    let speaker = &info.speaker;
    let _ = write!(
        text,
        "# Speech and gestures of {speaker}\n\n\
         3D upper-body and finger motion with its speech: one speaker, {} of motion from {} of video, at {}.\n\n\
         | split | videos | intervals | length |\n|---|---|---|---|\n",
        length(stats.footage.accepted_secs),
        length(stats.footage.secs),
        info.fps
    );
    for split in Split::ALL {
        if let Some(split_info) = info.splits.get(split.name()) {
            let (videos, length) = (split_info.videos.len(), length(split_info.secs));
            let _ = writeln!(text, "| {} | {videos} | {} | {length} |", split.name(), split_info.samples);
        }
    }
    let _ = write!(
        text,
        "\n## Samples\n\nA sample is an interval of continuous motion with its audio. Its files in a shard:\n\n\
         | file | shape | element | meaning |\n|---|---|---|---|\n"
    );
    for (name, member) in &info.members {
        let [shape, meaning] = [&member.shape, &member.meaning].map(|stored| {
            MEMBERS.iter().find(|(from, _)| from == stored).map_or(stored.as_str(), |(_, printed)| printed)
        });
        let _ = writeln!(text, "| `{name}` | {shape} | {} | {meaning} |", member.element);
    }
    let axes = &info.axes;
    let _ = write!(
        text,
        "\nAxes: x {}, y {}, z {}; {}; the origin is {}. `info.json` lists joints, parents and sides. The scale is a \
         convention, because pictures do not determine it: arms and shoulders of an average adult, hands in \
         proportion to the forearm.\n",
        axes.x, axes.y, axes.z, axes.unit, axes.origin
    );
    let _ = write!(
        text,
        "\n## Reading\n\n```python\nfrom datasets import Audio, load_dataset\n\
         Audio.encode_example = lambda self, value: value  # keep audio as wav bytes; torchcodec is not needed\n\
         rows = load_dataset(\"webdataset\", data_files={{\"train\": \"train-*.tar\"}}, split=\"train\")\n\
         rows = rows.cast_column(\"wav\", Audio(decode=False))\n```\n\n\
         ```python\nimport glob, webdataset\n\
         motion = webdataset.WebDataset(sorted(glob.glob(\"train-*.tar\")), shardshuffle=False).decode()\n```\n\n\
         `orator dataset verify --deep .` checks all files; `b3sum --check checksums.b3` checks their hashes.\n\n\
         ## Use of the footage\n\n| | length |\n|---|---|\n| accepted | {} |\n",
        length(stats.footage.accepted_secs)
    );
    for (reason, secs) in &stats.footage.rejected_secs {
        let _ = writeln!(text, "| rejected: {} | {} |", Rejection::label(reason), length(*secs));
    }
    let _ = writeln!(text, "| failed | {} |", length(stats.footage.failed_secs));
    if let Some(WordCount { n_words, n_accepted, .. }) = stats.footage.words {
        let _ = writeln!(text, "\nThe samples contain {n_accepted} of the {n_words} words of the transcripts.");
    }
    if let Some(posture) = &stats.posture {
        let n_frames = info.splits.get(Split::Train.name()).map_or(0, |split| split.frames).max(1) as f64;
        let shares =
            posture.iter().map(|(channel, angles)| (channel.name(), percent(angles.n_visible[0] as f64, n_frames)));
        let shares: Vec<String> = shares.map(|(name, share)| format!("the {name} in {share}")).collect();
        let _ = writeln!(text, "\nVisible in the training split: {} of the frames.", shares.join(", "));
    }
    let _ = write!(
        text,
        "\n`ledger.jsonl` lists every second of every video as accepted, rejected or failed, with the measured \
         values.\n\n## Splits\n\n{} {}\n",
        describe_splits(info.split_rule.as_ref()),
        describe_leakage(leakage)
    );
    let or_unstated = |text: &str| if text.is_empty() { "not stated".to_owned() } else { text.to_owned() };
    let _ = write!(
        text,
        "\n## Terms\n\nLicence: {}. Consent of the speaker: {}. Source: {}.\n",
        or_unstated(&info.licence),
        or_unstated(&info.consent),
        or_unstated(&info.source)
    );
    let terms = |licence: &str| if licence.is_empty() { String::new() } else { format!(", licence {licence}") };
    let model = |model: &ModelUsed| format!("{} ({}{})", model.id, model.role, terms(&model.licence));
    let models: Vec<String> = info.models.iter().map(model).collect();
    let models = if models.is_empty() { String::new() } else { format!(" with the models {}", models.join(", ")) };
    let _ = write!(text, "\nCreated by {}{models}.", info.tool);
    for note in &info.notes {
        let plain = NOTES.iter().fold(note.clone(), |text, (stored, printed)| text.replace(stored, printed));
        let _ = write!(text, " {plain}");
    }
    text.push('\n');
    text
}

/// Paragraph on how the dataset is divided into splits.
fn describe_splits(rule: Option<&SplitRule>) -> String {
    match rule {
        None => "Each video is in one split, chosen by the hash of its content or by the author.".to_owned(),
        Some(SplitRule { unit: SplitUnit::Time, why, guard_secs }) => format!(
            "Videos are divided by time into blocks of one split each ({why}). Splits of a video are at least \
             {guard_secs:.2} s apart, more than a training window with the context of its features, so no window \
             depends on audio or motion of another split. Person, room and camera are the same in all splits: the test \
             split measures generalisation to new speech, not to new recordings."
        ),
        Some(SplitRule { why, .. }) => format!(
            "Each video is in one split ({why}). New videos are assigned to approach the configured shares by \
             duration, unless the author assigns them; no video changes its split."
        ),
    }
}

/// YAML header. Values are quoted as JSON strings, which are valid YAML.
fn header(info: &DatasetInfo) -> String {
    let quoted = |text: &str| serde_json::Value::from(text).to_string();
    let licence = if info.licence.is_empty() { "unknown" } else { &info.licence };
    let samples: usize = info.splits.values().map(|split| split.samples).sum();
    let mut text = format!(
        "---\npretty_name: {}\nlicense: {}\ntags:\n- gesture\n- speech\n- motion\n- 3d-pose\n- webdataset\n\
         task_categories:\n- other\nsize_categories:\n- {}\n",
        quoted(&format!("Speech and gestures of {}", info.speaker)),
        quoted(licence),
        size_category(samples)
    );
    let filled: Vec<&str> = Split::ALL
        .iter()
        .map(|split| split.name())
        .filter(|name| info.splits.get(*name).is_some_and(|s| s.samples > 0))
        .collect();
    if !filled.is_empty() {
        text += "configs:\n- config_name: default\n  data_files:\n";
        for name in filled {
            let _ = writeln!(text, "  - split: {name}\n    path: \"{name}-*.tar\"");
        }
    }
    text + "---\n\n"
}

fn size_category(samples: usize) -> &'static str {
    match samples {
        0..1_000 => "n<1K",
        1_000..10_000 => "1K<n<10K",
        10_000..100_000 => "10K<n<100K",
        100_000..1_000_000 => "100K<n<1M",
        _ => "1M<n<10M",
    }
}

/// Sentence on audio shared between videos.
fn describe_leakage(leakage: &Leakage) -> String {
    if leakage.duplicate_secs <= 0.0 {
        return "Videos were not compared for shared audio.".to_owned();
    }
    let found = match (leakage.shared.len(), leakage.leaks.len()) {
        (0, 0) => "no such pair was found".to_owned(),
        (n, 0) => format!("{} found, none across splits", counted(n, "such pair")),
        (n, leaks) => format!("{} found, {leaks} ACROSS SPLITS (see `leakage.json`)", counted(n, "such pair")),
    };
    format!(
        "Videos that share at least {} of audio are assigned to one split: {found}.",
        length(leakage.duplicate_secs)
    )
}
