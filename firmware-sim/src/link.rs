use bhm_core::{geometry::Pose, mapper::Mapper, scan::Scan};

use crate::Counters;

/// The world around the loop: where scans come from and posteriors go.
///
/// No method waits for a reader, and none but [`receive`](Self::receive) waits at all.
///
/// A world of one scan, which then stops the loop:
///
/// ```
/// use bhm_core::{geometry::Pose, map::Map, mapper::Mapper, profile::COMPACT, scan::{Scan, ScanHeader}, tile::NoArchive};
/// use bhm_firmware_sim::{Incoming, IncomingScan, LentMap, Link, News, Onboard, OnboardMap, Options, Patience, Report};
///
/// #[derive(Default)]
/// struct OneScan {
///     sent: bool,
///     published: u32,
/// }
///
/// impl Link<144, 40> for OneScan {
///     type Fault = ();
///
///     fn receive(&mut self, _: Patience) -> Result<Incoming<'_>, ()> {
///         if std::mem::replace(&mut self.sent, true) {
///             return Ok(Incoming::Stop);
///         }
///         let header = ScanHeader {
///             map_from_sensor: Pose::new(0.0, 0.0, 0.0),
///             angle_min_rad: -0.5,
///             angle_increment_rad: 0.1,
///             range_max_m: 30.0,
///             ..ScanHeader::default()
///         };
///         let scan = Scan { header, ranges_m: &[2.0; 11] };
///         Ok(Incoming::Scan(IncomingScan { source: 1, sequence: 1, last: true, received_ns: None, scan }))
///     }
///
///     fn publish(&mut self, _: &Mapper<'_, 2, 144, 40>, _: &News) -> Result<(), ()> {
///         self.published += 1;
///         Ok(())
///     }
///
///     fn report(&mut self, _: &Report<'_>) -> Result<(), ()> {
///         Ok(())
///     }
/// }
///
/// let mut memory = Box::new(<bhm_core::static_memory!(COMPACT)>::ZERO);
/// let map = LentMap::new(Mapper::new(COMPACT.settings, memory.lend())?, NoArchive);
/// let mut onboard = Onboard::new(map, OneScan::default(), Options::default());
/// onboard.run();
/// assert_eq!((onboard.counters().integrated, onboard.link().published), (1, 2), "the empty map first");
/// assert!(onboard.map().mapper().occupancy(&[2.0, 0.0].into()).probability > 0.5, "a wall ahead");
/// # Ok::<(), bhm_core::settings::SettingsError>(())
/// ```
pub trait Link<const M: usize, const B: usize> {
    /// What can go wrong in the link.
    type Fault;

    /// The next thing that happened, borrowed from the link.
    ///
    /// With [`Patience::Some`] the link may wait for something to happen, but not so long that a stop would seem ignored. It
    /// also does what has to be done when nothing happens.
    ///
    /// # Errors
    /// If the link failed; the loop counts it and goes on.
    fn receive(&mut self, patience: Patience) -> Result<Incoming<'_>, Self::Fault>;

    /// Publishes the map's resident tiles as they are now.
    ///
    /// # Errors
    /// If the link failed; the loop counts it and goes on.
    fn publish(&mut self, mapper: &Mapper<'_, 2, M, B>, news: &News) -> Result<(), Self::Fault>;

    /// Says how far the loop has come: to the source, which may wait for that, and to onlookers.
    ///
    /// # Errors
    /// If the link failed; the loop counts it and goes on.
    fn report(&mut self, report: &Report<'_>) -> Result<(), Self::Fault>;

    /// What a clock that never goes back shows, nanoseconds since whenever it began; `None` in a world without one.
    ///
    /// The clock is read to say how long updates take ([`UpdateTime`]) and which of them are too slow; it never changes a map.
    fn now_ns(&mut self) -> Option<u64> {
        None
    }

    /// Whether part of what was published has not left the link yet: the loop then publishes again instead of waiting.
    fn behind(&self) -> bool {
        false
    }
}

/// Whether to wait for something to happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Patience {
    /// Answer at once.
    None,
    /// Wait a while.
    Some,
}

/// What came over a link.
#[derive(Clone, Copy, Debug)]
pub enum Incoming<'a> {
    /// A scan came.
    Scan(IncomingScan<'a>),
    /// Something came that is not a scan for this loop.
    Unusable(Unusable),
    /// Nothing came.
    Nothing,
    /// The loop is to end.
    Stop,
}

/// A scan, and which one it is.
#[derive(Clone, Copy, Debug)]
pub struct IncomingScan<'a> {
    /// Which run of which source sent the scan.
    pub source: u64,
    /// The source's count of its scans, from 1.
    pub sequence: u64,
    /// Whether the source said that the scan is its last.
    pub last: bool,
    /// What the link's clock ([`Link::now_ns`]) showed when the link had the scan; `None` without a clock. A loop cannot ask
    /// for it later: until the scan is learned, it is borrowed from the link.
    pub received_ns: Option<u64>,
    /// The scan, whose values were not checked yet.
    pub scan: Scan<'a>,
}

/// Why a message is of no use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unusable {
    /// The message cannot be read.
    Unreadable,
    /// The message was meant for an earlier run of this program, and will be sent again.
    ForAnother,
}

/// What is said with a posterior that the posterior itself does not hold.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct News {
    /// Which run of which source was heard last, and the scan up to which all of its scans are dealt with.
    pub handled: Option<(u64, u64)>,
    /// Whether that source has ended, and its last scan is dealt with.
    pub ended: bool,
    /// Where the sensor stood at the newest scan integrated.
    pub map_from_sensor: Pose,
    /// Tiles in the archive.
    pub archived: u64,
    /// Tiles evicted and not kept.
    pub lost: u64,
}

/// How far the loop has come.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// Which run of which source was heard last, and the scan up to which all of its scans are dealt with.
    pub handled: Option<(u64, u64)>,
    /// Whether that source has ended, and its last scan is dealt with.
    pub ended: bool,
    /// Everything that happened.
    pub counters: &'a Counters,
    /// How long updates took; `None` before the first, and without a clock.
    pub update: Option<UpdateTime>,
}

/// How long scans took from being received to being integrated or refused, by the link's clock. Publishing is no part of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UpdateTime {
    /// The last, nanoseconds.
    pub last_ns: u64,
    /// The slowest so far, nanoseconds.
    pub slowest_ns: u64,
}

impl UpdateTime {
    /// With one more, which took so long.
    pub(crate) fn after(earlier: Option<Self>, last_ns: u64) -> Self {
        Self { last_ns, slowest_ns: earlier.map_or(last_ns, |earlier| earlier.slowest_ns.max(last_ns)) }
    }
}
