//! Writes HTML. Only this file and the plots write tags; all other text is escaped.
//!
//! Names in recordings are untrusted text. Each page also has a content security policy, which
//! forbids loading resources and running scripts.

use data_encoding::BASE64;

use crate::markup::escaped;
use crate::plots::Svg;

/// A piece of a page.
#[derive(Default)]
pub(super) struct Html(String);

/// A table: its cells, and which columns are numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Table {
    pub(super) title: String,
    pub(super) head: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
    /// Columns of text; all others are numbers.
    pub(super) naming: usize,
}

/// Tone of a sentence, a number or a badge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tone {
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
    pub(super) fn new() -> Self {
        Self::default()
    }

    /// Appends another piece.
    pub(super) fn append(&mut self, other: Self) -> &mut Self {
        self.0 += &other.0;
        self
    }

    /// Escapes untrusted text.
    pub(super) fn text(&mut self, text: &str) -> &mut Self {
        self.0 += &escaped(text);
        self
    }

    /// Appends text of the program; text between backticks is code.
    pub(super) fn prose(&mut self, text: &str) -> &mut Self {
        for (k, part) in text.split('`').enumerate() {
            match k % 2 {
                0 => self.text(part),
                _ => self.element("code", "", |code| {
                    code.text(part);
                }),
            };
        }
        self
    }

    /// Writes an element around the content that `inner` writes. An empty class is left out.
    pub(super) fn element(
        &mut self,
        tag: &'static str,
        class: &'static str,
        inner: impl FnOnce(&mut Self),
    ) -> &mut Self {
        self.0 += "<";
        self.0 += tag;
        if !class.is_empty() {
            self.0 += " class=\"";
            self.0 += class;
            self.0 += "\"";
        }
        self.0 += ">";
        inner(self);
        self.0 += "</";
        self.0 += tag;
        self.0 += ">";
        if matches!(tag, "p" | "div" | "section" | "figure" | "table" | "tr" | "ul" | "li" | "h1" | "h2" | "h3" | "dl")
        {
            self.0 += "\n";
        }
        self
    }

    pub(super) fn paragraph(&mut self, text: &str) -> &mut Self {
        self.element("p", "", |p| {
            p.prose(text);
        })
    }

    pub(super) fn heading(&mut self, text: &str) -> &mut Self {
        self.element("h3", "", |h| {
            h.prose(text);
        })
    }

    /// Appends a section with its own heading, to which a table of contents can link.
    pub(super) fn section(&mut self, id: &'static str, title: &str, inner: impl FnOnce(&mut Self)) -> &mut Self {
        self.0 += "<section id=\"";
        self.0 += id;
        self.0 += "\">\n";
        self.element("h2", "", |h| {
            h.prose(title);
        });
        inner(self);
        self.0 += "</section>\n";
        self
    }

    /// Appends a list of links to sections.
    pub(super) fn contents(&mut self, sections: &[(&'static str, String)]) -> &mut Self {
        self.element("nav", "contents", |nav| {
            for (id, title) in sections {
                nav.0 += "<a href=\"#";
                nav.0 += id;
                nav.0 += "\">";
                nav.prose(title);
                nav.0 += "</a> ";
            }
        })
    }

    pub(super) fn badge(&mut self, tone: Tone, text: &str) -> &mut Self {
        self.0 += "<span class=\"badge ";
        self.0 += tone.class();
        self.0 += "\">";
        self.text(text);
        self.0 += "</span> ";
        self
    }

    /// Appends key numbers: name, value with its unit, and tone.
    pub(super) fn tiles(&mut self, tiles: &[(String, String, Tone)]) -> &mut Self {
        self.element("div", "tiles", |all| {
            for (what, value, tone) in tiles {
                all.0 += "<div class=\"tile ";
                all.0 += tone.class();
                all.0 += "\">";
                all.element("b", "", |b| {
                    b.text(value);
                });
                all.element("span", "", |span| {
                    span.text(what);
                });
                all.0 += "</div>\n";
            }
        })
    }

    /// Appends names and values.
    pub(super) fn facts(&mut self, facts: &[(String, String)]) -> &mut Self {
        self.element("div", "scroll", |scroll| {
            scroll.element("table", "facts", |table| {
                for (name, value) in facts {
                    table.element("tr", "", |row| {
                        row.element("th", "", |cell| {
                            cell.text(name);
                        });
                        row.element("td", "", |cell| {
                            cell.text(value);
                        });
                    });
                }
            });
        })
    }

    pub(super) fn table(&mut self, table: &Table) -> &mut Self {
        let Table { title, head, rows, naming } = table;
        self.element("div", "scroll", |scroll| {
            scroll.element("table", "", |whole| {
                if !title.is_empty() {
                    whole.element("caption", "", |caption| {
                        caption.prose(title);
                    });
                }
                whole.element("thead", "", |all| all.row("th", head, *naming));
                whole.element("tbody", "", |all| rows.iter().for_each(|row| all.row("td", row, *naming)));
            });
        })
    }

    fn row(&mut self, tag: &'static str, cells: &[String], naming: usize) {
        self.element("tr", "", |row| {
            for (k, cell) in cells.iter().enumerate() {
                row.element(tag, if k < naming { "name" } else { "" }, |inner| {
                    inner.prose(cell);
                });
            }
        });
    }

    /// Appends a section that can be opened and closed.
    pub(super) fn folded(&mut self, title: &str, inner: impl FnOnce(&mut Self)) -> &mut Self {
        self.element("details", "", |details| {
            details.element("summary", "", |summary| {
                summary.prose(title);
            });
            inner(details);
        })
    }

    /// Appends a plot made by this program.
    pub(super) fn plot(&mut self, svg: &Svg, caption: &str) -> &mut Self {
        self.figure(caption, |scroll| scroll.0 += svg.as_str())
    }

    /// Appends a plot from a file as an image, in which no script can run.
    pub(super) fn drawing(&mut self, svg: &[u8], caption: &str) -> &mut Self {
        self.figure(caption, |scroll| scroll.picture("image/svg+xml", svg, caption))
    }

    /// Appends a picture, light and dark (PNG).
    pub(super) fn picture_pair(&mut self, light: &[u8], dark: &[u8], caption: &str) -> &mut Self {
        self.element("figure", "shot", |figure| {
            figure.0 +=
                "<picture><source media=\"screen and (prefers-color-scheme: dark)\" srcset=\"data:image/png;base64,";
            figure.0 += &BASE64.encode(dark);
            figure.0 += "\">";
            figure.picture("image/png", light, caption);
            figure.0 += "</picture>";
            figure.element("figcaption", "", |words| {
                words.prose(caption);
            });
        })
    }

    fn figure(&mut self, caption: &str, inner: impl FnOnce(&mut Self)) -> &mut Self {
        self.element("figure", "", |figure| {
            figure.element("div", "scroll", inner);
            if !caption.is_empty() {
                figure.element("figcaption", "", |words| {
                    words.prose(caption);
                });
            }
        })
    }

    fn picture(&mut self, kind: &'static str, bytes: &[u8], words: &str) {
        self.0 += "<img alt=\"";
        self.text(&words.replace('`', ""));
        self.0 += "\" src=\"data:";
        self.0 += kind;
        self.0 += ";base64,";
        self.0 += &BASE64.encode(bytes);
        self.0 += "\">";
    }

    /// Appends a legend of colours: a style class and a meaning for each.
    pub(super) fn key(&mut self, entries: &[(&'static str, &str)]) -> &mut Self {
        self.element("p", "key", |all| {
            for (class, meaning) in entries {
                all.element("span", class, |entry| {
                    entry.text(meaning);
                });
                all.0 += " ";
            }
        })
    }

    /// Returns the whole page with this content.
    pub(super) fn page(&self, title: &str) -> String {
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
