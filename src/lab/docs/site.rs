//! Pages of the site: an index, a page per topic of the guide, and the gallery. They link to each other by relative
//! names, so the site works from a folder.

use super::gallery::GalleryItem;
use super::markdown::GuidePage;
use anyhow::Result;
use orator::guide::{TOPICS, Topic};
use orator_base::stage::workdir;
use orator_report::html::{Node, html_file, node, page_head};
use std::path::{Path, PathBuf};

const STYLE: &str = include_str!("page.css");
/// Name of the first page.
pub const INDEX: &str = "index";
/// Name of the page of the gallery, and of the folder of its files.
pub const GALLERY: &str = "gallery";

/// File of the page `name`.
pub fn file_name(name: &str) -> String {
    format!("{name}.html")
}

/// Page of the site.
struct SitePage {
    name: &'static str,
    /// Sentence under the title.
    lead: String,
    content: GuidePage,
}

/// Writes the pages into `dir`, with the files of `items` in its folder `gallery`; returns the paths.
///
/// # Errors
/// A picture of the gallery cannot be read; a page cannot be written.
pub fn write(dir: &Path, items: &[GalleryItem]) -> Result<Vec<PathBuf>> {
    let topic_page = |topic: &Topic| SitePage {
        name: topic.name,
        lead: topic.summary.to_owned(),
        content: GuidePage::of_markdown(topic.text),
    };
    let mut pages = vec![index()];
    pages.extend(TOPICS.iter().map(topic_page));
    pages.push(gallery_page(&dir.join(GALLERY), items)?);
    let write_page = |page: &SitePage| -> Result<PathBuf> {
        let path = dir.join(file_name(page.name));
        workdir::write_file(&path, html(page, &pages).as_bytes())?;
        Ok(path)
    };
    pages.iter().map(write_page).collect()
}

/// Links to all topics, with their contents.
fn index() -> SitePage {
    let entry = |name: &str, summary: &str| {
        let link = node("a").attr("href", file_name(name)).text(name);
        node("tr").child(node("th").child(link)).child(node("td").text(summary))
    };
    let mut rows: Vec<Node> = TOPICS.iter().map(|topic| entry(topic.name, topic.summary)).collect();
    rows.push(entry(GALLERY, "pictures of the demo, and the commands that made them"));
    let table = node("table").child(node("tbody").children(rows));
    let sections = vec![node("section").child(node("h2").text("Pages")).child(table)];
    SitePage {
        name: INDEX,
        lead: "Videos of one speaker to a 3D speech-gesture dataset, and to a model that gestures like that speaker."
            .to_owned(),
        content: GuidePage { title: "orator".to_owned(), contents: Vec::new(), sections },
    }
}

/// Pictures in `folder`, with the commands that made them.
fn gallery_page(folder: &Path, items: &[GalleryItem]) -> Result<SitePage> {
    let contents = items.iter().map(|item| (item.anchor.to_owned(), item.title.to_owned())).collect();
    let mut sections = items.iter().map(|item| item.section(folder)).collect::<Result<Vec<Node>>>()?;
    if items.is_empty() {
        let text = "There is no demo yet: run `make demo`, then `make docs`.";
        sections.extend(GuidePage::of_markdown(text).sections);
    }
    let lead = "Made by the commands shown, which run in the folder of the demo (`make demo`).".to_owned();
    Ok(SitePage { name: GALLERY, lead, content: GuidePage { title: "Gallery".to_owned(), contents, sections } })
}

/// Text of the file of a page that links to all `pages`.
fn html(page: &SitePage, pages: &[SitePage]) -> String {
    let to_page = |other: &SitePage| {
        let link = node("a").attr("href", file_name(other.name)).text(other.name);
        if other.name == page.name { link.attr("aria-current", "page") } else { link }
    };
    let to_section = |(anchor, title): &(String, String)| node("a").attr("href", format!("#{anchor}")).text(title);
    let mut top = node("header")
        .child(node("h1").text(&page.content.title))
        .child(node("p").class("lead").text(&page.lead))
        .child(node("nav").attr("aria-label", "Pages").children(pages.iter().map(to_page)));
    if !page.content.contents.is_empty() {
        let links = page.content.contents.iter().map(to_section);
        top = top.child(node("nav").attr("aria-label", "Contents of this page").children(links));
    }
    let body = node("body")
        .child(node("a").class("skip").attr("href", "#main").text("Skip to content"))
        .child(top)
        .child(node("main").id("main").children(page.content.sections.iter().cloned()));
    html_file(page_head(&page.content.title, STYLE), body)
}
