//! Unit tests of `orator_report::html::node`.

use orator_report::html::node::{Page, Section, node};

#[test]
fn user_text_does_not_become_markup() {
    let evil = "</p><script>alert(\"x\")</script> & 'y'";
    let shown = node("p").attr("title", evil).text(evil).child(node("br")).to_string();
    assert_eq!(shown.matches('<').count(), 3, "{shown}");
    assert!(shown.starts_with("<p title=\"&lt;/p&gt;") && shown.ends_with("&amp; &#39;y&#39;<br></p>"), "{shown}");
    assert!(!shown.contains("\"x\""));
}

#[test]
fn elements_are_balanced_and_data_cannot_close_the_script() {
    let section = Section { id: "a", title: "A & b", body: vec![node("p").text("x < y")] };
    let data = serde_json::json!({ "name": "</script><b>" });
    let title = "\"<i>\"".to_owned();
    let page = Page { title, lead: String::new(), sections: vec![section], style: "", script: "", data }.html();
    for name in ["html", "head", "body", "script", "style", "section", "main", "header", "nav", "div"] {
        let opened = page.matches(&format!("<{name}>")).count() + page.matches(&format!("<{name} ")).count();
        assert_eq!(opened, page.matches(&format!("</{name}>")).count(), "{name}");
    }
    assert!(!page.contains("<i>") && !page.contains("<b>") && page.contains("href=\"#a\""));
    assert!(!page.contains("http://") && !page.contains("https://"));
}
