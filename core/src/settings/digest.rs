//! One encoding of settings for files, shared memory and serial lines, and one digest of it.

use core::fmt;

use postcard::ser_flavors::Flavor;
use serde::Serialize;

use super::Settings;

/// Most bytes that encoded settings of the plane take, for messages of fixed size.
pub const ENCODED_BYTES: usize = 192;

/// A checksum of settings, or of anything else that is encoded the same way: equal values have equal digests, on every machine.
///
/// The CRC-32 of the postcard encoding. It finds accidents, not forgeries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Digest(pub u32);

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:08x}", self.0)
    }
}

impl Digest {
    /// The digest of a value.
    ///
    /// # Errors
    /// If the value cannot be encoded; settings always can.
    pub fn of(value: &impl Serialize) -> Result<Self, postcard::Error> {
        postcard::serialize_with_flavor(value, Checksum(crc32fast::Hasher::new()))
    }
}

impl<const D: usize> Settings<D> {
    /// What distinguishes these settings from others.
    #[must_use]
    pub fn digest(&self) -> Digest {
        // Plain numbers and enumerations of them can always be encoded.
        Digest::of(self).unwrap_or(Digest(0))
    }
}

/// Where encoded bytes are counted in and forgotten.
struct Checksum(crc32fast::Hasher);

impl Flavor for Checksum {
    type Output = Digest;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.0.update(&[byte]);
        Ok(())
    }

    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        self.0.update(bytes);
        Ok(())
    }

    fn finalize(self) -> postcard::Result<Digest> {
        Ok(Digest(self.0.finalize()))
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::{
        beam::AnyBeamRule,
        kernel::KernelSettings,
        prior::{MaternPrior, PriorSettings, WhitePrior},
        profile,
        rule::{AnyRule, JaakkolaJordan, XiStart},
        settings::BiasSettings,
        support::SupportSettings,
    };

    fn variants() -> Vec<Settings> {
        let settings = profile::COMPACT.settings;
        type Change = fn(&mut Settings);
        let changes: [Change; 18] = [
            |_| (),
            |s| s.origin_m[1] = -0.0,
            |s| s.spacing_m = 0.25,
            |s| s.tile.stencil = 6,
            |s| s.tile.width = [12, 13],
            |s| s.tile.stride = [8, 7],
            |s| s.tile.count = Some([0, 0]),
            |s| s.prior = PriorSettings::White(WhitePrior { precision: 2e-4 }),
            |s| s.prior = PriorSettings::Matern(MaternPrior { deviation: 20.0, ..MaternPrior::DEFAULT }),
            |s| s.prior = PriorSettings::Matern(MaternPrior { range_m: 3.0, ..MaternPrior::DEFAULT }),
            |s| s.bias = Some(BiasSettings::DEFAULT),
            |s| s.bias = Some(BiasSettings { precision: 2.0 }),
            |s| s.limits.range_max_m = 41.0,
            |s| s.limits.no_return_free_m = 1.0,
            |s| s.passes = 2,
            |s| s.forgetting = 0.5,
            |s| s.rule = AnyRule::JaakkolaJordan(JaakkolaJordan { start: XiStart::Constant(1.0) }),
            |s| s.rule = AnyRule::JaakkolaJordan(JaakkolaJordan { start: XiStart::PredictedUpTo(1.0) }),
        ];
        let changed = changes.iter().map(|change| {
            let mut settings = settings;
            change(&mut settings);
            settings
        });
        changed
            .chain(KernelSettings::ALL[1..].iter().map(|kernel| Settings { kernel: *kernel, ..settings }))
            .chain(SupportSettings::ALL[1..].iter().map(|support| Settings { support: *support, ..settings }))
            .chain(AnyBeamRule::ALL[1..].iter().map(|beam| Settings { beam: *beam, ..settings }))
            .collect()
    }

    #[test]
    fn every_setting_counts() {
        let mut digests: Vec<_> = variants().iter().map(|settings| settings.digest().0).collect();
        let all = digests.len();
        digests.sort_unstable();
        digests.dedup();
        assert_eq!(digests.len(), all);
    }

    /// With another number or order of fields, what was written before is read as something else. (Another default changes this
    /// number too, and no version.)
    #[test]
    fn whoever_changes_the_encoding_raises_the_versions_that_carry_it() {
        let all = variants()
            .iter()
            .fold(0_u32, |all, settings| Digest::of(&(all, settings)).expect("settings can be encoded").0);
        let remedy = "raise the versions that carry settings (CONTRIBUTING.md), then this number";
        assert_eq!(all, 1_771_378_814, "{remedy}");
    }

    #[test]
    fn what_is_encoded_is_read_again_and_fits_a_message() {
        for settings in variants().iter().chain(profile::ALL.map(|profile| &profile.settings)) {
            let mut buffer = [0; ENCODED_BYTES];
            let encoded = postcard::to_slice(settings, &mut buffer).expect("they fit");
            assert!(encoded.len() + 32 <= ENCODED_BYTES, "{} bytes", encoded.len());
            assert_eq!(postcard::from_bytes::<Settings>(encoded).as_ref(), Ok(settings));
        }
    }
}
