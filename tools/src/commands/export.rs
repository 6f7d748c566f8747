use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use anyhow::Context;
use bhm_bench::{
    contest::{self, Dataset},
    evaluation::Held,
};
use clap::Args;
use flate2::{Compression, write::GzEncoder};
use serde::Serialize;

use crate::{
    options::{fraction, held},
    output::{Output, Usage, table},
};

/// Write what a contest learns and asks, for systems outside of this one
#[derive(Args, Debug)]
pub(crate) struct Export {
    #[command(subcommand)]
    what: What,
}

subcommands! { enum What { Points(Points) } }

impl Export {
    pub(crate) fn run(&self, output: &Output) -> anyhow::Result<()> {
        self.what.run(output)
    }
}

/// Write the points that contestants learn and are asked, as CSV: scan,x,y,label
///
/// They are those of `bhm compare` with the same dataset, division and seed. `bhm score` scores anyone's answers.
#[derive(Args, Debug)]
struct Points {
    /// A log's path, or a simulated scene (building, traffic, outdoor); @PROFILE may follow
    #[arg(value_name = "LOG|SCENE")]
    log: String,
    /// File of the points to learn; gzip where it ends in .gz
    #[arg(long, value_name = "CSV")]
    train: PathBuf,
    /// File of the points to predict
    #[arg(long, value_name = "CSV")]
    test: PathBuf,
    /// What is held out as a whole
    #[arg(long, value_parser = held(), default_value_t = Held::Beams)]
    holdout: Held,
    /// The part that is held out, above 0 and below 1
    #[arg(long, default_value_t = 0.1, value_parser = fraction(), value_name = "PART")]
    fraction: f64,
    /// Seed of what is simulated and held out, and of where points lie
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Use every n-th scan
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), value_name = "N")]
    every: u32,
}

#[derive(Serialize)]
struct Exported {
    train: PathBuf,
    train_points: usize,
    test: PathBuf,
    test_points: usize,
}

impl Points {
    fn run(&self, output: &Output) -> anyhow::Result<()> {
        if self.train == self.test {
            return Err(Usage("--train and --test are the same file".to_owned()).into());
        }
        let dataset = Dataset::parse(&self.log).map_err(|problem| Usage(problem.to_string()))?;
        let dataset = Dataset { every: self.every as usize, ..dataset };
        let loaded = contest::load(&[dataset], &[self.seed])?;
        let [(_, loaded)] = &loaded[..] else { unreachable!("one dataset, one seed") };
        let task = loaded.task(self.holdout, self.fraction, self.seed)?;
        let learned = task.training.iter().flat_map(|shown| shown.points().map(|(at, label)| (shown.scan, at, label)));
        let asked = &task.test;
        let asked =
            asked.scans.iter().zip(&asked.points_m).zip(&asked.occupied).map(|((s, at), label)| (*s, *at, *label));
        let exported = Exported {
            train_points: write(&self.train, learned)?,
            train: self.train.clone(),
            test_points: write(&self.test, asked)?,
            test: self.test.clone(),
        };
        output.result(&exported, || {
            table(&[
                ("learned", format!("{} points in {}", exported.train_points, self.train.display())),
                ("asked", format!("{} points in {}", exported.test_points, self.test.display())),
            ])
        })
    }
}

/// Writes them, and counts. The shortest decimals that read back as the same `f32`.
fn write(path: &Path, points: impl Iterator<Item = (u64, [f32; 2], bool)>) -> anyhow::Result<usize> {
    let written = || -> io::Result<usize> {
        let file = BufWriter::new(File::create(path)?);
        if path.extension().is_some_and(|extension| extension == "gz") {
            let mut encoder = GzEncoder::new(file, Compression::default());
            let count = write_to(&mut encoder, points)?;
            encoder.finish()?.flush()?;
            Ok(count)
        } else {
            let mut file = file;
            let count = write_to(&mut file, points)?;
            file.flush()?;
            Ok(count)
        }
    };
    written().with_context(|| format!("cannot write {}", path.display()))
}

fn write_to(to: &mut impl Write, points: impl Iterator<Item = (u64, [f32; 2], bool)>) -> io::Result<usize> {
    writeln!(to, "scan,x,y,label")?;
    let mut count = 0;
    for (scan, [x, y], occupied) in points {
        writeln!(to, "{scan},{x},{y},{}", u8::from(occupied))?;
        count += 1;
    }
    Ok(count)
}
