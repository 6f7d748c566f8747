//! Every baseline is at least as good as an independent implementation of the same method, on the very same points of a
//! recorded log: a weak baseline would flatter what is compared with it.
//!
//! The points are those of the evidence: two free points a beam, a tenth of the beams held out whole. The independent figures,
//! OctoMap's among them, were measured on the same points with other people's programs.

use std::time::{Duration, Instant};

use bhm_bench::{
    baselines::{self, Setup, Size},
    evaluation::{Task, Timing},
    metrics::Scores,
};
use bhm_core::profile::COMPACT;
use bhm_host::{
    ScanRecord,
    dataset::{self, PointLog, ReadOptions},
};
use bhm_oracle::recorded;

const TRAIN: &str = "intel-beams-train.csv.gz";
const TEST: &str = "intel-beams-test.csv.gz";
const LOG: &str = "intel-corrected.log.gz";

fn scans() -> Option<Vec<ScanRecord>> {
    Some(dataset::read_log(&recorded(LOG)?, &ReadOptions::default()).expect("a readable log").scans)
}

fn position_m(scan: &ScanRecord) -> [f32; 2] {
    [scan.header.map_from_sensor.x_m, scan.header.map_from_sensor.y_m]
}

/// All points, and where the sensor stood.
fn task() -> Option<Task> {
    let [train, test] =
        [TRAIN, TEST].map(|name| Some(PointLog::read(&recorded(name)?).expect("readable points").scans));
    let scans = scans()?;
    let origin_m = |at: u64| scans.get(usize::try_from(at).ok()?).map(position_m);
    Some(Task::of_points(train?, test?, COMPACT.settings.limits, origin_m))
}

/// Has a baseline of this name learn the whole task, asks it, and says on standard error how it went.
fn run(name: &str, size: Option<f32>, task: &Task) -> Scores {
    let entry = baselines::all().find(|entry| entry.name == name).expect("an entry of this name");
    let (Size::Metres(default) | Size::Count(default, _)) = entry.size;
    let setup = Setup {
        area_m: task.area_m().expect("something to learn"),
        size: size.unwrap_or(default),
        limits: task.limits,
        profile: COMPACT,
        seed: 1,
    };
    let mut baseline = (entry.open)(&setup).expect("opens");
    let durations: Vec<Duration> = task
        .training
        .iter()
        .map(|shown| {
            let start = Instant::now();
            baseline.integrate(shown).expect("learns");
            start.elapsed()
        })
        .collect();
    let logits: Vec<f64> = baseline.predict(&task.test.points_m).iter().map(|prediction| prediction.logit).collect();
    let scores = Scores::of(&logits, &task.test.occupied).expect("finite logits");
    eprintln!(
        "{name} ({}): AUC {:.4}, NLL {:.4}, ECE {:.4}, median {:.2} ms a scan, {} kB",
        baseline.description(),
        scores.auc.unwrap_or(f64::NAN),
        scores.nll,
        scores.ece,
        Timing::of(durations).p50_ms,
        baseline.memory_bytes() / 1000
    );
    scores
}

#[track_caller]
fn at_least(scores: &Scores, least_auc: f64, most_nll: f64) {
    let auc = scores.auc.expect("both classes");
    assert!(auc >= least_auc, "AUC {auc:.4} is below {least_auc}");
    assert!(scores.nll <= most_nll, "NLL {:.4} is above {most_nll}", scores.nll);
}

/// The scan `n` of the points is the `n`-th of the log: each hit lies at a range that the scan has, from where it stood.
#[test]
fn the_scans_of_the_points_are_those_of_the_log() {
    // Both files are written to 1e-5 m; ranges have centimetres.
    const WRITTEN_M: f32 = 1e-3;
    let (Some(scans), Some(task)) = (scans(), task()) else { return };
    assert_eq!(scans.len(), task.training.len());
    for shown in &task.training {
        let scan = &scans[usize::try_from(shown.scan).unwrap()];
        let [x_m, y_m] = shown.origin_m().expect("a scan of the log");
        for ray in shown.rays() {
            let length_m = (ray.end_m[0] - x_m).hypot(ray.end_m[1] - y_m);
            let found = scan.ranges_m.iter().any(|range_m| (range_m - length_m).abs() < WRITTEN_M);
            assert!(found, "scan {} has no range of {length_m} m", shown.scan);
        }
    }
}

/// A clamped grid of the same cells in C++ has .962 and .199, OctoMap .971 and .191.
#[test]
fn log_odds_grids_are_as_good_as_octomap() {
    let Some(task) = task() else { return };
    at_least(&run("log-odds-grid", None, &task), 0.960, 0.20);
    at_least(&run("log-odds-grid-unclamped", None, &task), 0.960, 0.45);
}

/// In Python, .991 and .116.
#[test]
fn a_counting_grid_is_as_good_as_another() {
    let Some(task) = task() else { return };
    at_least(&run("counting-grid", None, &task), 0.990, 0.110);
}

/// The public program has .954 and .275.
#[test]
fn a_diagonal_bhm_is_as_good_as_the_public_one() {
    let Some(task) = task() else { return };
    at_least(&run("diagonal-bhm", None, &task), 0.953, 0.278);
    at_least(&run("diagonal-bhm-mean-field", None, &task), 0.980, 0.160);
}

/// In scikit-learn, .961 and .297 (sparse), .895 and 1.74 (10 000 Fourier features), .925 and .363 (1 000 inducing points).
#[test]
fn hilbert_maps_are_as_good_as_others() {
    let Some(task) = task() else { return };
    at_least(&run("hilbert-sparse", None, &task), 0.988, 0.120);
    at_least(&run("hilbert-fourier", None, &task), 0.965, 0.220);
    if cfg!(feature = "dense") {
        at_least(&run("hilbert-nystrom", None, &task), 0.980, 0.160);
    }
}
