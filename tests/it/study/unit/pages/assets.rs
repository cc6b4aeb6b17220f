//! Tests of `orator_study::pages::assets`.

use orator_study::pages::assets::{ASSETS, BUILT_IN, PageTexts, SOUND_CHECK_TONES, built_in, page_texts, text_keys};
use orator_study::store::participants::QuotaCounts;
use std::collections::{BTreeMap, BTreeSet};

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
        if content_type == "text/html; charset=utf-8" {
            assert!(!text.contains("<style") && text.matches("<script").count() == 1, "{path}");
            assert!(text.contains("<script type=\"module\" src=\""), "{path}");
        }
    }
    let sound = include_str!("../../../../../src/study/pages/sound.js");
    assert!(sound.contains(&format!("const TONES = {SOUND_CHECK_TONES};")));
}

#[test]
fn the_operators_page_names_every_count_that_the_server_sends() {
    let script = include_str!("../../../../../src/study/pages/operator.js");
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
