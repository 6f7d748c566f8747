//! How many instructions a scan costs, and what explains them: counted by callgrind, so that a busy machine does not matter.
//!
//! `cargo bench -p bhm-tests --bench instructions [-- LOG]` runs itself under `valgrind --tool=callgrind`, which dumps the
//! count after every call of [`measured`]. Without a log it maps the simulated building. It fails if the figures leave their
//! bounds: the mean of a scan, and the linear model `a·tiles·passes + b·rows·passes + c` over all scans.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, ExitCode},
};

use bhm_core::{mapper::IntegrateReport, profile};
use bhm_host::{ScanRecord, dataset, map, sim};

/// Most instructions that a scan may cost on average, at 0.5 m and three passes.
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

fn scans(log: Option<&str>) -> Vec<ScanRecord> {
    match log {
        Some(path) => {
            let options = dataset::ReadOptions::default();
            dataset::read_log(Path::new(path), &options).unwrap_or_else(|error| panic!("{error}")).scans
        }
        None => sim::Scene::named("building").expect("the building is built in").simulate(1).collect(),
    }
}

/// Prints a line `tiles·passes rows·passes` per scan; callgrind writes the counts.
fn child(log: Option<&str>) {
    let mut map = map::open(&profile::COMPACT).expect("the profile is usable");
    for scan in scans(log) {
        let report = measured(&mut *map, &scan);
        let passes = f64::from(profile::COMPACT.settings.passes);
        println!("{} {}", report.passes, f64::from(report.rows) * passes);
    }
}

fn main() -> ExitCode {
    let log = env::args().skip(1).find(|argument| !argument.starts_with("--"));
    if env::var_os(CHILD).is_some() {
        child(log.as_deref());
        return ExitCode::SUCCESS;
    }
    let folder = env::temp_dir().join(format!("bhm-instructions-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a temporary folder");
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--toggle-collect=instructions::measured", "--dump-after=instructions::measured"])
        .arg(format!("--callgrind-out-file={}", folder.join("count").display()))
        .arg(env::current_exe().expect("this program's path"))
        .args(&log)
        .env(CHILD, "1")
        .output();
    let output = match output {
        Ok(output) if output.status.success() => output,
        Ok(output) => {
            eprintln!("callgrind failed: {}", String::from_utf8_lossy(&output.stderr));
            return ExitCode::FAILURE;
        }
        Err(error) => {
            eprintln!("cannot run valgrind ({error}); install it (Debian: apt-get install valgrind)");
            return ExitCode::FAILURE;
        }
    };
    let rows: Vec<[f64; 2]> = String::from_utf8_lossy(&output.stdout)
        .lines()
        .filter_map(|line| {
            let (tiles, rows) = line.split_once(' ')?;
            Some([tiles.parse().ok()?, rows.parse().ok()?])
        })
        .collect();
    let counts: Vec<f64> = (1..=rows.len()).map(|part| count_of(&folder, part)).collect();
    fs::remove_dir_all(&folder).ok();
    report(&rows, &counts)
}

/// The total of the `part`-th dump.
fn count_of(folder: &Path, part: usize) -> f64 {
    let path: PathBuf = folder.join(format!("count.{part}"));
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let total = text.lines().find_map(|line| line.strip_prefix("totals: ").or_else(|| line.strip_prefix("summary: ")));
    total.and_then(|total| total.trim().parse().ok()).unwrap_or_else(|| panic!("{} has no total", path.display()))
}

fn report(rows: &[[f64; 2]], counts: &[f64]) -> ExitCode {
    let scans = counts.len() as f64;
    let mean = counts.iter().sum::<f64>() / scans;
    let worst = counts.iter().copied().fold(0.0, f64::max);
    let [a, b, c] = least_squares(rows, counts);
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
    println!("off the model, largest       {:.2} % (bound {:.0} %)", 100.0 * largest, 100.0 * MODEL_BOUND);
    println!("off the model, 99th percent. {:.2} %", 100.0 * p99);
    if mean <= MEAN_BOUND && largest <= MODEL_BOUND { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The plane through the counts: normal equations of three unknowns, by Gaussian elimination.
fn least_squares(rows: &[[f64; 2]], counts: &[f64]) -> [f64; 3] {
    let mut system = [[0.0; 4]; 3];
    for (row, count) in rows.iter().zip(counts) {
        let x = [row[0], row[1], 1.0];
        for i in 0..3 {
            for j in 0..3 {
                system[i][j] += x[i] * x[j];
            }
            system[i][3] += x[i] * count;
        }
    }
    for pivot in 0..3 {
        let normal = system[pivot];
        for row in system.iter_mut().skip(pivot + 1) {
            let factor = row[pivot] / normal[pivot];
            for (entry, above) in row.iter_mut().zip(normal) {
                *entry -= factor * above;
            }
        }
    }
    let mut solution = [0.0; 3];
    for row in (0..3).rev() {
        let known: f64 = (row + 1..3).map(|column| system[row][column] * solution[column]).sum();
        solution[row] = (system[row][3] - known) / system[row][row];
    }
    solution
}
