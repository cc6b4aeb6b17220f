//! Conversion of a guide page from Markdown to the elements of a report page. `orator guide TOPIC` in code becomes a
//! link to the page of the topic.

use super::site::file_name;
use orator::guide::TOPICS;
use orator_report::html::{Node, node};
use pulldown_cmark::{Event, HeadingLevel, Options, Parser, Tag, TagEnd};

/// Page of the guide as HTML elements.
pub struct GuidePage {
    /// Text of the first heading.
    pub title: String,
    /// Anchor and title of each section.
    pub contents: Vec<(String, String)>,
    /// Sections in order, each with its heading; text before the first heading is a section of its own.
    pub sections: Vec<Node>,
}

impl GuidePage {
    /// Converts Markdown with tables. Markup in it is shown as text.
    pub fn of_markdown(text: &str) -> Self {
        let page = Self { title: String::new(), contents: Vec::new(), sections: Vec::new() };
        let mut reader =
            MarkdownReader { page, open: vec![node("section")], heading: None, anchors: Vec::new(), in_head: false };
        for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
            reader.add(event);
        }
        reader.close_section();
        reader.page
    }
}

/// Page whose Markdown is being read.
struct MarkdownReader {
    page: GuidePage,
    /// Elements that are not complete, from the outermost, which is a section.
    open: Vec<Node>,
    /// Text of the current heading.
    heading: Option<String>,
    /// Anchors without their numbers.
    anchors: Vec<String>,
    /// Whether the current row is the header of a table.
    in_head: bool,
}

impl MarkdownReader {
    fn add(&mut self, event: Event<'_>) {
        match event {
            Event::Start(tag) => self.start(tag),
            Event::End(tag) => self.end(tag),
            Event::Text(text) | Event::Html(text) | Event::InlineHtml(text) => self.text(&text),
            Event::Code(code) => self.code(&code),
            Event::SoftBreak => self.text("\n"),
            Event::HardBreak => self.append(node("br")),
            Event::Rule => self.append(node("hr")),
            // Extensions of Markdown that are not enabled.
            Event::InlineMath(_) | Event::DisplayMath(_) | Event::FootnoteReference(_) | Event::TaskListMarker(_) => {}
        }
    }

    fn start(&mut self, tag: Tag<'_>) {
        let element = match tag {
            Tag::Heading { level, .. } => {
                self.heading = Some(String::new());
                node(if level == HeadingLevel::H2 { "h2" } else { "h3" })
            }
            Tag::Paragraph => node("p"),
            Tag::CodeBlock(_) => node("code"),
            Tag::List(None) => node("ul"),
            Tag::List(Some(first)) => node("ol").attr("start", first),
            Tag::Item => node("li"),
            Tag::Table(_) => node("table"),
            Tag::TableHead => {
                self.in_head = true;
                node("tr")
            }
            Tag::TableRow => node("tr"),
            Tag::TableCell => node(if self.in_head { "th" } else { "td" }),
            Tag::Emphasis => node("em"),
            Tag::Strong => node("strong"),
            Tag::Link { dest_url, .. } => node("a").attr("href", dest_url),
            _ => node("div"),
        };
        self.open.push(element);
    }

    fn end(&mut self, tag: TagEnd) {
        let Some(element) = self.open.pop() else { return };
        match tag {
            TagEnd::Heading(level) => self.end_heading(level, element),
            TagEnd::CodeBlock => self.append(node("pre").attr("tabindex", 0).child(element)),
            TagEnd::TableHead => {
                self.in_head = false;
                self.append(node("thead").child(element));
                self.open.push(node("tbody"));
            }
            TagEnd::Table => {
                let table = self.open.pop().unwrap_or_else(|| node("table")).child(element);
                self.append(node("div").class("scroll").attr("tabindex", 0).child(table));
            }
            _ => self.append(element),
        }
    }

    fn end_heading(&mut self, level: HeadingLevel, element: Node) {
        let text = self.heading.take().unwrap_or_default();
        if level == HeadingLevel::H1 {
            self.page.title = text;
            return;
        }
        let anchor = self.anchor(&text);
        if level == HeadingLevel::H2 {
            self.close_section();
            self.page.contents.push((anchor.clone(), text));
        }
        self.append(element.id(anchor));
    }

    /// Anchor of a heading, which no other heading of the page has.
    fn anchor(&mut self, text: &str) -> String {
        let lower = text.to_lowercase();
        let words: Vec<&str> = lower.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
        let name = words.join("-");
        let n_equal = self.anchors.iter().filter(|other| **other == name).count();
        self.anchors.push(name.clone());
        if n_equal == 0 { name } else { format!("{name}-{}", n_equal + 1) }
    }

    fn close_section(&mut self) {
        let empty = node("section");
        let section = std::mem::replace(&mut self.open, vec![empty.clone()]);
        self.page.sections.extend(section.into_iter().filter(|section| *section != empty));
    }

    fn code(&mut self, code: &str) {
        if let Some(heading) = &mut self.heading {
            heading.push_str(code);
        }
        let element = node("code").text(code);
        let topic = code.strip_prefix("orator guide ").filter(|name| TOPICS.iter().any(|topic| topic.name == *name));
        self.append(match topic {
            Some(name) => node("a").attr("href", file_name(name)).child(element),
            None => element,
        });
    }

    fn text(&mut self, text: &str) {
        if let Some(heading) = &mut self.heading {
            heading.push_str(text);
        }
        if let Some(element) = self.open.pop() {
            self.open.push(element.text(text));
        }
    }

    fn append(&mut self, child: Node) {
        if let Some(parent) = self.open.pop() {
            self.open.push(parent.child(child));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_tables_code_and_links_become_elements() {
        let text = "# A `b`\n\nSee `orator guide\ndataset` & `x <y>`.\n\n## One\n\n| a | b |\n|---|---|\n| 1 | **2** |\n\n\
                    ### Part\n\n## One\n\n```sh\nls \"a\"\n```\n";
        let page = GuidePage::of_markdown(text);
        assert_eq!(page.title, "A b");
        let contents: Vec<_> = page.contents.iter().map(|(anchor, title)| (&**anchor, &**title)).collect();
        assert_eq!(contents, [("one", "One"), ("one-2", "One")]);
        let html: Vec<String> = page.sections.iter().map(ToString::to_string).collect();
        let link = "<a href=\"dataset.html\"><code>orator guide dataset</code></a>";
        assert_eq!(html[0], format!("<section><p>See {link} &amp; <code>x &lt;y&gt;</code>.</p></section>"));
        let table = "<thead><tr><th>a</th><th>b</th></tr></thead><tbody><tr><td>1</td><td><strong>2</strong></td></tr>";
        assert!(html[1].starts_with("<section><h2 id=\"one\">One</h2>") && html[1].contains(table), "{}", html[1]);
        assert!(html[1].ends_with("</tbody></table></div><h3 id=\"part\">Part</h3></section>"), "{}", html[1]);
        assert!(html[2].contains("<pre tabindex=\"0\"><code>ls &quot;a&quot;\n</code></pre>"), "{}", html[2]);
        assert_eq!(html.len(), 3);
    }
}
