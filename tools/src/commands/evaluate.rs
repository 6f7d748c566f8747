use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use bhm_bench::{
    evaluation::{Held, TestPoints, Timing, Training, hold_out},
    metrics::Scores,
    reading,
};
use bhm_core::{beam::Observation, geometry::Point};
use bhm_host::{
    dataset::{LabelledPoints, PointLog, ScanLog},
    map::AnyMap,
};
use clap::Args;
use serde::Serialize;
use tracing::info;

use crate::{
    options::{Effective, MapOptions, fraction, held},
    output::{Output, Usage, bytes, table},
    progress,
    reports::Learned,
};

/// Learn one part of a log and score the map's predictions of the rest
#[derive(Args, Debug)]
pub(crate) struct Evaluate {
    /// Scan log (CARMEN), plain or gzip, of which a part is held out
    #[arg(required_unless_present_any = ["train", "print_config"], conflicts_with = "train")]
    log: Option<PathBuf>,
    /// What is held out as a whole
    #[arg(long, value_parser = held(), default_value_t = Held::Beams, conflicts_with = "train")]
    holdout: Held,
    /// The part that is held out, above 0 and below 1
    #[arg(long, default_value_t = 0.1, value_parser = fraction(), value_name = "PART", conflicts_with = "train")]
    fraction: f64,
    /// Seed of what is held out and of where held-out beams are asked
    #[arg(long, default_value_t = 1, conflicts_with = "train")]
    seed: u64,
    /// Labelled points to learn (CSV: scan,x,y,label), plain or gzip, instead of a log
    #[arg(long, value_name = "CSV", requires = "test")]
    train: Option<PathBuf>,
    /// Labelled points to predict
    #[arg(long, value_name = "CSV", requires = "train")]
    test: Option<PathBuf>,
    #[command(flatten)]
    map: MapOptions,
}

/// What is learned and what is asked.
struct Task {
    training: Training,
    test: TestPoints,
    held_out: String,
    /// Beams of the training scans that were replaced by NaN.
    beams_removed: usize,
    /// From the first scan to the last, where the stamps are the recorder's own.
    recorded_s: Option<f64>,
    max_range_m: Option<f32>,
}

#[derive(Serialize)]
struct Evaluated {
    held_out: String,
    max_range_m: Option<f32>,
    #[serde(flatten)]
    scores: Scores,
    #[serde(flatten)]
    timing: Timing,
    /// How many times faster than the scans were taken; null where the log has no usable stamps.
    times_real_time: Option<f64>,
    tiles: usize,
    tile_bytes: usize,
    /// Allocated at the start, and by tiles that left the store since.
    memory_bytes: usize,
    archive_bytes: usize,
    learned: Learned,
}

impl Evaluate {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        let Some(options) = self.map.effective()? else { return Ok(()) };
        let mut map = options.open()?;
        let task = match (&self.log, &self.train, &self.test) {
            (Some(log), ..) => self.divide(log, &options)?,
            (None, Some(train), Some(test)) => prepared(train, test)?,
            _ => return Err(Usage("a log, or --train and --test, are needed".to_owned()).into()),
        };
        info!("{}", task.held_out);
        anyhow::ensure!(!task.test.points_m.is_empty(), "{}: nothing to predict; hold out more", task.held_out);

        let mut learned = Learned::default();
        match &task.training {
            Training::Scans(scans) => learned.learn_all(&mut *map, scans, "learning"),
            Training::Points(scans) => {
                learn_points(&mut *map, scans, options.profile.capacities.observations, &mut learned);
            }
        }
        learned.leave_out(task.beams_removed);
        learned.warn(&options.profile);
        let learning_s = learned.durations.iter().sum::<Duration>().as_secs_f64();

        let (resident, archived) = map.tile_counts();
        let (memory_bytes, tile_bytes) = map.bytes();
        let evaluated = Evaluated {
            held_out: task.held_out,
            max_range_m: task.max_range_m,
            scores: task.test.score(|point_m| map.occupancy(point_m))?,
            timing: Timing::of(learned.durations.clone()),
            times_real_time: task.recorded_s.map(|recorded_s| recorded_s / learning_s),
            tiles: resident + archived,
            tile_bytes,
            memory_bytes,
            archive_bytes: archived * tile_bytes,
            learned,
        };
        output.result(&evaluated, || evaluated.text())
    }

    /// Holds a part of a log out.
    fn divide(&self, path: &Path, options: &Effective) -> anyhow::Result<Task> {
        let ScanLog { scans, report } = options.read(path)?;
        let split = hold_out(&scans, self.holdout, self.fraction, self.seed);
        let unit = match self.holdout {
            Held::Beams => "beams with a return",
            Held::Points => "points of beams with a return",
            Held::Scans => "scans",
        };
        Ok(Task {
            training: split.training,
            held_out: format!(
                "{} of {} {unit} held out (seed {}), {} points to predict",
                split.held,
                split.of,
                self.seed,
                split.test.points_m.len()
            ),
            test: split.test,
            beams_removed: if self.holdout == Held::Beams { split.held } else { 0 },
            recorded_s: reading::recorded_s(&scans, &report),
            max_range_m: Some(report.max_range_m),
        })
    }
}

/// Takes points that were prepared and divided elsewhere.
fn prepared(train: &Path, test: &Path) -> anyhow::Result<Task> {
    let read = |path: &Path| -> anyhow::Result<PointLog> {
        let log = PointLog::read(path)?;
        reading::point_log(path, &log.report);
        Ok(log)
    };
    let (training, test_log) = (read(train)?, read(test)?);
    let points = TestPoints::of(test_log.scans);
    Ok(Task {
        held_out: format!("{} points of {}", points.points_m.len(), test.display()),
        training: Training::Points(training.scans),
        test: points,
        beams_removed: 0,
        recorded_s: None,
        max_range_m: None,
    })
}

/// Learns labelled points scan by scan; a scan of more than the map takes at once, in pieces.
fn learn_points(map: &mut dyn AnyMap, scans: &[LabelledPoints], capacity: usize, learned: &mut Learned) {
    for scan in progress::over(scans.iter(), "learning") {
        let labelled = scan.points_m.iter().zip(&scan.occupied);
        let observations: Vec<_> =
            labelled.map(|(point_m, occupied)| Observation::at_point(Point::from(*point_m), *occupied)).collect();
        if observations.len() > capacity {
            info!("scan {}: {} points learned {capacity} at a time", scan.scan, observations.len());
        }
        for observations in observations.chunks(capacity) {
            learned.learn(|| map.integrate_observations(observations));
        }
    }
}

impl Evaluated {
    fn text(&self) -> String {
        let Self { scores, timing, .. } = self;
        let real_time = self.times_real_time.map_or(String::new(), |times| format!(", {times:.0} x real time"));
        let mut rows = vec![("held out", self.held_out.clone())];
        rows.extend(self.max_range_m.map(|max_range_m| ("max range", format!("{max_range_m} m"))));
        rows.push(("learned", self.learned.summary()));
        rows.extend(scores.rows());
        rows.extend([
            ("speed", format!("{:.1} scans/s{real_time}", timing.scans_per_s)),
            (
                "per scan",
                format!("p50 {:.3} ms, p99 {:.3} ms, max {:.3} ms", timing.p50_ms, timing.p99_ms, timing.max_ms),
            ),
            ("tiles", format!("{} of {}", self.tiles, bytes(self.tile_bytes))),
            ("memory", format!("{} and {} in the archive", bytes(self.memory_bytes), bytes(self.archive_bytes))),
        ]);
        table(&rows)
    }
}
