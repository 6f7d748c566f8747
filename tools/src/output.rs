use std::io::{self, ErrorKind, Write};

use serde::Serialize;

/// Where results go.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Output {
    /// As JSON, not as text.
    pub(crate) json: bool,
}

/// What was asked for cannot be meant: exit code 2, as for a flag that does not exist.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct Usage(pub(crate) String);

impl Output {
    /// Prints a command's result: one JSON object, or the text, on standard output.
    pub(crate) fn result(self, result: &impl Serialize, text: impl FnOnce() -> String) -> anyhow::Result<()> {
        print(&if self.json { serde_json::to_string(result)? + "\n" } else { text() })
    }
}

/// Writes to standard output. A reader that has gone (`bhm … | head`) is no failure.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    match io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// Lines of "name  value", the values in one column.
pub(crate) fn table(rows: &[(&str, String)]) -> String {
    let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    rows.iter().map(|(name, value)| format!("{name:width$}  {value}\n")).collect()
}

/// A number of bytes in the unit that suits it.
pub(crate) fn bytes(count: usize) -> String {
    match count {
        0..10_000 => format!("{count} B"),
        10_000..1_000_000 => format!("{:.1} kB", count as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", count as f64 / 1e6),
        _ => format!("{:.1} GB", count as f64 / 1e9),
    }
}
