use std::fs::File;

use bhm_host::ipc::TemporaryDomain;
use rustix::process::Signal;
use serde_json::Value;

use super::process::{Process, catches_sigterm, eventually, is_running};
use crate::support::{Bench, logs};

fn count(onboard: &Value, name: &str) -> u64 {
    onboard["counters"][name].as_u64().unwrap_or_else(|| panic!("no {name} in {onboard}"))
}

/// Every scan was sent once, received, learned and published.
#[track_caller]
fn nothing_was_lost(report: &Value, scans: u64) {
    let onboard = &report["onboard"];
    assert_eq!(report["source"]["scans"], scans);
    for (name, expected) in [
        ("received", scans),
        ("integrated", scans),
        ("published", scans + 1),
        ("sources", 1),
        ("sources_ended", 1),
        ("lost", 0),
        ("duplicates", 0),
        ("unreadable", 0),
        ("tiles_lost", 0),
        ("tiles_failed", 0),
        ("publish_failed", 0),
        ("receive_failed", 0),
        ("report_failed", 0),
    ] {
        assert_eq!(count(onboard, name), expected, "{name}: {report}");
    }
    let rejected = onboard["counters"].as_object().unwrap().iter().filter(|(name, _)| name.starts_with("rejected_"));
    assert!(rejected.clone().count() > 0 && rejected.clone().all(|(_, count)| count == 0), "{report}");
    let watch = &report["watch"];
    assert_eq!(watch["posteriors"].as_u64().unwrap() + watch["skipped"].as_u64().unwrap(), scans + 1, "{report}");
    assert_eq!((&watch["last"]["scans"], &watch["last"]["ended"]), (&Value::from(scans), &Value::from(true)));
    assert_eq!((&watch["unusable"], &report["posterior"]["equal"]), (&Value::from(0), &Value::from(true)), "{report}");
}

#[test]
fn a_demo_is_three_processes_and_leaves_pictures_a_map_and_a_report() {
    let bench = Bench::new();
    // An hour for each scan: what a deadline counts is known, however busy the machine.
    let report = bench.json("demo --scans 80 --profile compact --seed 3 --deadline-ms 3600000 -o out");
    nothing_was_lost(&report, 80);
    let onboard = &report["onboard"];
    assert_eq!((count(onboard, "deadlines_missed"), &onboard["deadline_ms"]), (0, &Value::from(3_600_000)));
    assert!(onboard["slowest_update_ms"].as_f64() > Some(0.0), "{onboard}");
    let ids = ["source", "onboard", "watch"].map(|role| report["processes"][role].as_u64().unwrap() as u32);
    assert!(ids[0] != ids[1] && ids[1] != ids[2] && ids[2] != ids[0], "{ids:?}");
    assert!(ids.iter().all(|id| *id != std::process::id() && !is_running(*id)), "{ids:?}");
    assert!(report["scores"]["auc"].as_f64() > Some(0.95), "{report}");

    for picture in ["out/probability.png", "out/deviation.png"] {
        let decoder = png::Decoder::new(std::io::BufReader::new(File::open(bench.path(picture)).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut pixels).unwrap();
        assert!(frame.width > 1_000 && frame.height > 500, "{picture}");
    }
    assert_eq!(bench.json("info out/map.bhm")["posterior"], report["posterior"]["saved"]);
    let written: Value = serde_json::from_slice(&bench.read("out/report.json")).unwrap();
    assert_eq!(written, report);
    let document = String::from_utf8(bench.read("out/report.md")).unwrap();
    assert!(
        document.contains("![Probability of occupancy](probability.png)") && document.contains("| received | 80 |")
    );

    // The options in effect, as a file, make the same map.
    let again = bench.json("demo --scans 80 --seed 3 --config out/options.toml -o again");
    assert_eq!(again["posterior"]["saved"], report["posterior"]["saved"]);
}

#[test]
fn a_replay_gives_the_map_that_is_built_offline_whatever_the_store_holds() {
    let bench = Bench::new();
    for log in logs(&bench) {
        let log = log.display().to_string();
        let built = bench.json(&format!("build {log} --profile compact -o built.bhm"));
        let (scans, tiles) = (built["learned"]["scans"].as_u64().unwrap(), built["tiles"].as_u64().unwrap());
        for slots in [tiles, tiles / 2] {
            let report = bench.json(&format!("replay {log} --profile compact --slots {slots} -o out"));
            nothing_was_lost(&report, scans);
            assert_eq!(report["posterior"]["saved"], built["posterior"], "{log}: {slots} slots");
            assert_eq!(bench.json("info out/map.bhm")["posterior"], built["posterior"], "{log}: {slots} slots");
            let onboard = &report["onboard"];
            assert_eq!(onboard["tiles_resident"], slots);
            assert_eq!(onboard["tiles_archived"], tiles - slots);
            if slots == tiles {
                assert_eq!(report["posterior"]["shared"], built["posterior"]);
            } else {
                assert!(count(onboard, "tiles_evicted") > 0 && count(onboard, "tiles_restored") > 0, "{log}");
            }
        }
    }
}

#[test]
fn a_consumer_asks_inside_shared_memory_what_the_saved_map_answers() {
    let bench = Bench::new();
    let domain = TemporaryDomain::new().unwrap();
    let onboard = Process::join(&bench, &domain, "onboard --profile compact --save map.bhm --until-end --consumers 2");
    let points = ["-16.5 0.0", "-20.0 3.0", "-13.0 -5.0", "100.0 100.0"];
    let queries = points.map(|point| format!("--query {point}")).join(" ");
    let watch =
        Process::join(&bench, &domain, &format!("watch --until-end {queries} --picture p.png --deviation d.png"));
    watch.reads(0);
    let once = Process::join(&bench, &domain, "watch --once").ends().well();
    assert_eq!(once["watched"]["posteriors"], 1);
    let source = Process::join(&bench, &domain, "simulate --scans 60");
    let mut newest = Value::Null;
    watch.says(|line| match &line["posterior"] {
        Value::Null => Some(()),
        posterior => {
            newest = posterior.clone();
            posterior["ended"].as_bool().filter(|ended| *ended).map(|_| ())
        }
    });
    for process in [source, watch, onboard] {
        process.ends().well();
    }
    for (point, probability) in points.iter().zip(newest["probabilities"].as_array().unwrap()) {
        let answer = bench.json(&format!("query map.bhm {point}"));
        assert_eq!(answer["probability"], *probability, "at {point}");
    }
    assert!(bench.read("p.png").starts_with(b"\x89PNG") && bench.read("d.png").starts_with(b"\x89PNG"));
}

#[test]
fn a_live_source_waits_for_nobody_and_every_gap_is_counted() {
    let bench = Bench::new();
    let domain = TemporaryDomain::new().unwrap();
    let onboard = Process::join(&bench, &domain, "onboard --profile compact --until-end --deadline-ms 1");
    let watch = Process::join(&bench, &domain, "watch --until-end");
    watch.reads(0);
    let sent = Process::join(&bench, &domain, "simulate --live --rate 1000 --scans 300").ends().well();
    assert_eq!((&sent["sent"]["scans"], &sent["sent"]["complete"]), (&Value::from(300), &Value::from(true)));
    let (watched, onboard) = (watch.ends().well(), onboard.ends().well());
    assert_eq!(watched["watched"]["last"]["scan_sequence"], 300, "the last scan is never overwritten");
    // What came before the first that was heard was not sent to this mapper.
    assert!(count(&onboard, "received") + count(&onboard, "lost") <= 300, "{onboard}");
    assert_eq!((count(&onboard, "integrated"), count(&onboard, "sources")), (count(&onboard, "received"), 1));
    // On no machine does the slowest of so many scans take less than the shortest deadline that can be stated.
    assert!(onboard["slowest_update_ms"].as_f64() > Some(1.0) && count(&onboard, "deadlines_missed") > 0, "{onboard}");
}

#[test]
fn sigterm_and_sigint_end_every_process_cleanly_and_the_map_is_saved() {
    let bench = Bench::new();
    for signal in [Signal::TERM, Signal::INT] {
        let domain = TemporaryDomain::new().unwrap();
        let onboard = Process::join(&bench, &domain, "onboard --profile compact --save map.bhm");
        let watch = Process::join(&bench, &domain, "watch");
        let source = Process::join(&bench, &domain, "simulate --rate 20");
        watch.reads(5);
        source.signal(signal);
        let sent = source.ends().well();
        assert_eq!(sent["sent"]["complete"], false);
        onboard.signal(signal);
        let onboarded = onboard.ends().well();
        assert_eq!(onboarded["source_ended"], false);
        assert_eq!(bench.json("info map.bhm")["posterior"], onboarded["posterior"]);
        watch.signal(signal);
        let watched = watch.ends().well();
        assert_eq!(watched["watched"]["posterior"], onboarded["posterior"], "what was learned last was published");
    }
    // One that waits for somebody is ended as well.
    let domain = TemporaryDomain::new().unwrap();
    for arguments in ["watch", "simulate"] {
        let waiting = Process::join(&bench, &domain, arguments);
        eventually("its handler of signals", || catches_sigterm(waiting.id()).then_some(()));
        waiting.signal(Signal::TERM);
        waiting.ends().well();
    }
}
