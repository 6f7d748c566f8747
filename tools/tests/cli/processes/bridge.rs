//! `bhm bridge` with a device in this process: the onboard loop over its serial link, at the other end of a socket.

use std::{
    io::{ErrorKind, Read, Write},
    os::unix::net::{UnixListener, UnixStream},
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

use bhm_core::{
    mapper::{IntegrateReport, Mapper},
    profile::{self, Profile},
    scan::{Scan, ScanRejected},
};
use bhm_firmware_sim::{
    Onboard, OnboardMap, Options, Step,
    serial::{
        LinkBuffers, Port, SentTile, SerialLink,
        embedded_io::{self, ErrorType, ReadReady},
    },
};
use bhm_host::{
    dataset::{self, ReadOptions},
    ipc::TemporaryDomain,
    map::{self, OwnedMapper, posterior_digest},
    sim::Scene,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::process::Signal;
use serde_json::Value;

use super::process::{Process, eventually};
use crate::support::{Bench, logs};

const SCANS: u64 = 60;

/// The device's end of a socket, on a line that damages one frame in so many in either direction.
struct Socket {
    stream: UnixStream,
    came: Vec<u8>,
    read: usize,
    gone: Arc<AtomicBool>,
    one_in: Option<u32>,
    rng: ChaCha8Rng,
}

impl Socket {
    fn damage(&mut self, bytes: &mut [u8]) {
        if let Some(one_in) = self.one_in
            && self.rng.random_ratio(1, one_in)
            && !bytes.is_empty()
        {
            let at = self.rng.random_range(0..bytes.len());
            bytes[at] ^= 0x10;
        }
    }
}

impl ErrorType for Socket {
    type Error = std::io::Error;
}

impl ReadReady for Socket {
    fn read_ready(&mut self) -> Result<bool, Self::Error> {
        if self.read == self.came.len() {
            let mut buffer = [0; 4_096];
            let length = match self.stream.read(&mut buffer) {
                Ok(0) => {
                    self.gone.store(true, Ordering::Relaxed);
                    0
                }
                Ok(length) => length,
                Err(error) if error.kind() == ErrorKind::WouldBlock || error.kind() == ErrorKind::TimedOut => 0,
                Err(_) => {
                    self.gone.store(true, Ordering::Relaxed);
                    0
                }
            };
            self.damage(&mut buffer[..length]);
            self.came = buffer[..length].to_vec();
            self.read = 0;
        }
        Ok(self.read < self.came.len())
    }
}

impl embedded_io::Read for Socket {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Self::Error> {
        let length = Read::read(&mut &self.came[self.read..], into)?;
        self.read += length;
        Ok(length)
    }
}

impl embedded_io::Write for Socket {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        let length = bytes.len();
        let mut bytes = bytes.to_vec();
        self.damage(&mut bytes);
        let written = self.stream.write_all(&bytes);
        if written.is_err() {
            self.gone.store(true, Ordering::Relaxed);
        }
        written.map(|()| length)
    }

    fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}

impl Port for Socket {
    fn overruns(&self) -> u32 {
        0
    }

    fn idle(&mut self) {}
}

struct Map(OwnedMapper<144, 40>, Arc<AtomicU64>);

impl OnboardMap<144, 40> for Map {
    fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected> {
        self.1.fetch_add(1, Ordering::Relaxed);
        self.0.integrate(scan)
    }

    fn mapper(&self) -> &Mapper<'_, 2, 144, 40> {
        self.0.mapper()
    }

    fn archived(&self) -> usize {
        self.0.archive().len()
    }
}

/// A device that listens on a socket.
struct Device {
    thread: JoinHandle<Option<String>>,
    off: Arc<AtomicBool>,
    scans: Arc<AtomicU64>,
}

/// Switches a device on. Its map is shown by its digest when it was told to end, and gone if it is switched off.
fn device(path: PathBuf, profile: Profile, one_in: Option<u32>) -> Device {
    let _ = std::fs::remove_file(&path);
    let listener = UnixListener::bind(path).unwrap();
    let (off, scans) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
    let (switch, learned) = (Arc::clone(&off), Arc::clone(&scans));
    let run = move || {
        let (stream, _) = listener.accept().unwrap();
        stream.set_read_timeout(Some(Duration::from_millis(1))).unwrap();
        let gone = Arc::new(AtomicBool::new(false));
        let rng = ChaCha8Rng::seed_from_u64(1);
        let socket = Socket { stream, came: Vec::new(), read: 0, gone: Arc::clone(&gone), one_in, rng };
        let mut buffers = Box::new(LinkBuffers::NEW);
        let mut sent = vec![SentTile::NONE; profile.capacities.tiles];
        let link = SerialLink::new(socket, &profile, &mut buffers, &mut sent, None);
        let map = Map(OwnedMapper::new(&profile).unwrap(), learned);
        let mut onboard = Onboard::new(map, link, Options::default());
        onboard.start();
        while !switch.load(Ordering::Relaxed) && !gone.load(Ordering::Relaxed) {
            if let Step::End(_) = onboard.step() {
                let tiles = onboard.map().mapper().tiles().iter();
                return Some(posterior_digest(tiles.map(|tile| (tile.index, tile.posterior.view()))).to_string());
            }
        }
        None
    };
    // As deep as the loop needs it.
    let thread = thread::Builder::new().stack_size(4 << 20).spawn(run).unwrap();
    Device { thread, off, scans }
}

impl Device {
    fn switch_off(self) {
        self.off.store(true, Ordering::Relaxed);
        assert_eq!(self.thread.join().unwrap(), None);
    }

    /// The digest of what it has, once it was told to end.
    fn ends(self) -> String {
        self.thread.join().unwrap().expect("told to end")
    }
}

fn count(bridge: &Value, name: &str) -> u64 {
    bridge["counters"][name].as_u64().unwrap_or_else(|| panic!("no {name} in {bridge}"))
}

/// The digest of these tiles of the map that this computer makes of the scans.
fn offline(scans: u64) -> String {
    let mut map = map::open(&profile::COMPACT).unwrap();
    for scan in Scene::named("building").unwrap().simulate(1).take(scans as usize) {
        map.integrate(&scan.as_scan()).unwrap();
    }
    assert_eq!(map.tile_counts().1, 0, "none is in the archive");
    map.digest().to_string()
}

#[test]
fn a_device_behind_a_bridge_is_the_onboard_process_to_everybody() {
    let (bench, domain) = (Bench::new(), TemporaryDomain::new().unwrap());
    let device = device(bench.path("line"), profile::COMPACT, None);
    let bridge = Process::join(&bench, &domain, "bridge --port unix:line --until-end --consumers 2");
    let watch = Process::join(&bench, &domain, "watch --until-end");
    watch.reads(0);
    // One place in a domain, one mapper.
    let second = Process::join(&bench, &domain, "onboard --profile compact").ends();
    assert!(second.stderr.contains("another mapper is already running in this domain"), "{}", second.stderr);
    let sent = Process::join(&bench, &domain, &format!("simulate --scans {SCANS}")).ends().well();
    assert_eq!(sent["sent"]["complete"], true);
    let (bridged, watched, learned) = (bridge.ends().well(), watch.ends().well(), device.ends());
    assert_eq!(learned, offline(SCANS));
    assert_eq!((&bridged["posterior"], &watched["watched"]["posterior"]), (&learned.clone().into(), &learned.into()));
    assert_eq!((&bridged["source_ended"], &bridged["map"]), (&Value::from(true), &Value::Null));
    for (name, expected) in [
        ("received", SCANS),
        ("integrated", SCANS),
        ("lost", 0),
        ("duplicates", 0),
        ("bridge_scans_taken", SCANS),
        ("bridge_scans_sent_again", 0),
        ("bridge_posteriors", SCANS + 1),
        ("bridge_device_restarts", 0),
        ("device_frames_bad_crc", 0),
        ("host_frames_bad_crc", 0),
        ("bridge_faults", 0),
    ] {
        assert_eq!(count(&bridged, name), expected, "{name}: {bridged}");
    }
    let last = &watched["watched"]["last"];
    assert_eq!((&last["scans"], &last["ended"]), (&Value::from(SCANS), &Value::from(true)));
}

#[test]
fn a_whole_log_through_the_line_is_the_map_made_on_this_computer() {
    let bench = Bench::new();
    for log in logs(&bench) {
        let domain = TemporaryDomain::new().unwrap();
        let device = device(bench.path("line"), profile::COMPACT, None);
        let bridge = Process::join(&bench, &domain, "bridge --port unix:line --until-end");
        let watch = Process::join(&bench, &domain, "watch --until-end");
        watch.reads(0);
        Process::join(&bench, &domain, &format!("play {}", log.display())).ends().well();
        let (bridged, watched, learned) = (bridge.ends().well(), watch.ends().well(), device.ends());
        // The same tiles stay in a store of as many slots.
        let mut map = OwnedMapper::<144, 40>::new(&profile::COMPACT).unwrap();
        for scan in dataset::read_log(&log, &ReadOptions::default()).unwrap().scans {
            map.integrate(&scan.as_scan()).unwrap();
        }
        let tiles = map.mapper().tiles().iter();
        let resident = posterior_digest(tiles.map(|tile| (tile.index, tile.posterior.view()))).to_string();
        assert_eq!(learned, resident, "{}", log.display());
        let shown = (&bridged["posterior"], &watched["watched"]["posterior"]);
        assert_eq!(shown, (&learned.clone().into(), &learned.into()), "{}", log.display());
        assert_eq!(count(&bridged, "integrated"), map.mapper().scans());
        assert!(count(&bridged, "tiles_evicted") > 0 && count(&bridged, "tiles_restored") > 0, "{bridged}");
    }
}

#[test]
fn a_bad_line_costs_time_and_nothing_else() {
    let (bench, domain) = (Bench::new(), TemporaryDomain::new().unwrap());
    let device = device(bench.path("line"), profile::COMPACT, Some(40));
    let bridge = Process::join(&bench, &domain, "bridge --port unix:line --until-end --send-again 1");
    let watch = Process::join(&bench, &domain, "watch --until-end");
    watch.reads(0);
    Process::join(&bench, &domain, "simulate --scans 20").ends().well();
    let (bridged, watched, learned) = (bridge.ends().well(), watch.ends().well(), device.ends());
    assert_eq!(learned, offline(20));
    assert_eq!((&bridged["posterior"], &watched["watched"]["posterior"]), (&learned.clone().into(), &learned.into()));
    assert_eq!((count(&bridged, "integrated"), count(&bridged, "lost")), (20, 0));
    assert!(count(&bridged, "host_frames_bad_crc") > 5 && count(&bridged, "bridge_refreshes") > 0, "{bridged}");
}

#[test]
fn a_device_that_starts_again_is_a_new_mapper() {
    let (bench, domain) = (Bench::new(), TemporaryDomain::new().unwrap());
    let first = device(bench.path("line"), profile::COMPACT, None);
    let bridge = Process::join(&bench, &domain, "bridge --port unix:line --until-end");
    let watch = Process::join(&bench, &domain, "watch --until-end");
    watch.reads(0);
    let source = Process::join(&bench, &domain, &format!("simulate --scans {SCANS}"));
    eventually("some scans", || (first.scans.load(Ordering::Relaxed) > 10).then_some(()));
    first.switch_off();
    let second = device(bench.path("line"), profile::COMPACT, None);
    assert_eq!(source.ends().well()["sent"]["complete"], true);
    let (bridged, watched, learned) = (bridge.ends().well(), watch.ends().well(), second.ends());
    assert_eq!((&bridged["posterior"], &watched["watched"]["posterior"]), (&learned.clone().into(), &learned.into()));
    assert_eq!((count(&bridged, "bridge_device_restarts"), count(&bridged, "bridge_line_gone")), (1, 1));
    assert_eq!(watched["watched"]["mappers"], 2);
    let last = &watched["watched"]["last"];
    assert_eq!((&last["scan_sequence"], &last["ended"]), (&Value::from(SCANS), &Value::from(true)));
    assert!(count(&bridged, "integrated") < SCANS && count(&bridged, "lost") == 0, "{bridged}");
}

#[test]
fn a_device_that_is_silent_or_another_is_an_error_and_a_signal_ends_a_bridge() {
    let (bench, domain) = (Bench::new(), TemporaryDomain::new().unwrap());
    let other = device(bench.path("line"), profile::INDOOR, None);
    let bridge = Process::join(&bench, &domain, "bridge --port unix:line").ends();
    assert_eq!(bridge.code, Some(1), "{}", bridge.stderr);
    let says = "the device has the profile \"indoor\", this computer has \"compact\"";
    assert!(bridge.stderr.contains(says), "{}", bridge.stderr);
    other.switch_off();

    for (port, says) in [
        ("unix:nowhere", "cannot open unix:nowhere: No such file or directory"),
        ("/dev/null", "cannot open /dev/null: neither a serial device nor a pseudo-terminal"),
    ] {
        bench.bhm(&format!("bridge --port {port}")).fails(1, &[says]);
    }
    let says = "there is no firmware at bhm.elf; build it with: firmware-sim/cortex-m7/run build";
    bench.bhm("demo --firmware bhm.elf").fails(1, &[says]);

    let _silent = UnixListener::bind(bench.path("silence")).unwrap();
    let bridge = Process::join(&bench, &domain, "bridge --port unix:silence --give-up 1").ends();
    assert_eq!(bridge.code, Some(1), "{}", bridge.stderr);
    assert!(bridge.stderr.contains("unix:silence: the device has been silent for 1 s (0 bytes"), "{}", bridge.stderr);

    let device = device(bench.path("line"), profile::COMPACT, None);
    let bridge = Process::join(&bench, &domain, "bridge --port unix:line");
    let watch = Process::join(&bench, &domain, "watch");
    watch.reads(0);
    bridge.signal(Signal::TERM);
    assert_eq!(bridge.ends().well()["source_ended"], false);
    device.switch_off();
}
