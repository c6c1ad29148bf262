//! Sections on the paper's Table 1 and Figures 4, 5 and 6. The paper's pictures are described,
//! because they may not be copied.

use serde_json::Value;

use super::data::{Columns, Data, number, quantile, word};
use super::origin;
use crate::numbers::{counted, number_of, said};
use crate::report::html::{Html, Tone};
use crate::table::Table;

/// Writes the section on the numbers of pieces of the models.
pub(super) fn table_1(html: &mut Html, data: &Data<'_>, run: &str) {
    html.section("table1", "Table 1: convex pieces", |section| {
        section.paragraph(
            "The number of convex pieces into which the surface of a model is divided. Fewer pieces are better, \
            and no piece may extend beyond the solid. The paper's meshes are not published; the meshes here have \
             the same numbers of triangles. The numbers of pieces do not depend on the machine.",
        );
        origin(section, data, "figures", run);
        let Some(rows) = data.json::<Vec<Value>>("figures", "table1.json") else { return };
        let count = |row: &Value, name: &str| number(row, &[name]).map_or(String::new(), |n| counted(n as u64));
        let share = |row: &Value, name: &str| number(row, &[name]).map_or(String::new(), |n| said(n, 3));
        let cells = |row: &Value| {
            vec![
                word(row, &["model"]).unwrap_or("").to_owned(),
                word(row, &["source"]).unwrap_or("").to_owned(),
                count(row, "triangles"),
                count(row, "pieces"),
                share(row, "pieces_per_triangle"),
                count(row, "paper_triangles"),
                count(row, "paper_pieces"),
                share(row, "paper_pieces_per_triangle"),
                number(row, &["seconds"]).map_or(String::new(), |n| said(n, 2)),
            ]
        };
        let head = [
            "model",
            "mesh",
            "triangles",
            "pieces",
            "per triangle",
            "paper: triangles",
            "paper: pieces",
            "paper: per triangle",
            "prepared in (s)",
        ];
        section.table(&Table::new(&head, 2, rows.iter().map(cells)));
    });
}

/// Writes the section on a spoon in a cup, with the force of each cluster.
pub(super) fn figure_4(html: &mut Html, data: &Data<'_>, run: &str) {
    html.section("figure4", "Figure 4: a contact scenario", |section| {
        section.paragraph(
            "The paper's picture: a spoon touches a cup; the contacts are in four clusters, one penetrating (P, a \
             red arrow) and three within the tolerance (D, green arrows); an arrow's length is the size of its \
            force. Here: the most similar tick of the built-in script, rendered directly with exact linkage as \
            in the paper.",
        );
        origin(section, data, "figures", run);
        let pictures = ["figure4.png", "figure4_dark.png", "figure4_near.png", "figure4_near_dark.png"];
        let [Some(whole), Some(whole_dark), Some(near), Some(near_dark)] = pictures.map(|file| data.bytes("figures", file))
        else {
            return;
        };
        section.element("div", "shots", |all| {
            all.picture_pair(&whole, &whole_dark, "A spoon in a cup");
            all.picture_pair(&near, &near_dark, "Close-up: contacts, and the force of each cluster");
        });
        section.key(&[("disjoint", "within the tolerance (D)"), ("penetrating", "penetrating (P)")]);
        let Some(described) = data.json::<Value>("figures", "figure4.json") else { return };
        let clusters = described.get("clusters").and_then(Value::as_array).cloned().unwrap_or_default();
        let cells = |cluster: &Value| {
            let penetrating = cluster.get("penetrating").and_then(Value::as_bool).unwrap_or_default();
            vec![
                if penetrating { "P: penetrating" } else { "D: within the tolerance" }.to_owned(),
                number(cluster, &["contacts"]).map_or(String::new(), |n| counted(n as u64)),
                number(cluster, &["separation_m"]).map_or(String::new(), |m| said(m * 1e3, 3)),
                number(cluster, &["force_n"]).map_or(String::new(), |n| said(n, 3)),
            ]
        };
        let tick = number(&described, &["tick"]).unwrap_or(f64::NAN);
        let table = Table::new(&["cluster", "contacts", "separation (mm)", "force (N)"], 1, clusters.iter().map(cells));
        section.table(&table.titled(format!(
            "Clusters at tick {}; its force is {} N/m times the engagement (tolerance minus separation) of its deepest contact",
            said(tick, 6),
            number(&described, &["stiffness"]).map_or(String::new(), |n| said(n, 4))
        )));
    });
}

/// Figure 5 in numbers.
pub(super) struct Profile {
    pub(super) most_contacts: f64,
    /// Time of query and force together, µs.
    pub(super) half: f64,
    pub(super) most: f64,
    pub(super) force_half: f64,
    penetrating_share: f64,
    intervals: usize,
    /// Time for each contact without and with overlap, µs.
    pub(super) per_contact: [f64; 2],
}

impl Profile {
    pub(super) fn of(columns: &Columns) -> Option<Self> {
        let [query, force, contacts, penetrating] =
            ["query_us", "force_us", "contacts", "penetrating"].map(|name| columns.of(name));
        let touching: Vec<usize> = (0..contacts.len()).filter(|k| contacts[*k] > 0.0).collect();
        if touching.is_empty() || query.len() != contacts.len() || force.len() != contacts.len() {
            return None;
        }
        let both: Vec<f64> = touching.iter().map(|k| query[*k] + force[*k]).collect();
        let per_contact = |inside: f64| {
            let those: Vec<usize> = touching.iter().copied().filter(|k| penetrating.get(*k) == Some(&inside)).collect();
            let sum = |values: &[f64]| those.iter().map(|k| values[*k]).sum::<f64>();
            sum(&query) / sum(&contacts)
        };
        Some(Self {
            most_contacts: contacts.iter().copied().fold(0.0, f64::max),
            half: quantile(&both, 0.5),
            most: quantile(&both, 1.0),
            force_half: quantile(&touching.iter().map(|k| force[*k]).collect::<Vec<_>>(), 0.5),
            penetrating_share: penetrating.iter().sum::<f64>() / penetrating.len() as f64,
            intervals: penetrating.windows(2).filter(|pair| pair[0] < pair[1]).count(),
            per_contact: [per_contact(0.0), per_contact(1.0)],
        })
    }
}

/// Writes the section on query time, force time and contacts.
pub(super) fn figure_5(html: &mut Html, data: &Data<'_>, run: &str) {
    html.section("figure5", "Figure 5: computation profile", |section| {
        section.paragraph(
            "The paper's figure: the time of the contact query and of the force computation while a cup touches a \
             spoon, over the number of contacts, divided into intervals of disjoint (D) and interpenetrating (P) \
             contact. It shows up to 30 contacts, all within 2 ms (500 Hz) on one of two Pentium III at 1 GHz. \
            The time grows about linearly with the number of contacts, penetration adds little, and the force \
            computation is much shorter than the query. Noise comes from the operating system's scheduler.",
        );
        origin(section, data, "figures", run);
        if let Some(svg) = data.bytes("figures", "figure5.svg") {
            section.drawing(
                &svg,
                "The results here: above, the time of the contacts in each tick; below, their number; shaded: \
                penetrating. Each time is the smallest of five passes, which removes interruptions by the \
                operating system.",
            );
        }
        let Some(profile) = data.columns("figures", "figure5.csv").as_ref().and_then(Profile::of) else { return };
        if let Some(passes) = data.json::<Vec<f64>>("figures", "figure5_passes.json") {
            let [least, most] = [0.0, 1.0].map(|share| quantile(&passes, share));
            section.paragraph(&format!(
                "Spread over {} runs: the whole script takes {} to {} ms.",
                passes.len(),
                said(least, 3),
                said(most, 3)
            ));
        }
        let row = |what: &str, paper: &str, here: String| vec![what.to_owned(), paper.to_owned(), here];
        let [apart, inside] = profile.per_contact;
        section.table(&Table::new(
            &["reading of the figure", "the paper", "here"],
            1,
            [
                row("most contacts in a tick", "30", said(profile.most_contacts, 3)),
                row("query and force in contact, median (µs)", "", said(profile.half, 3)),
                row("query and force, slowest tick (µs)", "about 2000", said(profile.most, 3)),
                row("possible rate, at least (Hz)", "500", said(1e6 / profile.most, 3)),
                row("force computation, median (µs)", "a fraction of the query", said(profile.force_half, 2)),
                row("query for each contact, bodies apart (µs)", "grows with the contacts", said(apart, 3)),
                row("query for each contact, penetrating (µs)", "a small increase", said(inside, 3)),
                row("penetrating (% of the ticks)", "", said(100.0 * profile.penetrating_share, 2)),
                row("intervals of penetration", "several", said(profile.intervals as f64, 3)),
            ],
        ));
    });
}

/// Largest change of a contact from one tick to the next.
pub(super) struct Smoothness {
    point_mm: f64,
    pub(super) normal_degrees: f64,
    distance_mm: f64,
    deepest_mm: f64,
}

impl Smoothness {
    /// Reads the contacts of Figure 6.
    pub(super) fn read(data: &Data<'_>) -> Option<Self> {
        Self::of(&data.columns("figures", "figure6.csv")?)
    }

    fn of(columns: &Columns) -> Option<Self> {
        let vectors = |names: [&str; 3]| {
            let [x, y, z] = names.map(|name| columns.of(name));
            (0..x.len().min(y.len()).min(z.len())).map(|k| glam::DVec3::new(x[k], y[k], z[k])).collect::<Vec<_>>()
        };
        let points = vectors(["point_x", "point_y", "point_z"]);
        let normals = vectors(["normal_x", "normal_y", "normal_z"]);
        let distances = columns.of("distance_m");
        let most = |steps: &mut dyn Iterator<Item = f64>| steps.fold(0.0, f64::max);
        (points.len() > 1).then(|| Self {
            point_mm: most(&mut points.windows(2).map(|pair| pair[1].distance(pair[0]) * 1e3)),
            normal_degrees: most(&mut normals.windows(2).map(|pair| pair[0].angle_between(pair[1]).to_degrees())),
            distance_mm: most(&mut distances.windows(2).map(|pair| (pair[1] - pair[0]).abs() * 1e3)),
            deepest_mm: -distances.iter().copied().fold(f64::INFINITY, f64::min) * 1e3,
        })
    }
}

/// Writes the section on contact point, normal and distance of a single contact.
pub(super) fn figure_6(html: &mut Html, data: &Data<'_>, run: &str) {
    html.section("figure6", "Figure 6: a single contact", |section| {
        section.paragraph(
            "The paper's figure: (a) the contact point, (b) the contact normal and (c) the distance while a \
            pen-like object is drawn over a sphere; thick where they interpenetrate, where the distance is \
            negative. It shows smooth curves, also at the changes between disjoint and interpenetrating contact \
            and along the penetrating path. It has no numbers.",
        );
        origin(section, data, "figures", run);
        if let Some(svg) = data.bytes("figures", "figure6.svg") {
            section.drawing(&svg, "The results here; thick and shaded: penetrating. A tick is a millisecond.");
        }
        let Some(smooth) = Smoothness::read(data) else { return };
        let tile = |what: &str, value: String| (what.to_owned(), value, Tone::Plain);
        section.tiles(&[
            tile("largest step of the contact point in a tick", format!("{} mm", said(smooth.point_mm, 3))),
            tile("largest turn of the normal in a tick", format!("{}°", said(smooth.normal_degrees, 3))),
            tile("largest step of the distance in a tick", format!("{} mm", said(smooth.distance_mm, 3))),
            tile("deepest", format!("{} mm", said(smooth.deepest_mm, 3))),
        ]);
    });
}

/// Writes the statements of the paper and the results measured here.
pub(super) fn claims(html: &mut Html, data: &Data<'_>) {
    let pieces = |model: &str| {
        let rows = data.json::<Vec<Value>>("figures", "table1.json")?;
        let row = rows
            .iter()
            .find(|row| word(row, &["model"]) == Some(model) && word(row, &["source"]) == Some("built-in scene"))?;
        number(row, &["pieces"])
    };
    let pieces =
        |model: &str| pieces(model).map_or_else(|| "not measured".to_owned(), |n| number_of(n as u64, "piece"));
    let profile = data.columns("figures", "figure5.csv").as_ref().and_then(Profile::of);
    let not = || "not measured".to_owned();
    let row = |what: &str, paper: &str, here: String| vec![what.to_owned(), paper.to_owned(), here];
    html.table(&Table {
        title: "The paper's figures and those measured here".to_owned(),
        head: ["", "the paper, 2002: Pentium III, 1 GHz", "here"].map(str::to_owned).to_vec(),
        rows: vec![
            row("torus of 2000 triangles (Table 1)", "67 pieces", pieces("torus")),
            row("cup of 500 triangles (Table 1)", "190 pieces", pieces("cup")),
            row("spoon of 336 triangles (Table 1)", "78 pieces", pieces("spoon")),
            row(
                "spoon in a cup: most contacts (Figure 5)",
                "up to 30",
                profile.as_ref().map_or_else(not, |profile| format!("up to {}", said(profile.most_contacts, 3))),
            ),
            row(
                "spoon in a cup: slowest tick, query and force (Figure 5)",
                "2 ms (500 Hz)",
                profile.as_ref().map_or_else(not, |profile| {
                    format!("{} µs ({} Hz)", said(profile.most, 3), said(1e6 / profile.most, 2))
                }),
            ),
        ],
        naming: 1,
    });
}
