//! Model selection: the ids of the configuration, with `auto` resolved by the files in the model folder.

use crate::process;
use anyhow::{Context, Result, ensure};
use orator_base::types::device::DeviceChoice;
use orator_dataset::config::{FollowRule, ModelsConfig, Pose2dConfig, Settings};
use orator_onnx::{AUTO, ModelEntry, ModelRequest, ModelRole, ModelStore, PICTURES_ON_GPU, Runtime};

/// Keys of `[pose2d]` that name a model, with role and configured id.
pub fn keys(config: &Pose2dConfig) -> [(&'static str, ModelRole, &String); 5] {
    [
        ("person", ModelRole::Person, &config.person),
        ("body", ModelRole::Body, &config.body),
        ("hand", ModelRole::Hand, &config.hand),
        ("palm", ModelRole::Palm, &config.palm),
        ("face", ModelRole::Face, &config.face),
    ]
}

/// Replaces every `auto` in the configuration by a model id; an absent face model becomes the empty id.
///
/// # Errors
/// An id that is not in the manifest, or has another role.
pub fn choose(config: &Pose2dConfig, store: &ModelStore) -> Result<Pose2dConfig> {
    let id = |(key, role, id): (&str, ModelRole, &String)| -> Result<String> {
        if id.is_empty() {
            return Ok(String::new());
        }
        Ok(store.choose(id, role).with_context(|| format!("pose2d.{key}"))?.id.clone())
    };
    let [person, body, hand, palm, face] = keys(config).map(id);
    let face = if face_is_missing(config, store) { String::new() } else { face? };
    Ok(Pose2dConfig { person: person?, body: body?, hand: hand?, palm: palm?, face, ..config.clone() })
}

/// ONNX Runtime with the configured provider, or that of the run that started this process; and why `"auto"` is the CPU.
///
/// # Errors
/// No library; `provider = "cuda"`, and the GPU does not start.
pub fn runtime(models: &ModelsConfig) -> Result<(Runtime, Option<String>)> {
    let runtime = Runtime::load(&models.onnxruntime, &models.dir)?;
    match (models.provider, process::parent_inference()) {
        (DeviceChoice::Cpu, _) => Ok((runtime, None)),
        (_, Some(inference)) => Ok((runtime.with_inference(inference), None)),
        (DeviceChoice::Cuda(gpu), None) => Ok((runtime.on_gpu(gpu, PICTURES_ON_GPU).context("models.provider")?, None)),
        (DeviceChoice::Auto, None) => Ok(match runtime.clone().on_gpu(0, PICTURES_ON_GPU) {
            Ok(on_gpu) => (on_gpu, None),
            Err(error) => (runtime, Some(format!("the image models run on the CPU: {error:#}"))),
        }),
    }
}

pub struct ChosenModels {
    /// Settings with resolved ids, see `choose`.
    pub settings: Pose2dConfig,
    pub store: ModelStore,
}

impl ChosenModels {
    /// Reads the manifest and resolves the ids; opens no model.
    ///
    /// # Errors
    /// An invalid manifest; those of `choose`.
    pub fn find(settings: &Settings) -> Result<Self> {
        let store = ModelStore::open(&settings.models.dir)?;
        Ok(Self { settings: choose(&settings.pose2d, &store)?, store })
    }

    /// Selected models, with the key of `[pose2d]` that names each.
    pub fn used(&self) -> Result<Vec<(&'static str, &ModelEntry)>> {
        let named = keys(&self.settings).into_iter().filter(|(_, _, id)| !id.is_empty());
        named.map(|(key, role, id)| Ok((key, self.store.choose(id, role)?))).collect()
    }
}

/// Advice to print once in a run without the optional face model.
pub fn advice(config: &Pose2dConfig, store: &ModelStore) -> Option<&'static str> {
    face_is_missing(config, store).then_some(
        "no face model is installed, so an off-screen voice is taken for the speaker's: install one with \
         `orator models fetch`",
    )
}

/// Checks that `follow = "speaking"` has the models that it needs.
///
/// # Errors
/// The empty key, and what to do.
pub fn check_follow(chosen: &Pose2dConfig) -> Result<()> {
    if chosen.follow == FollowRule::Speaking {
        let needs = |key: &str, id: &str, remedy: &str| {
            ensure!(!id.is_empty(), "pose2d.follow = \"speaking\" needs a model in pose2d.{key}: {remedy}");
            Ok(())
        };
        needs("face", &chosen.face, "install one with `orator models fetch`, or set follow = \"largest\"")?;
        needs("person", &chosen.person, "set person = \"auto\" or follow = \"largest\"")?;
    }
    Ok(())
}

/// Whether the face model is `auto` and none is installed.
fn face_is_missing(config: &Pose2dConfig, store: &ModelStore) -> bool {
    let is_installed = |entry| store.path(entry).is_file();
    config.face == AUTO && !store.choose(AUTO, ModelRole::Face).is_ok_and(is_installed)
}

/// Models to pass to `ModelStore::fetch`, so that every model of the configuration is installed.
pub fn required_models(config: &Pose2dConfig) -> Vec<ModelRequest> {
    let named = keys(config).into_iter().filter(|(_, _, id)| !id.is_empty());
    named
        .map(|(_, role, id)| if id == AUTO { ModelRequest::Role(role) } else { ModelRequest::Id(id.clone()) })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn following_the_active_speaker_needs_face_and_person_models() {
        let speaking = Pose2dConfig { follow: FollowRule::Speaking, ..Pose2dConfig::default() };
        let error_of = |config: Pose2dConfig| check_follow(&config).err().map(|error| error.to_string());
        assert_eq!(
            (error_of(speaking.clone()), error_of(Pose2dConfig { face: String::new(), ..Pose2dConfig::default() })),
            (None, None)
        );
        let face = error_of(Pose2dConfig { face: String::new(), ..speaking.clone() }).unwrap();
        assert!(face.contains("pose2d.face") && face.contains("orator models fetch"), "{face}");
        assert!(
            error_of(Pose2dConfig { person: String::new(), ..speaking.clone() }).unwrap().contains("pose2d.person")
        );
        // `auto` without an installed model resolves to none.
        let empty = tempfile::tempdir().unwrap();
        let chosen = choose(&speaking, &ModelStore::open(empty.path()).unwrap()).unwrap();
        assert!(error_of(chosen).is_some());
    }
}
