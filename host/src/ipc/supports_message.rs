use bhm_core::{
    lattice::Window,
    support::{AnySupport, SupportNumbers, SupportSettings},
};
use iceoryx2::prelude::ZeroCopySend;

use super::{
    LayoutError,
    layout::Layout,
    wire::{Name, PlainNumbers, name_of, text_of},
};
use crate::supports::{Kinds, LearnedSupports, SupportsError};

/// Most kinds of support that a message can name.
pub const MAX_SUPPORT_KINDS: usize = 16;

const _: () = assert!(SupportSettings::ALL.len() <= MAX_SUPPORT_KINDS, "a new layout is needed");

/// What stands before learned supports: on which lattice they stand, and what their numbers mean.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[type_name("bhm.supports.v2")]
pub struct SupportsHeader {
    /// [`SupportsHeader::MAGIC`].
    pub magic: u64,
    /// [`SupportsHeader::VERSION`].
    pub version: u32,
    /// The digest of the supports and their lattice, by which a posterior's header names it; never 0.
    pub digest: u32,
    /// Supports that follow.
    pub count: u64,
    /// Where lattice node 0 sits, metres.
    pub origin_m: [f32; 2],
    /// Distance between neighbouring nodes, metres.
    pub spacing_m: f32,
    /// The first node that has a support of its own.
    pub first: [i32; 2],
    /// Nodes along each axis that have a support of their own.
    pub width: [u32; 2],
    /// Names of the kinds of support, UTF-8, filled up with zeros; those that are not needed are empty.
    pub kinds: [Name; MAX_SUPPORT_KINDS],
}

// SAFETY: integers, floating-point numbers, and arrays of them.
unsafe impl PlainNumbers for SupportsHeader {}

/// A support of one node.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[type_name("bhm.support.v1")]
pub struct SupportMessage {
    /// The place of the support's kind among [`SupportsHeader::kinds`].
    pub kind: u32,
    /// The support as plain numbers.
    pub numbers: SupportNumbers,
}

// SAFETY: integers, floating-point numbers, and arrays of them.
unsafe impl PlainNumbers for SupportMessage {}

/// Learned supports that cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SupportsRejected {
    /// The message is no message of supports, or has another layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// The number of supports is not the one that arrived.
    #[error("message of {claimed} supports, {arrived} arrived")]
    Count {
        /// What the header says.
        claimed: u64,
        /// What arrived.
        arrived: usize,
    },
    /// The supports do not have the digest that the header states.
    #[error("supports have the digest {found:08x}, not {claimed:08x}")]
    Digest {
        /// What the header says.
        claimed: u32,
        /// The digest of what arrived.
        found: u32,
    },
    /// The values in the message are not usable as supports.
    #[error(transparent)]
    Supports(#[from] SupportsError),
}

impl SupportsHeader {
    /// What supports begin with.
    pub const MAGIC: u64 = u64::from_le_bytes(*b"BHM supp");
    /// The layout described here, of header and supports.
    pub const VERSION: u32 = 2;
    const LAYOUT: Layout = Layout { what: "message of supports", magic: Self::MAGIC, version: Self::VERSION, flags: 0 };

    pub(super) fn write(&mut self, supports: &LearnedSupports) {
        let mut kinds = [Name::default(); MAX_SUPPORT_KINDS];
        for (to, kind) in kinds.iter_mut().zip(Kinds::names()) {
            *to = name_of(kind);
        }
        *self = Self {
            magic: Self::MAGIC,
            version: Self::VERSION,
            digest: supports.digest(),
            count: supports.supports().len() as u64,
            origin_m: supports.origin_m(),
            spacing_m: supports.spacing_m(),
            first: supports.window().first,
            width: supports.window().width.map(|width| width as u32),
            kinds,
        };
    }

    /// The supports, if header and messages can be used. What they were learned with does not travel.
    ///
    /// # Errors
    /// The first fault found in the header or the messages.
    pub fn check(&self, supports: &[SupportMessage]) -> Result<LearnedSupports, SupportsRejected> {
        Self::LAYOUT.check(self.magic, self.version, 0)?;
        if self.count != supports.len() as u64 {
            return Err(SupportsRejected::Count { claimed: self.count, arrived: supports.len() });
        }
        let window = Window { first: self.first, width: self.width.map(|width| width as usize) };
        // A name that is no text is the name of no kind.
        let kinds = Kinds::named(self.kinds.iter().map(|name| text_of(name).unwrap_or_default()));
        let supports = kinds.supports(&window, supports.iter().map(|message| (message.kind, message.numbers)))?;
        let learned = LearnedSupports::new(self.origin_m, self.spacing_m, window, supports, None)?;
        if learned.digest() != self.digest {
            return Err(SupportsRejected::Digest { claimed: self.digest, found: learned.digest() });
        }
        Ok(learned)
    }
}

impl SupportMessage {
    /// Writes a support over whatever was here.
    pub fn write(&mut self, support: &AnySupport<2>) {
        *self = Self { kind: Kinds::number_of(support), numbers: support.numbers() };
    }
}
