//! `bhm compare`, `bhm export points` and `bhm score`, as people use them.

use std::{fmt::Write as _, fs};

use crate::support::Bench;

const SMALL: &str = "compare -d building --every 60 -c ours:0.5,counting-grid:0.2";

/// The row of a contestant in the first table.
fn row<'a>(compared: &'a serde_json::Value, contestant: &str) -> &'a serde_json::Value {
    let rows = compared["standings"][0]["rows"].as_array().unwrap();
    rows.iter().find(|row| row["contestant"] == contestant).unwrap()
}

#[test]
fn contestants_are_ranked_by_what_they_say_of_what_they_were_not_shown() {
    let bench = Bench::new();
    let compared = bench.json(SMALL);
    let rows = compared["standings"][0]["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 2);
    assert!(rows[0]["nll"]["mean"].as_f64() < rows[1]["nll"]["mean"].as_f64());
    assert_eq!((rows[0]["rank"].as_u64(), rows[1]["rank"].as_u64()), (Some(1), Some(2)));
    let ours = row(&compared, "ours:0.5");
    assert!(ours["auc"]["mean"].as_f64().unwrap() > 0.9, "{ours}");
    assert_eq!((ours["time_ratio"].as_f64(), ours["nll_ratio"].as_f64()), (Some(1.0), Some(1.0)));
    assert!(row(&compared, "counting-grid:0.2")["time_ratio"].as_f64().unwrap() < 0.5);
    // Unseen places are asked where the truth is known, and nobody knows them.
    assert!((ours["unseen_nll"].as_f64().unwrap() - std::f64::consts::LN_2).abs() < 0.1, "{ours}");

    let text = bench.bhm(&format!("{SMALL} --markdown"));
    assert!(text.stdout.starts_with("### building, beams held out\n\n| # | contestant | AUC |"), "{}", text.stdout);
}

#[test]
fn the_same_seed_gives_the_same_scores_however_many_jobs() {
    let bench = Bench::new();
    let scores = |arguments: &str| {
        let compared = bench.json(&format!("{SMALL} --holdout beams,scans {arguments}"));
        let outcomes = compared["outcomes"].as_array().unwrap().clone();
        outcomes.into_iter().map(|outcome| outcome["scores"].to_string()).collect::<Vec<_>>()
    };
    let one = scores("--jobs 1");
    assert_eq!(one.len(), 4);
    assert_eq!(one, scores("--jobs 3"));
    assert_ne!(one, scores("--seed 2"));
}

#[test]
fn who_meets_the_deadline_is_scored_on_what_it_saw_and_not_ranked() {
    let bench = Bench::new();
    let compared = bench.json(&format!("{SMALL} --deadline 1e-9"));
    let ours = row(&compared, "ours:0.5");
    assert_eq!((ours["rank"].as_u64(), ours["stopped"].as_str()), (None, Some("stopped at scan 1 of 10")));
    let outcomes = compared["outcomes"].as_array().unwrap();
    let whole = bench.json(SMALL);
    let asked = |compared: &serde_json::Value| compared["outcomes"][0]["scores"]["points"].as_u64().unwrap();
    let points = outcomes[0]["scores"]["points"].as_u64().unwrap();
    assert!(points > 0 && points * 5 < asked(&whole), "{points} of {}", asked(&whole));
    assert!(outcomes.iter().all(|outcome| outcome["unseen"].is_null()));
}

#[test]
fn a_contest_that_was_cut_short_goes_on_where_it_was() {
    let bench = Bench::new();
    let file = bench.path("kept.jsonl");
    let first = bench.json("compare -d building --every 60 -c counting-grid:0.2 --results kept.jsonl");
    // A process that is killed leaves half a line.
    let mut text = fs::read(&file).unwrap();
    text.extend_from_within(..text.len() / 2);
    fs::write(&file, &text).unwrap();
    let run = bench.bhm(&format!("{SMALL} --results kept.jsonl --json"));
    run.succeeds(&["1 of 2 outcomes are kept already", "1 lines of the kept results say nothing"]);
    let both: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(both["outcomes"][1], first["outcomes"][0]);
    // Everything is kept: nothing is learned again, down to the times.
    let again = bench.json(&format!("{SMALL} --results kept.jsonl"));
    assert_eq!(again, both);
    // Other data, another seed, a longer deadline: nothing that is kept answers for them.
    for other in ["--seed 2", "--every 50", "--fraction 0.2"] {
        let run = bench.bhm(&format!("{SMALL} {other} --results kept.jsonl"));
        assert!(!run.stderr.contains("are kept already"), "{other}: {}", run.stderr);
    }
}

#[test]
fn what_cannot_be_compared_is_said() {
    let bench = Bench::new();
    bench.bhm("compare").fails(2, &["nothing to map"]);
    bench.bhm("compare -d building -c best").fails(2, &["there is no \"best\"", "counting-grid"]);
    bench.bhm("compare -d building -c ours:-1").fails(2, &["no usable size"]);
    bench.bhm("compare -d building@moon").fails(2, &["no profile \"moon\"", "outdoor"]);
    bench.bhm("compare -d missing.log").fails(1, &["missing.log"]);
    bench.bhm("compare --train a.csv -d building").fails(2, &["--test"]);
    bench.bhm("compare -d building --deadline 0").fails(2, &["above 0"]);
    bench.write("folder.jsonl", "");
    fs::create_dir(bench.path("folder")).unwrap();
    bench.bhm(&format!("{SMALL} --results folder")).fails(1, &["folder"]);
    // A size that no memory holds is that contestant's failure, and nobody else's.
    let compared = bench.json("compare -d building --every 100 -c ours:0.5,counting-grid:0.00001");
    assert!(row(&compared, "ours:0.5")["rank"].as_u64().is_some());
    assert!(row(&compared, "counting-grid:0.00001")["stopped"].as_str().unwrap().contains("too many"), "{compared}");
}

#[test]
fn exported_points_are_those_that_contestants_learn_and_are_asked() {
    let bench = Bench::new();
    bench.json("export points building --every 60 --train train.csv --test test.csv.gz");
    let points = bench.json("compare --train train.csv --test test.csv.gz -c counting-grid:0.2");
    let scene = bench.json("compare -d building --every 60 -c counting-grid:0.2");
    let scores = |compared: &serde_json::Value| compared["outcomes"][0]["scores"].clone();
    assert_eq!(scores(&points), scores(&scene));
    bench.bhm("export points building --train a.csv --test a.csv").fails(2, &["same file"]);
}

/// Answers to the exported questions: the labels, softened.
fn answers(bench: &Bench, header: &str, answer: impl Fn(bool) -> f64) -> String {
    let test = fs::read_to_string(bench.path("test.csv")).unwrap();
    let mut text = format!("{header}\n");
    for line in test.lines().skip(1) {
        writeln!(text, "{}", answer(line.ends_with(",1"))).unwrap();
    }
    text
}

#[test]
fn anyones_answers_are_scored_on_the_same_points() {
    let bench = Bench::new();
    bench.json("export points building --every 100 --train train.csv --test test.csv");
    let score = |name: &str| bench.json(&format!("score --test test.csv --predictions {name}"));

    bench.write("half.csv", answers(&bench, "probability", |_| 0.5));
    let half = score("half.csv");
    assert!((half["nll"].as_f64().unwrap() - std::f64::consts::LN_2).abs() < 1e-12);
    assert_eq!(half["auc"].as_f64(), Some(0.5));

    bench.write("nine.csv", answers(&bench, "probability", |occupied| if occupied { 0.9 } else { 0.1 }));
    bench.write("logit.csv", answers(&bench, "logit", |occupied| 9_f64.ln() * if occupied { 1.0 } else { -1.0 }));
    let (nine, logit) = (score("nine.csv"), score("logit.csv"));
    for scores in [&nine, &logit] {
        assert!((scores["nll"].as_f64().unwrap() + 0.9_f64.ln()).abs() < 1e-9, "{scores}");
        assert_eq!(scores["auc"].as_f64(), Some(1.0));
    }
    // Certain and right costs nothing; certain and wrong much, but not without limit.
    bench.write("sure.csv", answers(&bench, "probability", f64::from));
    bench.write("wrong.csv", answers(&bench, "probability", |occupied| f64::from(!occupied)));
    assert!(score("sure.csv")["nll"].as_f64().unwrap() < 1e-12);
    let wrong = score("wrong.csv")["nll"].as_f64().unwrap();
    assert!((36.0..710.0).contains(&wrong), "{wrong}");
}

#[test]
fn answers_that_do_not_fit_the_questions_are_refused() {
    let bench = Bench::new();
    bench.write("test.csv", "scan,x,y,label\n0,1,1,1\n0,2,2,0\n");
    let refused = |content: &str, says: &[&str]| {
        bench.write("p.csv", content);
        bench.bhm("score --test test.csv --predictions p.csv").fails(1, says);
    };
    refused("probability\n0.5\n", &["1 predictions, but 2 labels"]);
    refused("probability\n0.5\n0.5\n0.5\n", &["3 predictions, but 2 labels"]);
    refused("p\n0.5\n0.5\n", &["a column `probability` or a column `logit`"]);
    refused("probability,logit\n0.5,0\n0.5,0\n", &["a column `probability` or a column `logit`"]);
    refused("probability\n0.5\n1.5\n", &["line 3", "1.5 is not a probability"]);
    refused("probability\n0.5\nNaN\n", &["NaN is not a probability"]);
    refused("logit\n0.5\ninf\n", &["not finite"]);
    refused("probability\n0.5\nmany\n", &["line 3", "\"many\" is not a number"]);
    refused("probability,x\n0.5\n0.5\n", &["p.csv"]);
    refused("", &["expected a header"]);
    bench.write("p.csv", "x,probability\n1,0.25\n2,0.75\n");
    bench.bhm("score --test test.csv --predictions p.csv").succeeds(&[]);
    bench.write("test.csv", "scan,x,y,label\n0,1,1,1\n0,two,2,0\n0,2,2,0\n");
    bench.bhm("score --test test.csv --predictions p.csv").fails(1, &["damaged", "cannot be paired"]);
    bench.bhm("score --test none.csv --predictions p.csv").fails(1, &["none.csv"]);
}
