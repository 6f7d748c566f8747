//! Instructions of a function, call by call, counted by valgrind's callgrind: the same on every run, however busy the machine.

use std::{fs, io, path::Path, process::Command};

/// Where nothing was counted.
#[derive(Debug, thiserror::Error)]
pub enum CountError {
    /// It cannot be run.
    #[error("cannot run valgrind ({0}); install it (Debian: apt-get install valgrind)")]
    Missing(io::Error),
    /// It, or what it watched, failed.
    #[error("callgrind failed: {0}")]
    Failed(String),
    /// A count cannot be read.
    #[error("{path}: {what}")]
    Unreadable {
        /// The file.
        path: String,
        /// What is wrong.
        what: String,
    },
}

/// What was counted.
#[derive(Debug)]
pub struct Counted {
    /// What the program printed.
    pub stdout: String,
    /// Instructions within each call of the function, in order.
    pub calls: Vec<f64>,
}

/// Whether valgrind is there.
#[must_use]
pub fn available() -> bool {
    Command::new("valgrind").arg("--version").output().is_ok_and(|output| output.status.success())
}

/// Runs a program and counts each call of a function, which must not be inlined, by its full name. Files go to
/// `folder`.
///
/// # Errors
/// If valgrind is missing, the program fails, or the function was never called.
pub fn count_calls(folder: &Path, function: &str, program: &mut Command) -> Result<Counted, CountError> {
    let dump = folder.join("callgrind");
    let mut valgrind = Command::new("valgrind");
    valgrind
        .arg("--tool=callgrind")
        .arg(format!("--toggle-collect={function}"))
        .arg(format!("--dump-after={function}"))
        .arg(format!("--callgrind-out-file={}", dump.display()))
        .arg(program.get_program())
        .args(program.get_args());
    for (name, value) in program.get_envs() {
        match value {
            Some(value) => valgrind.env(name, value),
            None => valgrind.env_remove(name),
        };
    }
    let output = valgrind.output().map_err(CountError::Missing)?;
    if !output.status.success() {
        return Err(CountError::Failed(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    let part = |number: usize| folder.join(format!("callgrind.{number}"));
    let calls =
        (1..).map(part).take_while(|path| path.exists()).map(|path| total(&path)).collect::<Result<Vec<_>, _>>()?;
    if calls.is_empty() {
        return Err(CountError::Failed(format!("{function} was never called")));
    }
    Ok(Counted { stdout: String::from_utf8_lossy(&output.stdout).into_owned(), calls })
}

/// The total of a dump.
fn total(path: &Path) -> Result<f64, CountError> {
    let unreadable = |what: String| CountError::Unreadable { path: path.display().to_string(), what };
    let text = fs::read_to_string(path).map_err(|error| unreadable(error.to_string()))?;
    let total = text.lines().find_map(|line| line.strip_prefix("totals: ").or_else(|| line.strip_prefix("summary: ")));
    total.and_then(|total| total.trim().parse().ok()).ok_or_else(|| unreadable("no total".to_owned()))
}

/// The plane `a·x + b·y + c` through counts, by least squares: normal equations of three unknowns, by Gaussian elimination.
#[must_use]
pub fn plane(points: &[[f64; 2]], counts: &[f64]) -> [f64; 3] {
    let mut system = [[0.0; 4]; 3];
    for (point, count) in points.iter().zip(counts) {
        let x = [point[0], point[1], 1.0];
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

/// What a touched tile and pass cost in each quarter of a run.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PerTile {
    /// All instructions, per tile and pass.
    pub whole: [f64; 4],
    /// The same without what rows cost by the model of the whole run: how many rows a tile has is the scans' doing.
    pub without_rows: [f64; 4],
    /// The model: per tile and pass, per row and pass, per scan.
    pub model: [f64; 3],
}

impl PerTile {
    /// Of each scan's work, as (tiles · passes, rows · passes), and its instructions; `None` for fewer than 8 scans.
    #[must_use]
    pub fn of(work: &[[f64; 2]], counts: &[f64]) -> Option<Self> {
        let scans = work.len().min(counts.len());
        if scans < 8 {
            return None;
        }
        let model = plane(&work[..scans], &counts[..scans]);
        let quarter = |index: usize| index * scans / 4..(index + 1) * scans / 4;
        let tiles = |index: usize| work[quarter(index)].iter().map(|work| work[0]).sum::<f64>();
        let whole = [0, 1, 2, 3].map(|i| counts[quarter(i)].iter().sum::<f64>() / tiles(i));
        let rest = |(work, count): (&[f64; 2], &f64)| count - model[1] * work[1] - model[2];
        let without_rows =
            [0, 1, 2, 3].map(|i| work[quarter(i)].iter().zip(&counts[quarter(i)]).map(rest).sum::<f64>() / tiles(i));
        Some(Self { whole, without_rows, model })
    }

    /// How far the last quarter is from the first, as a share of the first: all instructions, and without rows.
    #[must_use]
    pub fn drift(&self) -> [f64; 2] {
        [&self.whole, &self.without_rows].map(|quarters| quarters[3] / quarters[0] - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_is_found_through_its_own_points() {
        let points: Vec<[f64; 2]> = (0..40).map(|i| [f64::from(i % 7), f64::from(i * i % 11)]).collect();
        let counts: Vec<f64> = points.iter().map(|[x, y]| 3.5 * x - 2.0 * y + 7.0).collect();
        let [a, b, c] = plane(&points, &counts);
        assert!((a - 3.5).abs() < 1e-9 && (b + 2.0).abs() < 1e-9 && (c - 7.0).abs() < 1e-9);
    }

    #[test]
    fn rows_are_the_scans_doing_and_growth_is_not_hidden() {
        // More rows to a tile in later scans, at constant costs.
        let work: Vec<[f64; 2]> = (0..80).map(|i| [f64::from(3 + i % 5), f64::from(30 + i + 7 * (i % 3))]).collect();
        let cost =
            |grown: f64| move |(i, work): (usize, &[f64; 2])| work[0] * (1000.0 + grown * i as f64) + 10.0 * work[1];
        let flat: Vec<f64> = work.iter().enumerate().map(cost(0.0)).collect();
        let [whole, without_rows] = PerTile::of(&work, &flat).unwrap().drift();
        assert!(whole > 0.05 && without_rows.abs() < 1e-9, "{whole} {without_rows}");
        let growing: Vec<f64> = work.iter().enumerate().map(cost(5.0)).collect();
        assert!(PerTile::of(&work, &growing).unwrap().drift()[0] > 0.2);
        assert_eq!(PerTile::of(&work[..7], &flat), None);
    }
}
