use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use bhm_bench::metrics::Scores;
use bhm_core::map::ModelledMap;
use bhm_host::{
    snapshot::{self, Snapshot},
    stop_on_signals,
};
use bhm_plot::map_picture::{MapPicture, Quantity, worth_drawing};
use clap::Args;

use super::{
    Deadline,
    firmware::{DEFAULT_ELF, Firmware},
    group::{Maker, ProcessGroup},
    report::{Made, RunReport},
};
use crate::{
    options::{Effective, MapOptions},
    output::Output,
};

/// Options of the commands that start processes and show what they did.
#[derive(Args, Debug)]
pub(crate) struct MappingRunOptions {
    /// Folder for the pictures, the map and the report
    #[arg(short, long, value_name = "DIR", default_value = "bhm-out")]
    output: PathBuf,
    /// Have the firmware make the map, in an emulated microcontroller, with a bridge in the place of the onboard process
    /// [default: where `firmware-sim/cortex-m7/run build` puts it]
    #[arg(long, value_name = "ELF", num_args = 0..=1, default_missing_value = DEFAULT_ELF)]
    firmware: Option<PathBuf>,
    #[command(flatten)]
    deadline: Deadline,
    #[command(flatten)]
    map: MapOptions,
}

/// Processes that map everything, and what they leave: pictures, a map, a report.
pub(crate) struct MappingRun<'a> {
    /// What was mapped, for headings.
    pub(crate) title: &'a str,
    /// The subcommand that sends the scans.
    pub(crate) source: &'static str,
    /// Its arguments.
    pub(crate) arguments: Vec<String>,
    /// The map options in effect.
    pub(crate) options: Effective,
}

impl MappingRunOptions {
    /// The map options in effect, see [`MapOptions::effective`].
    pub(crate) fn effective(&self) -> anyhow::Result<Option<Effective>> {
        if self.firmware.is_some() { self.map.effective_of_firmware() } else { self.map.effective() }
    }
}

impl MappingRun<'_> {
    /// Has the processes map everything, and fills the folder. `score` judges the map, if there is a truth to judge it by.
    ///
    /// # Errors
    /// If a process fails; if what the consumer read is not what the mapper saved; if a file cannot be written.
    pub(crate) fn run(
        &self,
        exhibits: &MappingRunOptions,
        score: impl FnOnce(&dyn ModelledMap<2>) -> anyhow::Result<Option<Scores>>,
        output: &Output,
    ) -> anyhow::Result<()> {
        // Mistakes in the options are found here, and not by a process that has just been started.
        drop(self.options.open()?);
        let stop = stop_on_signals()?;
        let folder = &exhibits.output;
        fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
        let config = folder.join("options.toml");
        write(&config, self.options.configuration()?)?;

        let firmware = exhibits.firmware.as_ref().map(|elf| Firmware::find(elf, folder)).transpose()?;
        let map_file = folder.join("map.bhm");
        let maker = match &firmware {
            Some(firmware) => Maker::Firmware(firmware),
            None => Maker::Onboard { config: &config, map: &map_file, deadline: exhibits.deadline },
        };
        let outcome = ProcessGroup::start(&maker).and_then(|group| group.run(self.source, &self.arguments, &stop));
        if let Some(firmware) = &firmware {
            firmware.show_log();
        }
        let mut outcome = outcome?;
        ensure!(outcome.sent.complete && outcome.onboarded.source_ended, "stopped before the last scan");

        let (made, scores) = match &firmware {
            Some(firmware) => {
                let posterior = outcome.posterior.take().context("no posterior was read")?;
                self.draw(&*posterior, &[], folder)?;
                (Made::by_firmware(firmware, &*posterior), score(&*posterior)?)
            }
            None => {
                let Snapshot { map, extras } = snapshot::load(&map_file)?;
                self.draw(&*map, &extras.path_m, folder)?;
                (Made::saved(&*map, &outcome), score(&*map)?)
            }
        };
        let report = RunReport::new(self.title, folder, outcome, made, scores, self.options.values());
        write(&folder.join("report.md"), report.markdown()?)?;
        write(&folder.join("report.json"), serde_json::to_string_pretty(&report)? + "\n")?;
        output.result(&report, || report.text())?;
        report.check()
    }

    fn draw(&self, map: &dyn ModelledMap<2>, path_m: &[[f32; 2]], folder: &Path) -> anyhow::Result<()> {
        let bounds_m = worth_drawing(map).context("not one scan could be learned from; there is nothing to draw")?;
        for (file, quantity) in [("probability.png", Quantity::Probability), ("deviation.png", Quantity::Deviation)] {
            let picture = MapPicture { map, quantity, bounds_m, pixels_per_metre: None, title: self.title, path_m };
            picture.write(&folder.join(file))?;
        }
        Ok(())
    }
}

fn write(path: &Path, text: String) -> anyhow::Result<()> {
    fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
}
