//! `orator-lab docs`.

use crate::docs::gallery::{self, GalleryItem};
use crate::docs::site;
use anyhow::Result;
use orator::cli::Outcome;
use orator::cli::ui::Ui;
use orator_base::text::counted;
use serde_json::json;
use std::path::PathBuf;

/// Write the guide as HTML pages, with a gallery of the demo.
#[derive(clap::Args)]
pub struct Args {
    /// Folder of the pages; created if it does not exist.
    out: PathBuf,
    /// Folder of a complete demo (`make demo`), for the pictures of the gallery.
    #[arg(long, value_name = "DIR")]
    demo: Option<PathBuf>,
}

pub fn run(args: &Args, ui: &Ui) -> Result<Outcome> {
    let items: &[GalleryItem] = match &args.demo {
        Some(demo) => {
            gallery::make(&gallery::ITEMS, demo, &args.out.join(site::GALLERY))?;
            &gallery::ITEMS
        }
        None => &[],
    };
    let pages = site::write(&args.out, items)?;
    let next = format!("xdg-open {}", args.out.join(site::file_name(site::INDEX)).display());
    let text = format!("wrote {} to {}", counted(pages.len(), "page"), args.out.display());
    ui.summary(&text, Some(&next), json!({ "pages": pages, "next": next }));
    Ok(Outcome::Done)
}
