//! Colours of plots, on white and on black.

use std::fmt::Write;

/// A colour, as an index into the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ink(usize);

pub(crate) const BLUE: Ink = Ink(0);
pub(crate) const VERMILION: Ink = Ink(1);
pub(crate) const GREEN: Ink = Ink(2);

/// Colours on white and on black that colour-blind readers can tell apart (after Okabe and Ito).
const INKS: [[&str; 2]; 10] = [
    ["#0072b2", "#56a8e8"],
    ["#d55e00", "#ff8a3d"],
    ["#009e73", "#2fcf9f"],
    ["#cc79a7", "#e69ac3"],
    ["#964b00", "#c98d4f"],
    ["#003c82", "#8fb4f0"],
    ["#787878", "#a0a4aa"],
    ["#e69f00", "#f2bd45"],
    ["#56b4e9", "#9ad4f7"],
    ["#000000", "#f0f0f0"],
];

/// Colours of a plot's other elements: class, coloured property, colour on white, and colour on
/// black.
const REST: [(&str, &str, [&str; 2]); 6] = [
    ("paper", "fill", ["#ffffff", "#171a20"]),
    ("ink", "fill", ["#1c212b", "#e6e9ee"]),
    ("faint", "fill", ["#626b79", "#9aa2b1"]),
    ("grid", "stroke", ["#e4e7ec", "#2c313a"]),
    ("mark", "stroke", ["#626b79", "#9aa2b1"]),
    ("band", "fill", ["#fae2da", "#4a2a22"]),
];

impl Ink {
    /// Returns the `k`-th distinguishable colour; the table repeats after its last entry.
    pub(crate) const fn nth(k: usize) -> Self {
        Self(k % INKS.len())
    }

    /// Returns the colour on white.
    pub(super) fn light(self) -> &'static str {
        INKS[self.0][0]
    }

    /// Returns the CSS class of a curve, and the class of a filled shape.
    pub(super) fn classes(self) -> [String; 2] {
        [format!("s{}", self.0), format!("f{}", self.0)]
    }
}

/// Returns the colour on white of an element other than a curve.
pub(super) fn light(class: &str) -> &'static str {
    REST.iter().find(|rest| rest.0 == class).map_or("#000000", |rest| rest.2[0])
}

/// Returns the style for systems with a dark theme. Printed pages stay light.
pub(super) fn dark_style() -> String {
    let mut text = String::from("@media screen and (prefers-color-scheme:dark){");
    for (class, property, [_, dark]) in REST {
        // Writing to a string cannot fail.
        let _ = write!(text, ".plot .{class}{{{property}:{dark}}}");
    }
    for (k, [_, dark]) in INKS.iter().enumerate() {
        let _ = write!(text, ".plot .s{k}{{stroke:{dark}}}.plot .f{k}{{fill:{dark}}}");
    }
    text + "}"
}
