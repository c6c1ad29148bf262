//! Tables of measured figures, as text, as Markdown and (by `report::html`) as HTML.

use comfy_table::CellAlignment;
use comfy_table::presets::UTF8_BORDERS_ONLY;

/// A table: its cells, and which columns are numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Table {
    pub(crate) title: String,
    pub(crate) head: Vec<String>,
    pub(crate) rows: Vec<Vec<String>>,
    /// Number of columns of text; all other columns have numbers.
    pub(crate) naming: usize,
}

impl Table {
    /// Returns a table without a title.
    pub(crate) fn new(head: &[&str], naming: usize, rows: impl IntoIterator<Item = Vec<String>>) -> Self {
        let head = head.iter().copied().map(str::to_owned).collect();
        Self { title: String::new(), head, rows: rows.into_iter().collect(), naming }
    }

    /// Returns the table with a title.
    pub(crate) fn titled(self, title: impl Into<String>) -> Self {
        Self { title: title.into(), ..self }
    }

    /// The table in a frame, for a terminal.
    pub(crate) fn text(&self) -> String {
        let mut table = comfy_table::Table::new();
        table.load_preset(UTF8_BORDERS_ONLY).set_header(&self.head).add_rows(&self.rows);
        for column in table.column_iter_mut().skip(self.naming) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        table.to_string()
    }

    /// The table below its title, as Markdown.
    pub(crate) fn markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let rows: String = self.rows.iter().map(|row| line(row)).collect();
        format!("**{}**\n\n{}|{}\n{rows}", self.title, line(&self.head), "---|".repeat(self.head.len()))
    }

    /// Returns the table without rows and columns that have no cell beyond the names.
    pub(crate) fn without_empty(mut self) -> Self {
        let naming = self.naming;
        self.rows.retain(|row| row[naming..].iter().any(|cell| !cell.is_empty()));
        let kept: Vec<bool> = (0..self.head.len())
            .map(|column| column < naming || self.rows.iter().any(|row| !row[column].is_empty()))
            .collect();
        for cells in self.rows.iter_mut().chain([&mut self.head]) {
            let mut kept = kept.iter();
            cells.retain(|_| kept.next().is_some_and(|kept| *kept));
        }
        self
    }
}
