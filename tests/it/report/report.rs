//! The report on a run: its values are those of the ledgers, names are escaped, a browser opens it without errors, and
//! a slider predicts the seconds that a run with that threshold accepts.

use crate::fixtures::browser::Browser;
use orator_test_support::project::{ProgramAnswer, Project};
use serde_json::Value;
use std::path::Path;

const NAME: &str = "a <b> & \"c\" 'd'.mp4";
/// Settings strict enough to reject parts of the synthetic speaker's videos.
const STRICT: [&str; 4] = ["--set", "segment.max_body_gap_secs=0.1", "--set", "segment.min_frames=20"];

fn report(project: &Project, args: &[&str]) -> (ProgramAnswer, String) {
    let answer = project.answer(&[&["report", "--out", "deep/r.html"], args].concat());
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let html = std::fs::read_to_string(project.dir().join("deep/r.html")).unwrap();
    (answer, html)
}

fn secs(value: &Value) -> f64 {
    value.as_f64().or_else(|| value.as_str()?.parse().ok()).unwrap()
}

#[test]
fn the_page_is_drawn_and_its_sliders_predict_a_run() {
    let project = Project::with_clips("report", 1, 8.0);
    std::fs::rename(&project.clips()[0], project.video(NAME)).unwrap();
    std::fs::write(project.video("broken.mp4"), "no video").unwrap();
    assert_eq!(project.run(&[&["--to", "lift"], &STRICT[..]].concat()).code, 2);
    let (answer, html) = report(&project, &STRICT);
    let facts = &answer.json;
    assert_eq!((&facts["n_videos"], &facts["bytes"]), (&2.into(), &html.len().into()));
    let rejected: f64 = facts["rejected_secs"].as_object().unwrap().values().map(secs).sum();
    let accepted = secs(&facts["accepted_secs"]);
    assert!(
        rejected > 0.0 && accepted > 0.0 && (rejected + accepted - secs(&facts["duration_secs"])).abs() < 1e-6,
        "{facts}"
    );
    assert!(html.len() < 1_000_000 && !html.contains("<b>") && !html.contains("://"));
    assert!(!html.contains(&*project.dir().to_string_lossy()), "the page contains a path of this machine");
    assert_eq!(html, report(&project, &STRICT).1, "the output is deterministic");
    check_in_browser(&project, facts);
}

#[test]
fn the_page_states_the_splits_of_the_videos() {
    let project = Project::with_clips("report-splits", 2, 4.6);
    // Two videos of the same file name in different folders.
    let [first, second] = &project.clips()[..] else { panic!("expected two clips") };
    let other = project.dir().join("videos/other");
    std::fs::create_dir(&other).unwrap();
    std::fs::rename(second, other.join(first.file_name().unwrap())).unwrap();
    project.name_videos(&["videos/*/*.mp4"]);
    let column = |expected: &str| {
        let (_, html) = report(&project, &[]);
        let videos = html.split_once("id=\"videos\"").map_or(html.as_str(), |(_, table)| table);
        assert!(videos.contains(expected), "{videos:.3000}");
    };
    column("<td>no dataset yet</td>");
    assert_eq!(project.run(&[]).code, 0);
    column("<td>train</td>");
}

/// Checks the page in a browser, and the prediction of a slider with a run.
fn check_in_browser(project: &Project, facts: &Value) {
    let Some(mut browser) = Browser::open(&project.dir().join("deep/r.html"), [1200, 900]) else { return };
    let mut count = |selector: &str| browser.value(&format!("document.querySelectorAll('{selector}').length"));
    assert_eq!(count(".timeline > li"), facts["n_intervals"]);
    assert_eq!(count(".shot img"), facts["n_pictures"]);
    assert_eq!(count("#reasons tbody tr"), facts["rejected_secs"].as_object().unwrap().len() + 1);
    assert_eq!(
        (count("input[type=range]"), count(".distribution svg"), count(".range svg")),
        (19.into(), 16.into(), 6.into())
    );
    assert!(facts["n_pictures"].as_u64().unwrap() > 0);
    let drawn = "[...document.querySelectorAll('canvas[data-preview]')].filter(c => c.getContext('2d')\
                 .getImageData(0, 0, c.width, c.height).data.some(v => v > 0)).length";
    assert_eq!(browser.value(drawn), 1, "one video has accepted motion, which is drawn");
    let flat = "[...document.querySelectorAll('svg, .timeline > li, .bar')].filter(e => { const b = e.getBoundingClientRect(); \
                return !(b.width > 0 && b.height > 0) }).length";
    let unread =
        "[...document.querySelectorAll('.shot img')].map(i => { i.loading = 'eager'; return i.decode() }).length";
    let named = "[...document.querySelectorAll('.videos th a')].map(a => a.textContent).join('|')";
    assert_eq!((browser.value(flat), browser.value(unread)), (0.into(), facts["n_pictures"].clone()));
    assert_eq!(browser.value(named), format!("{NAME}|broken.mp4"));
    for (width, scheme) in [(360, "dark"), (768, "light"), (1200, "light")] {
        browser.resize([width, 800]);
        browser.colours(scheme);
        let wide = browser.value("document.documentElement.scrollWidth");
        assert!(wide.as_u64().unwrap() <= u64::from(width), "{wide} px wide in a window of {width} px");
    }
    // Arrow keys step through a timeline and show the tooltip of a segment.
    browser.value("document.querySelector('.timeline').focus()");
    browser.press("ArrowRight");
    let tip = browser.value("document.getElementById('tip').hidden ? '' : document.getElementById('tip').textContent");
    assert!(tip.as_str().unwrap().starts_with("0:00.0 to "), "{tip}");
    let now = secs(&browser.value("document.getElementById('now').dataset.secs"));
    assert!((now - secs(&facts["accepted_secs"])).abs() < 1e-3, "{now}");
    let moved = "(() => { const s = document.getElementById('slider-max_body_gap_secs'); s.value = 4; \
                 s.dispatchEvent(new Event('input', { bubbles: true })); \
                 return [document.getElementById('now').dataset.secs, document.getElementById('toml').textContent, \
                 document.querySelector('#by-video td.num').textContent].join('|') })()";
    let moved = browser.value(moved);
    let [seconds, toml, video] = moved.as_str().unwrap().split('|').collect::<Vec<_>>()[..] else { panic!("{moved}") };
    let predicted: f64 = seconds.parse().unwrap();
    assert!(predicted > now && video == format!("{predicted:.1} s"), "{moved}, {now} s before");
    assert!(browser.problems.is_empty(), "{:?}", browser.problems);
    // A run with the setting shown on the page accepts the predicted seconds.
    let set = toml.replace("[segment]\n", "segment.").replace(" = ", "=");
    assert!(set.starts_with("segment.max_body_gap_secs=0.2"), "{toml}");
    let set = ["--set", STRICT[3], "--set", &set];
    project.run(&[&["--to", "lift"], &set[..]].concat());
    let accepted = secs(&report(project, &set).0.json["accepted_secs"]);
    assert!((accepted - predicted).abs() < 1e-3, "predicted {predicted} s, accepted {accepted} s");
}

#[test]
fn the_page_lists_missing_files_and_unprocessed_videos() {
    let project = Project::with_clips("nothing-done", 1, 1.0);
    let clip = project.clips().remove(0);
    let missing = project.video("gone.mp4");
    project.name_videos(&[&clip.to_string_lossy(), &missing.to_string_lossy(), "none-*.mp4"]);
    let (answer, html) = report(&project, &[]);
    assert_eq!((&answer.json["n_videos"], &answer.json["accepted_secs"]), (&2.into(), &0.0.into()));
    for text in [
        "The video file is missing",
        "Not processed yet: run `orator run`.",
        "none-*.mp4: no matching file",
        "no motion to show",
    ] {
        assert!(html.contains(text), "{text}");
    }
    if let Some(browser) = Browser::open(Path::new(&project.dir().join("deep/r.html")), [800, 600]) {
        assert!(browser.problems.is_empty(), "{:?}", browser.problems);
    }
    let unknown = project.answer(&["report", "--speaker", "nobody"]);
    assert!(unknown.code == 1 && unknown.errors.contains("unknown speaker nobody"), "{}", unknown.errors);
}
