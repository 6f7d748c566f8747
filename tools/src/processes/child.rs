use std::{
    collections::VecDeque,
    env,
    io::{BufRead, BufReader, Read},
    os::unix::process::CommandExt,
    process::{self, Command, ExitStatus, Stdio},
    sync::mpsc::{self, Receiver},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use anyhow::{Context, bail};
use rustix::process::{Pid, Signal, kill_process};
use serde::de::DeserializeOwned;

/// How long a process that was told to end may take before it is killed.
const GRACE: Duration = Duration::from_secs(5);

const NAP: Duration = Duration::from_millis(10);

/// Lines of a process's log that an error quotes.
const TAIL: usize = 12;

/// Another process, mostly of this binary; it is ended when this is dropped, and ends when this process does.
pub(super) struct Child {
    role: &'static str,
    process: process::Child,
    status: Option<ExitStatus>,
    printed: Receiver<String>,
    logged: Receiver<String>,
    tail: VecDeque<String>,
    readers: Vec<JoinHandle<()>>,
}

impl Child {
    /// Starts `bhm ROLE ARGUMENTS --json` in a domain.
    ///
    /// Call it on a thread that lives as long as the process: the child ends with it.
    ///
    /// # Errors
    /// If the operating system refuses.
    pub(super) fn start(role: &'static str, domain: &str, arguments: &[String]) -> anyhow::Result<Self> {
        let mut command = Command::new(env::current_exe().context("cannot find this program's own file")?);
        // Options reach it as arguments only: what the environment says has been taken into account.
        for (name, _) in env::vars_os().filter(|(name, _)| name.to_string_lossy().starts_with("BHM_")) {
            command.env_remove(name);
        }
        command
            .args([role, "--json", "--quiet", "--domain", domain, "--parent", &process::id().to_string()])
            .args(arguments);
        Self::spawn(role, command)
    }

    /// Starts another program in a role.
    ///
    /// # Errors
    /// If the operating system refuses.
    pub(super) fn spawn(role: &'static str, mut command: Command) -> anyhow::Result<Self> {
        command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // Ctrl-C reaches the parent only, which then ends its children in its own way.
            .process_group(0);
        let mut process = command.spawn().with_context(|| format!("cannot start {role}"))?;
        let (printed, stdout) = lines(process.stdout.take());
        let (logged, stderr) = lines(process.stderr.take());
        let readers = vec![stdout, stderr];
        Ok(Self { role, process, status: None, printed, logged, tail: VecDeque::new(), readers })
    }

    pub(super) fn role(&self) -> &'static str {
        self.role
    }

    pub(super) fn id(&self) -> u32 {
        self.process.id()
    }

    /// What it printed since the last call, on standard output.
    ///
    /// # Errors
    /// If that is not what was expected.
    pub(super) fn printed<T: DeserializeOwned>(&self) -> anyhow::Result<Vec<T>> {
        let parse = |line: String| {
            serde_json::from_str(&line).with_context(|| format!("{} printed what is not understood: {line}", self.role))
        };
        self.printed.try_iter().map(parse).collect()
    }

    /// What it logged since the last call, on standard error.
    pub(super) fn logged(&mut self) -> Vec<String> {
        let lines: Vec<_> = self.logged.try_iter().collect();
        self.tail.extend(lines.iter().cloned());
        self.tail.drain(..self.tail.len().saturating_sub(TAIL));
        lines
    }

    /// Whether it has ended, and all it printed is there to be read.
    ///
    /// # Errors
    /// If it failed; with the end of its log.
    pub(super) fn has_ended(&mut self) -> anyhow::Result<bool> {
        if self.status.is_none() {
            self.status = self.process.try_wait()?;
        }
        let Some(status) = self.status else { return Ok(false) };
        for reader in self.readers.drain(..) {
            // It ends with the process's pipes.
            let _ = reader.join();
        }
        if !status.success() {
            self.logged();
            let log: Vec<_> = self.tail.iter().map(|line| format!("\n  {line}")).collect();
            bail!("{} (process {}) failed: {status}{}", self.role, self.id(), log.concat());
        }
        Ok(true)
    }

    /// Ends it, if it has not ended: it is asked to, and killed if it does not.
    fn end(&mut self) {
        let Some(pid) = i32::try_from(self.id()).ok().and_then(Pid::from_raw) else { return };
        let mut running = || self.status.is_none() && matches!(self.process.try_wait(), Ok(None));
        // Until it is waited for, its id is nobody else's.
        if running() {
            let _ = kill_process(pid, Signal::TERM);
        }
        let asked = Instant::now();
        while running() && asked.elapsed() < GRACE {
            thread::sleep(NAP);
        }
        if running() {
            let _ = self.process.kill();
            let _ = self.process.wait();
        }
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        self.end();
    }
}

/// The lines that come out of a pipe, which is read to its end so that the writer never waits.
fn lines(pipe: Option<impl Read + Send + 'static>) -> (Receiver<String>, JoinHandle<()>) {
    let (sender, receiver) = mpsc::channel();
    let reader = thread::spawn(move || {
        for line in pipe.into_iter().flat_map(|pipe| BufReader::new(pipe).lines()).map_while(Result::ok) {
            let _ = sender.send(line);
        }
    });
    (receiver, reader)
}
