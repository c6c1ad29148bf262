//! Writes HTML. Only this file and the plots write tags; all other text is escaped.
//!
//! Names in recordings are untrusted text. Each page also has a content security policy, which
//! forbids loading resources and running scripts.

use data_encoding::BASE64;

use crate::markup::escaped;
use crate::plots::Svg;
use crate::table::Table;

/// A piece of a page.
#[derive(Default)]
pub(crate) struct Html(String);

/// Tone of a sentence, a number or a badge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tone {
    Plain,
    Good,
    Warning,
    Bad,
}

impl Tone {
    fn class(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Good => "good",
            Self::Warning => "warning",
            Self::Bad => "bad",
        }
    }
}

impl Html {
    pub(crate) fn new() -> Self {
        Self::default()
    }

    /// Appends another piece.
    pub(crate) fn append(&mut self, other: Self) -> &mut Self {
        self.0 += &other.0;
        self
    }

    /// Escapes untrusted text.
    pub(crate) fn text(&mut self, text: &str) -> &mut Self {
        self.0 += &escaped(text);
        self
    }

    /// Appends text of the program; text between backticks is code.
    pub(crate) fn prose(&mut self, text: &str) -> &mut Self {
        for (k, part) in text.split('`').enumerate() {
            match k % 2 {
                0 => self.text(part),
                _ => self.text_in("code", "", part),
            };
        }
        self
    }

    /// Writes an element around the content that `inner` writes. An empty class is left out.
    pub(crate) fn element(
        &mut self,
        tag: &'static str,
        class: &'static str,
        inner: impl FnOnce(&mut Self),
    ) -> &mut Self {
        let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
        self.0 += &format!("<{tag}{class}>");
        inner(self);
        self.0 += &format!("</{tag}>");
        if matches!(tag, "p" | "div" | "section" | "figure" | "table" | "tr" | "ul" | "li" | "h1" | "h2" | "h3" | "dl")
        {
            self.0 += "\n";
        }
        self
    }

    /// Writes an element around untrusted text.
    pub(crate) fn text_in(&mut self, tag: &'static str, class: &'static str, text: &str) -> &mut Self {
        self.element(tag, class, |inner| {
            inner.text(text);
        })
    }

    /// Writes an element around text in which backticks mark code.
    pub(crate) fn prose_in(&mut self, tag: &'static str, class: &'static str, text: &str) -> &mut Self {
        self.element(tag, class, |inner| {
            inner.prose(text);
        })
    }

    pub(crate) fn paragraph(&mut self, text: &str) -> &mut Self {
        self.prose_in("p", "", text)
    }

    pub(crate) fn heading(&mut self, text: &str) -> &mut Self {
        self.prose_in("h3", "", text)
    }

    /// Appends a section with its own heading, to which a table of contents can link.
    pub(crate) fn section(&mut self, id: &'static str, title: &str, inner: impl FnOnce(&mut Self)) -> &mut Self {
        self.0 += &format!("<section id=\"{id}\">\n");
        self.prose_in("h2", "", title);
        inner(self);
        self.0 += "</section>\n";
        self
    }

    /// Appends a list of links to sections.
    pub(crate) fn contents(&mut self, sections: &[(&'static str, String)]) -> &mut Self {
        self.element("nav", "contents", |nav| {
            for (id, title) in sections {
                nav.0 += &format!("<a href=\"#{id}\">");
                nav.prose(title);
                nav.0 += "</a> ";
            }
        })
    }

    pub(crate) fn badge(&mut self, tone: Tone, text: &str) -> &mut Self {
        self.0 += &format!("<span class=\"badge {}\">{}</span> ", tone.class(), escaped(text));
        self
    }

    /// Appends key numbers: name, value with its unit, and tone.
    pub(crate) fn tiles(&mut self, tiles: &[(String, String, Tone)]) -> &mut Self {
        self.element("div", "tiles", |all| {
            for (what, value, tone) in tiles {
                all.0 += &format!("<div class=\"tile {}\">", tone.class());
                all.text_in("b", "", value).text_in("span", "", what);
                all.0 += "</div>\n";
            }
        })
    }

    /// Appends a list of sentences.
    pub(crate) fn list(&mut self, sentences: &[String]) -> &mut Self {
        self.element("ul", "", |list| {
            for sentence in sentences {
                list.prose_in("li", "", sentence);
            }
        })
    }

    /// Appends names and values.
    pub(crate) fn facts(&mut self, facts: &[(String, String)]) -> &mut Self {
        self.element("div", "scroll", |scroll| {
            scroll.element("table", "facts", |table| {
                for (name, value) in facts {
                    table.element("tr", "", |row| {
                        row.text_in("th", "", name).text_in("td", "", value);
                    });
                }
            });
        })
    }

    pub(crate) fn table(&mut self, table: &Table) -> &mut Self {
        let Table { title, head, rows, naming } = table;
        self.element("div", "scroll", |scroll| {
            scroll.element("table", "", |whole| {
                if !title.is_empty() {
                    whole.prose_in("caption", "", title);
                }
                whole.element("thead", "", |all| all.row("th", head, *naming));
                whole.element("tbody", "", |all| rows.iter().for_each(|row| all.row("td", row, *naming)));
            });
        })
    }

    fn row(&mut self, tag: &'static str, cells: &[String], naming: usize) {
        self.element("tr", "", |row| {
            for (k, cell) in cells.iter().enumerate() {
                row.prose_in(tag, if k < naming { "name" } else { "" }, cell);
            }
        });
    }

    /// Appends a section that can be opened and closed.
    pub(crate) fn folded(&mut self, title: &str, inner: impl FnOnce(&mut Self)) -> &mut Self {
        self.element("details", "", |details| {
            details.prose_in("summary", "", title);
            inner(details);
        })
    }

    /// Appends a plot made by this program.
    pub(crate) fn plot(&mut self, svg: &Svg, caption: &str) -> &mut Self {
        self.figure(caption, |scroll| scroll.0 += svg.as_str())
    }

    /// Appends a plot from a file as an image, in which no script can run.
    pub(crate) fn drawing(&mut self, svg: &[u8], caption: &str) -> &mut Self {
        self.figure(caption, |scroll| scroll.picture("image/svg+xml", svg, caption))
    }

    /// Appends a picture, light and dark (PNG).
    pub(crate) fn picture_pair(&mut self, light: &[u8], dark: &[u8], caption: &str) -> &mut Self {
        self.element("figure", "shot", |figure| {
            figure.0 += &format!(
                "<picture><source media=\"screen and (prefers-color-scheme: dark)\" srcset=\"data:image/png;base64,{}\">",
                BASE64.encode(dark)
            );
            figure.picture("image/png", light, caption);
            figure.0 += "</picture>";
            figure.prose_in("figcaption", "", caption);
        })
    }

    fn figure(&mut self, caption: &str, inner: impl FnOnce(&mut Self)) -> &mut Self {
        self.element("figure", "", |figure| {
            figure.element("div", "scroll", inner);
            if !caption.is_empty() {
                figure.prose_in("figcaption", "", caption);
            }
        })
    }

    fn picture(&mut self, kind: &'static str, bytes: &[u8], words: &str) {
        let words = escaped(&words.replace('`', ""));
        self.0 += &format!("<img alt=\"{words}\" src=\"data:{kind};base64,{}\">", BASE64.encode(bytes));
    }

    /// Appends a legend of colours: a style class and a meaning for each.
    pub(crate) fn key(&mut self, entries: &[(&'static str, &str)]) -> &mut Self {
        self.element("p", "key", |all| {
            for (class, meaning) in entries {
                all.text_in("span", class, meaning);
                all.0 += " ";
            }
        })
    }

    /// Returns the whole page with this content.
    pub(crate) fn page(&self, title: &str) -> String {
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n\
             <meta name=\"generator\" content=\"palpus {}\">\n\
             <link rel=\"icon\" href=\"data:,\">\n<title>{}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
            env!("CARGO_PKG_VERSION"),
            escaped(title),
            self.0
        )
    }
}

const STYLE: &str = include_str!("style.css");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_text_is_escaped() {
        let hostile = "</td><script>alert(1)</script><img src=x onerror=\"y\">&'`\u{0}";
        let mut html = Html::new();
        html.paragraph(hostile).text(hostile).prose(hostile).heading(hostile).badge(Tone::Bad, hostile);
        html.facts(&[(hostile.to_owned(), hostile.to_owned())]).folded(hostile, |inner| {
            inner.text(hostile);
        });
        html.tiles(&[(hostile.to_owned(), hostile.to_owned(), Tone::Good)]);
        html.table(&Table {
            title: hostile.to_owned(),
            head: vec![hostile.to_owned()],
            rows: vec![vec![hostile.to_owned()]],
            naming: 1,
        });
        html.picture_pair(b"x", b"y", hostile);
        let page = html.page(hostile);
        for part in ["<script", "onerror=\"", "</td><", "\u{0}"] {
            let tags = part == "</td><";
            assert!(!page.contains(part) || tags && !page.contains("</td><script"), "{part} in {page}");
        }
    }

    #[test]
    fn code_is_marked_by_backticks() {
        let mut html = Html::new();
        html.prose("run `palpus <x>` now");
        assert_eq!(html.0, "run <code>palpus &lt;x&gt;</code> now");
    }
}
