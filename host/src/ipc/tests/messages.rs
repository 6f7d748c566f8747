use bhm_core::{
    geometry::PoseCovariance,
    kernel::{KernelSettings, SquaredExponentialSettings},
    posterior::PosteriorView,
    prior::{PriorSettings, WhitePrior},
    scan::{MAX_BEAMS, Scan, ScanHeader, ScanRejected},
    settings::{ENCODED_BYTES, Model, Settings, SettingsError, TileSettings},
    shape::{self, ShapeVisitor},
};
use iceoryx2::prelude::ZeroCopySend;
use proptest::prelude::*;

use super::supports::supports;
use super::*;
use crate::ipc::wire::PlainNumbers;
use crate::supports::test_supports;

/// A message on the heap, zeroed: too large for the stack.
fn zeroed<T: PlainNumbers>() -> Box<T> {
    let message = Box::<T>::new_zeroed();
    // SAFETY: zeros are a value of a message that is plain numbers.
    unsafe { message.assume_init() }
}

/// Writes bytes over a message, as a stranger might.
fn scribble<T: PlainNumbers>(message: &mut T, bytes: &[u8]) {
    assert!(bytes.len() <= size_of::<T>());
    // SAFETY: inside the message, and any bytes are a value of a message that is plain numbers.
    unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), std::ptr::from_mut(message).cast(), bytes.len()) };
}

const ADDRESS: ScanAddress = ScanAddress { source: 7, mapper: Some(9), sequence: 3, place: Place::Last };

fn scan_message() -> Box<ScanMessage> {
    let mut message = zeroed::<ScanMessage>();
    message.write(&ADDRESS, &scan(3).as_scan()).expect("few beams");
    message
}

fn status_message() -> Box<StatusMessage> {
    let mut message = zeroed::<StatusMessage>();
    message.write(5, &Progress { handled: Some((7, 3)), ended: true }, [("received", 4), ("lost", 1)]);
    message
}

/// A header as it is sent, and its tiles.
pub(super) fn posterior() -> (PosteriorHeader, Vec<PosteriorTile<144, 40>>) {
    let map = learned(3);
    let mut header = PosteriorHeader::default();
    let news = PosteriorNews { handled: Some((7, 3)), map_from_sensor: Pose::new(1.0, 2.0, 3.0), ..Default::default() };
    header.write(map.mapper().settings(), None, (144, 40), &news);
    header.mapper = 5;
    header.sequence = 1;
    let tiles: Vec<PosteriorTile<144, 40>> = PosteriorSource::tiles(map.mapper())
        .map(|tile| {
            let mut copy = zeroed::<PosteriorTile<144, 40>>();
            copy.write(&tile);
            *copy
        })
        .collect();
    assert!(tiles.len() >= 2, "the scans reach more than one tile");
    header.resident = tiles.len() as u64;
    (header, tiles)
}

/// A change of any of these is a new layout and needs a new version, in the type's name and in the constant.
#[test]
fn layouts_are_those_of_these_versions() {
    assert_eq!(size_of::<ScanMessage>(), 104 + 4 * MAX_BEAMS);
    assert_eq!(std::mem::offset_of!(ScanMessage, ranges_m), 104);
    assert_eq!(size_of::<StatusMessage>(), 48 + 40 * MAX_COUNTERS);
    assert_eq!((size_of::<PosteriorHeader>(), ENCODED_BYTES), (312, 192));
    assert_eq!(std::mem::offset_of!(PosteriorHeader, supports), 100);
    assert_eq!(std::mem::offset_of!(PosteriorHeader, settings), 116);
    assert_eq!(size_of::<PosteriorTile<144, 40>>(), 32 + 4 * (144 + 144 + 144 * 40));
    assert_eq!(size_of::<SupportsHeader>(), (52 + 32 * MAX_SUPPORT_KINDS).next_multiple_of(8));
    assert_eq!(std::mem::offset_of!(SupportsHeader, kinds), 52);
    assert_eq!(size_of::<SupportMessage>(), 28);
    // SAFETY: the names are read, nothing is done with them.
    let names = unsafe {
        [
            <ScanMessage as ZeroCopySend>::type_name(),
            <StatusMessage as ZeroCopySend>::type_name(),
            <PosteriorHeader as ZeroCopySend>::type_name(),
            <PosteriorTile<144, 40> as ZeroCopySend>::type_name(),
            <SupportsHeader as ZeroCopySend>::type_name(),
            <SupportMessage as ZeroCopySend>::type_name(),
        ]
    };
    let (plain, learned) = names.split_at(4);
    assert_eq!(plain, ["bhm.scan.v2", "bhm.status.v2", "bhm.posterior.v3", "bhm.posterior-tile.v1"]);
    assert_eq!(learned, ["bhm.supports.v2", "bhm.support.v1"]);
    assert_eq!([ScanMessage::VERSION, StatusMessage::VERSION, PosteriorHeader::VERSION], [2, 2, 3]);
    assert_eq!(SupportsHeader::VERSION, 2);
}

#[test]
fn a_scan_survives_the_way() {
    let message = scan_message();
    let numbered = message.check().expect("a good message");
    assert_eq!(numbered.address, ADDRESS);
    let record = scan(3);
    assert_eq!(format!("{:?}", numbered.scan), format!("{:?}", record.as_scan()));
    assert!(std::ptr::eq(numbered.scan.ranges_m.as_ptr(), message.ranges_m.as_ptr()), "borrowed, not copied");
}

#[test]
fn a_pose_covariance_survives_the_way_whatever_it_says() {
    let good = PoseCovariance {
        xx_m2: 0.04,
        xy_m2: 0.01,
        yy_m2: 0.09,
        x_theta_m_rad: -0.001,
        y_theta_m_rad: 0.002,
        theta_rad2: 1e-3,
    };
    let hostile = [
        PoseCovariance { xx_m2: f32::NAN, ..good },
        PoseCovariance { theta_rad2: f32::INFINITY, ..good },
        PoseCovariance { yy_m2: -1.0, ..good },
        PoseCovariance { xy_m2: 1.0, ..good },
    ];
    let sent = |covariance| {
        let mut message = zeroed::<ScanMessage>();
        // What stood there before does not shine through.
        message.pose_covariance = [f32::NAN; 6];
        let record = ScanRecord { header: ScanHeader { pose_covariance: covariance, ..scan(3).header }, ..scan(3) };
        message.write(&ADDRESS, &record.as_scan()).expect("few beams");
        message
    };
    let certain = sent(None);
    assert_eq!((certain.flags, certain.pose_covariance), (ScanMessage::LAST, [0.0; 6]));
    assert_eq!(certain.check().expect("a good message").scan.header.pose_covariance, None);
    let message = sent(Some(good));
    assert_eq!(message.flags, ScanMessage::LAST | ScanMessage::UNCERTAIN);
    let numbered = message.check().expect("a good message");
    assert_eq!((numbered.scan.header.pose_covariance, numbered.address), (Some(good), ADDRESS));
    learned(1)
        .integrate(&Scan {
            header: ScanHeader { pose_covariance: Some(good), ..numbered.scan.header },
            ..numbered.scan
        })
        .expect("a covariance");
    for hostile in hostile {
        // The message carries it; what it says is the mapper's to judge.
        let message = sent(Some(hostile));
        let scan = message.check().expect("a message that can be read").scan;
        assert_eq!(format!("{:?}", scan.header.pose_covariance), format!("{:?}", Some(hostile)));
        let mut map = learned(1);
        let before = map.mapper().scans();
        assert_eq!(map.integrate(&scan).err(), Some(ScanRejected::PoseCovariance), "{hostile:?}");
        assert_eq!(map.mapper().scans(), before);
    }
}

#[test]
fn every_damage_to_a_scan_is_named() {
    type Damage = (fn(&mut ScanMessage), ScanMessageRejected);
    let damages: [Damage; 7] = [
        (|m| m.magic += 1, LayoutError::Magic { what: "scan message", found: ScanMessage::MAGIC + 1 }.into()),
        (|m| m.version = 1, LayoutError::Version { what: "scan message", found: 1, understood: 2 }.into()),
        (|m| m.flags = 4, LayoutError::Flags { what: "scan message", found: 4 }.into()),
        (|m| m.flags |= 1 << 31, LayoutError::Flags { what: "scan message", found: 1 << 31 | 1 }.into()),
        (|m| m.source = 0, ScanMessageRejected::Unnumbered),
        (|m| m.sequence = 0, ScanMessageRejected::Unnumbered),
        (|m| m.beams = MAX_BEAMS as u32 + 1, ScanMessageRejected::Beams { found: MAX_BEAMS as u32 + 1 }),
    ];
    for (damage, expected) in damages {
        let mut message = scan_message();
        damage(&mut message);
        assert_eq!(message.check().err(), Some(expected));
    }
}

#[test]
fn a_scan_with_too_many_beams_is_not_sent() {
    let mut record = scan(1);
    record.ranges_m = vec![1.0; MAX_BEAMS + 1];
    let refused = zeroed::<ScanMessage>().write(&ADDRESS, &record.as_scan());
    assert_eq!(refused, Err(IpcError::TooManyBeams { beams: MAX_BEAMS + 1 }));
    record.ranges_m.pop();
    zeroed::<ScanMessage>().write(&ADDRESS, &record.as_scan()).expect("as many as fit");
}

#[test]
fn a_status_survives_the_way() {
    let message = status_message();
    assert_eq!(message.check(), Ok(()));
    assert_eq!(message.progress(), Progress { handled: Some((7, 3)), ended: true });
    assert_eq!(message.counters().collect::<Vec<_>>(), [("received", 4), ("lost", 1)]);
}

#[test]
fn every_damage_to_a_status_is_named() {
    type Damage = (fn(&mut StatusMessage), StatusRejected);
    let damages: [Damage; 7] = [
        (|m| m.magic = 0, LayoutError::Magic { what: "status message", found: 0 }.into()),
        (|m| m.version = 0, LayoutError::Version { what: "status message", found: 0, understood: 2 }.into()),
        (|m| m.flags = 6, LayoutError::Flags { what: "status message", found: 6 }.into()),
        (|m| m.reserved = 1, LayoutError::Flags { what: "status message", found: 1 }.into()),
        (|m| m.mapper = 0, StatusRejected::NoMapper),
        (|m| m.counters_len = MAX_COUNTERS as u32 + 1, StatusRejected::Counters { found: MAX_COUNTERS as u32 + 1 }),
        (|m| m.counters[1].name[0] = 0xff, StatusRejected::Name { index: 1 }),
    ];
    for (damage, expected) in damages {
        let mut message = status_message();
        damage(&mut message);
        assert_eq!(message.check(), Err(expected));
    }
}

/// Writes a header's settings anew, changed.
pub(super) fn change_settings(header: &mut PosteriorHeader, change: impl FnOnce(&mut Settings)) {
    let mut settings = header.settings().expect("settings that were written");
    change(&mut settings);
    let encoded = postcard::to_slice(&settings, &mut header.settings.0).expect("they fit");
    header.settings_bytes = encoded.len() as u32;
}

/// Checks a header of any shape, without tiles.
struct Check(PosteriorHeader);

impl ShapeVisitor for Check {
    type Output = Result<Model<'static, 2>, PosteriorRejected>;

    fn visit<const M: usize, const B: usize>(self) -> Self::Output {
        self.0.check::<M, B>(&[], None).map(|checked| checked.model)
    }
}

#[test]
fn a_posterior_of_every_profile_gives_back_its_model() {
    for profile in profile::ALL {
        let mut header = PosteriorHeader::default();
        let model = profile.settings.model().expect("a good profile");
        let shape = (profile.settings.supports(), profile.settings.band());
        header.write(&profile.settings, None, shape, &PosteriorNews::default());
        (header.mapper, header.sequence) = (5, 1);
        let found = shape::visit(shape, Check(header)).expect("a compiled shape").expect("a good header");
        assert_eq!((found, header.settings()), (model, Ok(profile.settings)), "{}", profile.name);
    }
}

/// A number of its own in each place, so that none can stand for another.
#[test]
fn every_number_of_a_tile_survives_the_way() {
    let (mean, border_covariance, covariance) = ([1.0, 2.0], [3.0, 4.0], [[5.0, 6.0], [7.0, 0.0]]);
    let view = PosteriorView::<2, 2> {
        mean: &mean,
        covariance: &covariance,
        border_covariance: &border_covariance,
        bias_covariance: 8.0,
        bias_mean: 9.0,
    };
    let mut message = zeroed::<PosteriorTile<2, 2>>();
    message.write(&SourceTile { index: [10, -11], updates: 12, touched_at: 13, view });
    assert_eq!((message.index, message.updates, message.touched_at), ([10, -11], 12, 13));
    let PosteriorView { mean, covariance, border_covariance, bias_covariance, bias_mean } = message.view();
    assert_eq!((mean, border_covariance), (&[1.0, 2.0], &[3.0, 4.0]));
    assert_eq!((covariance, bias_covariance, bias_mean), (&[[5.0, 6.0], [7.0, 0.0]], 8.0, 9.0));
}

#[test]
fn every_damage_to_a_posterior_is_named() {
    type Damage = (fn(&mut PosteriorHeader), fn(&PosteriorRejected) -> bool);
    use PosteriorRejected as No;
    fn tile(h: &mut PosteriorHeader, change: fn(&mut TileSettings<2>)) {
        change_settings(h, |settings| change(&mut settings.tile));
    }
    let damages: [Damage; 27] = [
        (|h| h.magic ^= 1, |e| matches!(e, No::Layout(LayoutError::Magic { .. }))),
        (|h| h.version = 2, |e| matches!(e, No::Layout(LayoutError::Version { found: 2, .. }))),
        (|h| h.flags |= 8, |e| matches!(e, No::Layout(LayoutError::Flags { .. }))),
        (|h| h.supports_digest = 8, |e| matches!(e, No::SupportsMissing { digest: 8 })),
        (|h| h.mapper = 0, |e| matches!(e, No::Unnumbered)),
        (|h| h.sequence = 0, |e| matches!(e, No::Unnumbered)),
        (|h| h.supports = 145, |e| matches!(e, No::Shape { supports: 145, .. })),
        (|h| h.band = 39, |e| matches!(e, No::Shape { band: 39, .. })),
        (|h| tile(h, |t| t.width = [144, 2]), |e| matches!(e, No::Shape { .. })),
        (|h| tile(h, |t| t.width = [usize::MAX; 2]), |e| matches!(e, No::Shape { .. })),
        (|h| tile(h, |t| t.width = [144, 1]), |e| matches!(e, No::Settings(SettingsError::Tiling(_)))),
        (|h| tile(h, |t| t.width = [1, 144]), |e| matches!(e, No::Settings(SettingsError::Tiling(_)))),
        (|h| tile(h, |t| t.stride = [0, 8]), |e| matches!(e, No::Settings(SettingsError::Tiling(_)))),
        (|h| tile(h, |t| t.stride = [usize::MAX; 2]), |e| matches!(e, No::Settings(SettingsError::Tiling(_)))),
        (|h| tile(h, |t| t.stencil = 0), |e| matches!(e, No::Settings(SettingsError::Tiling(_)))),
        (|h| tile(h, |t| t.stencil = usize::MAX), |e| matches!(e, No::Settings(SettingsError::Tiling(_)))),
        (|h| tile(h, |t| t.stencil = 6), |e| matches!(e, No::Settings(SettingsError::Tiling(_)))),
        (|h| h.resident += 1, |e| matches!(e, No::Count { .. })),
        (|h| h.settings_bytes = u32::MAX, |e| matches!(e, No::SettingsEncoding)),
        (|h| h.settings_bytes -= 1, |e| matches!(e, No::SettingsEncoding)),
        (|h| h.settings_bytes += 1, |e| matches!(e, No::SettingsEncoding)),
        // The kernel's place in its list stands behind origin and spacing.
        (|h| h.settings.0[12] = 77, |e| matches!(e, No::SettingsEncoding)),
        (|h| h.theta_rad = f32::NAN, |e| matches!(e, No::Pose)),
        (
            |h| change_settings(h, |s| s.origin_m[1] = f32::INFINITY),
            |e| matches!(e, No::Settings(SettingsError::Number { .. })),
        ),
        (|h| change_settings(h, |s| s.spacing_m = -0.5), |e| matches!(e, No::Settings(SettingsError::Number { .. }))),
        (
            |h| {
                let kernel = SquaredExponentialSettings { shape: f32::NAN };
                change_settings(h, |s| s.kernel = KernelSettings::SquaredExponential(kernel));
            },
            |e| matches!(e, No::Settings(SettingsError::Number { .. })),
        ),
        (
            |h| change_settings(h, |s| s.prior = PriorSettings::White(WhitePrior { precision: 0.0 })),
            |e| matches!(e, No::Settings(SettingsError::Number { .. })),
        ),
    ];
    let (good, mut tiles) = posterior();
    assert!(good.check(&tiles, None).is_ok());
    for (number, (damage, expected)) in damages.into_iter().enumerate() {
        let mut header = good;
        damage(&mut header);
        let error = header.check(&tiles, None).expect_err("damaged");
        assert!(expected(&error), "damage {number} gives {error:?}");
    }
    tiles.swap(0, 1);
    assert_eq!(good.check(&tiles, None), Err(No::Order { at: 1 }));
    tiles[1].index = tiles[0].index;
    assert_eq!(good.check(&tiles, None), Err(No::Order { at: 1 }));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// A stranger's bytes, whole or behind a good beginning, are answered without a panic.
    #[test]
    fn random_bytes_never_panic(
        bytes in proptest::collection::vec(any::<u8>(), size_of::<PosteriorHeader>()),
        good in 0_usize..size_of::<PosteriorHeader>(),
    ) {
        let (first, rest) = (&bytes[..good], &bytes[good..]);
        let mut scan = scan_message();
        scribble(&mut *scan, &bytes[..104]);
        prop_assert!(scan.check().is_err());
        let mut status = status_message();
        scribble(&mut *status, first);
        let _ = (status.check(), status.progress(), status.counters().count());

        let (mut supports_header, mut messages) = supports();
        let first = good % (1 + size_of::<SupportsHeader>().min(bytes.len()));
        scribble(&mut supports_header, &bytes[..first]);
        let _ = supports_header.check(&messages);
        scribble(&mut messages[3], &bytes[..28]);
        let _ = supports().0.check(&messages);

        let mut header = PosteriorHeader::default();
        header.write(&profile::COMPACT.settings, None, (144, 40), &PosteriorNews::default());
        (header.mapper, header.sequence) = (5, 1);
        let mut behind = header;
        scribble(&mut header, &bytes);
        prop_assert!(header.check::<144, 40>(&[], None).is_err());
        // SAFETY: within the header, and any bytes are a value of it.
        let tail = unsafe {
            std::slice::from_raw_parts_mut(std::ptr::from_mut(&mut behind).cast::<u8>().add(good), bytes.len() - good)
        };
        tail.copy_from_slice(rest);
        let _ = behind.check::<144, 40>(&[], Some(&test_supports::some()));
    }
}
