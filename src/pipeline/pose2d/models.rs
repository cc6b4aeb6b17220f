//! Which models look at a frame: the ids of the configuration, with `auto` answered by the folder of models.

use crate::config::Pose2dConfig;
use crate::external::onnx::{AUTO, ModelRole, ModelStore, Wanted};
use anyhow::{Context, Result};

/// The keys of `[pose2d]` that name a model, with the role of each and what the configuration says.
pub fn keys(config: &Pose2dConfig) -> [(&'static str, ModelRole, &String); 4] {
    [
        ("person", ModelRole::Person, &config.person),
        ("body", ModelRole::Body, &config.body),
        ("hand", ModelRole::Hand, &config.hand),
        ("palm", ModelRole::Palm, &config.palm),
    ]
}

/// The configuration with a model's id in the place of every `auto`.
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
    let [person, body, hand, palm] = keys(config).map(id);
    Ok(Pose2dConfig { person: person?, body: body?, hand: hand?, palm: palm?, ..config.clone() })
}

/// What `ModelStore::fetch` is asked for, so that every model of the configuration is there.
pub fn wanted(config: &Pose2dConfig) -> Vec<Wanted> {
    let named = keys(config).into_iter().filter(|(_, _, id)| !id.is_empty());
    named.map(|(_, role, id)| if id == AUTO { Wanted::Role(role) } else { Wanted::Id(id.clone()) }).collect()
}
