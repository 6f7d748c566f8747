//! Learned supports and uncertain poses: what carries them says the same, and what does not fit is refused.

use bhm_core::{
    kernel::{Averaging, KernelSettings},
    lattice::Window,
    support::{GaussianSettings, RectangleSettings, SupportSettings},
};
use bhm_host::{
    ipc::TemporaryDomain,
    supports::{self, LearnedSupports, LearnedWith},
};
use serde_json::Value;

use crate::{
    processes::process::Process,
    support::{Bench, room, scan},
};

/// Writes Gaussians of different widths over the room, with rectangles among them, for a map of this spacing.
fn learned(bench: &Bench, name: &str, spacing_m: f32) {
    let window = Window { first: [-24, -24], width: [48, 48] };
    let shapes = (0..window.supports()).map(|number| {
        let size = 0.1 + 0.02 * (number % 11) as f32;
        let kind = if number % 5 == 0 {
            SupportSettings::RectangularSupport(RectangleSettings { size, samples: Averaging::Exact })
        } else {
            SupportSettings::GaussianSupport(GaussianSettings { size })
        };
        kind.build(spacing_m)
    });
    let source = "by a test".to_owned();
    let learned_with = Some(LearnedWith { kernel: KernelSettings::ALL[0], source });
    let learned = LearnedSupports::new([0.0; 2], spacing_m, window, shapes.collect(), learned_with).unwrap();
    supports::save(&bench.path(name), &learned).unwrap();
}

#[test]
fn a_map_with_learned_supports_is_the_same_wherever_it_is_made_and_asked() {
    let bench = Bench::new();
    bench.write("room.log", room());
    learned(&bench, "room.sup", 0.5);
    let plain = bench.json("build room.log --profile compact -o plain.bhm");
    let built = bench.json("build room.log --profile compact --supports room.sup -o built.bhm");
    assert_ne!(plain["posterior"], built["posterior"], "they matter");
    let by_environment =
        bench.bhm_with("build room.log --profile compact -o environment.bhm", &[("BHM_SUPPORTS", "room.sup")]);
    by_environment.succeeds(&[]);
    assert_eq!(bench.read("built.bhm"), bench.read("environment.bhm"));

    let replayed = bench.json("replay room.log --profile compact --supports room.sup -o out");
    let posterior = &replayed["posterior"];
    assert_eq!((&posterior["saved"], &posterior["shared"]), (&built["posterior"], &built["posterior"]));
    assert_eq!((&posterior["equal"], &replayed["watch"]["unusable"]), (&Value::from(true), &Value::from(0)));
    assert_eq!(replayed["options"]["supports"], "room.sup");
    // The map files answer without the file of supports, both the same.
    std::fs::rename(bench.path("room.sup"), bench.path("moved.sup")).unwrap();
    let ask = |map: &str, x: f32, y: f32| bench.json(&format!("query {map} {x} {y}"));
    let mut differ = 0;
    for (x, y) in [(3.9, -0.5), (1.0, 0.5), (-2.3, 3.95), (3.98, 2.0)] {
        assert_eq!(ask("built.bhm", x, y), ask("out/map.bhm", x, y));
        differ += usize::from(ask("built.bhm", x, y) != ask("plain.bhm", x, y));
    }
    assert!(differ > 0);

    let info = bench.json("info out/map.bhm");
    let supports = &info["supports"];
    assert_eq!((&supports["count"], &supports["source"]), (&Value::from(2_304), &Value::from("by a test")));
    assert_eq!((&supports["kinds"]["rectangle"], &supports["kinds"]["gaussian"]), (&461.into(), &1_843.into()));
    assert!(bench.json("info plain.bhm")["supports"].is_null());
    let text = bench.bhm("info built.bhm").stdout;
    assert!(text.contains("2304 learned (1843 gaussian, 461 rectangle)"), "{text}");
    let scores = |supports: &str| bench.json(&format!("evaluate room.log --profile compact {supports}"));
    assert_ne!(scores("--supports moved.sup")["nll"], scores("")["nll"]);
}

#[test]
fn a_consumer_asks_with_the_supports_of_the_mapper() {
    let bench = Bench::new();
    bench.write("room.log", room());
    learned(&bench, "room.sup", 0.5);
    let domain = TemporaryDomain::new().unwrap();
    let onboard = "onboard --profile compact --supports room.sup --save map.bhm --until-end --consumers 2";
    let onboard = Process::join(&bench, &domain, onboard);
    let points = ["3.9 -0.5", "1.0 0.5", "-2.3 3.95", "3.98 2.0"];
    let queries = points.map(|point| format!("--query {point}")).join(" ");
    let watch = Process::join(&bench, &domain, &format!("watch --until-end {queries}"));
    watch.reads(0);
    let source = Process::join(&bench, &domain, "play room.log");
    let mut newest = Value::Null;
    watch.says(|line| {
        newest = line["posterior"].clone();
        newest["ended"].as_bool().filter(|ended| *ended).map(|_| ())
    });
    source.ends().well();
    let (watched, onboarded) = (watch.ends().well(), onboard.ends().well());
    assert_eq!(
        (&watched["watched"]["posterior"], &watched["watched"]["unusable"]),
        (&onboarded["posterior"], &0.into())
    );
    for (point, probability) in points.iter().zip(newest["probabilities"].as_array().unwrap()) {
        let answer = bench.json(&format!("query map.bhm {point}"));
        assert_eq!(answer["probability"], *probability, "at {point}");
    }
}

#[test]
fn supports_that_do_not_fit_are_refused_with_what_helps() {
    let bench = Bench::new();
    bench.write("room.log", room());
    learned(&bench, "room.sup", 0.5);
    let spacing = "room.sup: the supports were learned at a spacing of 0.5 m, the map has 0.25 m; \
                   give --spacing 0.5 or --profile compact";
    for command in ["build room.log -o m.bhm", "evaluate room.log", "replay room.log", "demo", "onboard"] {
        bench.bhm(&format!("{command} --supports room.sup")).fails(2, &[spacing]);
    }
    bench
        .bhm("build room.log -o m.bhm --profile paper --supports room.sup")
        .fails(2, &["node 0 at", "--profile compact"]);
    bench.write("map.toml", "supports = \"room.sup\"\n");
    bench.bhm("build room.log -o m.bhm --config map.toml").fails(2, &["map.toml: room.sup: the supports were learned"]);
    bench.bhm("build room.log -o m.bhm --config map.toml --spacing 0.5").succeeds(&[]);

    let whole = bench.read("room.sup");
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 4;
    bench.write("flipped.sup", flipped);
    let mut older = whole.clone();
    older[8] = 1;
    bench.write("older.sup", older);
    bench.write("cut.sup", &whole[..whole.len() / 2]);
    for (file, says) in [
        ("flipped.sup", "flipped.sup: damaged: checksum".to_owned()),
        ("older.sup", "older.sup: format version 1, only 2 is understood".to_owned()),
        ("cut.sup", format!("cut.sup: cut short at byte {} of {}", whole.len() / 2, whole.len())),
        ("room.log", "room.log: expected a file of learned supports, found text beginning with `FLASER".to_owned()),
        ("absent.sup", "cannot read absent.sup: No such file".to_owned()),
    ] {
        bench.bhm(&format!("build room.log -o m.bhm --profile compact --supports {file}")).fails(1, &[&says]);
    }
    let printed = bench.bhm("build --print-config --profile compact --supports room.sup");
    assert!(printed.stdout.lines().any(|line| line == "supports = \"room.sup\""), "{}", printed.stdout);
}

#[test]
fn uncertain_poses_mean_the_same_offline_and_through_shared_memory() {
    let bench = Bench::new();
    bench.write("room.log", room());
    let certain = bench.json("build room.log --profile compact -o certain.bhm");
    let deviations = "--pose-deviation 0.05 --heading-deviation 0.01";
    let built = bench.json(&format!("build room.log --profile compact {deviations} -o uncertain.bhm"));
    assert_ne!(certain["posterior"], built["posterior"]);
    let zero = bench.json("build room.log --profile compact --pose-deviation 0 -o zero.bhm");
    assert_eq!(zero["posterior"], certain["posterior"]);
    let replayed = bench.json(&format!("replay room.log --profile compact {deviations} -o out"));
    assert_eq!(replayed["posterior"]["saved"], built["posterior"]);
    let scores = |options: &str| bench.json(&format!("evaluate room.log --profile compact {options}"));
    assert_ne!(scores(deviations)["nll"], scores("")["nll"]);
    let demo = |options: &str| bench.json(&format!("demo --scans 10 --profile compact {options} -o demo"));
    assert_ne!(demo(deviations)["posterior"]["saved"], demo("")["posterior"]["saved"]);
    let printed = bench.bhm_with("build --print-config", &[("BHM_POSE_DEVIATION", "0.25")]);
    assert!(printed.stdout.lines().any(|line| line == "pose_deviation_m = 0.25"), "{}", printed.stdout);
    bench.write("one.log", scan(0.0, "1"));
    for (command, says) in [
        ("build one.log -o m.bhm --pose-deviation=-1", "pose deviation is -1, expected 0 to 1000 m"),
        ("build one.log -o m.bhm --heading-deviation nan", "heading deviation is NaN, expected 0 to 4 rad"),
        ("play one.log --heading-deviation 9", "heading deviation is 9, expected 0 to 4 rad"),
    ] {
        bench.bhm(command).fails(2, &[says]);
    }
}
