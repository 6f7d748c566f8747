//! Table 1: run time of an update in M (supports, features, inducing points) and N (points of a scan), measured.

use bhm_host::ScanRecord;

use super::{Extent, FRACTION, page::Page};
use crate::{
    baselines::Size,
    contest::{Contest, Contestant, Dataset, Loaded, Outcome, Results, Round, RunOptions, hold, load},
    evaluation::{Held, Sampling, Task, TrainingScan},
    text::headed,
};

/// Scans of the building: few, since only the time of an update is wanted, and spread over the whole of it.
const EVERY: usize = 40;

/// Processor time for one measurement, seconds.
const DEADLINE_S: f64 = 2.0;

/// Of whom: the finest size, how often it is coarsened (doubling M), and what theory says.
const MEASURED: [(&str, f32, &str); 8] = [
    ("ours", 0.25, "rows + touched tiles: N + M of the scan's surroundings"),
    ("dense-bhm", 1.0, "M³ + N"),
    ("diagonal-bhm", 0.25, "N, and M to copy"),
    ("vsdgpom", 800.0, "M³ + N M²"),
    ("gaussian-process", 0.0, "N³"),
    ("hilbert-nystrom", 800.0, "N M"),
    ("hilbert-fourier", 8_000.0, "N M"),
    ("counting-grid", 0.1, "N"),
];

/// One measurement.
struct Point {
    /// M or N.
    size: f64,
    ms: f64,
}

pub(super) fn write(page: &mut Page, extent: &Extent, seed: u64, results: &mut Results) -> anyhow::Result<()> {
    page.section("Table 1: run time in M and N, measured");
    page.text(
        "Median time of an update on every 40th scan of the simulated building, each line doubling M (number of supports over the \
         area, features, inducing points, or points a region) at full scans, or N (points of a scan) at the middle size. The \
         exponent is the slope of the logarithm of time over that of the size: what it is at these sizes, not in the limit.\n",
    );
    let dataset = Dataset { every: EVERY, name: "building".to_owned(), ..Dataset::parse("building")? };
    let loaded = load(&[dataset], &[seed])?;
    let [(_, loaded)] = &loaded[..] else { return Ok(()) };
    let mut rows = headed(["contestant", "M", "ms", "exponent in M", "N", "ms", "exponent in N", "theory"]);
    let steps = extent.scaling_steps;
    let mut measure = Measure { loaded, steps, seed, results };
    for (name, finest, theory) in MEASURED {
        let Ok(default) = name.parse::<Contestant>() else { continue };
        let finest = Contestant { size: if finest > 0.0 { finest } else { default.size }, ..default };
        let in_m = measure.in_m(&finest)?;
        let in_n = measure.in_n(&coarsened(&finest, steps / 2))?;
        let list =
            |points: &[Point], cell: fn(&Point) -> String| points.iter().map(cell).collect::<Vec<_>>().join(", ");
        let exponent = |points: &[Point]| slope(points).map_or("-".to_owned(), |slope| format!("{slope:.2}"));
        rows.push(vec![
            format!("`{name}`"),
            list(&in_m, |point| format!("{:.0}", point.size)),
            list(&in_m, |point| format!("{:.3}", point.ms)),
            exponent(&in_m),
            list(&in_n, |point| format!("{:.0}", point.size)),
            list(&in_n, |point| format!("{:.3}", point.ms)),
            exponent(&in_n),
            theory.to_owned(),
        ]);
    }
    page.table(&rows);
    Ok(())
}

/// A contestant with half as many of everything, so many times.
fn coarsened(finest: &Contestant, times: usize) -> Contestant {
    // In the plane a length grows with the root of what M falls by.
    let factor = match finest.entry.size {
        Size::Metres(_) => 2.0_f32.sqrt(),
        Size::Count(..) => 2.0,
    };
    finest.coarser(factor.powi(times as i32))
}

/// What is measured, and where it is kept.
struct Measure<'a> {
    loaded: &'a Loaded,
    /// Sizes in each direction.
    steps: usize,
    seed: u64,
    results: &'a mut Results,
}

impl Measure<'_> {
    fn in_m(&mut self, finest: &Contestant) -> anyhow::Result<Vec<Point>> {
        let task = self.loaded.task(Held::Beams, FRACTION, self.seed)?;
        let [min, max] = task.area_m().unwrap_or_default();
        let area_m2 = f64::from(max[0] - min[0]) * f64::from(max[1] - min[1]);
        let contestants: Vec<Contestant> = (0..self.steps).rev().map(|times| coarsened(finest, times)).collect();
        let size = |contestant: &Contestant| match contestant.entry.size {
            Size::Metres(_) => area_m2 / f64::from(contestant.size).powi(2),
            Size::Count(..) => f64::from(contestant.size),
        };
        let sizes: Vec<f64> = contestants.iter().map(size).collect();
        let round = Round::new(self.loaded, "beams, for Table 1".to_owned(), self.seed, task);
        let outcomes = self.taken(vec![round], contestants)?;
        Ok(points(sizes, &outcomes))
    }

    fn in_n(&mut self, contestant: &Contestant) -> anyhow::Result<Vec<Point>> {
        let task = self.loaded.task(Held::Beams, FRACTION, self.seed)?;
        let mut points_of_a_scan = Vec::new();
        let mut rounds = Vec::new();
        for times in (0..self.steps).rev() {
            let thinned = thinned(&task, 1 << times, &self.loaded.sampling(self.seed));
            let count: usize = thinned.training.iter().map(|shown| shown.points().len()).sum();
            points_of_a_scan.push(count as f64 / thinned.training.len().max(1) as f64);
            rounds.push(Round::new(
                self.loaded,
                format!("beams, every {}., for Table 1", 1 << times),
                self.seed,
                thinned,
            ));
        }
        let outcomes = self.taken(rounds, vec![*contestant])?;
        Ok(points(points_of_a_scan, &outcomes))
    }

    /// One after the other: two at once would share caches that the sizes are to fill.
    fn taken(&mut self, rounds: Vec<Round<'_>>, contestants: Vec<Contestant>) -> anyhow::Result<Vec<Outcome>> {
        let options = RunOptions { deadline_s: Some(DEADLINE_S), checkpoints: 0 };
        Ok(hold(&Contest { rounds, contestants, options, jobs: 1 }, self.results)?)
    }
}

/// The task with every n-th training beam.
fn thinned(task: &Task, every: usize, sampling: &Sampling) -> Task {
    let thin = |shown: &TrainingScan| {
        let record = shown.beams()?;
        let kept = |(beam, range_m): (usize, &f32)| if beam % every == 0 { *range_m } else { f32::NAN };
        let ranges_m = record.ranges_m.iter().enumerate().map(kept).collect();
        Some(TrainingScan::of_beams(shown.scan, ScanRecord { ranges_m, ..record.clone() }, sampling))
    };
    Task { training: task.training.iter().filter_map(thin).collect(), ..task.clone() }
}

/// Sizes with the median times of those that learned anything.
fn points(sizes: Vec<f64>, outcomes: &[Outcome]) -> Vec<Point> {
    let measured = sizes.into_iter().zip(outcomes).filter(|(_, outcome)| outcome.timing.p50_ms > 0.0);
    measured.map(|(size, outcome)| Point { size, ms: outcome.timing.p50_ms }).collect()
}

/// The slope of the line through the logarithms; `None` for fewer than two sizes.
fn slope(points: &[Point]) -> Option<f64> {
    let logs: Vec<[f64; 2]> = points.iter().map(|point| [point.size.ln(), point.ms.ln()]).collect();
    let count = logs.len() as f64;
    let mean = [0, 1].map(|axis| logs.iter().map(|log| log[axis]).sum::<f64>() / count);
    let product = |a: usize, b: usize| logs.iter().map(|log| (log[a] - mean[a]) * (log[b] - mean[b])).sum::<f64>();
    (product(0, 0) > 0.0).then(|| product(0, 1) / product(0, 0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_is_the_exponent() {
        let of = |exponent: f64| [10.0, 20.0, 40.0].map(|size: f64| Point { size, ms: 0.3 * size.powf(exponent) });
        assert!((slope(&of(3.0)).unwrap() - 3.0).abs() < 1e-12);
        assert!(slope(&of(0.0)).unwrap().abs() < 1e-12);
        assert_eq!(slope(&of(1.0)[..1]), None);
        assert_eq!(slope(&[]), None);
    }

    #[test]
    fn coarsening_halves_m() {
        let ours = coarsened(&"ours:0.25".parse().unwrap(), 2);
        assert!((ours.size - 0.5).abs() < 1e-6);
        assert_eq!(coarsened(&"ours:0.25".parse().unwrap(), 0).size, 0.25);
    }
}
