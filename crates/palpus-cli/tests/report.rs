//! Pages: what must be in them, that a browser can read them, that they load nothing, and that a
//! stranger's text stays text.

mod program_run;

use std::fs;
use std::path::Path;

use program_run::{Folder, assert_success, palpus, text};

fn recorded(folder: &Path, name: &str, seconds: &str) {
    assert_success(&palpus(folder, &["run", "spoon-cup", "--fast", "--duration", seconds, "--record", name]));
}

fn page(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).expect("a page")
}

/// A name and a value.
type Attribute = (String, String);

/// Elements that have no end.
const VOID: [&str; 6] = ["meta", "link", "img", "source", "br", "hr"];

/// Reads the page as strictly as XML would, but for void elements, and hands every tag with its
/// attributes to `each`.
fn read(page: &str, each: &mut dyn FnMut(&str, &[Attribute])) {
    let mut rest = page.strip_prefix("<!doctype html>").expect("it begins as HTML does");
    let mut open: Vec<String> = Vec::new();
    while let Some(at) = rest.find('<') {
        text_is_fine(&rest[..at]);
        rest = &rest[at + 1..];
        // No attribute holds a bare `>`: all is escaped.
        let (tag, after) = rest.split_once('>').expect("a tag ends");
        rest = after;
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name), "closed in another order");
            continue;
        }
        let (tag, is_empty) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
        let (name, attributes) = tag.split_once([' ', '\n']).unwrap_or((tag, ""));
        assert!(!name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric()), "a tag called {name:?}");
        each(name, &attributes_of(attributes));
        if name == "style" {
            let (css, after) = rest.split_once("</style>").expect("a style ends");
            assert!(!css.contains("url(") && !css.contains("@import"), "a style loads something");
            rest = after;
        } else if !is_empty && !VOID.contains(&name) {
            open.push(name.to_owned());
        }
    }
    text_is_fine(rest);
    assert!(open.is_empty(), "{open:?} stay open");
}

fn text_is_fine(text: &str) {
    for (at, _) in text.match_indices('&') {
        let entity = text[at..].split(';').next().unwrap_or("");
        assert!(["&amp", "&lt", "&gt", "&quot", "&#39"].contains(&entity), "a bare & in {text:?}");
    }
    assert!(!text.contains('>') && !text.contains('\0'), "{text:?}");
}

fn attributes_of(mut text: &str) -> Vec<Attribute> {
    let mut attributes = Vec::new();
    while let Some((name, after)) = text.split_once("=\"") {
        let (value, after) = after.split_once('"').expect("a value ends");
        assert!(!name.trim().contains(char::is_whitespace) && !value.contains('<'), "{name}={value}");
        text_is_fine(value);
        attributes.push((name.trim().to_owned(), value.to_owned()));
        text = after;
    }
    assert!(text.trim().is_empty(), "an attribute without a value: {text:?}");
    attributes
}

/// Nothing is loaded, nothing is run.
fn is_self_contained(page: &str) {
    let mut pictures = 0;
    read(page, &mut |tag, attributes| {
        assert!(!["script", "iframe", "object", "embed", "form", "base"].contains(&tag), "a {tag}");
        for (name, value) in attributes {
            assert!(!name.starts_with("on"), "{name} would run something");
            match name.as_str() {
                "src" | "srcset" => assert!(value.starts_with("data:image/"), "{tag} loads {value}"),
                "href" if tag == "a" => {
                    assert!(value.starts_with('#') || value.starts_with("https://"), "a link to {value}");
                }
                "href" => assert_eq!(value, "data:,", "{tag} loads something"),
                _ => {}
            }
        }
        pictures += usize::from(tag == "img");
    });
    assert!(page.contains("default-src 'none'"));
    assert!(pictures < 40);
}

#[test]
fn a_run_becomes_a_page_that_needs_nothing_else() {
    let folder = Folder::new("report-run");
    recorded(&folder.0, "run.csv", "1.8");
    assert_success(&palpus(&folder.0, &["report", "run.csv"]));
    let page = page(&folder.0, "run.html");
    is_self_contained(&page);
    for part in [
        "spoon-cup: a run of",
        "replays bit for bit",
        "no faults",
        "Moments",
        "data:image/png;base64,",
        "<svg",
        "separation: least distance",
        "how long steps took",
        "by how much the force changed",
        "engagement",
        "contact tolerance",
        "virtual coupling",
        "safety.force_peak",
        "palpus replay run.csv",
        "prefers-color-scheme",
        "width=device-width",
    ] {
        assert!(page.contains(part), "{part} is not in the page");
    }
}

#[test]
fn a_strangers_text_stays_text() {
    let folder = Folder::new("report-hostile");
    recorded(&folder.0, "run.csv", "0.05");
    let recording = fs::read_to_string(folder.0.join("run.csv")).expect("a recording");
    let hostile = r#"</h1><script>alert(1)</script><img src=x onerror='y'>&\"`"#;
    let recording = recording
        .replace("device = \"sim\"", &format!("device = \"{hostile}\""))
        .replace("built_in = \"spoon-cup\"", &format!("file = \"{hostile}.toml\""))
        .replace("mesh = \"spoon-cup/probe\"", &format!("mesh = \"{hostile}\""));
    fs::write(folder.0.join("b.csv"), recording).expect("a recording");
    assert_success(&palpus(&folder.0, &["report", "b.csv", "--out", "pages/b.html"]));
    let page = page(&folder.0, "pages/b.html");
    is_self_contained(&page);
    assert!(page.contains("could not be replayed") && page.contains("&lt;script&gt;"));
}

#[test]
fn a_folder_becomes_a_page_for_each_recording() {
    let folder = Folder::new("report-folder");
    let empty = palpus(&folder.0, &["report", "."]);
    assert_eq!(empty.status.code(), Some(1));
    assert!(text(&empty.stderr).contains("contains no recording"));
    for name in ["a.csv", "b.csv"] {
        recorded(&folder.0, name, "0.05");
    }
    fs::write(folder.0.join("poses.csv"), "tx,ty,tz\n").expect("another table");
    assert_success(&palpus(&folder.0, &["report", "."]));
    for name in ["a.html", "b.html"] {
        is_self_contained(&page(&folder.0, name));
    }
    assert!(!folder.0.join("poses.html").exists());
}

#[test]
fn a_reproduction_says_what_was_measured_and_what_was_not() {
    let folder = Folder::new("report-reproduce");
    let wrong = palpus(&folder.0, &["report", "out", "--reproduce", "--only", "nothing"]);
    assert_eq!(wrong.status.code(), Some(1));
    assert!(text(&wrong.stderr).contains("the steps are doctor, figures"));
    assert_success(&palpus(
        &folder.0,
        &["report", "out", "--reproduce", "--quick", "--only", "depth", "--only", "convex"],
    ));
    let first = page(&folder.0, "out/report.html");
    is_self_contained(&first);
    for part in [
        "Table 1",
        "Figure 4",
        "Figure 5",
        "Figure 6",
        "1 of 14 steps measured in this run",
        "palpus bench depth --out DIR/data/depth",
        "cold walks are only local",
        "data:image/svg+xml;base64,",
        "figures of an earlier run, from",
        "the bench has to be built first",
        "processor",
        "compiler",
        "Seeds",
    ] {
        assert!(first.contains(part), "{part} is not in the page");
    }
    // A page must not tell where it was made.
    assert!(!first.contains(&*folder.0.to_string_lossy()));
    // Once more from the files alone: the same.
    fs::remove_file(folder.0.join("out/report.html")).expect("it was there");
    assert_success(&palpus(&folder.0, &["report", "out"]));
    assert!(page(&folder.0, "out/report.html") == first);
}

#[test]
fn the_command_explains_itself() {
    let folder = Folder::new("report-help");
    let output = palpus(&folder.0, &["report", "--help"]);
    assert_success(&output);
    assert!(text(&output.stdout).contains("Examples:\n  palpus "));
}
