//! How many instructions a scan costs, and what explains them: counted by callgrind, so that a busy machine does not matter.
//!
//! `cargo bench -p bhm-tools --bench instructions [-- LOG NAME=VALUE …]` runs itself under `valgrind --tool=callgrind`, which
//! dumps the count after every call of [`measured`]. Without a log it maps the simulated building. It fails if the figures
//! leave their bounds: the mean of a scan, the linear model `a·tiles·passes + b·rows·passes + c` over all scans, and what points
//! asked for in one call cost against the same points one by one.
//!
//! Arguments of the form `NAME=VALUE` change what is measured, and then nothing is bounded: `kernel`, `kernel-shape`,
//! `beam-rule`, `segment-length`, `free-spacing`, `spacing` and `passes` as `bhm` has them, `every=N` for every N-th scan.
//! Features are computed once for all passes: of the same scans with 1 and with 3 passes, `b₁ = features + row` and
//! `3·b₃ = features + 3·row` tell one from the other.

use std::{
    env, fs,
    path::Path,
    process::{Command, ExitCode},
};

use bhm_bench::instructions::{CountError, Counted, PerTile, count_calls, plane};
use bhm_core::{
    beam::AnyBeamRule,
    geometry::Point,
    kernel::KernelSettings,
    map::{Grid, Occupancy},
    mapper::IntegrateReport,
    posterior::{Posterior, Scratch},
    profile::{self, Capacities, Profile},
    scan::ScanHeader,
    settings::Settings,
};
use bhm_host::{ScanRecord, dataset, map, sim};

/// Most instructions that a scan of a log may cost on average, at 0.5 m and three passes; the simulated scans have twice the
/// beams of the log that the bound is for, and are held to the model only.
const MEAN_BOUND: f64 = 30e6;

/// How far a scan may lie from the linear model, relative to its own count.
const MODEL_BOUND: f64 = 0.05;

/// Set in the process that valgrind watches.
const CHILD: &str = "BHM_INSTRUCTIONS_CHILD";

/// One update, kept out of line so that callgrind can count it by name.
#[inline(never)]
fn measured(map: &mut dyn map::AnyMap, scan: &ScanRecord) -> IntegrateReport {
    map.integrate(&scan.as_scan()).unwrap_or_default()
}

/// What is measured, from the command line.
struct Task {
    log: Option<String>,
    profile: Profile,
    every: usize,
    /// Whether it is what the bounds are for.
    usual: bool,
}

impl Task {
    fn parse(arguments: &[String]) -> Self {
        let mut task = Self { log: None, profile: profile::COMPACT, every: 1, usual: true };
        for argument in arguments {
            let Some((name, value)) = argument.split_once('=') else {
                task.log = Some(argument.clone());
                continue;
            };
            // Room for every row of any rule; a mean over all rows needs all of them.
            task.profile.capacities = Capacities { observations: 1 << 16, rows: 1 << 16, ..task.profile.capacities };
            task.usual = false;
            let number = || value.parse::<f32>().unwrap_or_else(|error| panic!("{argument}: {error}"));
            let settings = &mut task.profile.settings;
            match name {
                "kernel" => settings.kernel = KernelSettings::named(value).expect("a kernel of that name"),
                "beam-rule" => settings.beam = AnyBeamRule::named(value).expect("a beam rule of that name"),
                "kernel-shape" => match &mut settings.kernel {
                    KernelSettings::SquaredExponential(kernel) => kernel.shape = number(),
                    KernelSettings::TwoScales(kernel) => kernel.shape = number(),
                    _ => panic!("{argument}: the kernel has no shape"),
                },
                "segment-length" => match &mut settings.beam {
                    AnyBeamRule::LineSegments(rule) => rule.length = number(),
                    AnyBeamRule::PointSamples(_) => panic!("{argument}: the beam rule gives no segments"),
                },
                "free-spacing" => match &mut settings.beam {
                    AnyBeamRule::PointSamples(rule) => rule.free_spacing_m = number(),
                    AnyBeamRule::LineSegments(_) => panic!("{argument}: the beam rule gives no free points"),
                },
                "spacing" => settings.spacing_m = number(),
                "passes" => settings.passes = number() as u32,
                "every" => task.every = (number() as usize).max(1),
                _ => panic!("{argument}: there is no such setting here"),
            }
        }
        if !task.usual {
            let Settings { kernel, .. } = task.profile.settings;
            task.profile.settings = task.profile.settings.with_kernel(kernel);
        }
        task
    }

    fn scans(&self) -> Vec<ScanRecord> {
        let scans = match &self.log {
            Some(path) => {
                let options = dataset::ReadOptions::default();
                dataset::read_log(Path::new(path), &options).unwrap_or_else(|error| panic!("{error}")).scans
            }
            None => sim::Scene::named("building").expect("the building is built in").simulate(1).collect(),
        };
        scans.into_iter().step_by(self.every).collect()
    }
}

impl Task {
    /// After the log, its first quarter once more: the very same scans, on a map that has grown since.
    fn scans_and_the_first_again(&self) -> Vec<ScanRecord> {
        let mut scans = self.scans();
        let span_ns = scans.last().map_or(0, |last| last.header.stamp_ns) + 1;
        let again = |scan: &ScanRecord| {
            let header = ScanHeader { stamp_ns: scan.header.stamp_ns + span_ns, ..scan.header };
            ScanRecord { header, ..scan.clone() }
        };
        let first: Vec<ScanRecord> = scans[..scans.len() / 4].iter().map(again).collect();
        scans.extend(first);
        scans
    }
}

/// Points asked for together cost at most this share of what they cost one by one: below a half (0.38 to 0.46), and above it where
/// overflows are checked, as they are with the profile of the tests (0.45 to 0.53).
const QUERY_BOUND: f64 = 0.6;

/// The square of 10 m around the first scan's pose, every 5 cm, row by row.
const QUERY_SIDE: usize = 200;

#[inline(never)]
fn measured_one_by_one(map: &dyn map::AnyMap, points: &[Point<2>], answers: &mut [Occupancy]) {
    for (point, answer) in points.iter().zip(answers) {
        *answer = map.occupancy(point);
    }
}

#[inline(never)]
fn measured_in_one_call(map: &dyn map::AnyMap, points: &[Point<2>], answers: &mut [Occupancy]) {
    map.occupancies(points, answers);
}

/// The functions that are compared.
type Query = fn(&dyn map::AnyMap, &[Point<2>], &mut [Occupancy]);
const QUERIES: [(&str, Query); 2] =
    [("measured_one_by_one", measured_one_by_one), ("measured_in_one_call", measured_in_one_call)];

/// Asks a map of the first scans of the simulated building.
fn query_child(query: Query, profile: &str) {
    let mut map = map::open(profile::named(profile).expect("a profile of that name")).expect("the profile is usable");
    let scans: Vec<ScanRecord> = Task::parse(&[]).scans();
    for scan in &scans[..20] {
        map.integrate(&scan.as_scan()).expect("simulated scans are usable");
    }
    let pose = scans[0].header.map_from_sensor;
    let (side, resolution_m) = (QUERY_SIDE, 0.05);
    let corner_m = [pose.x_m, pose.y_m].map(|middle| middle - 0.5 * side as f32 * resolution_m).into();
    let grid = Grid { corner_m, resolution_m, cells: [side; 2] };
    let points: Vec<Point<2>> = (0..grid.len()).map(|number| grid.centre_m(number)).collect();
    query(&*map, &points, &mut vec![Occupancy::UNKNOWN; points.len()]);
}

/// Prints what a point costs one by one and in one call; whether the second is within its bound.
fn compare_queries(folder: &Path) -> Result<bool, CountError> {
    let mut bounded = true;
    for profile in [profile::COMPACT.name, profile::INDOOR.name] {
        let mut per_point = [0.0; 2];
        for (cost, (name, _)) in per_point.iter_mut().zip(QUERIES) {
            *cost = count(folder, name, name, &[profile.to_owned()])?.calls[0] / (QUERY_SIDE * QUERY_SIDE) as f64;
        }
        let [alone, together] = per_point;
        println!("a point of a raster, {profile:8}  {alone:.0} one by one, {together:.0} in one call");
        bounded &= together <= QUERY_BOUND * alone;
    }
    Ok(bounded)
}

/// The band's kernels alone, and little else: factor, solve and selected inverse of one tile's posterior.
fn kernels<const M: usize, const B: usize>(measured: fn(&mut Posterior<M, B>, &Posterior<M, B>, &mut Scratch<M, B>)) {
    let (mut posterior, mut scratch) = (Box::new(Posterior::ZERO), Box::new(Scratch::ZERO));
    let mut prior = Box::new(Posterior::ZERO);
    prior.reset_white(1.0);
    posterior.copy_from(&prior);
    measured(&mut posterior, &prior, &mut scratch);
}

#[inline(never)]
fn measured_spline_tile(
    posterior: &mut Posterior<144, 40>,
    prior: &Posterior<144, 40>,
    scratch: &mut Scratch<144, 40>,
) {
    posterior.discount(prior, 0.5, scratch).expect("the prior is positive definite");
}

#[inline(never)]
fn measured_exponential_tile(
    posterior: &mut Posterior<196, 76>,
    prior: &Posterior<196, 76>,
    scratch: &mut Scratch<196, 76>,
) {
    posterior.discount(prior, 0.5, scratch).expect("the prior is positive definite");
}

/// The kernels of two shapes; callgrind writes their count at the end.
fn kernels_child(which: &str) {
    match which {
        "measured_spline_tile" => kernels(measured_spline_tile),
        _ => kernels(measured_exponential_tile),
    }
}

/// A line `tiles·passes rows·passes` per scan; callgrind writes a count after each.
fn child(task: &Task) {
    let mut map = map::open(&task.profile).expect("the profile is usable");
    for scan in task.scans_and_the_first_again() {
        let report = measured(&mut *map, &scan);
        let passes = f64::from(task.profile.settings.passes);
        println!("{} {}", report.passes, f64::from(report.rows) * passes);
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).filter(|argument| !argument.starts_with("--")).collect();
    match env::var(CHILD).as_deref() {
        Ok("scans") => child(&Task::parse(&arguments)),
        Ok(other) => match QUERIES.iter().find(|(name, _)| *name == other) {
            Some((_, query)) => query_child(*query, &arguments[0]),
            None => kernels_child(other),
        },
        Err(_) => {
            return parent(&arguments).unwrap_or_else(|error| {
                eprintln!("{error}");
                ExitCode::FAILURE
            });
        }
    }
    ExitCode::SUCCESS
}

/// Runs this program under callgrind, as the process that counts `what`: instructions of each call of `function`.
fn count(folder: &Path, what: &str, function: &str, arguments: &[String]) -> Result<Counted, CountError> {
    let folder = folder.join(what);
    fs::create_dir_all(&folder).expect("a temporary folder");
    let mut program = Command::new(env::current_exe().expect("this program has a path"));
    count_calls(&folder, &format!("instructions::{function}"), program.args(arguments).env(CHILD, what))
}

fn parent(arguments: &[String]) -> Result<ExitCode, CountError> {
    let task = Task::parse(arguments);
    let folder = env::temp_dir().join(format!("bhm-instructions-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a temporary folder");
    let shapes = [("measured_spline_tile", "M = 144, B = 40"), ("measured_exponential_tile", "M = 196, B = 76")];
    for (name, shape) in shapes.into_iter().filter(|_| task.usual) {
        let counted = count(&folder, name, name, &[])?;
        println!("kernels, {shape}     {:.0} (factor, solve, inverse; without AVX2)", counted.calls[0]);
    }
    let queries_bounded = compare_queries(&folder)?;
    let counted = count(&folder, "scans", "measured", arguments)?;
    fs::remove_dir_all(&folder).ok();
    let work = |line: &str| {
        let (tiles, rows) = line.split_once(' ')?;
        Some([tiles.parse().ok()?, rows.parse().ok()?])
    };
    let rows: Vec<[f64; 2]> = counted.stdout.lines().filter_map(work).collect();
    // A fifth of all, since a quarter of the log came twice.
    let scans = rows.len() - rows.len() / 5;
    let per_tile = |part: std::ops::Range<usize>| {
        counted.calls[part.clone()].iter().sum::<f64>() / rows[part].iter().map(|row| row[0]).sum::<f64>()
    };
    let outcome = report(&rows[..scans], &counted.calls[..scans], &task);
    let (first, again) = (per_tile(0..rows.len() - scans), per_tile(scans..rows.len()));
    println!("the first quarter's scans again, at the end  {:+.2} % a tile and pass", 100.0 * (again / first - 1.0));
    Ok(if queries_bounded { outcome } else { ExitCode::FAILURE })
}

fn report(rows: &[[f64; 2]], counts: &[f64], task: &Task) -> ExitCode {
    let scans = counts.len() as f64;
    let passes = f64::from(task.profile.settings.passes);
    let mean = counts.iter().sum::<f64>() / scans;
    let worst = counts.iter().copied().fold(0.0, f64::max);
    let [a, b, c] = plane(rows, counts);
    let residual = |(row, count): (&[f64; 2], &f64)| ((a * row[0] + b * row[1] + c) / count - 1.0).abs();
    let mut residuals: Vec<f64> = rows.iter().zip(counts).map(residual).collect();
    residuals.sort_by(f64::total_cmp);
    let largest = residuals.last().copied().unwrap_or(0.0);
    let p99 = residuals[(residuals.len() - 1) * 99 / 100];
    println!("scans                        {scans}");
    println!("instructions a scan, mean    {:.2} million (bound {:.0})", mean / 1e6, MEAN_BOUND / 1e6);
    println!("instructions a scan, worst   {:.2} million", worst / 1e6);
    println!("a, per tile and pass         {a:.0}");
    println!("b, per row and pass          {b:.0}");
    println!("c, per scan                  {c:.0}");
    println!("rows a scan, mean            {:.1}", rows.iter().map(|row| row[1]).sum::<f64>() / passes / scans);
    if let Some(per_tile) = PerTile::of(rows, counts) {
        let [whole, without_rows] = per_tile.drift().map(|drift| 100.0 * drift);
        println!("a tile and pass, last quarter against first: {without_rows:+.2} % (everything: {whole:+.2} %)");
    }
    println!("off the model, largest       {:.2} % (bound {:.0} %)", 100.0 * largest, 100.0 * MODEL_BOUND);
    println!("off the model, 99th percent. {:.2} %", 100.0 * p99);
    let bounded = (mean <= MEAN_BOUND || task.log.is_none()) && largest <= MODEL_BOUND;
    if bounded || !task.usual { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
