//! The files of the report: Markdown, and a page with plots.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use anyhow::Context;

use super::Report;
use crate::durations::spoken;
use crate::markup::escaped;
use crate::soak::figures;

impl Report {
    /// Rewrites all files. A reader sees either the old or the new file.
    pub(in crate::soak) fn write(&self) -> anyhow::Result<()> {
        let [time, late] = figures::of(self);
        replace(&self.folder.join("soak.json"), &serde_json::to_string_pretty(&self.document())?)?;
        replace(&self.folder.join("time.svg"), &time)?;
        replace(&self.folder.join("lateness.svg"), &late)?;
        replace(&self.folder.join("soak.md"), &self.markdown())?;
        replace(&self.folder.join("soak.html"), &self.page(&time, &late))
    }

    fn title(&self) -> String {
        format!("{} of {} in real time", spoken(self.whole.span[1]), self.scene)
    }

    fn markdown(&self) -> String {
        let mut text = format!("# Soak: {}\n\n| | |\n|---|---|\n", self.title());
        for (name, value) in self.lines() {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "| {name} | {} |", value.replace('|', "\\|"));
        }
        text.push_str("\n![over time](time.svg)\n\n![how late](lateness.svg)\n");
        text
    }

    fn page(&self, time: &str, late: &str) -> String {
        let mut rows = String::new();
        for (name, value) in self.lines() {
            let _ = write!(rows, "<tr><th>{}</th><td>{}</td></tr>", escaped(name), escaped(&value));
        }
        let title = escaped(&self.title());
        format!(
            "<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>Soak: {title}</title><style>{STYLE}</style></head>\
             <body><h1>Soak: {title}</h1><table>{rows}</table>{time}{late}</body></html>\n"
        )
    }
}

const STYLE: &str = "body{font-family:sans-serif;max-width:1020px;margin:2em auto;color:#222}\
    th{text-align:right;padding:.2em 1em .2em 0;vertical-align:top;white-space:nowrap}td{padding:.2em 0}svg{max-width:100%;height:auto}";

/// Replaces an older file by a complete new file.
fn replace(file: &Path, text: &str) -> anyhow::Result<()> {
    let problem = || format!("{} could not be written", file.display());
    let new = file.with_extension("new");
    fs::write(&new, text).with_context(problem)?;
    fs::rename(&new, file).with_context(problem)
}
