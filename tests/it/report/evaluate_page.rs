//! The HTML page of an evaluation, as written and as displayed in a browser.

use crate::fixtures::browser::Browser;
use crate::fixtures::motion_folders::folders;
use orator_test_support::project::Project;

#[test]
fn the_page_opens_plays_and_can_be_scrubbed_with_keys() {
    let project = Project::with_clips("judged-page", 0, 1.0);
    folders(project.dir(), &[14, 8, 9]);
    let args =
        ["evaluate", "--truth", "truth", "--prediction", "prediction", "--audio", "audio", "--report", "deep/p.html"];
    let answer = project.answer(&args);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let page = project.dir().join("deep/p.html");
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(html.len() < 8_000_000 && !html.contains("://") && !html.contains(&*project.dir().to_string_lossy()));
    assert_eq!(project.answer(&args).code, 0);
    assert_eq!(std::fs::read_to_string(&page).unwrap(), html, "the output is deterministic");
    let Some(mut browser) = Browser::open(&page, [1280, 900]) else { return };
    let mut count = |selector: &str| browser.value(&format!("document.querySelectorAll('{selector}').length"));
    assert_eq!((count("#excerpt option"), count(".over-time:not([hidden])")), (3.into(), 1.into()));
    assert_eq!((count("circle.share"), count(".speed svg"), count(".conclusion")), (46.into(), 4.into(), 2.into()));
    assert!(count(".metrics tbody tr").as_u64().unwrap() > 30 && count(".definitions details").as_u64().unwrap() > 30);
    for (width, scheme) in [(360, "dark"), (360, "light"), (1280, "dark"), (1280, "light")] {
        browser.resize([width, 800]);
        browser.colours(scheme);
        let wide = browser.value("document.documentElement.scrollWidth").as_u64().unwrap();
        assert!(wide <= u64::from(width), "{wide} px wide in a window of {width} px");
    }
    // Both figures are drawn, and they differ.
    let drawn = |side: &str| {
        format!(
            "(() => {{ const c = document.getElementById('{side}'); const d = c.getContext('2d')\
             .getImageData(0, 0, c.width, c.height).data; let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; \
             return n }})()"
        )
    };
    let [truth, predicted] = ["truth", "predicted"].map(|side| browser.value(&drawn(side)).as_u64().unwrap());
    assert!(truth > 500 && predicted > 500 && truth != predicted, "{truth} {predicted}");
    // Arrow keys scrub.
    browser.value("document.getElementById('at').focus()");
    for _ in 0..5 {
        browser.press("ArrowRight");
    }
    let at = |browser: &mut Browser| browser.value("Number(document.getElementById('at').value)").as_f64().unwrap();
    let scrubbed = at(&mut browser);
    assert!((scrubbed - 5.0 / 15.0).abs() < 0.02, "{scrubbed}");
    let line = "Number(document.querySelector('.over-time:not([hidden]) line.at').getAttribute('x1'))";
    assert!(browser.value(line).as_f64().unwrap() > 5.0);
    // The time advances when playing and stops when paused.
    browser.value("document.getElementById('play').click()");
    std::thread::sleep(std::time::Duration::from_millis(1200));
    let played = at(&mut browser);
    assert!(played > scrubbed + 0.3, "{scrubbed} {played}");
    browser.value("document.getElementById('play').click()");
    let paused = at(&mut browser);
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert_eq!(at(&mut browser), paused);
    // Another excerpt starts at its beginning and has its own charts.
    let chosen = browser.value(
        "(() => { const s = document.getElementById('excerpt'); s.value = 2; s.dispatchEvent(new Event('change')); \
         return [document.getElementById('at').value, document.querySelector('.over-time:not([hidden])').dataset.excerpt]\
         .join('|') })()",
    );
    assert_eq!(chosen, "0|2");
    assert!(browser.problems.is_empty(), "{:?}", browser.problems);
}
