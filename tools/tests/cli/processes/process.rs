use std::{
    fs,
    io::{BufRead, BufReader, Read},
    process::{Child, Command, Stdio},
    sync::mpsc::{self, Receiver},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use bhm_host::ipc::TemporaryDomain;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::support::Bench;

/// For a machine that is busy with something else. No test passes or fails by it, unless something hangs.
const LONG: Duration = Duration::from_secs(240);

/// A process of the binary; killed by its id if a test leaves it behind.
pub(crate) struct Process {
    child: Child,
    printed: Receiver<Value>,
    log: Option<JoinHandle<String>>,
}

/// How a process ended.
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    /// What it printed last.
    pub(crate) last: Value,
    pub(crate) stderr: String,
}

impl Process {
    /// Starts `bhm ARGUMENTS --json`, the arguments separated by blanks, in a bench's folder.
    pub(crate) fn start(bench: &Bench, arguments: &str) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bhm"));
        for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("BHM_") || name == "RUST_LOG") {
            command.env_remove(name);
        }
        command.current_dir(bench.path("")).args(arguments.split_whitespace()).arg("--json");
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let (sender, printed) = mpsc::channel();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                // A line that is cut is from a process that was killed.
                if let Ok(value) = serde_json::from_str(&line) {
                    let _ = sender.send(value);
                }
            }
        });
        let mut stderr = child.stderr.take().unwrap();
        let log = thread::spawn(move || {
            let mut text = Vec::new();
            stderr.read_to_end(&mut text).unwrap();
            String::from_utf8_lossy(&text).into_owned()
        });
        Self { child, printed, log: Some(log) }
    }

    /// Starts it in a domain.
    pub(crate) fn join(bench: &Bench, domain: &TemporaryDomain, arguments: &str) -> Self {
        Self::start(bench, &format!("{arguments} --domain {}", domain.name()))
    }

    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    pub(crate) fn signal(&self, signal: Signal) {
        kill_process(Pid::from_raw(self.id() as i32).unwrap(), signal).unwrap();
    }

    /// `kill -9`.
    pub(crate) fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// The next line of which `pick` makes something.
    #[track_caller]
    pub(crate) fn says<T>(&self, mut pick: impl FnMut(&Value) -> Option<T>) -> T {
        let deadline = Instant::now() + LONG;
        loop {
            match self.printed.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(line) => {
                    if let Some(picked) = pick(&line) {
                        return picked;
                    }
                }
                Err(gone) => panic!("process {} did not say it: {gone}", self.id()),
            }
        }
    }

    /// The next line, if it comes within so long.
    pub(crate) fn says_within(&self, patience: Duration) -> Option<Value> {
        self.printed.recv_timeout(patience).ok()
    }

    /// Waits for a consumer to read a posterior of so many scans or more.
    #[track_caller]
    pub(crate) fn reads(&self, scans: u64) {
        self.says(|line| (line["posterior"]["scans"].as_u64()? >= scans).then_some(()));
    }

    /// Waits for its end.
    #[track_caller]
    pub(crate) fn ends(mut self) -> Ended {
        let status = eventually("its end", || self.child.try_wait().unwrap());
        let stderr = self.log.take().unwrap().join().unwrap();
        // The pipe's reader hangs up at its end.
        let last = self.printed.iter().last().unwrap_or_default();
        Ended { code: status.code(), last, stderr }
    }
}

impl Ended {
    /// It succeeded; what it printed last.
    #[track_caller]
    pub(crate) fn well(self) -> Value {
        assert_eq!(self.code, Some(0), "{}", self.stderr);
        self.last
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Waits for what another process is about to do.
#[track_caller]
pub(crate) fn eventually<T>(what: &str, mut attempt: impl FnMut() -> Option<T>) -> T {
    let deadline = Instant::now() + LONG;
    loop {
        if let Some(done) = attempt() {
            return done;
        }
        assert!(Instant::now() < deadline, "waited in vain for {what}");
        thread::sleep(Duration::from_millis(5));
    }
}

/// Whether a process is there, and not only its entry in its parent's list.
pub(crate) fn is_running(id: u32) -> bool {
    let stat = fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    stat_field(&stat, 0).is_some_and(|state| state != "Z" && state != "X")
}

/// Whether a process has a handler for SIGTERM; without one, the signal ends it at once.
pub(crate) fn catches_sigterm(id: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigCgt:")?.trim(), 16).ok());
    caught.is_some_and(|signals| signals >> (Signal::TERM.as_raw() - 1) & 1 == 1)
}

/// Ids and command lines of a process's children.
pub(crate) fn children(parent: u32) -> Vec<(u32, String)> {
    let processes = fs::read_dir("/proc").unwrap().flatten();
    let ids = processes.filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    ids.filter_map(|id| {
        let stat = fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
        let command = fs::read_to_string(format!("/proc/{id}/cmdline")).ok()?.replace('\0', " ");
        (stat_field(&stat, 1)?.parse() == Ok(parent)).then_some((id, command))
    })
    .collect()
}

/// A field after the process's name, which may hold anything.
fn stat_field(stat: &str, index: usize) -> Option<&str> {
    stat.rsplit_once(')')?.1.split_whitespace().nth(index)
}
