use std::{fs, path::PathBuf};

use serde::{Deserialize, Serialize};

use crate::{image::image, run::Run};

/// Two compilers' programs may differ by so much, relative.
const TOLERANCE: f64 = 0.06;

/// What the documentation and `bhm budget` quote: `firmware-sim/cortex-m7/measured.toml`.
#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct Measured {
    flash_bytes: u64,
    data_bytes: u64,
    bss_bytes: u64,
    stack_bytes: u32,
    three_passes: Updates,
    one_pass: Updates,
}

/// Instructions of an update.
#[derive(Debug, Deserialize, Serialize)]
struct Updates {
    /// How many of the log.
    scans: usize,
    mean: u64,
    worst: u64,
    /// Of the scan that fills every capacity.
    full: u64,
}

impl Measured {
    pub(crate) fn of(three: &(Run, u64), one: &(Run, u64)) -> Self {
        let image = image().expect("it ran");
        let updates = |(run, full): &(Run, u64)| {
            let scans = run.instructions.len();
            Updates { scans, mean: run.mean() as u64, worst: run.worst(), full: *full }
        };
        Self {
            flash_bytes: image.flash_bytes,
            data_bytes: image.data_bytes,
            bss_bytes: image.bss_bytes,
            stack_bytes: three.0.stack_bytes.max(one.0.stack_bytes),
            three_passes: updates(three),
            one_pass: updates(one),
        }
    }

    /// Compares with the figures that are quoted, or writes them if that is asked for.
    pub(crate) fn check(&self) {
        let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../firmware-sim/cortex-m7/measured.toml"));
        println!("{self:?}");
        assert!(self.flash_bytes <= 256 << 10 && self.stack_bytes <= 16 << 10, "{self:?}");
        if std::env::var("BHM_FIRMWARE_MEASURE").as_deref() == Ok("write") {
            let head = "# Measured by `cargo test -p bhm-tests --test firmware` with BHM_FIRMWARE_MEASURE=write.\n";
            fs::write(path, head.to_owned() + &toml::to_string(self).expect("plain numbers")).expect("written");
            return;
        }
        let quoted: Self = toml::from_str(&fs::read_to_string(path).expect("measured.toml")).expect("figures");
        assert_eq!((self.data_bytes, self.bss_bytes), (quoted.data_bytes, quoted.bss_bytes));
        let mut pairs = vec![
            ("flash", self.flash_bytes, quoted.flash_bytes),
            ("stack", self.stack_bytes.into(), quoted.stack_bytes.into()),
            ("full scan, three passes", self.three_passes.full, quoted.three_passes.full),
            ("full scan, one pass", self.one_pass.full, quoted.one_pass.full),
        ];
        for (mine, quoted) in [(&self.three_passes, &quoted.three_passes), (&self.one_pass, &quoted.one_pass)] {
            // Of as many scans as the quoted figures are of, that is.
            if mine.scans == quoted.scans {
                pairs.extend([("mean", mine.mean, quoted.mean), ("worst", mine.worst, quoted.worst)]);
            }
        }
        for (what, measured, quoted) in pairs {
            let off = measured as f64 / quoted as f64 - 1.0;
            assert!(off.abs() <= TOLERANCE, "{what}: {measured} measured, {quoted} quoted");
        }
    }
}
