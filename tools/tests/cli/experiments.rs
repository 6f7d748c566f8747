//! Experiments print a line for each contestant, in text and as JSON, and compare what they claim to compare.

use serde_json::Value;

use crate::support::{Bench, Run, room};

fn number(value: &Value, name: &str) -> f64 {
    value[name].as_f64().unwrap_or_else(|| panic!("{name} of {value}"))
}

/// The line of each contestant says what its object does, cell by cell, and these further cells; the best NLL is marked.
fn says_the_same(run: &Run, contestants: &Value, further: impl Fn(&Value) -> Vec<String>) {
    let contestants = contestants.as_array().unwrap();
    let best = contestants.iter().map(|one| number(one, "nll")).fold(f64::INFINITY, f64::min);
    for one in contestants {
        let mut expected: Vec<String> = ["auc", "nll", "ece"].map(|name| format!("{:.5}", number(one, name))).to_vec();
        expected.extend(["rows", "passes", "stencil", "tiles"].map(|name| one[name].to_string()));
        expected.extend(further(one));
        expected.push(format!("{:.2}", number(one, "instructions_per_scan") / 1e6));
        expected.extend((number(one, "nll") == best).then(|| "best".to_owned()));
        assert_eq!(run.cells(one["name"].as_str().unwrap()), expected, "{one}");
    }
}

#[test]
fn segments_meet_points_of_equal_cost() {
    let bench = Bench::new();
    bench.write("room.log", room());
    let found = bench.json("experiment segments room.log --profile compact --lengths 1,4");
    let contestants = found.as_array().unwrap();
    let names: Vec<_> = contestants.iter().map(|one| one["name"].as_str().unwrap()).collect();
    assert_eq!(names[..3], ["points, as configured", "segments of 1", "points, equal rows"]);
    assert_eq!(names.len(), 7);
    for group in contestants[1..].chunks(3) {
        let [segments, rows, instructions] = group else { panic!("three of each length") };
        // Beams have few pieces here, and each beam a whole number of them.
        assert!((number(rows, "rows") / number(segments, "rows") - 1.0).abs() < 0.1, "{found}");
        let cost = number(instructions, "instructions_per_scan") / number(segments, "instructions_per_scan");
        assert!((cost - 1.0).abs() < 0.1, "{found}");
        assert!(segments["free_spacing_m"].is_null() && rows["segment_length"].is_null());
    }
    let arguments = "experiment segments room.log --every 4 --lengths 2 --profile compact";
    let (run, found) = (bench.bhm(arguments), bench.json(arguments));
    run.succeeds(&[]);
    says_the_same(&run, &found, |one| {
        vec![one["free_spacing_m"].as_f64().map_or("-".to_owned(), |spacing_m| format!("{spacing_m:.3}"))]
    });
    assert_eq!(run.cells("segments of 2")[7], "-", "segments have no spacing: {}", run.stdout);
}

#[test]
fn kernels_are_compared_and_those_that_do_not_fit_are_named() {
    let bench = Bench::new();
    bench.write("room.log", room());
    let arguments = "experiment kernels room.log --every 4 --profile compact --shapes 0.6,9 --two-scales-shapes 0.3";
    let (run, found) = (bench.bhm(arguments), bench.json(arguments));
    run.succeeds(&[]);
    says_the_same(&run, &found["contestants"], |_| Vec::new());
    // The narrowest of the stencils 4, 6 and 8 that cuts off less than 1e-4: the spline ends in the first, exp(−3²/0.6) is
    // 3e-7 where exp(−2²/0.6) is 1e-3, and ½ exp(−4²/1.2) is 8e-7 where ½ exp(−3²/1.2) is 3e-4.
    let contestants = found["contestants"].as_array().unwrap();
    let stencils: Vec<_> =
        contestants.iter().map(|one| (one["name"].as_str().unwrap(), one["stencil"].as_u64().unwrap())).collect();
    assert_eq!(stencils, [("cubic-b-spline", 4), ("squared-exponential 0.6", 6), ("two-scales 0.3", 8)]);
    // Each learns and is asked the same.
    for one in contestants {
        assert_eq!(
            (&one["observations"], &one["points"]),
            (&contestants[0]["observations"], &contestants[0]["points"])
        );
    }
    let [refused] = found["refused"].as_array().unwrap().as_slice() else { panic!("one is refused: {found}") };
    let refused = refused.as_str().unwrap();
    assert!(run.stdout.lines().any(|line| line == format!("refused: {refused}")), "{}", run.stdout);
    let cut_off = refused.strip_prefix("squared-exponential 9: a feature is still ").expect(refused);
    let cut_off: f64 = cut_off.split_once(" where a stencil of 8 ends").expect(refused).0.parse().unwrap();
    assert!((cut_off - (-16.0_f64 / 9.0).exp()).abs() < 1e-6, "{refused}");
}

#[test]
fn knowing_that_poses_are_uncertain_widens_what_is_learned() {
    let bench = Bench::new();
    let arguments = "experiment poses --every 60 --profile compact --position-noise 0.2 --heading-noise 0.03";
    let found = bench.json(arguments);
    let contestants = found.as_array().unwrap();
    assert_eq!(contestants.len(), 2 + 4);
    for one in contestants {
        let used = one["covariance_used"].as_bool().unwrap();
        assert_eq!(number(one, "narrowed") > 0.0, used, "far from the robot no stencil has room: {one}");
        assert!(number(&one["world"], "points") == number(&contestants[0]["world"], "points"));
        // The same beams are asked, where they really went.
        assert_eq!(number(one, "positives"), number(&contestants[0], "positives"));
    }
}

#[test]
fn supports_are_placed_by_data_and_only_the_experiment_takes_their_list() {
    let bench = Bench::new();
    bench.write("room.log", room());
    let learned = bench.json("learn supports room.log --cluster 20 -o list.json --profile compact");
    assert_eq!(learned["supports"], 20);
    assert_eq!(number(&learned, "bytes") as usize, bench.read("list.json").len());

    let common = "experiment placement room.log --profile compact --every 5 --shapes 1";
    let given = bench.json(&format!("{common} --list list.json"));
    let names: Vec<_> = given.as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["lattice over the box", "lattice over data", "list, centres", "list, Gaussians"]);
    let looked_for = bench.json(&format!("{common} --counts 20,40 --hit-weights 1"));
    for one in looked_for.as_array().unwrap() {
        assert!(number(one, "supports") <= 40.0 && number(one, "auc") > 0.5, "{one}");
    }

    let wrong = "beginning with `{\"source\":\"20 clust";
    for command in ["evaluate list.json", "info list.json", "build list.json -o map.bhm"] {
        bench.bhm(command).fails(1, &["list.json", wrong]);
    }
    let no_list = bench.bhm(&format!("{common} --list room.log"));
    no_list.fails(1, &["room.log: expected a list of scattered supports: expected value at line 1"]);
    bench.bhm(&format!("{common} --counts 513")).fails(2, &["--counts: 513 supports, expected 1 to 512"]);
    bench.bhm("learn supports room.log --cluster 0 -o x").fails(1, &["0 clusters, expected 1 to 4096"]);
}
