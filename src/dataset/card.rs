//! Dataset card `README.md`: a YAML header in the format of dataset hubs, and a description for readers.

use super::info::{DatasetInfo, ModelUsed};
use super::leakage::Leakage;
use super::split::{Split, SplitRule};
use super::stats::DatasetStats;
use crate::config::choices::SplitUnit;
use orator_base::stage::ledger::WordCount;
use orator_base::text::length;
use std::fmt::Write;

/// Text of the dataset card.
pub fn text(info: &DatasetInfo, stats: &DatasetStats, leakage: &Leakage) -> String {
    let mut text = header(info);
    let speaker = &info.speaker;
    let _ = write!(
        text,
        "# Speech and gestures of {speaker}\n\n\
         3D upper-body and finger motion with its speech: one speaker, {} of motion kept of {} of video, at {}.\n\n\
         | split | videos | intervals | length |\n|---|---|---|---|\n",
        length(stats.footage.kept_secs),
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
        "\n## A sample\n\nA sample is an interval: continuous motion with its sound. Its files in a shard are\n\n| file | shape | element | meaning |\n|---|---|---|---|\n"
    );
    for (name, member) in &info.members {
        let _ = writeln!(text, "| `{name}` | {} | {} | {} |", member.shape, member.element, member.meaning);
    }
    let axes = &info.axes;
    let _ = write!(
        text,
        "\nAxes: x {}, y {}, z {}; {}; the origin is {}. `info.json` names joints, parents and sides. Sizes are a convention, \
         as no picture tells them: arms and shoulders of a common adult, hands in proportion to the forearm.\n",
        axes.x, axes.y, axes.z, axes.unit, axes.origin
    );
    let _ = write!(
        text,
        "\n## Reading it\n\n```python\nfrom datasets import Audio, load_dataset\n\
         Audio.encode_example = lambda self, value: value  # the sound stays a wav file: no torchcodec is needed\n\
         rows = load_dataset(\"webdataset\", data_files={{\"train\": \"train-*.tar\"}}, split=\"train\")\n\
         rows = rows.cast_column(\"wav\", Audio(decode=False))\n```\n\n\
         ```python\nimport glob, webdataset\n\
         motion = webdataset.WebDataset(sorted(glob.glob(\"train-*.tar\")), shardshuffle=False).decode()\n```\n\n\
         `orator dataset verify --deep .` checks every byte; so does `b3sum --check checksums.b3`.\n\n\
         ## What became of the footage\n\n| | length |\n|---|---|\n| kept | {} |\n",
        length(stats.footage.kept_secs)
    );
    for (reason, secs) in &stats.footage.refused_secs {
        let _ = writeln!(text, "| refused: {reason} | {} |", length(*secs));
    }
    let _ = writeln!(text, "| failed | {} |", length(stats.footage.failed_secs));
    if let Some(WordCount { n_words, n_kept, .. }) = stats.footage.words {
        let _ = writeln!(text, "\nOf {n_words} words in the transcripts {n_kept} lie in samples.");
    }
    if let Some(posture) = &stats.posture {
        let n_frames = info.splits.get(Split::Train.name()).map_or(0, |split| split.frames).max(1) as f64;
        let seen = posture.iter().map(|(channel, angles)| (channel.name(), 100.0 * angles.n_seen[0] as f64 / n_frames));
        let seen: Vec<String> = seen.map(|(name, percent)| format!("the {name} in {percent:.1} %")).collect();
        let _ = writeln!(text, "\nOf the frames to train on {} were seen.", seen.join(" and "));
    }
    let _ = write!(
        text,
        "\n`ledger.jsonl` says of every second of every video which it was, with what was measured.\n\n## Splits\n\n\
         {} {}\n",
        describe_splits(info.split_rule.as_ref()),
        describe_leakage(leakage)
    );
    let or_unstated = |text: &str| if text.is_empty() { "not said".to_owned() } else { text.to_owned() };
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
    let _ = write!(text, "\nMade by {}{models}.", info.tool);
    for note in &info.notes {
        let _ = write!(text, " {note}");
    }
    text.push('\n');
    text
}

/// Paragraph on how the dataset is divided into splits.
fn describe_splits(rule: Option<&SplitRule>) -> String {
    match rule {
        None => "A video is in one split as a whole; its content's hash, or the maker, chooses which.".to_owned(),
        Some(SplitRule { unit: SplitUnit::Time, why, guard_secs }) => format!(
            "Videos are divided by time, in blocks of one split each ({why}). Two splits of a video are at least \
             {guard_secs:.2} s apart: that is longer than a training window with all that its numbers were made from, so \
             none was made from sound or motion of another split. Person, room and camera are those of the training \
             split: the test is of new speech, not of a new recording."
        ),
        Some(SplitRule { why, .. }) => format!(
            "A video is in one split as a whole ({why}). New videos fill the splits toward their shares by seconds, or \
             the maker chooses; no video changes its split."
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
        _ => "100K<n<1M",
    }
}

/// Sentence on sound shared between videos.
fn describe_leakage(leakage: &Leakage) -> String {
    if leakage.duplicate_secs <= 0.0 {
        return "Whether videos share sound was not looked at.".to_owned();
    }
    let same = match leakage.shared.len() {
        0 => "none do".to_owned(),
        1 => "two do".to_owned(),
        n => format!("{n} pairs do"),
    };
    let leaks = match leakage.leaks.len() {
        0 => "none across splits".to_owned(),
        n => format!("{n} ACROSS SPLITS, see `leakage.json`"),
    };
    format!("Videos that share {} s of sound or more belong together: {same}, {leaks}.", leakage.duplicate_secs)
}
