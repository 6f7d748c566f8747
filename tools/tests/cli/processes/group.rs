//! The parent of three processes: it notices deaths, and leaves nobody behind.

use std::fs;

use bhm_host::ipc::Domain;
use rustix::process::{Pid, Signal, kill_process};

use super::process::{Process, children, eventually, is_running};
use crate::support::Bench;

const ROLES: [&str; 3] = ["onboard", "watch", "simulate"];

/// A demo that is under way, and the ids of its children in the order of [`ROLES`].
fn under_way(bench: &Bench) -> (Process, [u32; 3]) {
    let demo = Process::start(bench, "demo -o out");
    let ids = eventually("three children", || {
        let children = children(demo.id());
        let id = |role: &str| children.iter().find(|(_, command)| command.contains(&format!(" {role} "))).map(|c| c.0);
        Some([id(ROLES[0])?, id(ROLES[1])?, id(ROLES[2])?])
    });
    (demo, ids)
}

fn all_end(ids: &[u32]) {
    eventually("the children's end", || ids.iter().all(|id| !is_running(*id)).then_some(()));
}

#[test]
fn a_process_that_dies_is_named_and_the_others_are_ended() {
    for (role, name) in ROLES.iter().enumerate() {
        let bench = Bench::new();
        let (demo, ids) = under_way(&bench);
        kill_process(Pid::from_raw(ids[role] as i32).unwrap(), Signal::KILL).unwrap();
        let ended = demo.ends();
        assert_eq!(ended.code, Some(1), "{}", ended.stderr);
        let says = format!("error: {name} (process {}) failed: signal: 9", ids[role]);
        assert!(ended.stderr.contains(&says), "{}", ended.stderr);
        all_end(&ids);
        assert!(!bench.path("out/report.md").exists());
    }
}

#[test]
fn a_parent_that_is_told_to_end_or_is_killed_takes_its_children_along() {
    for signal in [Signal::TERM, Signal::INT, Signal::KILL] {
        let bench = Bench::new();
        let (demo, ids) = under_way(&bench);
        let parent = demo.id();
        demo.signal(signal);
        let ended = demo.ends();
        if signal == Signal::KILL {
            assert_eq!(ended.code, None);
        } else {
            assert_eq!(ended.code, Some(1), "{}", ended.stderr);
            assert!(ended.stderr.contains("error: stopped before the end"), "{}", ended.stderr);
        }
        all_end(&ids);
        // Its domain goes with it, unless it had no time for that.
        let domain = Domain::named(&format!("t{parent}-0")).unwrap();
        assert_eq!(domain.root().exists(), signal == Signal::KILL);
        let _ = fs::remove_dir_all(domain.root());
        for entry in fs::read_dir("/dev/shm").unwrap().flatten() {
            if entry.file_name().to_string_lossy().starts_with(domain.prefix()) {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}
