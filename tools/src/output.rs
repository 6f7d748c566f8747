use std::io::{self, ErrorKind, Write};

use bhm_core::settings::SettingsError;
use bhm_plot::picture::PictureError;
use serde::Serialize;

use bhm_bench::text::Report;
pub(crate) use bhm_bench::text::{bytes, columns, headed, markdown, table};

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

/// Whether a command failed because of what was asked for: what [`Usage`] says, settings that contradict themselves, or a
/// picture that cannot be drawn.
pub(crate) fn is_usage(error: &anyhow::Error) -> bool {
    error.is::<Usage>() || error.is::<SettingsError>() || error.is::<PictureError>()
}

impl Output {
    /// Prints a command's result: one JSON object, or the text, on standard output.
    pub(crate) fn result(self, result: &impl Serialize, text: impl FnOnce() -> String) -> anyhow::Result<()> {
        print(&if self.json { serde_json::to_string(result)? + "\n" } else { text() })
    }

    /// Prints what came of something.
    pub(crate) fn report(self, report: &impl Report) -> anyhow::Result<()> {
        self.result(report, || report.text())
    }
}

/// Writes to standard output. A reader that has gone (`bhm … | head`) is no failure.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    match io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}
