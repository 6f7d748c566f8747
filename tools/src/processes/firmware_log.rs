//! What firmware logs: defmt's bytes, which only the program that wrote them can explain.

use std::path::Path;

/// Decodes a log by the program that wrote it, and prints it.
///
/// # Errors
/// If a file cannot be read, or the program has no table of its messages.
#[cfg(feature = "firmware-log")]
pub(super) fn show(elf: &Path, log: &Path) -> anyhow::Result<()> {
    use anyhow::Context;
    use defmt_decoder::{DecodeError, Table};
    use tracing::{info, warn};

    let read = |path: &Path| std::fs::read(path).with_context(|| format!("cannot read {}", path.display()));
    let table = Table::parse(&read(elf)?)?.with_context(|| format!("{} has no defmt table", elf.display()))?;
    let mut decoder = table.new_stream_decoder();
    decoder.received(&read(log)?);
    let mut malformed = 0;
    loop {
        match decoder.decode() {
            Ok(frame) => {
                let level = frame.level().map_or("print", |level| level.as_str());
                let message = frame.display_message();
                match level {
                    "warn" | "error" => warn!("firmware: {level}: {message}"),
                    _ => info!("firmware: {level}: {message}"),
                }
            }
            Err(DecodeError::UnexpectedEof) => break,
            Err(DecodeError::Malformed) => {
                malformed += 1;
                if !table.encoding().can_recover() {
                    break;
                }
            }
        }
    }
    if malformed > 0 {
        warn!("firmware: {malformed} messages of its log cannot be read");
    }
    Ok(())
}

/// Says where the log is: this build cannot decode it.
#[cfg(not(feature = "firmware-log"))]
pub(super) fn show(elf: &Path, log: &Path) -> anyhow::Result<()> {
    tracing::info!(
        "what the firmware logged is in {}; a bhm built with --features firmware-log shows it, or: defmt-print -e {}",
        log.display(),
        elf.display()
    );
    Ok(())
}
