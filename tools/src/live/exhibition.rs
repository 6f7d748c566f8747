use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use bhm_host::{
    map::AnyMap,
    snapshot::{self, Snapshot},
    stop_on_signals,
};
use bhm_tools::metrics::Scores;
use clap::Args;

use super::{Deadline, crew::Crew, report::Report};
use crate::{
    drawing::{self, Drawing, What},
    options::{Effective, MapOptions, MapValues},
    output::Output,
};

/// Options of the commands that start a crew and show what it did.
#[derive(Args, Debug)]
pub(crate) struct Exhibits {
    /// Folder for the pictures, the map and the report
    #[arg(short, long, value_name = "DIR", default_value = "bhm-out")]
    output: PathBuf,
    #[command(flatten)]
    deadline: Deadline,
    #[command(flatten)]
    map: MapOptions,
}

/// Three processes, and what is left of them: pictures, a map, a report.
pub(crate) struct Exhibition<'a> {
    /// What was mapped, for headings.
    pub(crate) title: &'a str,
    /// The subcommand that sends the scans.
    pub(crate) source: &'static str,
    /// Its arguments.
    pub(crate) arguments: Vec<String>,
    /// The map options in effect.
    pub(crate) options: Effective,
}

impl Exhibits {
    /// The map options in effect, see [`MapOptions::effective`].
    pub(crate) fn effective(&self) -> anyhow::Result<Option<Effective>> {
        self.map.effective()
    }
}

impl Exhibition<'_> {
    /// Has the crew map everything, and fills the folder. `score` judges the map, if there is a truth to judge it by.
    ///
    /// # Errors
    /// If a process fails; if what the consumer read is not what the mapper saved; if a file cannot be written.
    pub(crate) fn hold(
        &self,
        exhibits: &Exhibits,
        score: impl FnOnce(&dyn AnyMap) -> anyhow::Result<Option<Scores>>,
        output: &Output,
    ) -> anyhow::Result<()> {
        // Mistakes in the options are found here, and not by a process that has just been started.
        drop(self.options.open()?);
        let stop = stop_on_signals()?;
        let folder = &exhibits.output;
        fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
        let options = MapValues::of(&self.options);
        let config = folder.join("options.toml");
        write(&config, toml::to_string(&options)?)?;

        let map_file = folder.join("map.bhm");
        let outcome = Crew::start(&config, &map_file, exhibits.deadline)?.run(self.source, &self.arguments, &stop)?;
        ensure!(outcome.sent.complete && outcome.onboarded.source_ended, "stopped before the last scan");

        let Snapshot { map, extras } = snapshot::load(&map_file)?;
        self.draw(&*map, &extras.path_m, folder)?;
        let report = Report::new(self.title, folder, outcome, &*map, score(&*map)?, options);
        write(&folder.join("report.md"), report.markdown()?)?;
        write(&folder.join("report.json"), serde_json::to_string_pretty(&report)? + "\n")?;
        output.result(&report, || report.text())?;
        report.check()
    }

    fn draw(&self, map: &dyn AnyMap, path_m: &[[f32; 2]], folder: &Path) -> anyhow::Result<()> {
        let ask = |point_m: &_| map.occupancy(point_m);
        let worth = drawing::worth_drawing(&map.model(), &map.tile_indices(), ask);
        let bounds_m = worth.context("not one scan could be learned from; there is nothing to draw")?;
        for (file, what) in [("probability.png", What::Probability), ("deviation.png", What::Deviation)] {
            let drawing = Drawing { what, bounds_m, pixels_per_metre: None, title: self.title, path_m, occupancy: ask };
            drawing.write(&folder.join(file))?;
        }
        Ok(())
    }
}

fn write(path: &Path, text: String) -> anyhow::Result<()> {
    fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
}
