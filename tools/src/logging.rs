use std::io::{self, IsTerminal};

use clap::{ArgAction, Args};
use tracing_subscriber::EnvFilter;

/// How much is said on standard error; RUST_LOG, where set, decides instead.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct Verbosity {
    /// Say more on standard error; twice for everything. RUST_LOG, where set, decides instead.
    #[arg(short, long, global = true, action = ArgAction::Count)]
    verbose: u8,
    /// Say only what is wrong.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
}

/// Sends log lines to standard error from here on.
pub(crate) fn start(verbosity: Verbosity) {
    let level = match verbosity {
        Verbosity { quiet: true, .. } => "warn",
        Verbosity { verbose: 0, .. } => "info",
        Verbosity { verbose: 1, .. } => "debug",
        _ => "trace",
    };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        .with_ansi(io::stderr().is_terminal())
        .with_target(false)
        .without_time()
        .init();
    if cfg!(debug_assertions) {
        tracing::warn!("this is a debug build, several times slower than one made with --release");
    }
}
