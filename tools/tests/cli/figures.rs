//! What the experiments leave behind, and that their numbers hang together.

use serde_json::Value;

use crate::support::{Bench, room};

fn is_png(bench: &Bench, name: &str) -> bool {
    bench.read(name).starts_with(b"\x89PNG")
}

fn row<'a>(outcome: &'a Value, spacing_m: f64, supports: &str) -> &'a Value {
    let mut rows = outcome["rows"].as_array().unwrap().iter();
    let found = rows.find(|row| row["spacing_m"] == spacing_m && row["supports"] == supports);
    found.unwrap_or_else(|| panic!("no {supports} at {spacing_m} m in {outcome}"))
}

#[test]
fn granularity_compares_supports_on_coarser_and_coarser_lattices() {
    let bench = Bench::new();
    let outcome = bench.json("experiment granularity --quick --scene traffic --every 90 --maps -o pictures");
    let nll = |spacing_m: f64, supports: &str| row(&outcome, spacing_m, supports)["nll"]["mean"].as_f64().unwrap();
    // A rectangle that one sample stands for is its middle: a point.
    let [sample, point] = ["rectangles, 1 x 1 samples", "points"].map(|supports| nll(15.0, supports));
    assert!((sample - point).abs() < 1e-6, "{sample} {point}");
    // Points 15 m apart see nothing of most places; areas do.
    assert!(nll(15.0, "rectangles, closed form") < point, "{outcome}");
    for supports in ["rectangles, 4 x 4 samples", "Gaussians, 0.29 spacings", "Gaussians, learned"] {
        assert!(nll(10.0, supports).is_finite(), "{outcome}");
    }
    for name in ["traffic.png", "traffic-samples.png", "traffic-map-points.png", "traffic-map-rectangles.png"] {
        assert!(is_png(&bench, &format!("pictures/granularity-{name}")), "{name}");
    }
    // Two seeds of six ways on two lattices, and of one sample on the coarse one.
    let csv = String::from_utf8(bench.read("pictures/granularity-traffic.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 * (6 * 2 + 1), "{csv}");
    assert!(csv.lines().all(|line| line.matches(',').count() >= 11));
}

#[test]
fn shapes_are_drawn_and_lie_along_the_walls_of_a_room() {
    let bench = Bench::new();
    bench.write("room.log", room());
    let report = bench.json("experiment shapes room.log -o pictures");
    for picture in report["pictures"].as_array().unwrap() {
        assert!(is_png(&bench, picture.as_str().unwrap()), "{picture}");
    }
    assert_eq!(report["pictures"].as_array().unwrap().len(), 3);
    assert_eq!((&report["spacing_m"], report["contestants"].as_array().unwrap().len()), (&Value::from(1.0), 3));
    let alignment = &report["alignment"];
    assert!(alignment["supports"].as_u64() > Some(8), "{alignment}");
    assert!(alignment["through"]["cos"].as_f64() > Some(0.9), "{alignment}");
    // Options have the last word.
    let finer = bench.json("experiment shapes room.log -o pictures --spacing 0.5");
    assert_eq!(finer["spacing_m"], 0.5);
}

#[test]
fn what_an_experiment_cannot_do_is_code_2_and_what_it_cannot_read_or_write_code_1() {
    let bench = Bench::new();
    bench.write("room.log", room());
    for (arguments, says) in [
        ("granularity", "--output <DIR>"),
        ("granularity -o p --scene building", "[possible values: outdoor, traffic]"),
        ("granularity -o p --seeds 0", "0 is not in 1..=100"),
        ("granularity -o p --every 0", "0 is not in 1.."),
        ("granularity -o p --free-spacing 0", "free spacing is 0, expected a positive number"),
        ("shapes room.log", "--output <DIR>"),
        ("shapes -o p", "<LOG>"),
        ("shapes room.log -o p --spacing=-1", "spacing is -1, expected 1 mm to 1 km"),
        ("shapes room.log -o p --kernel-shape 9", "--kernel-shape: cubic-b-spline has no kernel-shape"),
        ("shapes room.log -o p --kernel squared-exponential --kernel-shape 9", "a feature is still"),
    ] {
        bench.bhm(&format!("experiment {arguments}")).fails(2, &[says]);
    }
    assert!(!bench.path("p").exists());
    bench.bhm("experiment granularity -o room.log --quick").fails(1, &["cannot make the folder room.log"]);
    bench.bhm("experiment shapes none.log -o p").fails(1, &["cannot read none.log"]);
    assert!(bench.bhm("experiment shapes --print-config").stdout.contains("spacing_m = 1.0"));
}
