//! Static files of the pages by path on the server.

const SCRIPT: &str = "text/javascript; charset=utf-8";
const PAGE: &str = "text/html; charset=utf-8";

/// Path, content type and content of every file.
pub const ASSETS: [(&str, &str, &str); 13] = [
    ("/", PAGE, include_str!("page.html")),
    ("/app.css", "text/css; charset=utf-8", include_str!("page.css")),
    ("/app.js", SCRIPT, include_str!("app.js")),
    ("/backend.js", SCRIPT, include_str!("backend.js")),
    ("/dom.js", SCRIPT, include_str!("dom.js")),
    ("/memory.js", SCRIPT, include_str!("memory.js")),
    ("/player.js", SCRIPT, include_str!("player.js")),
    ("/questions.js", SCRIPT, include_str!("questions.js")),
    ("/sound.js", SCRIPT, include_str!("sound.js")),
    ("/texts.js", SCRIPT, include_str!("texts.js")),
    ("/trial.js", SCRIPT, include_str!("trial.js")),
    ("/operator", PAGE, include_str!("operator.html")),
    ("/operator.js", SCRIPT, include_str!("operator.js")),
];

/// Number of tones in the film of the sound check; `sound.js` expects the same number.
pub const SOUND_CHECK_TONES: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::participants::QuotaCounts;
    use std::collections::BTreeSet;

    #[test]
    fn pages_load_only_assets_and_have_no_inline_code() {
        for (path, content_type, text) in ASSETS {
            for quoted in text.split('"').skip(1).step_by(2).filter(|quoted| quoted.starts_with("./")) {
                let module = quoted.trim_start_matches('.');
                assert!(ASSETS.iter().any(|(other, ..)| *other == module), "{path} loads {quoted}");
            }
            for wrong in ["innerHTML", "style=", "://", "eval(", "document.write", "userAgent"] {
                assert!(!text.contains(wrong), "{path} has {wrong}");
            }
            if content_type == PAGE {
                assert!(!text.contains("<style") && text.matches("<script").count() == 1, "{path}");
                assert!(text.contains("<script type=\"module\" src=\""), "{path}");
            }
        }
        let sound = include_str!("sound.js");
        assert!(sound.contains(&format!("const TONES = {SOUND_CHECK_TONES};")));
    }

    #[test]
    fn the_operators_page_names_every_count_that_the_server_sends() {
        let script = include_str!("operator.js");
        let (_, labels) = script.split_once("const COUNTS = {").unwrap();
        let (labels, _) = labels.split_once("};").unwrap();
        let labels: BTreeSet<&str> = labels.lines().filter_map(|line| Some(line.trim().split_once(':')?.0)).collect();
        let sent = serde_json::to_value(QuotaCounts::default()).unwrap();
        assert_eq!(labels, sent.as_object().unwrap().keys().map(String::as_str).collect::<BTreeSet<_>>());
    }
}
