//! Which models look at a frame: the ids of the configuration, with `auto` answered by the folder of models.

use anyhow::{Context, Result, ensure};
use orator_dataset::config::{FollowRule, Pose2dConfig, Settings};
use orator_onnx::{AUTO, ModelEntry, ModelRole, ModelStore, Wanted};

/// The keys of `[pose2d]` that name a model, with the role of each and what the configuration says.
pub fn keys(config: &Pose2dConfig) -> [(&'static str, ModelRole, &String); 5] {
    [
        ("person", ModelRole::Person, &config.person),
        ("body", ModelRole::Body, &config.body),
        ("hand", ModelRole::Hand, &config.hand),
        ("palm", ModelRole::Palm, &config.palm),
        ("face", ModelRole::Face, &config.face),
    ]
}

/// The configuration with a model's id in place of every `auto`; a face model that is not there is none.
///
/// # Errors
/// An id that the manifest does not have, or of another role.
pub fn choose(config: &Pose2dConfig, store: &ModelStore) -> Result<Pose2dConfig> {
    let id = |(key, role, id): (&str, ModelRole, &String)| -> Result<String> {
        if id.is_empty() {
            return Ok(String::new());
        }
        Ok(store.choose(id, role).with_context(|| format!("pose2d.{key}"))?.id.clone())
    };
    let [person, body, hand, palm, face] = keys(config).map(id);
    let face = if lacks_face(config, store) { String::new() } else { face? };
    Ok(Pose2dConfig { person: person?, body: body?, hand: hand?, palm: palm?, face, ..config.clone() })
}

/// The models that a configuration chooses.
pub struct ChosenModels {
    /// As `choose` returns them.
    pub settings: Pose2dConfig,
    pub store: ModelStore,
}

impl ChosenModels {
    /// Reads the manifest and looks which models are there; opens none.
    ///
    /// # Errors
    /// An invalid manifest; those of `choose`.
    pub fn find(settings: &Settings) -> Result<Self> {
        let store = ModelStore::open(&settings.models.dir)?;
        Ok(Self { settings: choose(&settings.pose2d, &store)?, store })
    }

    /// The models with the key of `[pose2d]` that names each.
    pub fn used(&self) -> Result<Vec<(&'static str, &ModelEntry)>> {
        let named = keys(&self.settings).into_iter().filter(|(_, _, id)| !id.is_empty());
        named.map(|(key, role, id)| Ok((key, self.store.choose(id, role)?))).collect()
    }
}

/// What to say once of a run without the face model that might have it.
pub fn advice(config: &Pose2dConfig, store: &ModelStore) -> Option<&'static str> {
    lacks_face(config, store).then_some(
        "no face model is there, so the voice of somebody who is not seen counts as the speaker's: `orator models fetch` \
         gets the model that sees the mouth",
    )
}

/// Whether the models are named that find who speaks, where that is to be found.
///
/// # Errors
/// The key that is empty, and what to do.
pub fn check_follow(chosen: &Pose2dConfig) -> Result<()> {
    if chosen.follow == FollowRule::Speaking {
        let needs = |key: &str, id: &str, remedy: &str| {
            ensure!(
                !id.is_empty(),
                "pose2d.follow = \"speaking\" needs a model in pose2d.{key}, and there is none: {remedy}"
            );
            Ok(())
        };
        needs("face", &chosen.face, "`orator models fetch` gets one; or write follow = \"largest\"")?;
        needs("person", &chosen.person, "write person = \"auto\", or follow = \"largest\"")?;
    }
    Ok(())
}

/// Whether the face model is left to what is there, and none is.
fn lacks_face(config: &Pose2dConfig, store: &ModelStore) -> bool {
    let is_there = |entry| store.path(entry).is_file();
    config.face == AUTO && !store.choose(AUTO, ModelRole::Face).is_ok_and(is_there)
}

/// What `ModelStore::fetch` is asked for, so that every model of the configuration is there.
pub fn wanted(config: &Pose2dConfig) -> Vec<Wanted> {
    let named = keys(config).into_iter().filter(|(_, _, id)| !id.is_empty());
    named.map(|(_, role, id)| if id == AUTO { Wanted::Role(role) } else { Wanted::Id(id.clone()) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_speaks_is_found_with_a_face_and_a_person_model_or_not_at_all() {
        let speaking = Pose2dConfig { follow: FollowRule::Speaking, ..Pose2dConfig::default() };
        let said = |config: Pose2dConfig| check_follow(&config).err().map(|error| error.to_string());
        assert_eq!(
            (said(speaking.clone()), said(Pose2dConfig { face: String::new(), ..Pose2dConfig::default() })),
            (None, None)
        );
        let face = said(Pose2dConfig { face: String::new(), ..speaking.clone() }).unwrap();
        assert!(face.contains("pose2d.face") && face.contains("orator models fetch"), "{face}");
        assert!(said(Pose2dConfig { person: String::new(), ..speaking.clone() }).unwrap().contains("pose2d.person"));
        // `auto` without the model's file is none.
        let empty = tempfile::tempdir().unwrap();
        let chosen = choose(&speaking, &ModelStore::open(empty.path()).unwrap()).unwrap();
        assert!(said(chosen).is_some());
    }
}
