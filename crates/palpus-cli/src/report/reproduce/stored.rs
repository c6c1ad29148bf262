//! Figures of an earlier run, read from the documentation. If this machine cannot measure a figure,
//! the page shows the stored figure and marks it.

use super::super::html::Table;

/// The step on real pairs, compared with Coal.
pub(super) const PAIRS_MEASURED: &str = include_str!("benchmarks.md");
/// Depth and distance of convex pairs, compared with parry, Coal and MuJoCo.
pub(super) const CONVEX: &str = include_str!("convex_peers.md");

/// Returns the tables of a Markdown text below the heading `section`, or all tables if it is empty.
/// A table's title is the line before it.
pub(super) fn tables(text: &str, section: &str) -> Vec<Table> {
    let mut tables: Vec<Table> = Vec::new();
    let (mut within, mut before, mut open) = (section.is_empty(), "", false);
    for line in text.lines().map(str::trim) {
        if let Some(cells) = line.strip_prefix('|').and_then(|line| line.strip_suffix('|')) {
            let cells: Vec<String> = cells.split('|').map(|cell| cell.trim().to_owned()).collect();
            let is_rule = cells.iter().all(|cell| !cell.is_empty() && cell.chars().all(|c| matches!(c, '-' | ':')));
            match tables.last_mut().filter(|_| open) {
                _ if !within || is_rule => {}
                Some(table) => table.rows.push(cells),
                None => {
                    let title = before.trim_matches(|c| matches!(c, '*' | '#' | ' ')).to_owned();
                    tables.push(Table { title, head: cells, rows: Vec::new(), naming: 0 });
                    open = true;
                }
            }
            continue;
        }
        open = false;
        if line.starts_with('#') && !section.is_empty() {
            within = line.trim_start_matches('#').trim() == section;
        }
        if !line.is_empty() {
            before = line;
        }
    }
    for table in &mut tables {
        table.naming = naming(table);
    }
    tables
}

/// Returns the number of leading columns that hold names.
fn naming(table: &Table) -> usize {
    let is_name = |cell: &String| cell.chars().next().is_some_and(char::is_alphabetic) && cell != "lost";
    let names = |column: usize| table.rows.iter().any(|row| row.get(column).is_some_and(is_name));
    (0..table.head.len()).take_while(|column| names(*column)).count()
}

/// Returns the table with only the rows for which `keep` is true.
pub(super) fn only(mut table: Table, keep: impl Fn(&[String]) -> bool) -> Table {
    table.rows.retain(|row| keep(row));
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn documents_have_the_tables_that_are_shown() {
        let [pairs] = &tables(PAIRS_MEASURED, "One step on real pairs")[..] else {
            panic!("the document must have one table of real pairs")
        };
        assert_eq!((pairs.head[0].as_str(), pairs.naming), ("pair", 1));
        assert!(
            pairs.rows.iter().any(|row| row[0] == "spoon-cup")
                && pairs.rows.iter().all(|row| row.len() == pairs.head.len())
        );
        let convex = tables(CONVEX, "");
        assert_eq!(convex.len(), 2);
        assert!(convex[0].title.starts_with("Depth of overlapping pairs") && convex[0].naming == 2);
        assert!(only(convex[0].clone(), |row| row[1] == "rolling").rows.len() >= 5);
    }

    #[test]
    fn table_ends_with_its_lines() {
        let text =
            "# A\n\n**one**\n\n| a | b |\n|---|---:|\n| x | 1 |\n\ntwo\n| a |\n|---|\n| 1 |\n## B\n| c |\n|---|\n";
        let all = tables(text, "");
        assert_eq!(all.iter().map(|table| table.title.as_str()).collect::<Vec<_>>(), ["one", "two", "B"]);
        assert_eq!((all[0].naming, all[1].naming, &all[0].rows[0][1][..]), (1, 0, "1"));
        assert_eq!(tables(text, "B").len(), 1);
    }
}
