use std::path::PathBuf;

use bhm_firmware_sim::{End, OnboardError, OnboardOptions, Options, Until, run_onboard};
use bhm_host::{
    ipc::DEFAULT_CONSUMERS,
    snapshot::{self, Extras},
};
use clap::Args;
use tracing::info;

use crate::{
    options::MapOptions,
    output::{Output, Usage},
    processes::{Deadline, DomainOptions, json_lines::Onboarded},
};

/// Map the scans that arrive in shared memory and publish the posterior, until SIGINT or SIGTERM
#[derive(Args, Debug)]
pub(crate) struct Onboard {
    #[command(flatten)]
    domain: DomainOptions,
    /// Map file to write at the end, tiles in the archive included
    #[arg(long, value_name = "MAP")]
    save: Option<PathBuf>,
    /// End after a source's last scan
    #[arg(long)]
    until_end: bool,
    /// Consumers that shared memory is taken for; each costs three posteriors
    #[arg(long, value_name = "N", default_value_t = DEFAULT_CONSUMERS as u32, value_parser = clap::value_parser!(u32).range(1..=64))]
    consumers: u32,
    /// Most scans between two posteriors while scans are waiting
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    publish_every: u32,
    #[command(flatten)]
    deadline: Deadline,
    #[command(flatten)]
    map: MapOptions,
}

impl Onboard {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(options) = self.map.effective()? else { return Ok(()) };
        if options.max_range_m.is_some() {
            info!("the maximum range is the source's to say; --max-range has no effect here");
        }
        if !options.poses.are_zero() {
            info!(
                "how far off poses are is the source's to say; --pose-deviation and --heading-deviation have no effect here"
            );
        }
        let (domain, stop) = self.domain.join()?;
        let until = if self.until_end { Until::SourceEnds } else { Until::Stopped };
        let onboard = OnboardOptions {
            run: Options { publish_every: self.publish_every, until, linger_ns: 0, deadline_ns: self.deadline.ns() },
            consumers: self.consumers as usize,
            supports: options.table().cloned(),
            ..OnboardOptions::default()
        };
        let mut result = None;
        let outcome = run_onboard(&options.profile, &domain, &onboard, &stop, |map, summary| {
            if let Some(path) = &self.save {
                let path_m = summary.path.iter().map(|pose| [pose.x_m, pose.y_m]).collect();
                snapshot::save(path, map, &Extras { profile: options.profile.name.to_owned(), path_m })?;
            }
            let (tiles_resident, tiles_archived) = map.tile_counts();
            result = Some(Onboarded {
                mapper: format!("{:016x}", summary.mapper),
                source_ended: summary.end == End::SourceEnded,
                map: self.save.clone(),
                posterior: map.digest().to_string(),
                tiles_resident,
                tiles_archived,
                counters: summary.counters.iter().map(|(name, count)| (name.to_owned(), count)).collect(),
                deadline_ms: self.deadline.deadline_ms,
                slowest_update_ms: summary.update.map(|update| update.slowest_ns as f64 / 1e6),
                last_fault: summary.last_fault.as_ref().map(ToString::to_string),
            });
            Ok(())
        });
        outcome.map_err(|error| match error {
            OnboardError::Shape(_) | OnboardError::Settings(_) => Usage(error.to_string()).into(),
            other => anyhow::Error::from(other),
        })?;
        let Some(onboarded) = result else { return Ok(()) };
        output.result(&onboarded, || onboarded.text(["in the store", "in the archive"]))
    }
}
