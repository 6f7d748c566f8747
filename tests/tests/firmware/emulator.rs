//! A Cortex-M7 in QEMU with the firmware in it, and the host's end of its serial line.

use std::{
    env,
    io::{ErrorKind, Read, Write},
    os::unix::net::UnixStream,
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    thread,
    time::{Duration, Instant},
};

use bhm_core::profile::Profile;
use bhm_firmware_sim::serial::{Device, DeviceStatus, Event, HostEnd};
use bhm_host::{
    ScanRecord,
    ipc::{NumberedScan, Place, ScanAddress},
};

pub(crate) const M: usize = 144;
pub(crate) const B: usize = 40;

/// Under emulation on a busy machine; only a device that hangs takes so long.
const PATIENCE: Duration = Duration::from_secs(120);

/// Nanoseconds of one instruction: QEMU is told to take 2⁷.
const INSTRUCTION_NS: u64 = 128;

/// One device.
pub(crate) struct Emulator {
    qemu: Child,
    line: UnixStream,
    pub(crate) end: HostEnd<M, B>,
    /// Bytes that came and were not looked at.
    came: Vec<u8>,
    folder: tempfile::TempDir,
    source: u64,
    sequence: u64,
}

/// The program of that name, if the firmware was built; in CI it must have been.
pub(crate) fn program(name: &str) -> Option<PathBuf> {
    let folder = env::var_os("BHM_FIRMWARE").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware-sim/cortex-m7/target/thumbv7em-none-eabihf/release"),
        PathBuf::from,
    );
    let path = folder.join(name);
    let missing = if !path.is_file() {
        format!("{} is absent: firmware-sim/cortex-m7/run build", path.display())
    } else if Command::new("qemu-system-arm").arg("--version").stdout(Stdio::null()).status().is_err() {
        String::from("QEMU is absent: apt-get install qemu-system-arm")
    } else {
        return Some(path);
    };
    assert!(env::var_os("CI").is_none(), "{missing}");
    eprintln!("skipped: {missing}");
    None
}

impl Emulator {
    /// Starts the program; it waits for the first byte.
    pub(crate) fn start(program: &Path, profile: &Profile) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let socket = folder.path().join("line");
        let mut qemu = Command::new("qemu-system-arm");
        qemu.args(["-M", "mps2-an500", "-display", "none", "-monitor", "none"])
            .arg("-serial")
            .arg(format!("unix:{},server=on,wait=on", socket.display()))
            .arg("-serial")
            .arg(format!("file:{}", folder.path().join("log").display()))
            .args(["-semihosting-config", "enable=on,target=native", "-icount", "shift=7,sleep=off", "-kernel"])
            .arg(program)
            .stdin(Stdio::null());
        let qemu = qemu.spawn().expect("QEMU starts");
        let begun = Instant::now();
        let line = loop {
            match UnixStream::connect(&socket) {
                Ok(line) => break line,
                Err(_) if begun.elapsed() < PATIENCE => thread::sleep(Duration::from_millis(20)),
                Err(cause) => panic!("QEMU does not listen: {cause}"),
            }
        };
        line.set_read_timeout(Some(Duration::from_millis(100))).expect("a time-out");
        let end = HostEnd::new(profile);
        Self { qemu, line, end, came: Vec::new(), folder, source: 7, sequence: 0 }
    }

    /// Sends bytes as they are.
    pub(crate) fn send(&mut self, bytes: &[u8]) {
        self.line.write_all(bytes).expect("the device listens");
    }

    /// Says hello and waits for who answers.
    pub(crate) fn greet(&mut self) -> Device {
        let hello = self.end.hello(4711).to_vec();
        self.send(&hello);
        self.wait(|event| match event {
            Event::Hello { device, .. } => Some(device),
            Event::Refused(why) => panic!("{why}"),
            _ => None,
        })
    }

    /// Says hello to a device that will be refused, and answers why.
    pub(crate) fn refusal(&mut self) -> String {
        let hello = self.end.hello(4711).to_vec();
        self.send(&hello);
        self.wait(|event| match event {
            Event::Refused(why) => Some(why.to_string()),
            _ => None,
        })
    }

    /// Sends a scan and waits until the device has dealt with it.
    pub(crate) fn learn(&mut self, scan: &ScanRecord) -> DeviceStatus {
        self.send_scan(scan);
        self.learned()
    }

    /// Sends a scan.
    pub(crate) fn send_scan(&mut self, scan: &ScanRecord) {
        self.sequence += 1;
        let address = ScanAddress { source: self.source, mapper: None, sequence: self.sequence, place: Place::Within };
        let bytes = self.end.scan(&NumberedScan { address, scan: scan.as_scan() }).expect("fits").expect("greeted");
        let bytes = bytes.to_vec();
        self.send(&bytes);
    }

    /// Waits until the device has dealt with the newest scan.
    pub(crate) fn learned(&mut self) -> DeviceStatus {
        let handled = Some((self.source, self.sequence));
        self.wait(|event| match event {
            Event::Status(status) if status.handled == handled => Some(status),
            _ => None,
        })
    }

    /// Waits until the posterior after the newest scan is here.
    pub(crate) fn settle(&mut self) {
        let refresh = self.end.refresh(&[]).to_vec();
        self.send(&refresh);
        let newest = self.sequence;
        self.wait(|event| match event {
            Event::Posterior(directory) => (directory.behind == 0 && directory.news.scans == newest).then_some(()),
            _ => None,
        });
    }

    /// Tells the device that it was all, and waits for its end.
    pub(crate) fn finish(mut self) -> (ExitStatus, Vec<u8>) {
        let finish = self.end.finish().expect("greeted").to_vec();
        self.send(&finish);
        self.ended()
    }

    /// Waits for the device's end: how it ended, and its log as it came.
    pub(crate) fn ended(mut self) -> (ExitStatus, Vec<u8>) {
        let begun = Instant::now();
        loop {
            // It must not be held up by a line that nobody reads.
            self.read();
            if let Some(status) = self.qemu.try_wait().expect("a child") {
                return (status, std::fs::read(self.folder.path().join("log")).expect("a log"));
            }
            assert!(begun.elapsed() < PATIENCE, "the device does not end");
        }
    }

    fn read(&mut self) {
        let mut buffer = [0; 65_536];
        match self.line.read(&mut buffer) {
            Ok(0) => thread::sleep(Duration::from_millis(20)),
            Ok(length) => self.came.extend_from_slice(&buffer[..length]),
            Err(cause) if matches!(cause.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(cause) if cause.kind() == ErrorKind::ConnectionReset => {}
            Err(cause) => panic!("the line broke: {cause}"),
        }
    }

    fn wait<T>(&mut self, mut wanted: impl FnMut(Event) -> Option<T>) -> T {
        let begun = Instant::now();
        loop {
            let came = std::mem::take(&mut self.came);
            let mut rest = &came[..];
            while let Some(event) = self.end.take(&mut rest) {
                if let Some(found) = wanted(event) {
                    self.came = rest.to_vec();
                    return found;
                }
            }
            self.read();
            assert!(begun.elapsed() < PATIENCE, "the device does not answer; {:?}", self.end.counters());
            if let Some(status) = self.qemu.try_wait().expect("a child") {
                let log = std::fs::read(self.folder.path().join("log")).unwrap_or_default();
                panic!("the device ended, {status}; its log: {}", String::from_utf8_lossy(&log));
            }
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = self.qemu.kill();
        let _ = self.qemu.wait();
    }
}

/// The instructions of the device's last update.
pub(crate) fn instructions(status: &DeviceStatus) -> u64 {
    (status.last_update_ns + INSTRUCTION_NS / 2) / INSTRUCTION_NS
}

/// A counter of the device's loop.
pub(crate) fn counter(status: &DeviceStatus, name: &str) -> u64 {
    status.counters.iter().find(|(known, _)| known == name).unwrap_or_else(|| panic!("a counter {name}")).1
}
