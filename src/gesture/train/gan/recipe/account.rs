//! What a recipe chose, and why, in five lines.

use super::material::TrainingMaterial;
use super::settings::GanSettings;
use orator_dataset::config::GanRecipe;

/// Five lines on the settings of a training that begins; `secs_a_step`: time of a step on this machine,
/// where it was measured.
pub fn lines(settings: &GanSettings, material: &TrainingMaterial, secs_a_step: Option<f64>) -> Vec<String> {
    let of = settings;
    let minutes = |secs: f64| format!("{:.1} min", secs / 60.0);
    let name = match of.recipe {
        GanRecipe::Auto => "auto",
        GanRecipe::Paper => "paper",
    };
    let (train, held_out) = (minutes(material.train_secs), minutes(material.validation_secs));
    let whose = if material.n_speakers > 1 { format!(" of {} speakers", material.n_speakers) } else { String::new() };
    let time = secs_a_step.map(|secs| format!(", about {} here", minutes(secs * of.steps as f64))).unwrap_or_default();
    let steps =
        format!("{} steps of {} windows{time}, with a validation each {} steps", of.steps, of.batch, of.epoch_steps);
    vec![
        format!("recipe {name} for {train} of speech{whose}, {held_out} held out"),
        format!("  {steps}{}", ending(of)),
        format!("  learning rate {}{}{}{}", of.learning_rate, shared(of), schedule(of), average(of)),
        format!("  {}{}", adversary(of), motion(of)),
        format!("  {}", regularisation(of)),
    ]
}

fn ending(of: &GanSettings) -> String {
    match of.patience {
        0 => String::new(),
        epochs => {
            format!("; ends after {epochs} validations without a better score, when more training no longer helps")
        }
    }
}

fn shared(of: &GanSettings) -> String {
    match of.shared_rate {
        1.0 => String::new(),
        0.0 => " of the new speaker's layer alone".to_owned(),
        share => format!(" of the new speaker's layer, {:.1} % of it for what all speakers share", 100.0 * share),
    }
}

fn schedule(of: &GanSettings) -> String {
    let rise = if of.warmup_steps > 0 { format!(", rising for {} steps", of.warmup_steps) } else { String::new() };
    let fade = match of.fade_to {
        1.0 => String::new(),
        left => format!(", fading to {:.0} % of it at the last step", 100.0 * left),
    };
    rise + &fade
}

fn average(of: &GanSettings) -> String {
    match of.ema_decay {
        0.0 => String::new(),
        decay => format!("; the mean of the weights over about {:.0} steps is kept", 1.0 / (1.0 - decay)),
    }
}

fn adversary(of: &GanSettings) -> String {
    if of.lambda_gan == 0.0 {
        return "no discriminator".to_owned();
    }
    let from = match (of.adversarial_from, of.adversarial_ramp) {
        (0, 0) => String::new(),
        (from, ramp) => format!(" from step {from} on, whole at step {}: the network hears first", from + ramp),
    };
    format!("adversarial weight {}{from}", of.lambda_gan)
}

/// What holds the motion to the data's beside the position of each joint.
fn motion(of: &GanSettings) -> String {
    let weights = [("speed", of.lambda_speed), ("energy", of.lambda_energy)];
    let used = weights.into_iter().filter(|(_, weight)| *weight > 0.0);
    used.map(|(name, weight)| format!(", {name} {weight:.2}")).collect()
}

fn regularisation(of: &GanSettings) -> String {
    let mut parts = Vec::new();
    let mut part = |is_there: bool, text: String| {
        if is_there {
            parts.push(text);
        }
    };
    part(of.augment_speed > 0.0, format!("speed {:.0} %", 100.0 * of.augment_speed));
    part(of.augment_pitch > 0.0, format!("pitch {:.1} bands", of.augment_pitch));
    part(of.augment_gain_db > 0.0, format!("loudness {:.0} dB", of.augment_gain_db));
    part(of.augment_noise_db > -120.0, format!("noise to {:.0} dB", of.augment_noise_db));
    let (bands, secs) = (of.augment_mask_bands, of.augment_mask_secs);
    part(bands > 0 || secs > 0.0, format!("masks to {bands} bands and {secs:.2} s"));
    part(of.augment_mirror > 0.0, format!("{:.0} % mirrored", 100.0 * of.augment_mirror));
    part(of.augment_pose_noise > 0.0, format!("noise {:.2} on poses", of.augment_pose_noise));
    part(of.dropout > 0.0, format!("dropout {:.2}", of.dropout));
    part(of.weight_decay > 0.0, format!("weight decay {:.2}", of.weight_decay));
    match parts.is_empty() {
        true => "nothing against learning by heart".to_owned(),
        false => format!("against learning by heart: {}", parts.join(", ")),
    }
}
