use super::*;
use bhm_core::profile;
use clap::Parser;

#[derive(Parser)]
struct Cli {
    #[command(flatten)]
    map: MapOptions,
}

fn effective(arguments: &[&str]) -> anyhow::Result<Effective> {
    let cli = Cli::try_parse_from([&["bhm"], arguments].concat())?;
    Ok(cli.map.effective()?.unwrap())
}

#[test]
fn without_options_a_profile_is_itself() {
    assert_eq!(
        effective(&[]).unwrap(),
        Effective { profile: profile::INDOOR, max_range_m: None, poses: Default::default(), supports: None }
    );
    for profile in profile::ALL {
        assert_eq!(effective(&["--profile", profile.name]).unwrap().profile, *profile);
    }
}

#[test]
fn a_printed_configuration_means_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.toml");
    for arguments in [
        &["--profile=paper"][..],
        &["--profile=outdoor", "--rule=jaakkola-jordan", "--passes=1", "--no-return-free=5", "--max-range=30"],
        &["--pose-deviation=0.05", "--heading-deviation=0.01"],
        &["--spacing=0.1", "--kernel=squared-exponential", "--bias=on", "--gap=0", "--forgetting=0.99"],
        &[
            "--slots=3",
            "--range-limit=12.5",
            "--free-spacing=0.3",
            "--prior=white",
            "--prior-precision=1e-3",
            "--spacing=0.1",
        ],
        &["--kernel=two-scales", "--kernel-shape=0.3", "--support=rectangle", "--support-samples=3"],
    ] {
        let expected = effective(arguments).unwrap();
        fs::write(&path, expected.configuration().unwrap()).unwrap();
        assert_eq!(effective(&["--config", path.to_str().unwrap()]).unwrap(), expected, "{arguments:?}");
    }
}

#[test]
fn a_flag_overrides_the_file_and_the_file_the_profile() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.toml");
    fs::write(&path, "profile = \"compact\"\n[settings]\npasses = 2\nspacing_m = 0.4\n").unwrap();
    let profile = effective(&["--spacing", "0.3", "--config", path.to_str().unwrap()]).unwrap().profile;
    assert_eq!((profile.name, profile.settings.passes, profile.settings.spacing_m), ("compact", 2, 0.3));
}

#[test]
fn what_is_wrong_with_a_file_is_said_with_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.toml");
    for (text, says) in [
        ("[settings]\nspacin_m = 1.0\n", ", line 2: unknown field `spacin_m`, expected one of `"),
        (
            "\n[settings]\nrule = \"newton\"\n",
            ", line 3: unknown rule `newton`, expected one of gaussian-variational, ",
        ),
        (
            "settings.beam = { point-samples = { length = 1.0 } }\n",
            ", line 1: unknown field `length`, expected one of ",
        ),
        (
            "gap = 1\n",
            ", line 1: unknown field `gap`, expected one of `capacities`, `heading_deviation_rad`, `max_range_m`",
        ),
        ("[settings]\nbiass = true\n", ", line 2: unknown field `biass`, expected one of `beam`, `bias`, "),
        ("[settings]\npasses = \"many\"\n", ", line 2: `settings.passes` is \"many\", expected a whole number"),
        ("[settings]\npasses = 1.5\n", ", line 2: `settings.passes` is 1.5, expected a whole number"),
        ("[settings]\nspacing_m = true\n", ", line 2: `settings.spacing_m` is true, expected a number"),
        ("settings = 1\n", ", line 1: `settings` is 1, expected a table"),
        ("[settings]\norigin_m = [1.0]\n", ": `settings.origin_m`: "),
        (
            "[settings.rule.jaakkola-jordan]\nstart = { constnt = 1.0 }\n",
            ": `settings.rule.start`: unknown variant `constnt`, expected `constant` or ",
        ),
        ("[settings]\nspacing_m = \n", ", line 2: "),
        ("[settings]\nspacing_m = -1.0\n", ": spacing is -1, expected 1 mm to 1 km"),
        ("settings.kernel.squared-exponential.shape = 0\n", ": kernel shape is 0, expected a positive number"),
        ("profile = \"cellar\"\n", ": unknown profile `cellar`, expected one of indoor, "),
    ] {
        fs::write(&path, text).unwrap();
        let error = effective(&["--config", path.to_str().unwrap()]).unwrap_err();
        assert!(error.is::<Usage>());
        let expected = format!("{}{says}", path.display());
        assert!(error.to_string().starts_with(&expected), "{error} is not {expected}");
    }
}

#[test]
fn a_choice_keeps_what_it_has_in_common_with_the_one_before() {
    use bhm_core::{
        beam::{AnyBeamRule, LineSegments},
        rule::{AnyRule, JaakkolaJordan, XiStart},
    };
    let outdoor = effective(&["--profile=outdoor", "--beam-rule=line-segments"]).unwrap().profile.settings;
    assert_eq!(outdoor.beam, AnyBeamRule::LineSegments(LineSegments { gap_m: 0.3, ..LineSegments::DEFAULT }));
    // A start of the rule takes the place of another.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.toml");
    for (start, name, expected) in
        [("constant", "compact", XiStart::Constant(2.0)), ("predicted-up-to", "paper", XiStart::PredictedUpTo(2.0))]
    {
        let text = format!("profile = \"{name}\"\nsettings.rule.jaakkola-jordan.start.{start} = 2\n");
        fs::write(&path, text).unwrap();
        let rule = effective(&["--config", path.to_str().unwrap()]).unwrap().profile.settings.rule;
        assert_eq!(rule, AnyRule::JaakkolaJordan(JaakkolaJordan { start: expected }));
    }
    // The paper's start of the rule is kept when the rule is named again.
    let paper = effective(&["--profile=paper", "--rule=jaakkola-jordan"]).unwrap().profile.settings;
    assert_eq!(paper, profile::PAPER.settings);
}

#[test]
fn a_prior_of_splines_gives_way_to_another_kernel_and_is_refused_where_both_are_named() {
    let prior = |arguments: &[&str]| effective(arguments).unwrap().profile.settings.prior.name();
    assert_eq!(prior(&[]), "matern");
    assert_eq!(prior(&["--kernel=squared-exponential"]), "white");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.toml");
    fs::write(&path, "settings.kernel = 'two-scales'").unwrap();
    assert_eq!(prior(&["--config", path.to_str().unwrap()]), "white");
    let says = "prior matern: it is not defined for the kernel squared-exponential";
    let both = ["--kernel=squared-exponential", "--prior=matern"];
    assert_eq!(effective(&both).unwrap_err().to_string(), says);
    fs::write(&path, "settings.kernel = 'squared-exponential'\nsettings.prior = 'matern'").unwrap();
    assert!(effective(&["--config", path.to_str().unwrap()]).unwrap_err().to_string().ends_with(says));
}

#[test]
fn a_setting_that_nothing_chosen_has_is_refused() {
    for (argument, says) in [
        ("--kernel-shape=1", "--kernel-shape: cubic-b-spline has no kernel-shape"),
        ("--support-size=1", "--support-size: point has no support-size"),
        ("--segment-length=1", "--segment-length: point-samples has no segment-length"),
    ] {
        assert_eq!(effective(&[argument]).unwrap_err().to_string(), says);
    }
}

#[test]
fn numbers_are_set_by_option_and_nothing_else_changes() {
    let mut start = effective(&["--kernel=squared-exponential", "--max-range=30"]).unwrap();
    start.profile.capacities.tiles = 77;
    for (flag, value) in
        [("spacing", 0.3), ("kernel-shape", 0.7), ("prior-precision", 1e-3), ("free-spacing", 0.8), ("gap", 0.2)]
    {
        let option = MapOption::named(flag).unwrap();
        let changed = start.with(&[(option, value)]).unwrap();
        assert_eq!(changed.number(option), Ok(value));
        assert_ne!(start.number(option), Ok(value));
        assert_eq!(changed.with(&[(option, start.number(option).unwrap())]), Ok(start.clone()), "{flag}");
    }
    let gap = MapOption::named("gap").unwrap();
    assert_eq!(start.with(&[(gap, -1.0)]).unwrap_err().split(" is ").next(), Some("gap before a hit"));
    let shape = Effective::of(profile::INDOOR).number(MapOption::named("kernel-shape").unwrap());
    assert_eq!(shape, Err("cubic-b-spline has no kernel-shape".to_owned()));
}
