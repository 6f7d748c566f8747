//! What is not understood is code 2; where a setting comes from, and which wins.

use crate::support::{Bench, room};

#[test]
fn what_is_not_understood_is_code_2() {
    let bench = Bench::new();
    bench.write("room.log", room());
    for (arguments, says) in [
        ("", "Usage: bhm"),
        ("fly", "unrecognized subcommand 'fly'"),
        ("build room.log", "--output <MAP>"),
        ("build room.log -o m.bhm --profile tiny", "[possible values: indoor, fine, compact, outdoor, paper]"),
        ("build room.log -o m.bhm --rule newton", "[possible values: gaussian-variational, jaakkola-jordan]"),
        ("build room.log -o m.bhm --spacing wide", "invalid value 'wide' for '--spacing <M>'"),
        ("build room.log -o m.bhm --spacing=-1", "spacing is -1, expected 1 mm to 1 km"),
        ("build room.log -o m.bhm --spacing nan", "spacing is NaN, expected 1 mm to 1 km"),
        ("build room.log -o m.bhm --passes 0", "passes is 0, expected 1 to 100"),
        ("build room.log -o m.bhm --forgetting 0", "forgetting is 0, expected above 0, at most 1"),
        ("build room.log -o m.bhm --max-range 0", "maximum range is 0, expected a positive number"),
        ("build room.log -o m.bhm --slots 0", "number of tile slots is 0, expected 1 to 23301"),
        ("build room.log -o m.bhm --slots 99999999", "number of tile slots is 99999999, expected 1 to 23301"),
        ("build room.log -o m.bhm --bias maybe", "invalid value 'maybe' for '--bias"),
        ("evaluate room.log --fraction 1", "expected a number above 0 and below 1"),
        ("evaluate room.log --fraction nan", "expected a number above 0 and below 1"),
        ("evaluate room.log --holdout lasers", "[possible values: beams, points, scans]"),
        ("evaluate room.log --train room.log --test room.log", "cannot be used with"),
        ("evaluate --train room.log", "--test <CSV>"),
        ("tune room.log", "--output <FILE>"),
        ("tune room.log -o t.toml --try-spacing 0.2;0.3", "expected `auto`, or numbers with commas between them"),
        ("tune room.log -o t.toml --try-spacing 0.2,", "invalid value '0.2,' for '--try-spacing <LIST>'"),
        ("tune room.log -o t.toml --try-colour red", "unexpected argument '--try-colour'"),
        ("tune room.log -o t.toml --try-kernel-shape auto", "--try-kernel-shape: cubic-b-spline has no kernel-shape"),
        ("tune room.log -o t.toml --gap 0 --try-gap auto", "--try-gap: it is 0: nothing to go around"),
        (
            "tune room.log -o t.toml --by objective --try-gap 0.1",
            "other observations, whose objectives cannot be compared",
        ),
        ("tune room.log -o t.toml --search grid --rounds 3", "a grid search has no --rounds"),
        ("tune room.log -o t.toml --fraction 0.5", "expected a number above 0 and below 0.5"),
        ("tune room.log -o t.toml --max-cost 0", "expected a positive number"),
        ("tune room.log -o t.toml --kernel-shape 1", "--kernel-shape: cubic-b-spline has no kernel-shape"),
        (
            "tune room.log -o t.toml --kernel squared-exponential --kernel-shape=-1",
            "kernel shape is -1, expected a positive number",
        ),
        ("query m.bhm 1", "<Y>"),
        ("query m.bhm 1 north", "invalid value 'north' for '<Y>'"),
        ("query m.bhm nan 0", "the point (NaN, 0) is not finite"),
        ("watch --query nan 1", "a point at NaN is nowhere"),
        ("watch --query 1", "2 values required"),
        ("bridge", "--port <PORT>"),
        ("bridge --port tcp:192.168.0.7:5555", "192.168.0.7 is another computer"),
        ("bridge --port unix:line --profile indoor", "the firmware is built with the profile compact as it is"),
        ("demo --firmware bhm.elf --passes 2", "the firmware is built with the profile compact as it is"),
        ("onboard --domain a/b", "'a/b' cannot be used as a domain's name"),
        ("onboard --consumers 0", "0 is not in 1..=64"),
        ("onboard --slots 99999999", "number of tile slots is 99999999, expected 1 to 23301"),
        ("simulate --scene moon", "[possible values: building, outdoor, traffic]"),
        ("simulate --position-noise=-1", "expected a standard deviation of at least 0"),
        ("demo --heading-noise nan", "expected a standard deviation of at least 0"),
        ("simulate --rate 0", "expected a number of scans per second"),
        ("play", "<LOG>"),
        ("replay", "<LOG>"),
        ("demo --spacing=-1", "spacing is -1, expected 1 mm to 1 km"),
        ("demo --slots 0", "number of tile slots is 0"),
        ("render m.bhm -o x.png --bounds 1,2,3", "expected four numbers of metres"),
    ] {
        bench.bhm(arguments).fails(2, &[says]);
    }
    assert!(!bench.path("m.bhm").exists() && !bench.path("t.toml").exists());
}

#[test]
fn a_configuration_file_with_an_unknown_key_is_refused_with_its_line() {
    let bench = Bench::new();
    bench.write("map.toml", "profile = \"compact\"\n# finer\nspacin = 0.2\n");
    bench
        .bhm("build room.log -o m.bhm --config map.toml")
        .fails(2, &["map.toml, line 3: unknown field `spacin`, expected one of `capacities`, ", "`settings`"]);
    bench.bhm("build room.log -o m.bhm --config none.toml").fails(1, &["cannot read none.toml: No such file"]);
}

#[test]
fn flag_before_environment_before_file_before_profile() {
    let bench = Bench::new();
    let file = "profile = \"compact\"\n[settings]\npasses = 7\nspacing_m = 0.4\nbeam.point-samples.gap_m = 0.2\n";
    bench.write("map.toml", file);
    let environment = [("BHM_CONFIG", "map.toml"), ("BHM_PASSES", "5"), ("BHM_SPACING", "0.3")];
    let run = bench.bhm_with("build --print-config --passes 2", &environment);
    run.succeeds(&[]);
    for line in ["profile = \"compact\"", "passes = 2", "spacing_m = 0.3", "gap_m = 0.2", "free_spacing_m = 1.0"] {
        assert!(run.stdout.lines().any(|printed| printed == line), "{line} is not in:\n{}", run.stdout);
    }
    bench.bhm_with("build --print-config", &[("BHM_PASSES", "several")]).fails(2, &["invalid value 'several'"]);
    // What is printed can be read, and means the same.
    bench.write("printed.toml", &run.stdout);
    assert_eq!(bench.bhm("evaluate --print-config --config printed.toml").stdout, run.stdout);
}

#[test]
fn completions_and_help_are_there() {
    let bench = Bench::new();
    for shell in ["bash", "zsh", "fish"] {
        let run = bench.bhm(&format!("completions {shell}"));
        assert!(run.code == 0 && run.stdout.contains("bhm") && run.stdout.contains("evaluate"));
    }
    let help = bench.bhm("build --help");
    assert!(help.code == 0 && help.stdout.contains("--no-return-free") && help.stdout.contains("[env: BHM_GAP="));
}
