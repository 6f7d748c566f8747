use std::string::String;
use std::vec::Vec;

use bhm_core::profile::Profile;
use bhm_host::map::MAX_TILE_BYTES;

use crate::serial::{Damage, HelloFrame, StatusFrame, packed};

/// Which device is at the other end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Device {
    /// The number of the device's run.
    pub run: u64,
    /// The name of the device's profile.
    pub profile: String,
    /// Passes over each scan.
    pub passes: u32,
    /// Tiles that the device has room for.
    pub slots: usize,
}

/// Why a device's posterior cannot be used on this computer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DeviceRefused {
    /// The device has another profile.
    #[error("the device has the profile {device:?}, this computer has {host:?}")]
    Profile {
        /// The device's.
        device: String,
        /// This computer's.
        host: &'static str,
    },
    /// The profile has the same name and other settings.
    #[error(
        "the device was built with other settings of the profile {profile:?}: digest {device:08x}, on this computer \
         {host:08x}"
    )]
    Settings {
        /// The profile's name.
        profile: String,
        /// The digest of the device's settings.
        device: u32,
        /// This computer's.
        host: u32,
    },
    /// The device's tiles have another shape.
    #[error(
        "the device's tiles have {} supports in a band of {}, this computer's {} in a band of {}", device.0, device.1, host.0, host.1
    )]
    Shape {
        /// The device's supports and band.
        device: (u32, u32),
        /// This computer's.
        host: (u32, u32),
    },
    /// The device claims room for no tile, or for more than a computer would hold.
    #[error("the device claims room for {slots} tiles, expected 1 to {most}")]
    Slots {
        /// Tiles that the device claims room for.
        slots: u32,
        /// The most that is accepted.
        most: u32,
    },
}

/// How far a device has come.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeviceStatus {
    /// The device's newest directory; 0 before the first.
    pub directory: u64,
    /// Which run of which source it heard last, and the scan up to which all of its scans are dealt with.
    pub handled: Option<(u64, u64)>,
    /// Whether that source has ended, and its last scan is dealt with.
    pub ended: bool,
    /// How long its newest integration took, nanoseconds; 0 if none did or nothing measures it.
    pub last_update_ns: u64,
    /// How long its slowest integration took, nanoseconds.
    pub slowest_update_ns: u64,
    /// The most that its stack ever took, bytes, where that is known.
    pub stack_high_water_bytes: Option<u32>,
    /// The counters of the device's loop.
    pub counters: Vec<(String, u64)>,
    /// What it saw of the line.
    pub link: Vec<(String, u64)>,
}

impl Device {
    /// Checks that the device's tiles mean here what they mean there.
    pub(super) fn check<const M: usize, const B: usize>(
        hello: &HelloFrame<'_>,
        profile: &Profile,
    ) -> Result<Self, DeviceRefused> {
        let (device, host) = (hello.settings, profile.settings.digest().0);
        if hello.profile != profile.name {
            return Err(DeviceRefused::Profile { device: hello.profile.into(), host: profile.name });
        }
        if device != host {
            return Err(DeviceRefused::Settings { profile: hello.profile.into(), device, host });
        }
        let (device, host) = ((hello.supports, hello.band), (M as u32, B as u32));
        if device != host {
            return Err(DeviceRefused::Shape { device, host });
        }
        let most = (MAX_TILE_BYTES / (M * B * size_of::<f32>())).max(1) as u32;
        if hello.slots == 0 || hello.slots > most {
            return Err(DeviceRefused::Slots { slots: hello.slots, most });
        }
        Ok(Self { run: hello.run, profile: hello.profile.into(), passes: hello.passes, slots: hello.slots as usize })
    }
}

impl DeviceStatus {
    pub(super) fn read(frame: &StatusFrame<'_>) -> Result<Self, Damage> {
        let counts = |bytes| {
            let counts = packed::named(bytes).map(|named| named.map(|(name, count)| (String::from(name), count)));
            counts.collect::<Result<_, _>>().map_err(|_| Damage::Unreadable)
        };
        let &StatusFrame { directory, handled, ended, last_update_ns, slowest_update_ns, .. } = frame;
        Ok(Self {
            directory,
            handled,
            ended,
            last_update_ns,
            slowest_update_ns,
            stack_high_water_bytes: frame.stack_high_water_bytes,
            counters: counts(frame.counters.0)?,
            link: counts(frame.link.0)?,
        })
    }
}
