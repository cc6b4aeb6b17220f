//! `orator guide`.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use crate::guide::TOPICS;
use anyhow::Result;
use clap::builder::PossibleValuesParser;
use serde_json::json;

/// Print a page of the guide, or the list of its pages.
///
/// The pages are Markdown: `orator guide dataset | less`.
#[derive(clap::Args)]
pub struct Args {
    /// Page to print; none: the list.
    #[arg(value_parser = PossibleValuesParser::new(TOPICS.map(|topic| topic.name)))]
    topic: Option<String>,
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    let facts = |topic: &crate::guide::Topic| json!({ "topic": topic.name, "summary": topic.summary });
    match TOPICS.iter().find(|topic| Some(topic.name) == args.topic.as_deref()) {
        Some(topic) => {
            let mut page = facts(topic);
            page["text"] = topic.text.into();
            ui.summary(topic.text, None, page);
        }
        None => {
            let lines = TOPICS.map(|topic| format!("{:14} {}", topic.name, topic.summary)).join("\n");
            let list: Vec<_> = TOPICS.iter().map(facts).collect();
            ui.summary(&lines, Some("orator guide TOPIC"), json!({ "topics": list }));
        }
    }
    Ok(Outcome::Done)
}
