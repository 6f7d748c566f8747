use std::path::PathBuf;

use anyhow::Context;
use clap::Args;

use crate::{
    output::Output,
    processes::{MappingRun, MappingRunOptions, Part},
};

/// Map a recorded log with three processes: a source, the onboard process, a consumer
#[derive(Args, Debug)]
pub(crate) struct Replay {
    /// Scan log (CARMEN), plain or gzip
    #[arg(required_unless_present = "print_config")]
    log: Option<PathBuf>,
    #[command(flatten)]
    part: Part,
    #[command(flatten)]
    options: MappingRunOptions,
}

impl Replay {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let (Some(options), Some(log)) = (self.options.effective()?, &self.log) else { return Ok(()) };
        let path = log.to_str().with_context(|| format!("{} is not Unicode", log.display()))?;
        let mut arguments = self.part.arguments();
        arguments.extend(options.max_range_m.map(|max_range_m| format!("--max-range={max_range_m}")));
        arguments.extend(options.poses.arguments());
        arguments.extend(["--".to_owned(), path.to_owned()]);
        let title = format!("bhm replay: {}", log.file_name().unwrap_or_default().to_string_lossy());
        let run = MappingRun { title: &title, source: "play", arguments, options };
        run.run(&self.options, |_| Ok(None), output)
    }
}
