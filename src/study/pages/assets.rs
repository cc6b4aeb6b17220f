//! Static files of the pages by path on the server, and the texts of the participants' page: built-in languages,
//! overridden by a study's own texts.

use std::collections::BTreeMap;

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

pub type PageTexts = BTreeMap<String, String>;

/// Built-in languages; the first is the fallback for missing texts.
const BUILT_IN: [(&str, &str); 3] = [
    ("en", include_str!("texts/en.json")),
    ("de", include_str!("texts/de.json")),
    ("ar", include_str!("texts/ar.json")),
];

fn built_in(language: &str) -> PageTexts {
    let text = BUILT_IN.iter().find(|(name, _)| *name == language).map_or("{}", |(_, text)| text);
    serde_json::from_str(text).unwrap_or_default()
}

/// Texts of each language: `written` overrides the built-in texts of the language, which override the English ones.
pub fn page_texts(languages: &[String], written: &BTreeMap<String, PageTexts>) -> BTreeMap<String, PageTexts> {
    let texts_of = |language: &String| {
        let mut texts = built_in("en");
        // A language without built-in texts is named by its code and is left-to-right unless the study sets `dir`.
        texts.insert("language.name".to_owned(), language.clone());
        texts.extend(built_in(language));
        texts.extend(written.get(language).cloned().unwrap_or_default());
        texts
    };
    languages.iter().map(|language| (language.clone(), texts_of(language))).collect()
}

/// Text keys of a study with these tasks: those of the page, and each task's own question, title and instructions.
pub fn text_keys<'t>(tasks: impl IntoIterator<Item = &'t str>) -> Vec<String> {
    let parts = ["question", "title", "instructions"];
    let of_task = |task: &'t str| parts.map(|part| format!("{part}.{task}"));
    built_in("en").into_keys().chain(tasks.into_iter().flat_map(of_task)).collect()
}

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

    fn placeholders(text: &str) -> BTreeSet<&str> {
        text.split('{').skip(1).filter_map(|rest| Some(rest.split_once('}')?.0)).collect()
    }

    #[test]
    fn every_language_has_every_text_with_the_same_placeholders() {
        let english = built_in("en");
        assert!(english.len() > 80);
        for (language, _) in BUILT_IN {
            let texts = built_in(language);
            assert!(texts.keys().eq(english.keys()), "{language}");
            for (key, text) in &texts {
                assert_eq!(placeholders(text), placeholders(&english[key]), "{language}: {key}");
                assert_eq!(text.is_empty(), english[key].is_empty(), "{language}: {key}");
            }
        }
    }

    #[test]
    fn a_studys_texts_override_the_built_in_ones() {
        let of_french = PageTexts::from([("continue".to_owned(), "Continuer".to_owned())]);
        let written = BTreeMap::from([("fr".to_owned(), of_french)]);
        let texts = page_texts(&["de".to_owned(), "fr".to_owned()], &written);
        assert_eq!(texts["de"]["continue"], "Weiter");
        assert_eq!(texts["fr"]["continue"], "Continuer");
        assert_eq!(texts["fr"]["language.name"], "fr");
        assert_eq!(texts["fr"]["done.copy"], "Copy");
        assert!(text_keys(["mine"]).contains(&"question.mine".to_owned()));
    }
}
