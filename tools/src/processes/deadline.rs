use clap::Args;

/// How long a scan may take.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct Deadline {
    /// How long a scan may take from being received to being integrated; those that take longer are counted
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) deadline_ms: Option<u32>,
}

impl Deadline {
    /// Nanoseconds.
    pub(crate) fn ns(self) -> Option<u64> {
        self.deadline_ms.map(|deadline_ms| u64::from(deadline_ms) * 1_000_000)
    }

    /// The options that say the same to another process.
    pub(crate) fn arguments(self) -> Option<String> {
        self.deadline_ms.map(|deadline_ms| format!("--deadline-ms={deadline_ms}"))
    }
}
