//! What a search has found, for people, for programs, and as the head of the file that is written.

use std::path::Path;

use bhm_bench::{
    evaluation::Parts,
    search::{Found, Tried},
};
use serde::Serialize;
use serde_json::{Map, Value};

use super::{
    By, Tune,
    trial::{Scored, Trial, TrialResult},
};
use crate::{
    options::MapOption,
    output::{bytes, columns, headed, table},
};

/// The test part, asked of the start and of the winner, unless they are the same.
pub(super) struct Tested {
    pub(super) start: Trial,
    pub(super) best: Option<Trial>,
}

/// Everything that a search has found.
pub(super) struct Tuned<'a> {
    pub(super) request: &'a Tune,
    pub(super) log_path: &'a Path,
    pub(super) path: &'a Path,
    pub(super) scans: usize,
    pub(super) numbers: Vec<&'static MapOption>,
    pub(super) parts: Parts,
    pub(super) found: Found<Trial>,
    pub(super) best: usize,
    pub(super) test: Tested,
}

/// The same for programs.
#[derive(Serialize)]
pub(super) struct Summary<'a> {
    config: &'a Path,
    log: &'a Path,
    scans: usize,
    every: usize,
    seed: u64,
    fraction: f64,
    by: By,
    max_cost: f64,
    beams: usize,
    beams_validation: usize,
    beams_test: usize,
    candidates: Vec<Candidate<'a>>,
    /// Position of the winner; the start is candidate 0.
    best: usize,
    test_start: &'a TrialResult,
    test_best: &'a TrialResult,
}

#[derive(Serialize)]
struct Candidate<'a> {
    values: Map<String, Value>,
    /// Work, as a multiple of the start's.
    cost: Option<f64>,
    #[serde(flatten)]
    result: &'a TrialResult,
}

/// What a candidate comes to, in words.
pub(super) fn remark(trial: &Trial) -> String {
    match &trial.result {
        TrialResult::Refused(reason) => format!("refused: {reason}"),
        TrialResult::Failed(reason) => format!("failed: {reason}"),
        TrialResult::Scored(scored) => format!("NLL {:.5}", scored.scores.nll),
    }
}

impl Tuned<'_> {
    pub(super) fn summary<'s>(&'s self) -> Summary<'s> {
        let candidate = |tried: &'s Tried<Trial>| Candidate {
            values: self
                .numbers
                .iter()
                .zip(&tried.values)
                .map(|(n, value)| (n.flag.to_owned(), short(*value)))
                .collect(),
            cost: tried.result.scored().and_then(|scored| self.cost(scored)),
            result: &tried.result.result,
        };
        let [beams_validation, beams_test, beams] = self.parts.beams();
        Summary {
            config: self.path,
            log: self.log_path,
            scans: self.scans,
            every: self.request.every.get(),
            seed: self.request.seed,
            fraction: self.request.fraction,
            by: self.request.by,
            max_cost: self.request.max_cost,
            beams,
            beams_validation,
            beams_test,
            candidates: self.found.tried.iter().map(candidate).collect(),
            best: self.best,
            test_start: &self.test.start.result,
            test_best: &self.tested_best().result,
        }
    }

    /// Comments for the file that is written: what was done, and what came of it.
    pub(super) fn header(&self) -> String {
        let Tune { every, fraction, seed, max_cost, .. } = self.request;
        let [validation, test, of] = self.parts.beams();
        let [start, best] = [0, self.best].map(|place| &self.found.tried[place].result);
        let names: Vec<_> = self.numbers.iter().map(|number| number.flag).collect();
        let lines = [
            format!("The best of {} candidates by `bhm tune`; read it with --config FILE.", self.found.tried.len()),
            // Quoted, so that no name of a file can end the comment.
            format!("log: {:?}, {} scans (--every {every})", self.log_path.display().to_string(), self.scans),
            format!(
                "split: of {of} beams with a return {validation} for validation, {test} for the test \
                     (--fraction {fraction} --seed {seed})"
            ),
            format!("searched: {}, by {}, --max-cost {max_cost}", names.join(", "), self.score_name()),
            format!("validation: start {}; best {}", self.scores(start), self.scores(best)),
            format!("test: start {}; best {}", self.scores(&self.test.start), self.scores(self.tested_best())),
        ];
        lines.iter().map(|line| format!("# {}\n", line.replace(char::is_control, " "))).collect()
    }

    pub(super) fn text(&self) -> String {
        let [validation, test, of] = self.parts.beams();
        let mut text = columns(&self.candidates());
        text += &format!(
            "\nBy {}: {validation} of {of} beams with a return for validation, {test} for the test, on which, learned \
             from all the rest:\n\n",
            self.score_name()
        );
        text += &columns(&self.tests());
        text += "\n";
        let gain = match (&self.test.best, self.test.start.scored(), self.tested_best().scored()) {
            (None, ..) => "the start is the best".to_owned(),
            (_, Some(start), Some(best)) => {
                let gain = start.scores.nll - best.scores.nll;
                format!("{gain:+.5} nats of NLL on the test part ({:+.1} %)", 100.0 * gain / start.scores.nll)
            }
            _ => "unknown: the start cannot be tested".to_owned(),
        };
        text + &table(&[("gain", gain), ("written", self.path.display().to_string())])
    }

    fn score_name(&self) -> &'static str {
        match self.request.by {
            By::Nll => "NLL of the validation part",
            By::Objective => "objective per row learned",
        }
    }

    fn candidates(&self) -> Vec<Vec<String>> {
        let names = self.numbers.iter().map(|number| number.flag);
        let scores = ["NLL", "AUC", "ECE", "objective/row", "ms/scan", "cost", "tiles", "memory", ""];
        let mut rows = vec![std::iter::once("").chain(names).chain(scores).map(str::to_owned).collect::<Vec<_>>()];
        for (place, tried) in self.found.tried.iter().enumerate() {
            let place_name = match (place == self.best, place) {
                (true, 0) => "start, best",
                (true, _) => "best",
                (false, 0) => "start",
                (false, _) => "",
            };
            let mut row = vec![place_name.to_owned()];
            row.extend(tried.values.iter().map(f32::to_string));
            match &tried.result.result {
                TrialResult::Scored(scored) => row.extend(self.cells(scored)),
                TrialResult::Refused(_) | TrialResult::Failed(_) => row.push(remark(&tried.result)),
            }
            rows.push(row);
        }
        rows
    }

    fn cells(&self, scored: &Scored) -> Vec<String> {
        let cost = self.cost(scored);
        let dear = cost.is_some_and(|cost| cost > self.request.max_cost);
        let [auc, nll, ece] = scored.scores.cells();
        vec![
            nll,
            auc,
            ece,
            format!("{:.5}", scored.objective_per_row),
            ms_per_scan(scored),
            cost.map_or("-".to_owned(), |cost| format!("{cost:.2}")),
            scored.tiles.to_string(),
            bytes(scored.map_bytes),
            if dear { "over --max-cost" } else { "" }.to_owned(),
        ]
    }

    fn tests(&self) -> Vec<Vec<String>> {
        let mut rows = headed(["", "NLL", "AUC", "ECE", "Brier", "ms/scan"]);
        for (name, trial) in [("start", Some(&self.test.start)), ("best", self.test.best.as_ref())] {
            let Some(trial) = trial else { continue };
            let mut row = vec![name.to_owned()];
            match trial.scored() {
                Some(scored) => {
                    let [auc, nll, ece] = scored.scores.cells();
                    row.extend([nll, auc, ece, format!("{:.5}", scored.scores.brier), ms_per_scan(scored)]);
                }
                None => row.push(remark(trial)),
            }
            rows.push(row);
        }
        rows
    }

    fn tested_best(&self) -> &Trial {
        self.test.best.as_ref().unwrap_or(&self.test.start)
    }

    fn cost(&self, scored: &Scored) -> Option<f64> {
        Some(scored.work / self.found.tried.first()?.result.scored()?.work)
    }

    fn scores(&self, trial: &Trial) -> String {
        let Some(scored) = trial.scored() else { return remark(trial) };
        let [auc, nll, ece] = scored.scores.cells();
        format!("NLL {nll}, AUC {auc}, ECE {ece}, objective per row {:.5}", scored.objective_per_row)
    }
}

fn ms_per_scan(scored: &Scored) -> String {
    format!("{:.2}", 1e3 / scored.timing.scans_per_s)
}

/// A number with the digits it was given in.
fn short(value: f32) -> Value {
    value.to_string().parse::<f64>().map_or(Value::Null, Value::from)
}
