//! Ranges of the settings: one line a key.

use super::Settings;
use super::auto::Auto;
use super::file::{Problem, SourceLocation};
use std::collections::{BTreeMap, BTreeSet};

/// Every value out of its range, with what was expected.
pub fn check(settings: &Settings, locations: &BTreeMap<String, SourceLocation>) -> Vec<Problem> {
    let mut rules = Rules { locations, problems: Vec::new() };
    let s = settings;
    rules.within("extract.fps", f64::from(s.extract.fps), 1.0, 120.0, "frames a second");
    rules.within("extract.audio_track", s.extract.audio_track as f64, 0.0, 100.0, "");
    rules.within("pose2d.person_every", s.pose2d.person_every as f64, 1.0, 10_000.0, "frames");
    rules.within("pose2d.palm_every", s.pose2d.palm_every as f64, 1.0, 10_000.0, "frames");
    rules.within("pose2d.person_follow", s.pose2d.person_follow, 0.0, 1.0, "");
    rules.within("pose2d.hand_score", s.pose2d.hand_score, 0.0, 1.0, "");
    rules.within("pose2d.joint_score", s.pose2d.joint_score, 0.0, 1.0, "");
    rules.within("segment.shot_threshold", s.segment.shot_threshold, 0.0, 1.0, "");
    rules.within("segment.min_frames", s.segment.min_frames as f64, 1.0, 1e6, "frames");
    rules.within("segment.joint_score", s.segment.joint_score, 0.0, 1.0, "");
    rules.within("segment.max_body_gap_secs", s.segment.max_body_gap_secs, 0.0, 1.0, "seconds, all that lift fills");
    rules.within("segment.max_hand_gap_secs", s.segment.max_hand_gap_secs, 0.0, 1.0, "seconds, all that lift fills");
    rules.within("segment.min_hand_share", s.segment.min_hand_share, 0.0, 1.0, "");
    rules.within("segment.max_rest_move", s.segment.max_rest_move, 0.0, 1.0, "shoulder widths");
    rules.within("segment.min_shoulder_px", s.segment.min_shoulder_px, 1.0, 1e5, "pixels");
    rules.within("segment.min_sound_db", s.segment.min_sound_db, -120.0, 0.0, "dB of full scale");
    rules.within("segment.min_speech", s.segment.min_speech, 0.0, 1.0, "");
    rules.within("segment.min_lip_sync", s.segment.min_lip_sync, -1.0, 1.0, "");
    rules.within("segment.max_quiet_secs", s.segment.max_quiet_secs, 0.0, 60.0, "seconds");
    rules.within("segment.min_change", s.segment.min_change, 0.0, 255.0, "steps of 8-bit colour");
    rules.within("segment.max_still_secs", s.segment.max_still_secs, 0.0, 1.0, "seconds, all that lift fills");
    rules.within("segment.min_facing", s.segment.min_facing, -10.0, 10.0, "neck-nose distances");
    rules.within("segment.max_nose_off", s.segment.max_nose_off, 0.0, 10.0, "half shoulder widths");
    rules.within("segment.max_people", f64::from(s.segment.max_people), 1.0, 255.0, "people");
    rules.within("segment.max_crowd_share", s.segment.max_crowd_share, 0.0, 1.0, "");
    rules.within("segment.max_jump", s.segment.max_jump, 0.01, 100.0, "shoulder widths");
    rules.within("lift.max_bone_change", s.lift.max_bone_change, 0.01, 100.0, "bone lengths");
    rules.within("lift.smooth_arms", s.lift.smooth_arms, 0.0, 30.0, "frames");
    rules.within("lift.smooth_hands", s.lift.smooth_hands, 0.0, 30.0, "frames");
    rules.within("dataset.max_mb", f64::from(s.dataset.max_mb), 1.0, 100_000.0, "megabytes");
    rules.within("dataset.validation", s.dataset.validation, 0.0, 0.9, "");
    rules.within("dataset.test", s.dataset.test, 0.0, 0.9, "");
    rules.within("dataset.duplicate_secs", s.dataset.duplicate_secs, 0.0, 3600.0, "seconds");
    if s.dataset.validation + s.dataset.test > 0.95 {
        rules.problem("dataset.test", "validation and test together leave less than 5 % to train on".to_owned());
    }
    rules.within("gan.window_frames", s.gan.window_frames as f64, 32.0, 4096.0, "frames");
    if !s.gan.window_frames.is_multiple_of(32) {
        rules.problem("gan.window_frames", format!("{} is not a multiple of 32", s.gan.window_frames));
    }
    rules.within("gan.stride_frames", s.gan.stride_frames as f64, 1.0, 4096.0, "frames");
    rules.count("gan.batch", s.gan.batch, 2.0, 4096.0, "windows");
    rules.count("gan.steps", s.gan.steps, 1.0, 1e9, "steps");
    rules.number("gan.learning_rate", s.gan.learning_rate, 1e-9, 1.0, "");
    rules.within("gan.lambda_l1", s.gan.lambda_l1, 0.0, 1e4, "");
    rules.number("gan.lambda_speed", s.gan.lambda_speed, 0.0, 1e4, "");
    rules.number("gan.lambda_energy", s.gan.lambda_energy, 0.0, 1e4, "");
    rules.within("gan.lambda_velocity", s.gan.lambda_velocity, 0.0, 1e4, "");
    rules.count("gan.epoch_steps", s.gan.epoch_steps, 1.0, 1e9, "steps");
    rules.number("gan.lambda_gan", s.gan.lambda_gan, 0.0, 1e4, "");
    rules.within("gan.lambda_bone", s.gan.lambda_bone, 0.0, 1e4, "");
    rules.number("gan.shared_rate", s.gan.shared_rate, 0.0, 1.0, "");
    rules.count("gan.warmup_steps", s.gan.warmup_steps, 0.0, 1e9, "steps");
    rules.number("gan.fade_to", s.gan.fade_to, 0.0, 1.0, "");
    rules.count("gan.adversarial_from", s.gan.adversarial_from, 0.0, 1e9, "steps");
    rules.count("gan.adversarial_ramp", s.gan.adversarial_ramp, 0.0, 1e9, "steps");
    rules.number("gan.ema_decay", s.gan.ema_decay, 0.0, 0.999_999, "");
    rules.number("gan.dropout", s.gan.dropout, 0.0, 0.9, "");
    rules.number("gan.weight_decay", s.gan.weight_decay, 0.0, 10.0, "");
    rules.number("gan.augment_speed", s.gan.augment_speed, 0.0, 0.5, "");
    rules.number("gan.augment_pitch", s.gan.augment_pitch, 0.0, 16.0, "bands");
    rules.number("gan.augment_gain_db", s.gan.augment_gain_db, 0.0, 40.0, "dB");
    rules.number("gan.augment_noise_db", s.gan.augment_noise_db, -120.0, 20.0, "dB");
    rules.count("gan.augment_mask_bands", s.gan.augment_mask_bands, 0.0, 32.0, "bands");
    rules.number("gan.augment_mask_secs", s.gan.augment_mask_secs, 0.0, 2.0, "seconds");
    rules.number("gan.augment_pose_noise", s.gan.augment_pose_noise, 0.0, 2.0, "deviations");
    rules.within("gan.augment_mirror", s.gan.augment_mirror, 0.0, 1.0, "");
    rules.count("gan.patience", s.gan.patience, 0.0, 1e9, "epochs");
    rules.within("gan.checkpoint_every", s.gan.checkpoint_every as f64, 1.0, 1e9, "steps");
    rules.within("gan.keep_checkpoints", s.gan.keep_checkpoints as f64, 1.0, 1e6, "checkpoints");
    rules.within("seq2seq.stride_frames", s.seq2seq.stride_frames as f64, 0.0, 4096.0, "frames");
    rules.within("seq2seq.batch", s.seq2seq.batch as f64, 2.0, 4096.0, "segments");
    rules.within("seq2seq.steps", s.seq2seq.steps as f64, 1.0, 1e9, "steps");
    rules.within("seq2seq.learning_rate", s.seq2seq.learning_rate, 1e-9, 1.0, "");
    rules.within("seq2seq.fade_from", s.seq2seq.fade_from as f64, 0.0, 1e9, "steps");
    rules.within("seq2seq.lambda_continuity", s.seq2seq.lambda_continuity, 0.0, 1e4, "");
    rules.within("seq2seq.lambda_reach", s.seq2seq.lambda_reach, 0.0, 1e4, "");
    rules.within("seq2seq.lambda_adversarial", s.seq2seq.lambda_adversarial, 0.0, 1e4, "");
    rules.within("seq2seq.words_around_secs", s.seq2seq.words_around_secs, 0.0, 60.0, "s");
    rules.within("seq2seq.own_previous", s.seq2seq.own_previous, 0.0, 1.0, "");
    rules.within("seq2seq.word_dropout", s.seq2seq.word_dropout, 0.0, 0.95, "");
    rules.within("seq2seq.hidden", s.seq2seq.hidden as f64, 1.0, 4096.0, "numbers");
    rules.within("seq2seq.autoencoder_steps", s.seq2seq.autoencoder_steps as f64, 0.0, 1e9, "steps");
    rules.within("seq2seq.epoch_steps", s.seq2seq.epoch_steps as f64, 1.0, 1e9, "steps");
    rules.within("seq2seq.checkpoint_every", s.seq2seq.checkpoint_every as f64, 1.0, 1e9, "steps");
    rules.within("seq2seq.keep_checkpoints", s.seq2seq.keep_checkpoints as f64, 1.0, 1e6, "checkpoints");
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

    fn within(&mut self, key: &str, value: f64, low: f64, high: f64, unit: &str) {
        if !(low..=high).contains(&value) {
            let message = format!("{value} is out of range: expected {low} to {high} {unit}");
            self.problem(key, message.trim_end().to_owned());
        }
    }

    /// A number that is not left to the program.
    fn number(&mut self, key: &str, value: Auto<f64>, low: f64, high: f64, unit: &str) {
        if let Some(value) = value.given() {
            self.within(key, value, low, high, unit);
        }
    }

    /// A whole number that is not left to the program.
    fn count(&mut self, key: &str, value: Auto<usize>, low: f64, high: f64, unit: &str) {
        if let Some(value) = value.given() {
            self.within(key, value as f64, low, high, unit);
        }
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
            if speaker.videos.is_empty() && speaker.keypoints.is_empty() {
                self.problem(&format!("speaker[{at}].videos"), "no video named".to_owned());
            }
        }
    }
}
