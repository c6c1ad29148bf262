//! Abstract and conclusion of the page of a reproduction.

use serde_json::Value;

use super::data::{Data, number, word};
use super::paper::{Profile, Smoothness};
use super::stored::tables;
use crate::numbers::said;
use crate::report::html::Html;
use crate::table::Table;

/// Largest turn of a contact's normal in a millisecond that counts as smooth, degrees.
const SMOOTH_TURN: f64 = 5.0;
/// The paper's time for all contacts of a tick, µs.
const PAPER_TICK: f64 = 2000.0;

/// Writes what was measured, and the main results.
pub(super) fn summary(html: &mut Html, data: &Data<'_>) {
    html.section("abstract", "Abstract", |section| {
        section.paragraph(
            "The paper computes the contact force and torque between two polygon meshes in three steps: the \
            meshes are divided into convex pieces, the distance or penetration depth of each near pair of pieces \
            is computed, and the contacts are joined into clusters that push. palpus implements this method and \
            extends it. This page measures the paper's table and figures again, and adds benchmarks that the \
            paper does not have.",
        );
        let mut results = Vec::new();
        if let Some(counts) = Pieces::of(data) {
            results.push(format!(
                "{} of {} built-in models have at most as many convex pieces as in the paper.",
                counts.fewer, counts.all
            ));
        }
        if let Some(profile) = profile(data) {
            results.push(format!(
                "A spoon in a cup has up to {} contacts, and the slowest tick takes {} µs; the paper states 2 ms on \
                its machine.",
                said(profile.most_contacts, 3),
                said(profile.most, 3)
            ));
        }
        for [what, paper, palpus] in feel(data) {
            results.push(format!("{what}: {paper} with the paper's method, {palpus} with palpus's default."));
        }
        if !results.is_empty() {
            section.heading("Main results");
            section.list(&results);
        }
    });
}

/// Writes which statements of the paper the measurements confirm, and what limits them.
pub(super) fn conclusion(html: &mut Html, data: &Data<'_>) {
    let not_measured = || ("not measured".to_owned(), None);
    let (pieces, profile, smooth) = (Pieces::of(data), profile(data), Smoothness::read(data));
    let of_profile = |words: &dyn Fn(&Profile) -> String, holds: &dyn Fn(&Profile) -> bool| {
        profile.as_ref().map_or_else(not_measured, |profile| (words(profile), Some(holds(profile))))
    };
    let statements = [
        (
            "a surface needs few convex pieces (Table 1)",
            pieces.map_or_else(not_measured, |Pieces { fewer, all }| {
                (format!("{fewer} of {all} models need at most as many"), Some(fewer == all))
            }),
        ),
        (
            "all contacts of a tick take at most 2 ms (Figure 5)",
            of_profile(&|p| format!("at most {} µs", said(p.most, 3)), &|p| p.most <= PAPER_TICK),
        ),
        (
            "the force computation is much shorter than the query (Figure 5)",
            of_profile(&|p| format!("{} of {} µs (medians)", said(p.force_half, 2), said(p.half, 3)), &|p| {
                p.force_half < 0.5 * p.half
            }),
        ),
        (
            "penetration adds little to the query (Figure 5)",
            of_profile(
                &|p| {
                    let [apart, inside] = p.per_contact.map(|micros| said(micros, 3));
                    format!("{apart} µs for each contact without overlap, {inside} µs with it")
                },
                &|p| p.per_contact[1] < 2.0 * p.per_contact[0],
            ),
        ),
        (
            "contact point, normal and distance change smoothly (Figure 6)",
            smooth.map_or_else(not_measured, |smooth| {
                let turn = smooth.normal_degrees;
                (format!("the normal turns by at most {}° in a millisecond", said(turn, 3)), Some(turn < SMOOTH_TURN))
            }),
        ),
    ];
    html.section("conclusion", "Conclusion", |section| {
        let rows = statements.into_iter().map(|(paper, (here, holds))| {
            let holds = match holds {
                Some(true) => "confirmed",
                Some(false) => "not confirmed",
                None => "",
            };
            vec![paper.to_owned(), here, holds.to_owned()]
        });
        section.table(&Table::new(&["statement of the paper", "here", ""], 1, rows));
        section.paragraph(
            "Limits of these results: the hands are simulated; the paper's meshes are not published, so other \
            meshes with the same numbers of triangles are used; and all times are from the one machine that is \
            described below.",
        );
    });
}

/// Number of built-in models, and of those with at most as many pieces as in the paper.
struct Pieces {
    fewer: usize,
    all: usize,
}

impl Pieces {
    fn of(data: &Data<'_>) -> Option<Self> {
        let rows = data.json::<Vec<Value>>("figures", "table1.json")?;
        let built_in = rows.iter().filter(|row| word(row, &["source"]) == Some("built-in scene"));
        let compared = built_in.filter_map(|row| Some(number(row, &["pieces"])? <= number(row, &["paper_pieces"])?));
        let compared: Vec<bool> = compared.collect();
        Some(Self { fewer: compared.iter().filter(|fewer| **fewer).count(), all: compared.len() })
    }
}

fn profile(data: &Data<'_>) -> Option<Profile> {
    Profile::of(&data.columns("figures", "figure5.csv")?)
}

/// Returns the main figures of feel: name, the paper's method, palpus's default.
fn feel(data: &Data<'_>) -> Vec<[String; 3]> {
    let text = data.text("feel", "glance.md").unwrap_or_default();
    let rows = tables(&text, "").into_iter().flat_map(|table| table.rows);
    rows.filter_map(|row| row.get(..3).map(|cells| [0, 1, 2].map(|k| cells[k].clone()))).collect()
}
