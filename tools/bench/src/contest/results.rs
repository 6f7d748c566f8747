use std::{
    fs::{File, OpenOptions},
    io::{self, BufRead, BufReader, Write},
    path::{Path, PathBuf},
};

use super::Outcome;

/// Outcomes, kept in a file as they come: one JSON object a line.
///
/// A line that was cut short, as a process that is killed leaves it, is counted and passed over; so is one that another
/// version wrote and this one cannot read.
#[derive(Debug)]
pub struct Results {
    outcomes: Vec<Outcome>,
    unreadable: usize,
    file: Option<(PathBuf, File)>,
}

/// A file of outcomes cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {source}", path = path.display())]
pub struct ResultsError {
    path: PathBuf,
    source: io::Error,
}

impl Results {
    /// In memory alone.
    #[must_use]
    pub fn in_memory() -> Self {
        Self { outcomes: Vec::new(), unreadable: 0, file: None }
    }

    /// In a file, with what it already holds; made if it is not there.
    ///
    /// # Errors
    /// If the file cannot be read or written.
    pub fn open(path: &Path) -> Result<Self, ResultsError> {
        let failed = |source| ResultsError { path: path.to_owned(), source };
        let mut file = OpenOptions::new().create(true).read(true).append(true).open(path).map_err(failed)?;
        let (mut outcomes, mut unreadable, mut ends_in_newline) = (Vec::new(), 0, true);
        let mut reader = BufReader::new(&file);
        let mut line = Vec::new();
        while reader.read_until(b'\n', &mut line).map_err(failed)? > 0 {
            ends_in_newline = line.ends_with(b"\n");
            match serde_json::from_slice(&line) {
                Ok(outcome) => outcomes.push(outcome),
                Err(_) => unreadable += usize::from(!line.trim_ascii().is_empty()),
            }
            line.clear();
        }
        if !ends_in_newline {
            file.write_all(b"\n").map_err(failed)?;
        }
        Ok(Self { outcomes, unreadable, file: Some((path.to_owned(), file)) })
    }

    /// Everything so far, oldest first.
    #[must_use]
    pub fn outcomes(&self) -> &[Outcome] {
        &self.outcomes
    }

    /// Lines of the file that say nothing.
    #[must_use]
    pub fn unreadable(&self) -> usize {
        self.unreadable
    }

    /// Keeps one.
    ///
    /// # Errors
    /// If it cannot be written; it is kept in memory all the same.
    pub fn keep(&mut self, outcome: Outcome) -> Result<(), ResultsError> {
        let line = serde_json::to_string(&outcome).map_err(io::Error::other);
        self.outcomes.push(outcome);
        let Some((path, file)) = &mut self.file else { return Ok(()) };
        let written = line.and_then(|line| file.write_all((line + "\n").as_bytes()));
        written.map_err(|source| ResultsError { path: path.clone(), source })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contest::{Contest, Contestant, Dataset, Progress, Round, RunOptions};
    use crate::evaluation::Held;

    struct Silent;

    impl Progress for Silent {
        fn begins(&self, _: usize, _: &str, _: usize) {}
        fn learned(&self, _: usize, _: usize) {}
        fn ends(&self, _: usize, _: &Outcome) {}
    }

    fn outcomes(results: &mut Results) -> Vec<Outcome> {
        let loaded = Dataset { every: 150, ..Dataset::parse("building").unwrap() }.load(1).unwrap();
        let task = loaded.task(Held::Beams, 0.1, 1).unwrap();
        let contest = Contest {
            rounds: vec![Round::new(&loaded, "beams".to_owned(), 1, task)],
            contestants: vec!["counting-grid:0.5".parse::<Contestant>().unwrap()],
            options: RunOptions { deadline_s: None, checkpoints: 2 },
            jobs: 1,
        };
        contest.run(results, &Silent).unwrap()
    }

    #[test]
    fn what_is_read_back_is_what_was_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.jsonl");
        let kept = outcomes(&mut Results::open(&path).unwrap());
        assert_eq!((kept.len(), kept[0].curve.len(), kept[0].learned), (1, 2, 4));
        let again = Results::open(&path).unwrap();
        assert_eq!((again.outcomes(), again.unreadable()), (&kept[..], 0));
    }

    #[test]
    fn cuts_and_junk_are_counted_and_hide_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.jsonl");
        let kept = outcomes(&mut Results::open(&path).unwrap());
        let line = fs_line(&path);
        for cut in 1..line.len() {
            std::fs::write(&path, &line[..cut]).unwrap();
            let mut results = Results::open(&path).unwrap();
            assert!(results.outcomes().is_empty() && results.unreadable() == 1, "cut at {cut}");
            if cut % 97 == 0 {
                // What follows a cut is on a line of its own.
                results.keep(kept[0].clone()).unwrap();
                assert_eq!(Results::open(&path).unwrap().outcomes(), kept);
            }
        }
        let junk = [&b"\xff\xfe\x00 junk\n{}\n[1]\n\n{\"contestant\":3}\n"[..], line.as_slice(), b"\n"].concat();
        std::fs::write(&path, junk).unwrap();
        let results = Results::open(&path).unwrap();
        assert_eq!((results.outcomes(), results.unreadable()), (&kept[..], 4));
    }

    /// The first line without its end.
    fn fs_line(path: &Path) -> Vec<u8> {
        std::fs::read(path).unwrap().trim_ascii_end().to_vec()
    }
}
