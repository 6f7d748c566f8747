use std::time::Duration;

use anyhow::anyhow;
use bhm_firmware_sim::{
    BridgeError, BridgeOptions, BridgeSummary, run_bridge,
    serial::{HostPort, PortAddress},
};
use bhm_host::ipc::DEFAULT_CONSUMERS;
use clap::Args;
use tracing::info;

use crate::{
    options::MapOptions,
    output::{Output, Usage},
    processes::{DomainOptions, json_lines::Onboarded},
};

/// Join a microcontroller at the end of a serial line to shared memory, in the place of the onboard process
#[derive(Args, Debug)]
pub(crate) struct Bridge {
    #[command(flatten)]
    domain: DomainOptions,
    /// Where the device is: unix:PATH (a socket), tcp:127.0.0.1:PORT, or the path of a serial device or pseudo-terminal
    #[arg(long, env = "BHM_PORT", value_name = "PORT", required_unless_present = "print_config")]
    port: Option<PortAddress>,
    /// Speed of a serial device, bits per second [default: as it is set]
    #[arg(long, env = "BHM_BAUD", value_name = "BAUD", value_parser = clap::value_parser!(u32).range(1..))]
    baud: Option<u32>,
    /// After a source's last scan, tell the device to end, and end
    #[arg(long)]
    until_end: bool,
    /// Consumers that shared memory is taken for; each costs three posteriors
    #[arg(long, value_name = "N", default_value_t = DEFAULT_CONSUMERS as u32, value_parser = clap::value_parser!(u32).range(1..=64))]
    consumers: u32,
    /// Wait so long for the port to appear
    #[arg(long, value_name = "S", default_value_t = 0)]
    wait: u32,
    /// Send a scan again that the device has not acknowledged after so long
    #[arg(long, value_name = "S", default_value_t = 15, value_parser = clap::value_parser!(u32).range(1..))]
    send_again: u32,
    /// Give the device up when it has been silent for so long
    #[arg(long, value_name = "S", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..))]
    give_up: u32,
    #[command(flatten)]
    map: MapOptions,
}

impl Bridge {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(options) = self.map.effective_of_firmware()? else { return Ok(()) };
        let Some(address) = &self.port else { return Ok(()) };
        let (domain, stop) = self.domain.join()?;
        let seconds = |seconds: u32| Duration::from_secs(seconds.into());
        let port = HostPort::open(address.clone(), self.baud, seconds(self.wait));
        let mut port = port.map_err(|error| anyhow!("cannot open {address}: {error}"))?;
        let bridge = BridgeOptions {
            consumers: self.consumers as usize,
            until_end: self.until_end,
            send_again_after: seconds(self.send_again),
            give_up_after: seconds(self.give_up),
            ..BridgeOptions::default()
        };
        let summary = run_bridge(&options.profile, &domain, &bridge, &mut port, &stop);
        let summary = summary.map_err(|error| match error {
            BridgeError::Shape(_) | BridgeError::Settings(_) => Usage(error.to_string()).into(),
            other => anyhow::Error::from(other).context(format!("{address}")),
        })?;
        if self.until_end && summary.source_ended && !summary.device_finished {
            info!("the device went without saying that it ends");
        }
        let onboarded = Onboarded::from(summary);
        output.result(&onboarded, || onboarded.text(["on the device", "in its archive"]))
    }
}

impl From<BridgeSummary> for Onboarded {
    fn from(summary: BridgeSummary) -> Self {
        Self {
            mapper: format!("{:016x}", summary.mapper),
            source_ended: summary.source_ended,
            posterior: summary.posterior,
            tiles_resident: summary.tiles_resident,
            tiles_archived: summary.tiles_archived as usize,
            counters: summary.counters.into_iter().collect(),
            last_fault: summary.last_fault.as_ref().map(ToString::to_string),
            // The deadline is the device's own, and so is what counts it.
            ..Self::default()
        }
    }
}
