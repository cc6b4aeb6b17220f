//! HTML elements. Text and attribute values are escaped only here, and only `Node` writes markup, so no user text can
//! become markup.

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

/// Text with markup characters replaced by entities.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\0' => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn user_text_does_not_become_markup() {
        let evil = "</p><script>alert(\"x\")</script> & 'y'";
        let shown = node("p").attr("title", evil).text(evil).child(node("br")).to_string();
        assert_eq!(shown.matches('<').count(), 3, "{shown}");
        assert!(shown.starts_with("<p title=\"&lt;/p&gt;") && shown.ends_with("&amp; &#39;y&#39;<br></p>"), "{shown}");
        assert!(!shown.contains("\"x\""));
    }
}
