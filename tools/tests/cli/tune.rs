//! What a search finds is what other commands then read, and is judged as they would.

use serde_json::Value;

use crate::support::{Bench, room};

fn scored<'a>(outcome: &'a Value, name: &str) -> &'a Value {
    &outcome["scored"][name]
}

#[test]
fn what_is_found_is_read_by_other_commands_and_scores_the_same_there() {
    let bench = Bench::new();
    bench.write("room.log", room());
    let common = "--fraction 0.2 --seed 3";
    let arguments =
        "tune room.log -o tuned.toml --profile compact --prior white --try-prior-precision 1,0.01,100 --try-gap 0.2";
    let tuned = bench.json(&format!("{arguments} {common}"));

    // A prior of 100 does not let a beam say anything, and one of 1 little.
    let candidates = tuned["candidates"].as_array().unwrap();
    let best = &candidates[tuned["best"].as_u64().unwrap() as usize];
    let nll = |candidate: &Value| scored(candidate, "nll").as_f64().unwrap();
    assert!(candidates.iter().all(|candidate| nll(candidate) >= nll(best)), "{tuned}");
    let stiff = candidates.iter().find(|candidate| candidate["values"]["prior-precision"] == 100.0).unwrap();
    assert!(nll(stiff) > 2.0 * nll(best), "{tuned}");
    assert_eq!(candidates[0]["values"]["prior-precision"], 1e-4);
    assert_eq!(candidates[0]["cost"], 1.0);

    // The parts are counted, and the test part is the one that `evaluate` holds out.
    for (options, outcome) in [("--profile compact --prior white", "test_start"), ("--config tuned.toml", "test_best")]
    {
        let evaluated = bench.json(&format!("evaluate room.log {options} {common}"));
        for score in ["nll", "auc", "ece", "points", "tiles"] {
            assert_eq!(&evaluated[score], scored(&tuned[outcome], score), "{options}: {score}");
        }
    }
    let printed = bench.bhm("evaluate --print-config --config tuned.toml").stdout;
    let values = best["values"].as_object().unwrap();
    assert_eq!(values.len(), 2, "{tuned}");
    let settings = &printed.parse::<toml::Table>().unwrap()["settings"];
    for (name, found) in [
        ("gap", &settings["beam"]["point-samples"]["gap_m"]),
        ("prior-precision", &settings["prior"]["white"]["precision"]),
    ] {
        assert_eq!(found.as_float(), values[name].as_f64(), "{name}: {printed}");
    }
    let file = String::from_utf8(bench.read("tuned.toml")).unwrap();
    assert!(file.starts_with("# ") && file.ends_with(&printed), "{file}");
    for part in ["# log: \"room.log\", 20 scans", "--seed 3", "# validation: start NLL 0.", "# test: start NLL 0."] {
        assert!(file.contains(part), "{part} is not in {file}");
    }

    // Once more, and it is the same file.
    bench.json(&format!("{arguments} {common}"));
    assert_eq!(bench.read("tuned.toml"), file.as_bytes());
}

#[test]
fn what_cannot_be_used_is_listed_and_does_not_win() {
    let bench = Bench::new();
    bench.write("room.log", room());
    let arguments = "tune room.log -o t.toml --profile compact --kernel squared-exponential --every 2 --search grid";
    // 4 is cut off too early by a stencil of 8, and half of the spacing costs more than 1.2 times as much.
    let grid = format!("{arguments} --try-kernel-shape 0.6,4 --try-spacing 0.5,0.25 --max-cost 1.2");
    let run = bench.bhm(&grid);
    run.succeeds(&["10 scans; of 1800 beams with a return"]);
    let tuned = bench.json(&grid);
    let candidate = |spacing: f64, shape: f64| {
        let values = |one: &&Value| {
            (&one["values"]["spacing"], &one["values"]["kernel-shape"]) == (&spacing.into(), &shape.into())
        };
        tuned["candidates"]
            .as_array()
            .unwrap()
            .iter()
            .find(values)
            .unwrap_or_else(|| panic!("{spacing}, {shape}: {tuned}"))
    };
    let refused = |shape: f64, spacing: f64| candidate(spacing, shape)["refused"].as_str().unwrap();
    // exp(−4²/4), four spacings from a support.
    let cut_off = refused(4.0, 0.5).strip_prefix("a feature is still ").unwrap().split_once(' ').unwrap().0;
    assert!((cut_off.parse::<f64>().unwrap() - (-4.0_f64).exp()).abs() < 1e-6, "{cut_off}");
    assert_eq!(run.cells("0.5 4").join(" "), format!("refused: {}", refused(4.0, 0.5)));
    assert_eq!(run.cells("0.25 4").join(" "), format!("refused: {}", refused(4.0, 0.25)));
    // What was learned, cell by cell, but for the time that it took.
    for (beginning, spacing, remark) in
        [("start, best 0.5 0.6", 0.5, None), ("0.25 0.6", 0.25, Some("over --max-cost"))]
    {
        let one = candidate(spacing, 0.6);
        let score = |name: &str| scored(one, name).as_f64().unwrap();
        let mut cells = run.cells(beginning);
        cells.remove(4);
        let mut expected: Vec<_> =
            ["nll", "auc", "ece", "objective_per_row"].map(|name| format!("{:.5}", score(name))).to_vec();
        expected.push(format!("{:.2}", one["cost"].as_f64().unwrap()));
        expected.push(scored(one, "tiles").to_string());
        assert_eq!(cells[..6], expected, "{beginning}");
        // The memory, a number with its unit, then the remark.
        assert_eq!(cells[8..].join(" "), remark.unwrap_or_default(), "{beginning}");
    }
    let cost = |spacing: f64| candidate(spacing, 0.6)["cost"].as_f64().unwrap();
    assert!(cost(0.5) == 1.0 && cost(0.25) > 1.2, "{tuned}");
    assert_eq!(tuned["best"], 0, "the start is the best of what may be used");
    assert!(run.stdout.contains("the start is the best"));

    let dear = bench.bhm(&format!("{arguments} --try-kernel-shape 4 --max-cost 0.5"));
    dear.fails(1, &["no candidate can be used (--max-cost 0.5): NLL 0.", "refused: a feature is still"]);
    let nowhere = bench.bhm("tune room.log -o no/such/t.toml");
    nowhere.fails(1, &["cannot write no/such/t.toml: No such file"]);
}

#[test]
fn the_objective_can_decide() {
    let bench = Bench::new();
    bench.write("room.log", room());
    let tuned = bench
        .json("tune room.log -o t.toml --profile compact --prior white --by objective --try-prior-precision 0.01,100");
    let objective = |candidate: &Value| scored(candidate, "objective_per_row").as_f64().unwrap();
    let candidates = tuned["candidates"].as_array().unwrap();
    let best = objective(&candidates[tuned["best"].as_u64().unwrap() as usize]);
    assert!(best < 0.0 && candidates.iter().all(|candidate| objective(candidate) <= best), "{tuned}");
}
