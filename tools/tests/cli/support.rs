use std::{
    fs,
    io::Write,
    path::PathBuf,
    process::{Command, Output},
};

use bhm_core::{geometry::Pose, scan::ScanHeader};
use bhm_host::{ScanRecord, sim::Scene};
use bhm_oracle::recorded;
use serde_json::Value;

/// A folder of its own for a test, and the binary run in it.
pub(crate) struct Bench {
    folder: tempfile::TempDir,
}

/// What a run of the binary did.
pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    /// Runs `bhm` with these arguments, separated by blanks.
    pub(crate) fn bhm(&self, arguments: &str) -> Run {
        self.bhm_with(arguments, &[])
    }

    pub(crate) fn bhm_with(&self, arguments: &str, environment: &[(&str, &str)]) -> Run {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bhm"));
        for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("BHM_") || name == "RUST_LOG") {
            command.env_remove(name);
        }
        command.envs(environment.iter().copied()).current_dir(self.folder.path()).args(arguments.split_whitespace());
        let Output { status, stdout, stderr } = command.output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        // A panic is code 101; a signal none.
        Run { code: status.code().expect("not ended by a signal"), stdout: text(stdout), stderr: text(stderr) }
    }

    /// Runs a command that must succeed, and parses what it prints with `--json`.
    pub(crate) fn json(&self, arguments: &str) -> Value {
        let run = self.bhm(&format!("{arguments} --json"));
        assert_eq!(run.code, 0, "{}", run.stderr);
        assert_eq!(run.stdout.lines().count(), 1, "one object on one line: {}", run.stdout);
        serde_json::from_str(&run.stdout).unwrap()
    }
}

impl Run {
    /// The command failed with this code, said this on standard error and nothing on standard output.
    #[track_caller]
    pub(crate) fn fails(&self, code: i32, says: &[&str]) {
        assert_eq!((self.code, self.stdout.as_str()), (code, ""), "{}", self.stderr);
        self.says(says);
    }

    /// The command succeeded, and said this on standard error.
    #[track_caller]
    pub(crate) fn succeeds(&self, says: &[&str]) {
        assert_eq!(self.code, 0, "{}", self.stderr);
        self.says(says);
    }

    /// The words of the table's only line that begins with these, those behind them.
    #[track_caller]
    pub(crate) fn cells(&self, beginning: &str) -> Vec<&str> {
        let beginning: Vec<_> = beginning.split_whitespace().collect();
        let lines = self.stdout.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
        let found: Vec<_> = lines.filter(|words| words.starts_with(&beginning)).collect();
        assert_eq!(found.len(), 1, "lines that begin with {beginning:?} in:\n{}", self.stdout);
        found[0][beginning.len()..].to_vec()
    }

    #[track_caller]
    fn says(&self, says: &[&str]) {
        for part in says {
            assert!(self.stderr.contains(part), "{:?} is not in: {}", part, self.stderr);
        }
    }
}

/// A `FLASER` line of 180 beams in a square room of 8 m, the robot at (x, 0) looking along +x.
pub(crate) fn scan(x: f32, stamp: &str) -> String {
    let range = |beam: i32| {
        let bearing = (f64::from(beam) - 90.0).to_radians();
        let to = |distance: f64, part: f64| if part > 1e-9 { distance / part } else { f64::INFINITY };
        to(4.0 - f64::from(x), bearing.cos()).min(to(4.0, bearing.sin().abs()))
    };
    line(&(0..180).map(|beam| format!("{:.2}", range(beam))).collect::<Vec<_>>(), x, stamp)
}

/// A `FLASER` line with these ranges.
pub(crate) fn line(ranges: &[String], x: f32, stamp: &str) -> String {
    format!("FLASER {} {} {x} 0 0 {x} 0 0 {stamp} host 0.1\n", ranges.len(), ranges.join(" "))
}

/// A log of a robot that drives two metres through the room.
pub(crate) fn room() -> String {
    (0..20).map(|i| scan(-1.0 + 0.1 * i as f32, &format!("{}.5", 100 + i))).collect()
}

/// The logs that a robot's whole way is tested on: every eighth scan of the simulated building, written into the bench's
/// folder, always, and the recorded one where it is.
pub(crate) fn logs(bench: &Bench) -> Vec<PathBuf> {
    let scans = Scene::named("building").unwrap().simulate(7).step_by(8);
    let log: String = scans.map(|scan| robot_laser(&scan)).collect();
    bench.write("building.log", log);
    let mut logs = vec![bench.path("building.log")];
    logs.extend(recorded("intel-corrected.log.gz").map(|log| log.canonicalize().unwrap()));
    logs
}

/// A scan as a `ROBOTLASER1` line; a missing return is the sensor's maximum.
fn robot_laser(scan: &ScanRecord) -> String {
    let ScanHeader { stamp_ns, map_from_sensor: Pose { x_m, y_m, theta_rad }, angle_min_rad, .. } = &scan.header;
    let ScanHeader { angle_increment_rad, range_max_m, .. } = &scan.header;
    let ranges: Vec<_> = scan.ranges_m.iter().map(|range_m| format!("{:.3}", range_m.min(*range_max_m))).collect();
    let (beams, stamp_s) = (ranges.len(), *stamp_ns as f64 * 1e-9);
    let field_of_view_rad = angle_increment_rad * beams as f32;
    let (ranges, pose) = (ranges.join(" "), format!("{x_m} {y_m} {theta_rad}"));
    format!(
        "ROBOTLASER1 0 {angle_min_rad} {field_of_view_rad} {angle_increment_rad} {range_max_m} 0.01 0 {beams} {ranges} 0 \
         {pose} {pose} 0 0 0 0 0 {stamp_s} host {stamp_s}\n"
    )
}

pub(crate) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}
