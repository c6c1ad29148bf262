//! Tests of HTML pages: their content and syntax, that they load nothing, and that foreign text is
//! escaped.

mod program_run;

use std::fs;
use std::path::Path;

use program_run::{Folder, assert_success, palpus, text};

fn recorded(folder: &Path, name: &str, seconds: &str) {
    assert_success(&palpus(folder, &["run", "spoon-cup", "--fast", "--duration", seconds, "--record", name]));
}

fn page(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).expect("the page can be read")
}

/// Name and value of an attribute.
type Attribute = (String, String);

/// Elements without an end tag.
const VOID: [&str; 6] = ["meta", "link", "img", "source", "br", "hr"];

/// Parses the page as strictly as XML, except for void elements, and passes every tag with its
/// attributes to `each`.
fn read(page: &str, each: &mut dyn FnMut(&str, &[Attribute])) {
    let mut rest = page.strip_prefix("<!doctype html>").expect("the page begins with a doctype");
    let mut open: Vec<String> = Vec::new();
    while let Some(at) = rest.find('<') {
        text_is_fine(&rest[..at]);
        rest = &rest[at + 1..];
        // No attribute contains a bare `>`, since all text is escaped.
        let (tag, after) = rest.split_once('>').expect("the tag ends");
        rest = after;
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name), "tags must be closed in order");
            continue;
        }
        let (tag, is_empty) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
        let (name, attributes) = tag.split_once([' ', '\n']).unwrap_or((tag, ""));
        assert!(!name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric()), "a tag called {name:?}");
        each(name, &attributes_of(attributes));
        if name == "style" {
            let (css, after) = rest.split_once("</style>").expect("the style ends");
            assert!(!css.contains("url(") && !css.contains("@import"), "a style must not load anything");
            rest = after;
        } else if !is_empty && !VOID.contains(&name) {
            open.push(name.to_owned());
        }
    }
    text_is_fine(rest);
    assert!(open.is_empty(), "tags without an end: {open:?}");
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
        let (value, after) = after.split_once('"').expect("the value ends");
        assert!(!name.trim().contains(char::is_whitespace) && !value.contains('<'), "{name}={value}");
        text_is_fine(value);
        attributes.push((name.trim().to_owned(), value.to_owned()));
        text = after;
    }
    assert!(text.trim().is_empty(), "an attribute without a value: {text:?}");
    attributes
}

/// Checks that the page loads nothing and runs nothing.
fn is_self_contained(page: &str) {
    let mut pictures = 0;
    read(page, &mut |tag, attributes| {
        assert!(
            !["script", "iframe", "object", "embed", "form", "base"].contains(&tag),
            "the page must not have a {tag}"
        );
        for (name, value) in attributes {
            assert!(!name.starts_with("on"), "{name} would run a script");
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
fn page_of_a_run_is_self_contained() {
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
        "start up ramp",
        "contact tolerance",
        "virtual coupling",
        "safety.force_peak",
        "palpus replay run.csv",
        "prefers-color-scheme",
        "width=device-width",
    ] {
        assert!(page.contains(part), "the page must contain {part}");
    }
}

#[test]
fn foreign_text_is_escaped() {
    let folder = Folder::new("report-hostile");
    recorded(&folder.0, "run.csv", "0.05");
    let recording = fs::read_to_string(folder.0.join("run.csv")).expect("the recording can be read");
    let hostile = r#"</h1><script>alert(1)</script><img src=x onerror='y'>&\"`"#;
    let recording = recording
        .replace("device = \"sim\"", &format!("device = \"{hostile}\""))
        .replace("built_in = \"spoon-cup\"", &format!("file = \"{hostile}.toml\""))
        .replace("mesh = \"spoon-cup/probe\"", &format!("mesh = \"{hostile}\""));
    fs::write(folder.0.join("b.csv"), recording).expect("the recording can be written");
    assert_success(&palpus(&folder.0, &["report", "b.csv", "--out", "pages/b.html"]));
    let page = page(&folder.0, "pages/b.html");
    is_self_contained(&page);
    assert!(page.contains("could not be replayed") && page.contains("&lt;script&gt;"));
}

#[test]
fn folder_gives_one_page_per_recording() {
    let folder = Folder::new("report-folder");
    let empty = palpus(&folder.0, &["report", "."]);
    assert_eq!(empty.status.code(), Some(1));
    assert!(text(&empty.stderr).contains("contains no recording"));
    for name in ["a.csv", "b.csv"] {
        recorded(&folder.0, name, "0.05");
    }
    fs::write(folder.0.join("poses.csv"), "tx,ty,tz\n").expect("the file can be written");
    assert_success(&palpus(&folder.0, &["report", "."]));
    for name in ["a.html", "b.html"] {
        is_self_contained(&page(&folder.0, name));
    }
    assert!(!folder.0.join("poses.html").exists());
}

#[test]
fn reproduction_lists_measured_and_missing_steps() {
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
        "1 of 16 steps measured in this run",
        "palpus bench depth --out DIR/data/depth",
        "data:image/svg+xml;base64,",
        "figures of an earlier run, from",
        "the bench has to be built first",
        "processor",
        "compiler",
        "Seeds",
    ] {
        assert!(first.contains(part), "the page must contain {part}");
    }
    // The page must not contain the path of the folder.
    assert!(!first.contains(&*folder.0.to_string_lossy()));
    // A page made again from the files alone must be identical.
    fs::remove_file(folder.0.join("out/report.html")).expect("the page exists");
    assert_success(&palpus(&folder.0, &["report", "out"]));
    assert!(page(&folder.0, "out/report.html") == first);
}

#[test]
fn report_help_has_an_example() {
    let folder = Folder::new("report-help");
    let output = palpus(&folder.0, &["report", "--help"]);
    assert_success(&output);
    assert!(text(&output.stdout).contains("Examples:\n  palpus "));
}
