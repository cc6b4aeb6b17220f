//! HTML elements, and documents of them: head, navigation, sections, and the style and script shared by all pages. Text
//! and attribute values are escaped only here, and only `Node` writes markup, so no user text can become markup. A page
//! does not refer to other files, and its content security policy forbids loading any.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use orator_base::text::escape;
use serde_json::Value;
use std::fmt::{self, Display, Write as _};

/// Element with its attributes and content.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    name: &'static str,
    attributes: String,
    inner: String,
}

/// Empty element, like `node("p")`.
pub fn node(name: &'static str) -> Node {
    Node { name, attributes: String::new(), inner: String::new() }
}

/// Legend of colours: the CSS class of each swatch and its meaning.
pub fn legend<C: Display, M: Display>(keys: impl IntoIterator<Item = (C, M)>) -> Node {
    let key = |(class, meaning): (C, M)| {
        let swatch = node("span").class(format!("swatch {class}"));
        node("li").child(swatch).child(node("span").text(meaning))
    };
    node("ul").class("legend").children(keys.into_iter().map(key))
}

/// Table of the CSS class `name` with the given header cells and rows.
pub fn table(name: &str, head: impl IntoIterator<Item = Node>, rows: impl IntoIterator<Item = Node>) -> Node {
    let head = node("thead").child(node("tr").children(head));
    node("table").class(name).child(head).child(node("tbody").children(rows))
}

impl Node {
    /// Adds an attribute; `name` must be a constant, `value` may be any text.
    pub fn attr(mut self, name: &str, value: impl Display) -> Self {
        let _ = write!(self.attributes, " {name}=\"{}\"", escape(&value.to_string()));
        self
    }

    /// Adds an attribute without a value, like `hidden`.
    pub fn flag(mut self, name: &str) -> Self {
        let _ = write!(self.attributes, " {name}");
        self
    }

    pub fn class(self, names: impl Display) -> Self {
        self.attr("class", names)
    }

    pub fn id(self, name: impl Display) -> Self {
        self.attr("id", name)
    }

    pub fn text(mut self, content: impl Display) -> Self {
        self.inner.push_str(&escape(&content.to_string()));
        self
    }

    pub fn child(mut self, child: Node) -> Self {
        let _ = write!(self.inner, "{child}");
        self
    }

    pub fn children(self, children: impl IntoIterator<Item = Node>) -> Self {
        children.into_iter().fold(self, Node::child)
    }

    /// Appends unescaped content of a style or script element; `text` must not contain the closing tag.
    pub(crate) fn verbatim(mut self, text: &str) -> Self {
        self.inner.push_str(text);
        self
    }
}

impl Display for Node {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, attributes, inner } = self;
        match *name {
            "img" | "input" | "meta" | "br" | "hr" => write!(f, "<{name}{attributes}>"),
            "rect" | "line" | "path" | "circle" => write!(f, "<{name}{attributes}/>"),
            _ => write!(f, "<{name}{attributes}>{inner}</{name}>"),
        }
    }
}

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");
const POLICY: &str =
    "default-src 'none'; img-src data:; media-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

pub struct Page {
    pub title: String,
    /// Sentence under the title.
    pub lead: String,
    pub sections: Vec<Section>,
    /// Style of this page, after the shared one.
    pub style: &'static str,
    /// Script of this page, after the shared one.
    pub script: &'static str,
    /// Data for the script (element `data`).
    pub data: Value,
}

pub struct Section {
    /// Anchor: letters and dashes only.
    pub id: &'static str,
    pub title: &'static str,
    pub body: Vec<Node>,
}

impl Page {
    pub fn html(&self) -> String {
        let links =
            self.sections.iter().map(|section| node("a").attr("href", format!("#{}", section.id)).text(section.title));
        let sections = self.sections.iter().map(|section| {
            let title = node("h2").text(section.title);
            node("section").id(section.id).child(title).children(section.body.iter().cloned())
        });
        // In JSON, `<` occurs only inside strings, where the escape is equivalent; it cannot close the script element.
        let data = self.data.to_string().replace('<', "\\u003c");
        let top = node("header")
            .child(node("h1").text(&self.title))
            .child(node("p").class("lead").text(&self.lead))
            .child(node("nav").attr("aria-label", "Sections").children(links));
        let body = node("body")
            .child(node("a").class("skip").attr("href", "#main").text("Skip to content"))
            .child(top)
            .child(node("main").id("main").children(sections))
            .child(node("div").id("tip").attr("role", "status").flag("hidden"))
            .child(node("script").attr("type", "application/json").id("data").verbatim(&data))
            .child(node("script").verbatim(SCRIPT).verbatim(self.script));
        html_file(page_head(&self.title, self.style), body)
    }
}

/// Head of a page, with the shared style followed by `style`.
pub fn page_head(title: &str, style: &'static str) -> Node {
    node("head")
        .child(node("meta").attr("charset", "utf-8"))
        .child(node("meta").attr("http-equiv", "Content-Security-Policy").attr("content", POLICY))
        .child(node("meta").attr("name", "viewport").attr("content", "width=device-width, initial-scale=1"))
        .child(node("meta").attr("name", "color-scheme").attr("content", "light dark"))
        .child(node("title").text(title))
        .child(node("style").verbatim(STYLE).verbatim(style))
}

pub fn html_file(head: Node, body: Node) -> String {
    format!("<!doctype html>\n{}\n", node("html").attr("lang", "en").child(head).child(body))
}

/// Embedded JPEG image of `width` x `height` px, loaded lazily, with `description` as its alternative text.
pub fn jpeg(bytes: &[u8], [width, height]: [usize; 2], description: &str) -> Node {
    node("img")
        .attr("src", format!("data:image/jpeg;base64,{}", STANDARD.encode(bytes)))
        .attr("width", width)
        .attr("height", height)
        .attr("alt", description)
        .attr("loading", "lazy")
}

/// Embedded MP4 video with controls and a description.
pub fn video(bytes: &[u8], description: &str) -> Node {
    let source = format!("data:video/mp4;base64,{}", STANDARD.encode(bytes));
    node("video").flag("controls").attr("src", source).attr("aria-label", description).attr("style", "max-width: 100%")
}
