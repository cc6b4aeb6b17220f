//! The guide as HTML pages: links, markup, and the pages in a browser.

use crate::fixtures::browser::Browser;
use orator_lab::docs::site;
use orator_test_support::project::program;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Text of each page by file name.
fn pages(dir: &Path) -> BTreeMap<String, String> {
    let read =
        |path: &Path| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read_to_string(path).unwrap());
    site::write(dir, &[]).unwrap().iter().map(|path| read(path)).collect()
}

/// Values of an attribute.
fn values<'a>(html: &'a str, attribute: &str) -> Vec<&'a str> {
    let begin = format!(" {attribute}=\"");
    html.split(begin.as_str()).skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

#[test]
fn every_link_of_the_site_resolves() {
    let dir = tempfile::tempdir().unwrap();
    let pages = pages(dir.path());
    for topic in orator::guide::TOPICS {
        let html = &pages[&site::file_name(topic.name)];
        assert!(html.contains("<h1>") && html.contains("aria-current=\"page\""), "{}", topic.name);
    }
    for (name, html) in &pages {
        let anchors = values(html, "id");
        assert_eq!(anchors.iter().collect::<BTreeSet<_>>().len(), anchors.len(), "{name}: {anchors:?}");
        for link in values(html, "href") {
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { Some(html) } else { pages.get(file) };
            let has_anchor = |html: &String| anchor.is_empty() || values(html, "id").contains(&anchor);
            assert!(target.is_some_and(has_anchor), "{name}: {link}");
        }
        assert_eq!(values(html, "src"), [""; 0], "{name}");
    }
    assert_eq!(pages.len(), orator::guide::TOPICS.len() + 2);
    let linked: BTreeSet<&str> = values(&pages["training.html"], "href").into_iter().collect();
    assert!(linked.contains("papers.html") && linked.contains("#several-speakers"), "{linked:?}");
}

#[test]
fn elements_of_the_site_are_closed_in_order() {
    let dir = tempfile::tempdir().unwrap();
    for (name, html) in pages(dir.path()) {
        let mut open = Vec::new();
        for tag in html.split('<').skip(1) {
            let (tag, _) = tag.split_once('>').unwrap_or_else(|| panic!("{name}: <{tag}"));
            let element = tag.split_whitespace().next().unwrap_or_default();
            match element.strip_prefix('/') {
                Some(closed) => assert_eq!(open.pop(), Some(closed), "{name}"),
                None if ["!doctype", "br", "hr", "img", "meta"].contains(&element) => {}
                None => open.push(element),
            }
        }
        assert!(open.is_empty(), "{name}: {open:?}");
    }
}

#[test]
fn the_program_writes_pages_that_a_browser_shows() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("site");
    let written = Command::new(program("orator-lab")).arg("docs").arg(&out).output().unwrap();
    let printed = String::from_utf8_lossy(&written.stdout);
    assert!(written.status.success() && printed.contains("index.html"), "{printed}");
    for name in ["index", "tutorial", "papers", "configuration"] {
        let Some(mut browser) = Browser::open(&out.join(site::file_name(name)), [1280, 900]) else { return };
        for width in [360, 1280] {
            browser.resize([width, 800]);
            let wide = browser.value("document.documentElement.scrollWidth").as_u64().unwrap();
            assert!(wide <= u64::from(width), "{name}: {wide} px wide in a window of {width} px");
        }
        assert_ne!(browser.value("document.querySelectorAll('main section').length"), 0, "{name}");
        assert!(browser.problems.is_empty(), "{name}: {:?}", browser.problems);
    }
}
