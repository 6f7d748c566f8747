//! What the commands give: the same map whenever and wherever it is made, and scores as published.

use serde_json::Value;

use bhm_oracle::recorded;

use crate::support::{Bench, room};

#[test]
fn a_map_does_not_depend_on_the_run_nor_on_the_store() {
    let bench = Bench::new();
    bench.write("room.log", room());
    let first = bench.json("build room.log -o first.bhm");
    let second = bench.json("build room.log -o second.bhm");
    assert_eq!(bench.read("first.bhm"), bench.read("second.bhm"));
    let small = bench.json("build room.log -o small.bhm --slots 3");
    assert!(small["learned"]["tiles_evicted"].as_u64() > Some(10), "{small}");
    assert_eq!(small["learned"]["tiles_lost"], 0);
    for built in [&first, &second, &small] {
        assert_eq!((&built["posterior"], &built["tiles"]), (&first["posterior"], &first["tiles"]));
    }
    for file in ["first.bhm", "small.bhm"] {
        let info = bench.json(&format!("info {file}"));
        assert_eq!((&info["posterior"], &info["scans"]), (&first["posterior"], &Value::from(20)));
        assert_eq!((&info["profile"], &info["path_points"]), (&Value::from("indoor"), &Value::from(20)));
    }
    let answers = ["first.bhm", "small.bhm"].map(|file| bench.json(&format!("query {file} 3.98 -0.5")));
    assert_eq!(answers[0], answers[1]);
}

#[test]
fn answers_fit_the_room() {
    let bench = Bench::new();
    bench.write("room.log", room());
    bench.json("build room.log -o room.bhm");
    let ask = |x: f32, y: f32| bench.json(&format!("query room.bhm {x} {y}"));
    let number = |answer: &Value, name: &str| answer[name].as_f64().unwrap();
    let [free, wall, beyond, out] = [ask(1.0, 0.5), ask(4.0, -1.0), ask(-9.0, 9.0), ask(1e7, 0.0)];
    assert!(free["known"] == true && number(&free, "probability") < 0.05, "{free}");
    assert!(wall["known"] == true && number(&wall, "probability") > 0.9, "{wall}");
    assert!(beyond["known"] == false && number(&beyond, "probability") == 0.5, "{beyond}");
    assert!(out["known"] == false && out["log_odds_variance"].is_null(), "{out}");
    // Towards the wall, occupancy rises along x.
    assert!(ask(3.8, -1.0)["log_odds_gradient_per_m"][0].as_f64() > Some(0.0));

    let observed = &bench.json("info room.bhm")["observed_m"];
    for axis in 0..2 {
        assert!((3.5..6.0).contains(&observed["max"][axis].as_f64().unwrap()), "{observed}");
    }
    let text = bench.bhm("query room.bhm -2 -1.5");
    assert!(text.code == 0 && text.stdout.contains("state") && text.stdout.contains("known"));
}

#[test]
fn pictures_are_written_and_repeat() {
    let bench = Bench::new();
    bench.write("room.log", room());
    bench.json("build room.log -o room.bhm");
    bench.json("render room.bhm -o a.png");
    bench.json("render room.bhm -o b.png");
    assert_eq!(bench.read("a.png"), bench.read("b.png"));
    assert!(bench.read("a.png").starts_with(b"\x89PNG"));
    let part = bench.json("render room.bhm -o c.png --bounds -2,-1,2,1 --scale 100 --what deviation --no-path");
    assert_eq!((&part["width_px"], &part["height_px"]), (&Value::from(400), &Value::from(200)));
    bench.bhm("render room.bhm -o d.png --bounds 2,0,1,1").fails(2, &["cannot draw from"]);
    bench.bhm("render room.bhm -o no/d.png").fails(1, &["cannot write no/d.png"]);
}

#[test]
fn what_is_held_out_is_predicted_and_repeats() {
    let bench = Bench::new();
    bench.write("room.log", room());
    for held in ["beams", "points", "scans"] {
        let arguments = format!("evaluate room.log --holdout {held} --fraction 0.2");
        let [first, again, other] = ["1", "1", "2"].map(|seed| bench.json(&format!("{arguments} --seed {seed}")));
        assert!(first["auc"].as_f64() > Some(0.98) && first["nll"].as_f64() < Some(0.15), "{held}: {first}");
        assert!(first["held_out"].as_str().unwrap().contains(held), "{first}");
        assert_eq!((&first["nll"], &first["points"]), (&again["nll"], &again["points"]));
        assert_ne!(first["nll"], other["nll"]);
        assert!(first["p50_ms"].as_f64() <= first["max_ms"].as_f64());
    }
}

#[test]
fn recorded_points_are_predicted_as_well_as_known() {
    let (Some(train), Some(test)) = (recorded("intel-beams-train.csv.gz"), recorded("intel-beams-test.csv.gz")) else {
        return;
    };
    let bench = Bench::new();
    let scores = |options: &str| {
        bench.json(&format!("evaluate --train {} --test {} {options}", train.display(), test.display()))
    };
    for (options, auc, nll, ece) in [
        ("--profile compact", 0.9935, 0.094, 0.022),
        ("--profile indoor", 0.996, 0.066, 0.008),
        ("--profile compact --rule jaakkola-jordan --passes 1", 0.98, 0.150, 0.1),
    ] {
        let scores = scores(options);
        let score = |name: &str| scores[name].as_f64().unwrap();
        assert!(score("auc") >= auc && score("nll") <= nll && score("ece") <= ece, "{options}: {scores}");
        assert_eq!((&scores["points"], &scores["learned"]["scans"]), (&Value::from(47_760), &Value::from(910)));
    }
}
