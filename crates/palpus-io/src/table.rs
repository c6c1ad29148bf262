//! CSV tables whose errors contain the line and the column.

use std::fmt;

use crate::exact;

/// Why a CSV file (poses, a recording) cannot be read.
///
/// Displayed for example as `poses.csv, line 3, column qx: "abc" is not a number; correct it`.
#[derive(Debug, thiserror::Error)]
pub struct TableError {
    /// Name of the file, as given by the caller.
    pub file: String,
    /// Line, counted from 1; 0 if the error concerns the whole file.
    pub line: u64,
    /// Name of the column; `None` if the error concerns no single column.
    pub column: Option<String>,
    /// The problem, and how to fix it.
    pub problem: String,
}

impl fmt::Display for TableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if self.line > 0 {
            write!(f, ", line {}", self.line)?;
        }
        if let Some(column) = &self.column {
            write!(f, ", column {column}")?;
        }
        write!(f, ": {}", self.problem)
    }
}

impl TableError {
    /// Returns an error about a line, or about the whole file if `line` is 0.
    pub(crate) fn at(file: &str, line: u64, problem: impl Into<String>) -> Self {
        Self { file: file.to_owned(), line, column: None, problem: problem.into() }
    }
}

/// A value of a cell.
pub(crate) trait Cell: Sized {
    /// Description of the expected value, for error messages.
    const KIND: &'static str;

    /// Parses a cell; `None` if the text is invalid.
    fn of_text(text: &str) -> Option<Self>;
}

impl Cell for f64 {
    const KIND: &'static str = "a number";

    fn of_text(text: &str) -> Option<Self> {
        exact::read(text)
    }
}

impl Cell for u32 {
    const KIND: &'static str = "a whole number from 0 to 4294967295";

    fn of_text(text: &str) -> Option<Self> {
        text.parse().ok()
    }
}

impl Cell for u64 {
    const KIND: &'static str = "a whole number that is not negative";

    fn of_text(text: &str) -> Option<Self> {
        text.parse().ok()
    }
}

impl Cell for bool {
    const KIND: &'static str = "0 or 1";

    fn of_text(text: &str) -> Option<Self> {
        match text {
            "0" => Some(false),
            "1" => Some(true),
            _ => None,
        }
    }
}

impl<T: Cell> Cell for Option<T> {
    const KIND: &'static str = T::KIND;

    fn of_text(text: &str) -> Option<Self> {
        if text.is_empty() { Some(None) } else { T::of_text(text).map(Some) }
    }
}

/// One line of a table whose columns are identified by their order.
pub(crate) struct Cells<'a> {
    pub(crate) file: &'a str,
    pub(crate) line: u64,
    columns: std::slice::Iter<'a, &'a str>,
    texts: std::str::Split<'a, char>,
}

impl<'a> Cells<'a> {
    /// Splits `text` into cells; fails if their number differs from the number of columns.
    pub(crate) fn new(file: &'a str, line: u64, columns: &'a [&'a str], text: &'a str) -> Result<Self, TableError> {
        let cells = text.split(',').count();
        if cells != columns.len() {
            let problem =
                format!("there are {cells} cells but should be {}; correct or remove the line", columns.len());
            return Err(TableError::at(file, line, problem));
        }
        Ok(Self { file, line, columns: columns.iter(), texts: text.split(',') })
    }

    /// Parses the next cell.
    pub(crate) fn next<T: Cell>(&mut self) -> Result<T, TableError> {
        let column = self.columns.next().copied().unwrap_or_default();
        let text = self.texts.next().unwrap_or_default().trim();
        T::of_text(text).ok_or_else(|| {
            let shown: String = text.chars().take(40).collect();
            let problem = format!("{shown:?} is not {}; correct it", T::KIND);
            TableError { column: Some(column.to_owned()), ..TableError::at(self.file, self.line, problem) }
        })
    }
}

/// One line of a table that is being written.
#[derive(Default)]
pub(crate) struct Line {
    text: String,
}

impl Line {
    /// Starts a new line.
    pub(crate) fn clear(&mut self) {
        self.text.clear();
    }

    /// Appends a cell of plain text, which must not contain a comma.
    pub(crate) fn cell(&mut self, value: impl fmt::Display) {
        use fmt::Write;
        self.separate();
        // Writing to a String cannot fail.
        let _: fmt::Result = write!(self.text, "{value}");
    }

    /// Appends numbers, which read back bit for bit.
    pub(crate) fn numbers(&mut self, values: impl IntoIterator<Item = f64>) {
        for value in values {
            self.separate();
            exact::write(value, &mut self.text);
        }
    }

    fn separate(&mut self) {
        if !self.text.is_empty() {
            self.text.push(',');
        }
    }

    /// Returns the finished line with a line break.
    pub(crate) fn end(&mut self) -> &[u8] {
        self.text.push('\n');
        self.text.as_bytes()
    }
}
