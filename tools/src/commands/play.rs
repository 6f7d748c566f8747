use std::path::PathBuf;

use bhm_bench::reading;
use bhm_host::dataset::{self, ReadOptions};
use clap::Args;

use crate::{
    output::Output,
    processes::{DomainOptions, Sending},
};

/// Send the scans of a recorded log into shared memory
#[derive(Args, Debug)]
pub(crate) struct Play {
    #[command(flatten)]
    domain: DomainOptions,
    /// Scan log (CARMEN), plain or gzip
    log: PathBuf,
    /// The sensor's maximum range, metres [default: stated by the log, or found from it and printed]
    #[arg(long, env = "BHM_MAX_RANGE", value_name = "M")]
    max_range: Option<f32>,
    #[command(flatten)]
    sending: Sending,
}

impl Play {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let (domain, stop) = self.domain.join()?;
        let mut log = dataset::read_log(&self.log, &ReadOptions { max_range_m: self.max_range })?;
        reading::scan_log(&self.log, &log.report);
        let scans: Vec<_> = self.sending.part.of(log.scans.drain(..)).collect();
        let recorded_s = reading::recorded_s(&scans, &log.report);
        self.sending.run(scans.into_iter(), recorded_s, &domain, &stop, output)
    }
}
