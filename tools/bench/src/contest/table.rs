use super::{Standing, Standings};
use crate::{metrics::Spread, text::bytes};

/// A table's rows, head first; a column that nobody has a value for is left out.
#[must_use]
pub fn rows(standings: &Standings) -> Vec<Vec<String>> {
    type Column = (&'static str, fn(&Standing) -> Option<String>);
    let every: [Column; 17] = [
        ("#", |row| row.rank.map(|rank| rank.to_string())),
        ("contestant", |row| Some(row.contestant.clone())),
        ("AUC", |row| row.auc.map(|auc| auc.text(false))),
        ("NLL", |row| row.nll.map(|nll| nll.text(false))),
        ("Brier", |row| row.brier.map(|brier| format!("{brier:.4}"))),
        ("ECE", |row| row.ece.map(|ece| format!("{ece:.4}"))),
        ("AUC over scans", |row| row.auc_over_scans.map(|auc| spread(&auc))),
        ("NLL over scans", |row| row.nll_over_scans.map(|nll| spread(&nll))),
        ("unseen AUC", |row| row.unseen_auc.map(|auc| format!("{auc:.3}"))),
        ("unseen NLL", |row| row.unseen_nll.map(|nll| format!("{nll:.3}"))),
        ("median ms", |row| Some(significant(row.update_ms[0]))),
        ("p99 ms", |row| Some(significant(row.update_ms[1]))),
        ("growth", |row| row.growth.map(|growth| format!("{growth:.2}"))),
        ("memory", |row| Some(bytes(row.memory_bytes))),
        ("time/ref", |row| row.time_ratio.map(significant)),
        ("NLL/ref", |row| row.nll_ratio.map(|ratio| format!("{ratio:.2}"))),
        ("", |row| row.stopped.clone()),
    ];
    let shown: Vec<&Column> =
        every.iter().filter(|(_, cell)| standings.rows.iter().any(|row| cell(row).is_some())).collect();
    let head = shown.iter().map(|(name, _)| (*name).to_owned()).collect();
    let line = |row: &Standing| shown.iter().map(|(_, cell)| cell(row).unwrap_or_else(|| "-".to_owned())).collect();
    let mut rows: Vec<Vec<String>> = vec![head];
    rows.extend(standings.rows.iter().map(line));
    // The remark is nobody's value.
    if every.last().is_some_and(|last| shown.last().is_some_and(|shown| shown.0 == last.0)) {
        for row in &mut rows {
            if let Some(remark) = row.last_mut().filter(|remark| *remark == "-") {
                remark.clear();
            }
        }
    }
    rows
}

/// A mean and twice the standard deviation.
#[must_use]
pub fn spread(spread: &Spread) -> String {
    format!("{:.3} ± {:.3}", spread.mean, spread.two_sigma)
}

/// Three digits that count, never an exponent.
fn significant(value: f64) -> String {
    let digits = if value > 0.0 { (2 - value.log10().floor() as i32).clamp(0, 5) as usize } else { 0 };
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits_that_count() {
        for (value, text) in [(0.0, "0"), (0.01234, "0.0123"), (1.234, "1.23"), (98.76, "98.8"), (12_345.6, "12346")] {
            assert_eq!(significant(value), text);
        }
    }
}
