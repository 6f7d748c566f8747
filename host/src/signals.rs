use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::TERM_SIGNALS;
use signal_hook::flag;

/// A flag that SIGINT and SIGTERM (and SIGQUIT) raise; whoever works in a loop looks at it and ends.
///
/// The second such signal ends the process at once, for the loop that does not look.
///
/// # Errors
/// If the operating system refuses.
pub fn stop_on_signals() -> io::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in TERM_SIGNALS {
        // In this order: the first signal finds the flag down, and the second finds it raised.
        flag::register_conditional_shutdown(*signal, 128 + *signal, Arc::clone(&stop))?;
        flag::register(*signal, Arc::clone(&stop))?;
    }
    Ok(stop)
}
