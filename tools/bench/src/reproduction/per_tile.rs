//! Figure 8a in instructions: what our update costs per touched tile and pass, counted.

use std::{
    ffi::OsStr,
    fs,
    path::Path,
    process::Command,
    thread::{self, JoinHandle},
};

use anyhow::Context;
use bhm_plot::chart::{Axis, Chart, Sample, Scale, Series};
use tracing::{info, warn};

use super::{COARSE, Extent, page::Page};
use crate::{
    contest::Results,
    instructions::{self, PerTile},
    text::headed,
};

/// The function whose calls are counted: one update, whoever the contestant.
const UPDATE: &str = "bhm_bench::contest::run::measured_update";

/// Scans that the figure averages.
const WINDOW: usize = 20;

/// What was counted: the dataset, each scan's work, and its instructions.
struct Counted {
    dataset: String,
    work: Vec<[f64; 2]>,
    counts: Vec<f64>,
}

/// A count that goes on beside other work: counts are the same however busy the machine.
pub(super) struct Counting(Option<JoinHandle<anyhow::Result<Counted>>>);

/// Begins to count, if valgrind is there.
pub(super) fn start(bhm: &Path, log: Option<&Path>, extent: &Extent, folder: &Path) -> Counting {
    if !instructions::available() {
        warn!("instructions are not counted: valgrind is missing (Debian: apt-get install valgrind)");
        return Counting(None);
    }
    info!("counting instructions of {COARSE}");
    let (name, every) = match log {
        Some(log) => (log.as_os_str().to_owned(), extent.every[1]),
        None => ("traffic".into(), extent.every[0]),
    };
    let (bhm, scratch) = (bhm.to_owned(), folder.join("instructions"));
    Counting(Some(thread::spawn(move || count(&bhm, &name, every, &scratch))))
}

fn count(bhm: &Path, dataset: &OsStr, every: usize, scratch: &Path) -> anyhow::Result<Counted> {
    fs::create_dir_all(scratch).with_context(|| format!("cannot make the folder {}", scratch.display()))?;
    let kept = scratch.join("results.jsonl");
    fs::remove_file(&kept).ok();
    let mut program = Command::new(bhm);
    program.args(["compare", "--quiet", "--contestant", COARSE, "--every", &every.to_string(), "--dataset"]);
    program.arg(dataset).arg("--results").arg(&kept);
    let counted = instructions::count_calls(scratch, UPDATE, &mut program)?;
    let results = Results::open(&kept)?;
    let outcome = results.outcomes().first().context("the watched run left no outcome")?;
    let (updates, calls) = (outcome.work.len(), counted.calls.len());
    anyhow::ensure!(updates == calls, "{updates} updates, but {calls} calls were counted");
    let work = outcome.work.iter().map(|work| work.map(|units| units as f64)).collect();
    let dataset = outcome.dataset.clone();
    fs::remove_dir_all(scratch).ok();
    Ok(Counted { dataset, work, counts: counted.calls })
}

/// Waits for the count, and writes what came of it.
pub(super) fn write(page: &mut Page, counting: Counting) -> anyhow::Result<()> {
    page.text("### Instructions of ours per touched tile and pass\n");
    let Some(counting) = counting.0 else {
        page.text("Not counted: valgrind is missing.\n");
        return Ok(());
    };
    let counted = counting.join().map_err(|_| anyhow::anyhow!("the count of instructions panicked"))??;
    report(page, &counted.dataset, &counted.work, &counted.counts)
}

fn report(page: &mut Page, dataset: &str, work: &[[f64; 2]], counts: &[f64]) -> anyhow::Result<()> {
    let Some(per_tile) = PerTile::of(work, counts) else {
        page.text("Too few scans to compare quarters.\n");
        return Ok(());
    };
    let thousands = |quarters: [f64; 4]| quarters.map(|count| format!("{:.1}", count / 1e3));
    let percent = per_tile.drift().map(|drift| format!("{:+.2} %", 100.0 * drift));
    let mut rows = headed(["thousands", "1st quarter", "2nd", "3rd", "4th", "4th to 1st"]);
    for (what, quarters, drift) in
        [("without what rows cost", per_tile.without_rows, &percent[1]), ("everything", per_tile.whole, &percent[0])]
    {
        let mut row = vec![what.to_owned()];
        row.extend(thousands(quarters));
        row.push(drift.clone());
        rows.push(row);
    }
    page.text(&format!(
        "`{COARSE}` on {dataset}, {} scans, counted by callgrind. The whole run is explained by {:.0} thousand instructions a \
         tile and pass, {:.2} thousand a row and pass, and {:.0} thousand a scan; a row is an observation in a tile. How many rows \
         a tile has is the scans' doing, not the map's: what they cost by that model is taken off in the first line.\n",
        counts.len(),
        per_tile.model[0] / 1e3,
        per_tile.model[1] / 1e3,
        per_tile.model[2] / 1e3,
    ));
    page.table(&rows);
    let windows = work.chunks(WINDOW).zip(counts.chunks(WINDOW)).enumerate();
    let points = |without_rows: bool| -> Vec<Sample> {
        let one = |(index, (work, counts)): (usize, (&[[f64; 2]], &[f64]))| {
            let sum = |of: usize| work.iter().map(|work| work[of]).sum::<f64>();
            let mut count = counts.iter().sum::<f64>();
            if without_rows {
                count -= per_tile.model[1] * sum(1) + per_tile.model[2] * counts.len() as f64;
            }
            let x = (index * WINDOW + counts.len()) as f64;
            Sample { x, y: count / sum(0).max(1.0) / 1e3, error: None }
        };
        windows.clone().map(one).collect()
    };
    let (all, rest) = (points(false), points(true));
    let series =
        [Series { name: "everything", points: &all }, Series { name: "without what rows cost", points: &rest }];
    let chart = Chart {
        title: "instructions per touched tile and pass",
        x: Axis { label: "scans", scale: Scale::Linear },
        y: Axis { label: "thousand instructions", scale: Scale::Linear },
        series: &series,
    };
    let title = format!("{dataset}: instructions against scans");
    page.chart("fig8a-instructions.png", &title, chart)
}
