use std::io;
use std::string::String;
use std::vec::Vec;

use bhm_core::settings::SettingsError;
use bhm_host::{ipc::IpcError, map::UnknownShape};

use crate::serial::{Device, DeviceRefused, PROTOCOL_VERSION};

/// What a bridge did.
#[derive(Clone, Debug, PartialEq)]
pub struct BridgeSummary {
    /// Whether a source ended and everything that came of it is published, rather than the bridge being stopped.
    pub source_ended: bool,
    /// Whether the device was told to end and said that it does.
    pub device_finished: bool,
    /// The device, if one answered.
    pub device: Option<Device>,
    /// What told the last run of the mapper from every other.
    pub mapper: u64,
    /// Digest of the device's resident tiles, as they came; see `bhm_host::map::posterior_digest`.
    pub posterior: String,
    /// How many there are.
    pub tiles_resident: usize,
    /// Tiles in the device's archive.
    pub tiles_archived: u64,
    /// The device's counters, those of either end of the line, and the bridge's own.
    pub counters: Vec<(String, u64)>,
    /// What shared memory last said, if it ever failed.
    pub last_fault: Option<IpcError>,
}

/// Why a bridge could not begin, or had to end.
#[derive(Debug, thiserror::Error)]
pub enum BridgeError {
    /// The profile needs tiles of a shape that is not compiled in, or contradicts itself.
    #[error(transparent)]
    Shape(#[from] UnknownShape),
    /// The profile contradicts itself.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// Shared memory refused, for instance because a mapper is already running.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// A device answered whose posterior cannot be used here.
    #[error(transparent)]
    Refused(#[from] DeviceRefused),
    /// What answers speaks another version of the protocol.
    #[error("the device speaks version {found} of the protocol, this computer version {PROTOCOL_VERSION}")]
    OtherVersion {
        /// The device's version of the protocol.
        found: u8,
    },
    /// No device has answered, or the device does not answer any more.
    #[error(
        "the device has been silent for {seconds} s ({bytes} bytes received in all, {damaged} damaged frames, the line \
         lost {gone} times)"
    )]
    Silent {
        /// For how long, seconds.
        seconds: u64,
        /// Bytes that came in all.
        bytes: u64,
        /// Damaged frames that came in all.
        damaged: u64,
        /// Times that the line was gone.
        gone: u64,
    },
    /// The line failed before a device answered.
    #[error("the line to the device failed: {0}")]
    Line(#[from] io::Error),
}
