use std::io;
use std::string::{String, ToString};
use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant};
use std::vec::Vec;

use bhm_core::geometry::Pose;
use bhm_host::{
    ipc::{IpcError, PosteriorNews, PosteriorPublisher, Progress, ScanSink, StatusPublisher, fresh_id},
    map::posterior_digest,
};

use super::{Bridge, BridgeCounters, BridgeError, BridgeSummary, Mirrored, Open, Published, UnderWay};
use crate::serial::{Device, DeviceStatus, Directory, Event, HostEnd, NewsFrame};

/// How long to wait for one thing before looking at the others.
const NAP: Duration = Duration::from_millis(5);

/// How long to wait before a line that is gone is opened again.
const BEFORE_REOPENING: Duration = Duration::from_millis(50);

/// How long a device that ends may take to send what is left.
const LAST_WORDS: Duration = Duration::from_secs(1);

impl<'p, const M: usize, const B: usize> Bridge<'p, M, B> {
    pub(super) fn open(Open { profile, domain, options, port, stop }: Open<'p>) -> Result<Self, BridgeError> {
        profile.settings.model()?;
        let participant = domain.join("bhm-bridge")?;
        let mapper = fresh_id();
        // First, since it is what a second mapper is refused by.
        let status = StatusPublisher::open(&participant, mapper)?;
        let scans = ScanSink::open(&participant)?;
        let now = Instant::now();
        Ok(Self {
            under_way: None,
            scans,
            posterior: None,
            status,
            participant,
            mapper,
            end: HostEnd::new(profile),
            port,
            stop,
            options: *options,
            settings: profile.settings,
            counters: BridgeCounters::NONE,
            published: None,
            device_status: DeviceStatus::default(),
            last_fault: None,
            last_refusal: None,
            heard: now,
            asked: now,
            connected: true,
            told_to_finish: false,
            finishing: false,
        })
    }

    pub(super) fn run(mut self) -> Result<BridgeSummary, BridgeError> {
        self.greet();
        while !self.stop.load(Ordering::Relaxed) {
            self.next_scan();
            // While the device works, what it says next is waited for; else the next scan is.
            let patience = if self.is_idle() { Duration::ZERO } else { NAP };
            self.listen(patience);
            if self.has_finished() {
                break;
            }
            self.remind()?;
        }
        Ok(self.summary())
    }

    /// Whether nothing is expected of the device.
    fn is_idle(&self) -> bool {
        self.under_way.is_none() && self.end.is_settled() && !self.told_to_finish
    }

    /// Takes a scan from shared memory, if the device is ready for one, and sends it.
    fn next_scan(&mut self) {
        if self.under_way.is_some() || self.told_to_finish || self.end.device().is_none() {
            return;
        }
        let patience = if self.end.is_settled() { NAP } else { Duration::ZERO };
        let sample = match self.scans.receive(patience) {
            Ok(Some(sample)) => sample,
            Ok(None) => {
                let greeted = self.status.greet();
                self.note(greeted);
                let greeted = self.posterior.as_ref().map_or(Ok(()), |(posterior, _)| posterior.greet());
                return self.note(greeted);
            }
            Err(fault) => {
                thread::sleep(NAP);
                return self.note(Err(fault));
            }
        };
        match sample.check() {
            Err(_) => self.counters.scans_unreadable += 1,
            Ok(numbered) if numbered.address.mapper.is_some_and(|mapper| mapper != self.mapper) => {
                self.counters.scans_for_another += 1;
            }
            Ok(numbered) => {
                let (source, sequence) = (numbered.address.source, numbered.address.sequence);
                self.counters.scans_taken += 1;
                self.under_way = Some(UnderWay { sample, source, sequence, sent: Instant::now() });
                self.send_scan();
            }
        }
    }

    /// Sends the scan that is under way.
    fn send_scan(&mut self) {
        let Some(UnderWay { sample, sent, .. }) = &mut self.under_way else { return };
        *sent = Instant::now();
        let Ok(numbered) = sample.check() else { return };
        let outcome = match self.end.scan(&numbered) {
            Ok(Some(bytes)) if self.connected => self.port.write_all(bytes),
            Ok(_) => Ok(()),
            Err(fault) => return self.note(Err(fault)),
        };
        self.line(&outcome);
    }

    fn greet(&mut self) {
        self.counters.greetings += 1;
        self.asked = Instant::now();
        let outcome = self.port.write_all(self.end.hello(fresh_id()));
        self.line(&outcome);
    }

    fn ask_for_what_is_missing(&mut self) {
        self.counters.refreshes += 1;
        self.asked = Instant::now();
        let missing = self.end.missing().to_vec();
        let outcome = self.port.write_all(self.end.refresh(&missing));
        self.line(&outcome);
    }

    /// Takes note that the line is gone, if it is.
    fn line<T>(&mut self, outcome: &io::Result<T>) {
        if outcome.is_err() && self.connected {
            // A device that ends takes its line along.
            self.counters.line_gone += u64::from(!self.told_to_finish);
            self.connected = false;
        }
    }

    fn note(&mut self, outcome: Result<(), IpcError>) {
        if let Err(fault) = outcome {
            self.counters.faults += 1;
            self.last_fault = Some(fault);
        }
    }

    /// Takes what the device says.
    fn listen(&mut self, patience: Duration) {
        let mut buffer = [0; 16_384];
        let came = if self.connected { self.read(&mut buffer, patience) } else { Ok(0) };
        let length = came.as_ref().map_or(0, |length| *length);
        self.line(&came);
        let mut bytes = &buffer[..length];
        while let Some(event) = self.end.take(&mut bytes) {
            self.heard = Instant::now();
            self.deal_with(event);
        }
    }

    /// Takes bytes that came, waiting for them at most as long as said; 0 if none came.
    fn read(&mut self, into: &mut [u8], patience: Duration) -> io::Result<usize> {
        if !self.port.wait(patience)? {
            return Ok(0);
        }
        match self.port.read(into)? {
            0 => Err(io::ErrorKind::UnexpectedEof.into()),
            length => Ok(length),
        }
    }

    fn deal_with(&mut self, event: Event) {
        match event {
            Event::Hello { device, new_run } => {
                self.last_refusal = None;
                if new_run && let Err(fault) = self.begin(&device) {
                    self.note(Err(fault));
                }
            }
            Event::Refused(why) => {
                self.counters.devices_refused += 1;
                self.last_refusal = Some(why.into());
            }
            Event::OtherVersion { found } => {
                self.counters.other_versions += 1;
                // One among others is noise that happens to fit.
                if self.end.device().is_none() {
                    self.last_refusal = Some(BridgeError::OtherVersion { found });
                }
            }
            Event::Posterior(directory) => {
                self.acknowledged(directory.news.handled);
                self.publish(&directory);
            }
            Event::Incomplete(directory) => {
                self.acknowledged(directory.news.handled);
                self.ask_for_what_is_missing();
            }
            Event::Status(status) => {
                self.acknowledged(status.handled);
                if self.end.lacks_directory() {
                    self.ask_for_what_is_missing();
                }
                self.device_status = status;
                self.report();
            }
            Event::Finishing => self.finishing = true,
        }
    }

    /// The device is another than before, or started again.
    fn begin(&mut self, device: &Device) -> Result<(), IpcError> {
        let restarted = self.posterior.is_some();
        self.counters.device_restarts += u64::from(restarted);
        if restarted {
            self.mapper = fresh_id();
            self.status.begin(self.mapper);
        }
        self.device_status = DeviceStatus::default();
        self.published = None;
        let kept = self.posterior.take().filter(|(_, slots)| *slots == device.slots);
        let mut posterior = match kept {
            Some((posterior, _)) => posterior,
            None => {
                let consumers = self.options.consumers;
                PosteriorPublisher::open(&self.participant, self.mapper, device.slots, consumers)?
            }
        };
        posterior.begin(self.mapper);
        self.posterior = Some((posterior, device.slots));
        // A source that waits sends it again, addressed to the new run; one that does not sent it to whoever is there.
        let addressed = self.under_way.as_ref().and_then(|way| Some(way.sample.check().ok()?.address.mapper.is_some()));
        match addressed {
            Some(false) => self.send_scan(),
            Some(true) => {
                self.counters.scans_dropped += 1;
                self.under_way = None;
            }
            None => self.under_way = None,
        }
        Ok(())
    }

    fn acknowledged(&mut self, handled: Option<(u64, u64)>) {
        let is_dealt_with =
            |way: &UnderWay| handled.is_some_and(|(of, up_to)| of == way.source && up_to >= way.sequence);
        if self.under_way.as_ref().is_some_and(is_dealt_with) {
            self.under_way = None;
        }
    }

    /// Publishes the mirror, if it is another than the one before: a device also repeats itself.
    fn publish(&mut self, directory: &Directory) {
        let tiles = self.end.mirror().tiles().map(|tile| tile.version).collect();
        let published = Some(Published { tiles, news: directory.news });
        if published == self.published {
            return;
        }
        let NewsFrame { handled, ended, map_from_sensor: [x_m, y_m, theta_rad], archived, lost, .. } = directory.news;
        let news = PosteriorNews { handled, ended, map_from_sensor: Pose::new(x_m, y_m, theta_rad), archived, lost };
        let source = Mirrored { settings: &self.settings, mirror: self.end.mirror(), news: &directory.news };
        let Some((posterior, _)) = &mut self.posterior else { return };
        let outcome = posterior.publish(&source, &news).map(drop);
        if outcome.is_ok() {
            self.counters.posteriors += 1;
            self.published = published;
        }
        self.note(outcome);
    }

    fn report(&mut self) {
        let DeviceStatus { handled, ended, .. } = self.device_status;
        let counters = self.all_counters();
        let counters = counters.iter().map(|(name, count)| (name.as_str(), *count));
        let outcome = self.status.publish(&Progress { handled, ended }, counters);
        self.note(outcome);
    }

    /// The device's counters as they are called there; those of the line with `device_` and `host_` before their names.
    fn all_counters(&self) -> Vec<(String, u64)> {
        let status = &self.device_status;
        let prefixed = |end: &str, name: &str| [end, name].concat();
        let mut counters = status.counters.clone();
        counters.extend([
            (String::from("device_last_update_ns"), status.last_update_ns),
            (String::from("device_slowest_update_ns"), status.slowest_update_ns),
        ]);
        let high_water = status.stack_high_water_bytes;
        counters.extend(high_water.map(|bytes| (String::from("device_stack_bytes"), u64::from(bytes))));
        counters.extend(status.link.iter().map(|(name, count)| (prefixed("device_", name), *count)));
        counters.extend(self.end.counters().iter().map(|(name, count)| (prefixed("host_", name), count)));
        let ours = self.end.mirror_counters().iter().chain(self.counters.iter());
        counters.extend(ours.map(|(name, count)| (prefixed("bridge_", name), count)));
        counters.push((String::from("bridge_for_another_run"), self.end.for_another_run()));
        counters
    }

    /// Sends again what was not answered, and gives a device up that is silent for too long.
    ///
    /// # Errors
    /// If it is given up, or of no use here.
    fn remind(&mut self) -> Result<(), BridgeError> {
        if self.end.device().is_none()
            && let Some(refusal) = self.last_refusal.take()
        {
            return Err(refusal);
        }
        let silent = self.heard.elapsed();
        if silent > self.options.give_up_after {
            let counters = self.end.counters();
            return Err(BridgeError::Silent {
                seconds: silent.as_secs(),
                bytes: counters.bytes_received,
                damaged: counters.frames_damaged(),
                gone: self.counters.line_gone,
            });
        }
        if !self.connected {
            thread::sleep(BEFORE_REOPENING);
            if self.port.reopen().is_ok() {
                self.connected = true;
                self.end.drop_begun();
                self.greet();
            }
            return Ok(());
        }
        if self.under_way.as_ref().is_some_and(|way| way.sent.elapsed() > self.options.send_again_after) {
            self.counters.scans_sent_again += 1;
            self.send_scan();
        }
        let ended = self.published.as_ref().is_some_and(|published| published.news.ended);
        if self.options.until_end && ended && self.under_way.is_none() && self.end.is_settled() && !self.told_to_finish
        {
            self.told_to_finish = true;
            self.tell_to_finish();
        }
        if silent.min(self.asked.elapsed()) > self.options.greet_after {
            if self.told_to_finish {
                self.tell_to_finish();
            } else if self.end.device().is_some() && !self.end.is_settled() {
                self.ask_for_what_is_missing();
            }
            self.greet();
        }
        Ok(())
    }

    fn tell_to_finish(&mut self) {
        self.asked = Instant::now();
        let outcome = self.end.finish().map_or(Ok(()), |bytes| self.port.write_all(bytes));
        self.line(&outcome);
    }

    /// Whether the device ends, and has said everything.
    fn has_finished(&self) -> bool {
        // A device that was told to end and is gone did as it was told.
        self.told_to_finish && (!self.connected || (self.finishing && self.heard.elapsed() > LAST_WORDS))
    }

    fn summary(&self) -> BridgeSummary {
        let mirror = self.end.mirror();
        BridgeSummary {
            source_ended: self.told_to_finish,
            device_finished: self.finishing,
            device: self.end.device().cloned(),
            mapper: self.mapper,
            posterior: posterior_digest(mirror.tiles().map(|tile| (tile.version.index, tile.view()))).to_string(),
            tiles_resident: mirror.tiles().len(),
            tiles_archived: self.published.as_ref().map_or(0, |published| published.news.archived),
            counters: self.all_counters(),
            last_fault: self.last_fault.clone(),
        }
    }
}
