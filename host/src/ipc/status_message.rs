use iceoryx2::prelude::ZeroCopySend;

use super::{
    LayoutError,
    layout::Layout,
    wire::{Name, PlainNumbers, name_of, text_of},
};

/// Most counters that a status carries: those of a mapper, and of both ends of the line where it sits behind one.
pub const MAX_COUNTERS: usize = 128;

/// A counter and what it counts.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("bhm.counter.v1")]
pub struct NamedCounter {
    /// UTF-8, filled up with zeros.
    pub name: Name,
    /// How many.
    pub value: u64,
}

/// How far the mapper has come, and everything it counts. Names travel with the numbers, so that an onlooker of any
/// version can print them.
#[repr(C)]
#[derive(Clone, Copy, Debug, ZeroCopySend)]
#[type_name("bhm.status.v2")]
pub struct StatusMessage {
    /// [`StatusMessage::MAGIC`].
    pub magic: u64,
    /// [`StatusMessage::VERSION`].
    pub version: u32,
    /// [`StatusMessage::ENDED`] or 0.
    pub flags: u32,
    /// Which run of the mapper; never 0.
    pub mapper: u64,
    /// Which run of which source the mapper heard last; 0 before the first.
    pub source: u64,
    /// Every scan of that source up to this sequence number is dealt with: integrated, or refused and counted.
    pub handled: u64,
    /// How many of the counters are in use.
    pub counters_len: u32,
    /// Zero.
    pub reserved: u32,
    /// The counters.
    pub counters: [NamedCounter; MAX_COUNTERS],
}

// SAFETY: integers and arrays of them, the counters included.
unsafe impl PlainNumbers for StatusMessage {}

/// How far the mapper has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Which run of which source was heard last, and the scan up to which all of its scans are dealt with.
    pub handled: Option<(u64, u64)>,
    /// Whether that source said that it ends, and its last scan is dealt with.
    pub ended: bool,
}

/// A status message that cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StatusRejected {
    /// The message is no status, or has another layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// The number of the mapper's run is 0.
    #[error("status message with mapper number 0")]
    NoMapper,
    /// The message claims more counters than it has room for.
    #[error("status message of {found} counters, at most {MAX_COUNTERS} fit")]
    Counters {
        /// The counters that the message claims.
        found: u32,
    },
    /// A counter's name is not UTF-8 text.
    #[error("status message: the name of counter {index} is not UTF-8 text")]
    Name {
        /// Position of the counter.
        index: usize,
    },
}

impl StatusMessage {
    /// What a status begins with.
    pub const MAGIC: u64 = u64::from_le_bytes(*b"BHM stat");
    /// The layout described here.
    pub const VERSION: u32 = 2;
    /// Flag: the source has ended, and its last scan is dealt with.
    pub const ENDED: u32 = 1;
    const LAYOUT: Layout =
        Layout { what: "status message", magic: Self::MAGIC, version: Self::VERSION, flags: Self::ENDED };

    /// Writes a status over whatever was here; counters beyond [`MAX_COUNTERS`] are left out.
    pub fn write<'n>(&mut self, mapper: u64, progress: &Progress, counters: impl IntoIterator<Item = (&'n str, u64)>) {
        let mut len = 0;
        for (slot, (name, value)) in self.counters.iter_mut().zip(counters) {
            *slot = NamedCounter { name: name_of(name), value };
            len += 1;
        }
        self.counters[len..].fill(NamedCounter::default());
        self.counters_len = len as u32;
        self.magic = Self::MAGIC;
        self.version = Self::VERSION;
        self.flags = if progress.ended { Self::ENDED } else { 0 };
        self.mapper = mapper;
        (self.source, self.handled) = progress.handled.unwrap_or((0, 0));
        self.reserved = 0;
    }

    /// Whether the message can be read.
    ///
    /// # Errors
    /// The first fault found in the message.
    pub fn check(&self) -> Result<(), StatusRejected> {
        Self::LAYOUT.check(self.magic, self.version, self.flags)?;
        if self.reserved != 0 {
            return Err(LayoutError::Flags { what: Self::LAYOUT.what, found: self.flags }.into());
        }
        if self.mapper == 0 {
            return Err(StatusRejected::NoMapper);
        }
        if self.counters_len as usize > MAX_COUNTERS {
            return Err(StatusRejected::Counters { found: self.counters_len });
        }
        match self.meant().iter().position(|counter| text_of(&counter.name).is_none()) {
            Some(index) => Err(StatusRejected::Name { index }),
            None => Ok(()),
        }
    }

    /// How far the mapper has come.
    #[must_use]
    pub fn progress(&self) -> Progress {
        let handled = (self.source != 0).then_some((self.source, self.handled));
        Progress { handled, ended: self.flags & Self::ENDED != 0 }
    }

    /// The counters, by name.
    pub fn counters(&self) -> impl Iterator<Item = (&str, u64)> {
        self.meant().iter().filter_map(|counter| Some((text_of(&counter.name)?, counter.value)))
    }

    fn meant(&self) -> &[NamedCounter] {
        &self.counters[..MAX_COUNTERS.min(self.counters_len as usize)]
    }
}
