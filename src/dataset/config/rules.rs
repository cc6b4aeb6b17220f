//! Ranges of the settings: one line a key.

use super::Settings;
use super::auto::AUTO;
use super::file::{Problem, SourceLocation};
use std::collections::{BTreeMap, BTreeSet};
use toml::{Table, Value};

/// Least and greatest value of each number, and its unit.
pub(super) const RANGES: [(&str, f64, f64, &str); 80] = [
    ("extract.fps", 1.0, 120.0, "frames a second"),
    ("extract.audio_track", 0.0, 100.0, ""),
    ("pose2d.person_every", 1.0, 10_000.0, "frames"),
    ("pose2d.palm_every", 1.0, 10_000.0, "frames"),
    ("pose2d.person_follow", 0.0, 1.0, ""),
    ("pose2d.hand_score", 0.0, 1.0, ""),
    ("pose2d.joint_score", 0.0, 1.0, ""),
    ("segment.shot_threshold", 0.0, 1.0, ""),
    ("segment.min_frames", 1.0, 1e6, "frames"),
    ("segment.joint_score", 0.0, 1.0, ""),
    ("segment.max_body_gap_secs", 0.0, 1.0, "seconds, all that lift fills"),
    ("segment.max_hand_gap_secs", 0.0, 1.0, "seconds, all that lift fills"),
    ("segment.min_hand_share", 0.0, 1.0, ""),
    ("segment.max_rest_move", 0.0, 1.0, "shoulder widths"),
    ("segment.min_shoulder_px", 1.0, 1e5, "pixels"),
    ("segment.min_sound_db", -120.0, 0.0, "dB of full scale"),
    ("segment.min_speech", 0.0, 1.0, ""),
    ("segment.min_lip_sync", -1.0, 1.0, ""),
    ("segment.max_quiet_secs", 0.0, 60.0, "seconds"),
    ("segment.min_change", 0.0, 255.0, "steps of 8-bit colour"),
    ("segment.max_still_secs", 0.0, 1.0, "seconds, all that lift fills"),
    ("segment.min_facing", -10.0, 10.0, "neck-nose distances"),
    ("segment.max_nose_off", 0.0, 10.0, "half shoulder widths"),
    ("segment.max_people", 1.0, 255.0, "people"),
    ("segment.max_crowd_share", 0.0, 1.0, ""),
    ("segment.max_jump", 0.01, 100.0, "shoulder widths"),
    ("lift.max_bone_change", 0.01, 100.0, "bone lengths"),
    ("lift.smooth_arms", 0.0, 30.0, "frames"),
    ("lift.smooth_hands", 0.0, 30.0, "frames"),
    ("dataset.max_mb", 1.0, 100_000.0, "megabytes"),
    ("dataset.validation", 0.0, 0.9, ""),
    ("dataset.test", 0.0, 0.9, ""),
    ("dataset.duplicate_secs", 0.0, 3600.0, "seconds"),
    ("gan.window_frames", 32.0, 4096.0, "frames"),
    ("gan.stride_frames", 1.0, 4096.0, "frames"),
    ("gan.batch", 2.0, 4096.0, "windows"),
    ("gan.steps", 1.0, 1e9, "steps"),
    ("gan.learning_rate", 1e-9, 1.0, ""),
    ("gan.lambda_l1", 0.0, 1e4, ""),
    ("gan.lambda_speed", 0.0, 1e4, ""),
    ("gan.lambda_energy", 0.0, 1e4, ""),
    ("gan.lambda_velocity", 0.0, 1e4, ""),
    ("gan.epoch_steps", 1.0, 1e9, "steps"),
    ("gan.lambda_gan", 0.0, 1e4, ""),
    ("gan.lambda_bone", 0.0, 1e4, ""),
    ("gan.shared_rate", 0.0, 1.0, ""),
    ("gan.warmup_steps", 0.0, 1e9, "steps"),
    ("gan.fade_to", 0.0, 1.0, ""),
    ("gan.adversarial_from", 0.0, 1e9, "steps"),
    ("gan.adversarial_ramp", 0.0, 1e9, "steps"),
    ("gan.ema_decay", 0.0, 0.999_999, ""),
    ("gan.dropout", 0.0, 0.9, ""),
    ("gan.weight_decay", 0.0, 10.0, ""),
    ("gan.augment_speed", 0.0, 0.5, ""),
    ("gan.augment_pitch", 0.0, 16.0, "bands"),
    ("gan.augment_gain_db", 0.0, 40.0, "dB"),
    ("gan.augment_noise_db", -120.0, 20.0, "dB"),
    ("gan.augment_mask_bands", 0.0, 32.0, "bands"),
    ("gan.augment_mask_secs", 0.0, 2.0, "seconds"),
    ("gan.augment_pose_noise", 0.0, 2.0, "deviations"),
    ("gan.augment_mirror", 0.0, 1.0, ""),
    ("gan.patience", 0.0, 1e9, "epochs"),
    ("gan.checkpoint_every", 1.0, 1e9, "steps"),
    ("gan.keep_checkpoints", 1.0, 1e6, "checkpoints"),
    ("seq2seq.stride_frames", 0.0, 4096.0, "frames"),
    ("seq2seq.batch", 2.0, 4096.0, "segments"),
    ("seq2seq.steps", 1.0, 1e9, "steps"),
    ("seq2seq.learning_rate", 1e-9, 1.0, ""),
    ("seq2seq.fade_from", 0.0, 1e9, "steps"),
    ("seq2seq.lambda_continuity", 0.0, 1e4, ""),
    ("seq2seq.lambda_reach", 0.0, 1e4, ""),
    ("seq2seq.lambda_adversarial", 0.0, 1e4, ""),
    ("seq2seq.words_around_secs", 0.0, 60.0, "s"),
    ("seq2seq.own_previous", 0.0, 1.0, ""),
    ("seq2seq.word_dropout", 0.0, 0.95, ""),
    ("seq2seq.hidden", 1.0, 4096.0, "numbers"),
    ("seq2seq.autoencoder_steps", 0.0, 1e9, "steps"),
    ("seq2seq.epoch_steps", 1.0, 1e9, "steps"),
    ("seq2seq.checkpoint_every", 1.0, 1e9, "steps"),
    ("seq2seq.keep_checkpoints", 1.0, 1e6, "checkpoints"),
];

/// Every value out of its range, with what was expected.
pub fn check(settings: &Settings, locations: &BTreeMap<String, SourceLocation>) -> Vec<Problem> {
    let mut rules = Rules { locations, problems: Vec::new() };
    // Settings are plain numbers, strings and paths: they always have a TOML form.
    let values = Table::try_from(settings).unwrap_or_default();
    for (key, low, high, unit) in RANGES {
        let value = key.split_once('.').and_then(|(section, name)| values.get(section)?.get(name));
        let value = match value {
            Some(Value::Integer(value)) => *value as f64,
            Some(Value::Float(value)) => *value,
            // Left to a recipe.
            Some(Value::String(text)) if text == AUTO => continue,
            _ => f64::NAN,
        };
        if !(low..=high).contains(&value) {
            let message = format!("{value} is out of range: expected {low} to {high} {unit}");
            rules.problem(key, message.trim_end().to_owned());
        }
    }
    if settings.dataset.validation + settings.dataset.test > 0.95 {
        rules.problem("dataset.test", "validation and test together leave less than 5 % to train on".to_owned());
    }
    if !settings.gan.window_frames.is_multiple_of(32) {
        rules.problem("gan.window_frames", format!("{} is not a multiple of 32", settings.gan.window_frames));
    }
    rules.speakers(settings);
    rules.problems
}

struct Rules<'a> {
    locations: &'a BTreeMap<String, SourceLocation>,
    problems: Vec<Problem>,
}

impl Rules<'_> {
    fn problem(&mut self, key: &str, message: String) {
        let location = self.locations.get(key).copied().unwrap_or(SourceLocation::Line(1));
        self.problems.push(Problem { key: key.to_owned(), location, message });
    }

    fn speakers(&mut self, settings: &Settings) {
        let mut seen = BTreeSet::new();
        for (at, speaker) in settings.speaker.iter().enumerate() {
            let key = format!("speaker[{at}].name");
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
            if speaker.name.is_empty() || !speaker.name.chars().all(plain) {
                let message = "expected letters, digits, - and _ (it names folders)";
                self.problem(&key, format!("{:?}: {message}", speaker.name));
            } else if !seen.insert(speaker.name.to_ascii_lowercase()) {
                self.problem(&key, format!("{:?} is there twice", speaker.name));
            }
            if speaker.fps != 0.0 && !(1.0..=1000.0).contains(&speaker.fps) {
                let message = format!("{} is no frame rate: expected 1 to 1000 frames a second", speaker.fps);
                self.problem(&format!("speaker[{at}].fps"), message);
            }
            if !speaker.size.is_empty() && speaker.image_size().is_none() {
                let message =
                    format!("{:?} is no size: expected width and height in pixels, \"1280x720\"", speaker.size);
                self.problem(&format!("speaker[{at}].size"), message);
            }
            // Where neither is written, the missing key has been told.
            let is_written = |name: &str| self.locations.contains_key(&format!("speaker[{at}].{name}"));
            let is_empty = speaker.videos.is_empty() && speaker.keypoints.is_empty();
            if is_empty && (is_written("videos") || is_written("keypoints")) {
                self.problem(&format!("speaker[{at}].videos"), "no video named".to_owned());
            }
        }
    }
}
