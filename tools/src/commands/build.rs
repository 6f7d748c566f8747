use std::{fs, path::PathBuf, time::Instant};

use bhm_bench::reading;
use bhm_host::snapshot::{self, Extras};
use clap::Args;
use serde::Serialize;

use crate::{
    options::MapOptions,
    output::{Output, Usage, bytes, table},
    progress,
    reports::Learned,
};

/// Make a map file from a scan log; the same log and options give the same file, byte for byte
#[derive(Args, Debug)]
pub(crate) struct Build {
    /// Scan log (CARMEN), plain or gzip
    #[arg(required_unless_present = "print_config")]
    log: Option<PathBuf>,
    /// Map file to write
    #[arg(short, long, value_name = "MAP", required_unless_present = "print_config")]
    output: Option<PathBuf>,
    #[command(flatten)]
    map: MapOptions,
}

#[derive(Serialize)]
struct Built {
    map: PathBuf,
    bytes: u64,
    posterior: String,
    tiles: usize,
    seconds: f64,
    max_range_m: f32,
    learned: Learned,
}

impl Build {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(options) = self.map.effective()? else { return Ok(()) };
        let (Some(log_path), Some(path)) = (&self.log, &self.output) else {
            return Err(Usage("a log and a map file are needed".to_owned()).into());
        };
        let mut map = options.open()?;
        let log = options.read(log_path)?;

        let mut learned = Learned::default();
        let mut extras = Extras { profile: options.profile.name.to_owned(), path_m: Vec::new() };
        let start = Instant::now();
        for scan in progress::over(log.scans.iter(), "learning") {
            if learned.learn(|| map.integrate(&scan.as_scan())) {
                extras.path_m.push([scan.header.map_from_sensor.x_m, scan.header.map_from_sensor.y_m]);
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        learned.warn(&options.profile);
        anyhow::ensure!(learned.counters.integrated > 0, "{}: not one scan could be learned from", log_path.display());
        snapshot::save(path, &*map, &extras)?;

        let (resident, archived) = map.tile_counts();
        let built = Built {
            map: path.clone(),
            bytes: fs::metadata(path)?.len(),
            posterior: map.digest().to_string(),
            tiles: resident + archived,
            seconds,
            max_range_m: log.report.max_range_m,
            learned,
        };
        output.result(&built, || {
            table(&[
                ("map", format!("{}, {}", path.display(), bytes(built.bytes as usize))),
                ("posterior", built.posterior.clone()),
                ("learned", built.learned.summary()),
                ("max range", format!("{} m, {}", built.max_range_m, reading::source(log.report.max_range_source))),
                ("tiles", built.tiles.to_string()),
                ("time", format!("{seconds:.2} s, {:.0} scans/s", built.learned.counters.integrated as f64 / seconds)),
            ])
        })
    }
}
