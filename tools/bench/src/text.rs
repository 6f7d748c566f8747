//! Results as text: tables for a terminal and for Markdown, numbers of bytes.

use serde::Serialize;

/// What came of something: one JSON object for programs, text for people.
pub trait Report: Serialize {
    /// For people.
    fn text(&self) -> String;
}

/// Lines of "name  value", the values in one column.
#[must_use]
pub fn table(rows: &[(&str, String)]) -> String {
    let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    rows.iter().map(|(name, value)| format!("{name:width$}  {value}\n")).collect()
}

/// Rows of cells, each column as wide as its widest cell and right-aligned; a row's last cell may be a remark of any length.
#[must_use]
pub fn columns(rows: &[Vec<String>]) -> String {
    let count = rows.iter().map(Vec::len).max().unwrap_or(0);
    let cells = |column: usize| rows.iter().filter(move |row| row.len() == count || column + 1 < row.len());
    let width = |column: usize| cells(column).filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..count).map(|column| width(column).unwrap_or(0)).collect();
    let line = |row: &Vec<String>| {
        let cells: Vec<String> = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:>width$}")).collect();
        cells.join("  ").trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}

/// The rows of a table that begins with the heads of its columns.
#[must_use]
pub fn headed<const N: usize>(heads: [&str; N]) -> Vec<Vec<String>> {
    vec![heads.map(str::to_owned).to_vec()]
}

/// Rows of cells as a table in Markdown, the first row as its head.
#[must_use]
pub fn markdown(rows: &[Vec<String>]) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | ").replace('\n', " "));
    let Some((head, body)) = rows.split_first() else { return String::new() };
    let rule = format!("|{}\n", "---|".repeat(head.len()));
    let full = |row: &Vec<String>| {
        let mut cells = row.clone();
        cells.resize(head.len().max(row.len()), String::new());
        line(&cells)
    };
    line(head) + &rule + &body.iter().map(full).collect::<String>()
}

/// A number of bytes in the unit that suits it.
#[must_use]
pub fn bytes(count: usize) -> String {
    match count {
        0..10_000 => format!("{count} B"),
        10_000..1_000_000 => format!("{:.1} kB", count as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", count as f64 / 1e6),
        _ => format!("{:.1} GB", count as f64 / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned_and_a_remark_widens_none() {
        let row = |cells: &[&str]| cells.iter().map(|cell| (*cell).to_owned()).collect::<Vec<_>>();
        let rows = [row(&["", "a", "long"]), row(&["best", "10", "2"]), row(&["", "a remark of some length"])];
        assert_eq!(columns(&rows), "       a  long\nbest  10     2\n      a remark of some length\n");
    }
}
