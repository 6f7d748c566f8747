//! Every kind of bad input is a clear error or a counted rejection.

use crate::support::{Bench, gzip, line, room, scan};

#[test]
fn files_that_are_no_logs_are_named_with_what_was_expected() {
    let bench = Bench::new();
    bench.write("empty.log", "");
    bench.write("half.log", &scan(0.0, "1")[..400]);
    bench.write("points.csv", "scan,x,y,label\n1,0,0,1\n");
    bench.write("binary.log", b"\0\x01\x02");
    bench.write("head.log.gz", &gzip(room().as_bytes())[..15]);
    for (file, says) in [
        ("empty.log", "empty.log: expected a CARMEN log, found an empty file"),
        ("half.log", "half.log: expected a CARMEN log with at least one usable"),
        ("half.log", "1 damaged, the first: line 1: ends before the field range"),
        ("points.csv", "found comma-separated values beginning with `scan,x,y,label`"),
        ("binary.log", "binary.log: expected a CARMEN log, found binary data"),
        ("head.log.gz", "cannot read head.log.gz: "),
        ("absent.log", "cannot read absent.log: No such file"),
        (".", "cannot read .: Is a directory"),
    ] {
        bench.bhm(&format!("build {file} -o out.bhm")).fails(1, &[says]);
        bench.bhm(&format!("evaluate {file}")).fails(1, &[says]);
    }
    assert!(!bench.path("out.bhm").exists());
    bench.write("room.log", room());
    bench.bhm("evaluate --train room.log --test points.csv").fails(1, &["room.log: expected labelled points"]);
    bench.bhm("build room.log -o no/such/folder.bhm").fails(1, &["cannot write no/such/folder.bhm: No such file"]);
}

#[test]
fn damaged_lines_are_skipped_named_and_counted() {
    let bench = Bench::new();
    let many: Vec<String> = (0..5_000).map(|_| "1.0".to_owned()).collect();
    bench.write(
        "mixed.log",
        room() + &line(&many, 0.0, "200") + "FLASER two 1 2\n" + &scan(0.0, "x") + &scan(0.0, "300")[..90],
    );
    let run = bench.bhm("build mixed.log -o out.bhm");
    run.succeeds(&[
        "mixed.log: line 21: field num_readings: expected 1 to 2048, found `5000`; skipped",
        "line 22: field num_readings: expected 1 to 2048, found `two`",
        "line 23: field ipc_timestamp: expected a number, found `x`",
        "line 24: ends before the field range",
        "4 damaged lines skipped",
        "20 scans in 24 lines",
    ]);
    let packed = gzip(room().as_bytes());
    bench.write("cut.log.gz", &packed[..packed.len() * 3 / 4]);
    bench.bhm("build cut.log.gz -o out.bhm").succeeds(&["the file cannot be read on from here"]);
    bench.write("only.log", line(&many, 0.0, "1"));
    bench.bhm("build only.log -o out.bhm").fails(1, &["expected 1 to 2048, found `5000`"]);
}

#[test]
fn ranges_that_are_none_are_dropped_and_counted() {
    let bench = Bench::new();
    let strange = ["nan", "NaN", "inf", "-inf", "-1", "0", "1e30", "2.0"].map(str::to_owned);
    bench.write("strange.log", room() + &line(&strange, 0.0, "200"));
    let built = bench.json("build strange.log -o out.bhm --max-range 50");
    let learned = &built["learned"];
    assert_eq!(learned["beams_not_a_number"], 2, "{learned}");
    assert_eq!(learned["beams_negative"], 2);
    assert_eq!(learned["beams_too_near"], 1);
    assert_eq!(learned["beams_no_return"], 2);
    bench
        .bhm("build strange.log -o out.bhm --max-range 50")
        .succeeds(&["2 beams dropped: not a number", "2 beams dropped: negative"]);
}

#[test]
fn scans_that_cannot_be_placed_are_rejected_and_counted() {
    let bench = Bench::new();
    bench.write("far.log", room() + &scan(0.0, "200").replace(" 0 0 0 0 0 0 200", " 1e9 0 0 0 0 0 200"));
    let run = bench.bhm("build far.log -o out.bhm --json");
    run.succeeds(&["scan 21 rejected: the pose (1000000000 m, 0 m) is too far", "1 scans rejected"]);
    bench.write("nowhere.log", scan(0.0, "200").replace(" 0 0 0 0 0 0 200", " 1e9 0 0 0 0 0 200"));
    bench.bhm("build nowhere.log -o none.bhm").fails(1, &["nowhere.log: not one scan could be learned from"]);
}

#[test]
fn stamps_that_go_back_are_repaired_and_counted() {
    let bench = Bench::new();
    bench.write("back.log", scan(0.0, "10") + &scan(0.1, "9") + &scan(0.2, "nan") + &scan(0.3, "11"));
    bench.bhm("build back.log -o out.bhm").succeeds(&["back.log: 2 stamps were unusable or not later"]);
    assert_eq!(bench.json("info out.bhm")["newest_stamp_ns"], 11_000_000_000_u64);
}

#[test]
fn damaged_map_files_are_refused_by_every_command() {
    let bench = Bench::new();
    bench.write("room.log", room());
    bench.bhm("build room.log -o room.bhm --profile compact").succeeds(&[]);
    let whole = bench.read("room.bhm");
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 4;
    // The version is looked at first: what another one seals, and how, is its own affair.
    let [older, newer] = [2, 9].map(|version| {
        let mut bytes = whole.clone();
        bytes[8] = version;
        bytes
    });
    bench.write("cut.bhm", &whole[..whole.len() / 2]);
    bench.write("flipped.bhm", flipped);
    bench.write("older.bhm", older);
    bench.write("newer.bhm", newer);
    bench.write("empty.bhm", "");
    for (file, says) in [
        ("cut.bhm", format!("cut.bhm: cut short at byte {} of {}", whole.len() / 2, whole.len())),
        ("flipped.bhm", "flipped.bhm: damaged: checksum".to_owned()),
        ("older.bhm", "older.bhm: format version 2, only 3 is understood".to_owned()),
        ("newer.bhm", "newer.bhm: format version 9, only 3 is understood".to_owned()),
        ("empty.bhm", "empty.bhm: expected a map file, found an empty file".to_owned()),
        ("room.log", "room.log: expected a map file, found text beginning with `FLASER 180".to_owned()),
        ("absent.bhm", "cannot read absent.bhm: No such file".to_owned()),
        (".", "cannot read .: Is a directory".to_owned()),
    ] {
        for command in [format!("info {file}"), format!("query {file} 0 0"), format!("render {file} -o out.png")] {
            bench.bhm(&command).fails(1, &[&says]);
        }
    }
    assert!(!bench.path("out.png").exists());
}
