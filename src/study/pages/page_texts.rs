//! Texts of the participants' page: built-in languages, overridden by a study's own texts.

use std::collections::BTreeMap;

/// Texts by key.
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

/// Keys for which a study with these tasks may provide texts: those of the page, and each task's own question, title
/// and instructions.
pub fn text_keys<'t>(tasks: impl IntoIterator<Item = &'t str>) -> Vec<String> {
    let parts = ["question", "title", "instructions"];
    let of_task = |task: &'t str| parts.map(|part| format!("{part}.{task}"));
    built_in("en").into_keys().chain(tasks.into_iter().flat_map(of_task)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// Placeholder names in braces.
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
