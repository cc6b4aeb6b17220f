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
pub const BUILT_IN: [(&str, &str); 3] = [
    ("en", include_str!("texts/en.json")),
    ("de", include_str!("texts/de.json")),
    ("ar", include_str!("texts/ar.json")),
];

/// Built-in texts of a language by key; empty if it has none.
pub fn built_in(language: &str) -> PageTexts {
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
