//! What `bhm budget` says, and that the documentation quotes it.

use crate::support::Bench;

/// The text between two marks of `docs/firmware.md`.
fn quoted(mark: &str) -> String {
    let text = include_str!("../../../docs/firmware.md");
    let rest = text.split_once(&format!("<!-- {mark} -->\n")).expect("the mark").1;
    rest.split_once("<!-- end -->").expect("its end").0.to_owned()
}

#[test]
fn the_documentation_quotes_the_budget() {
    let bench = Bench::new();
    for (mark, passes) in [("budget compact", ""), ("budget compact one pass", " --passes 1")] {
        let printed = bench.bhm(&format!("budget --profile compact --markdown{passes}"));
        printed.succeeds(&[]);
        assert_eq!(quoted(mark), printed.stdout, "docs/firmware.md is out of date");
    }
}

#[test]
fn every_profile_has_a_budget_and_only_measured_features_a_bound() {
    let bench = Bench::new();
    for (profile, bounded) in [("indoor", true), ("compact", true), ("outdoor", true), ("paper", false)] {
        let sheet = bench.json(&format!("budget --profile {profile}"));
        assert_eq!(sheet["instructions"].is_object(), bounded, "{sheet}");
        assert!(sheet["state_bytes"].as_u64() > sheet["bytes_per_tile"].as_u64());
        assert_eq!(sheet["firmware"].is_object(), profile == "compact");
    }
    let rate = |options: &str| {
        let sheet = bench.json(&format!("budget --profile compact {options}"));
        sheet["instructions"]["scans_per_second_at_least"].as_f64().unwrap()
    };
    assert!((rate("--clock-mhz 200") / rate("--clock-mhz 400") - 0.5).abs() < 1e-9);
    assert!((rate("--cycles 2") / rate("") - 0.5).abs() < 1e-9);
}
