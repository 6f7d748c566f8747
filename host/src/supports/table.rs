use std::sync::Arc;

use bhm_core::{
    kernel::KernelSettings,
    lattice::Window,
    settings::Settings,
    support::{AnySupport, SupportSettings, SupportTable},
};
use serde::{Deserialize, Serialize};

use super::SupportsError;

/// Longest text that says where supports were learned, bytes.
pub const MAX_SOURCE_BYTES: usize = 1 << 12;

/// What supports were learned with: for people, and not part of what a map says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LearnedWith {
    /// The kernel.
    pub kernel: KernelSettings,
    /// From what and how, in words; empty where that is not known.
    pub source: String,
}

/// A support of its own for each lattice node of a window. A copy shares the supports.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedSupports {
    origin_m: [f32; 2],
    spacing_m: f32,
    table: SupportTable<'static, 2>,
    learned_with: Option<LearnedWith>,
    digest: u32,
}

impl LearnedSupports {
    /// The supports of a window's nodes, the last axis fastest, on the lattice that has node 0 at `origin_m`.
    ///
    /// # Errors
    /// What [`SupportsError`] names, up to the lattice of a map: see [`matches`](Self::matches).
    pub fn new(
        origin_m: [f32; 2],
        spacing_m: f32,
        window: Window<2>,
        supports: Vec<AnySupport<2>>,
        learned_with: Option<LearnedWith>,
    ) -> Result<Self, SupportsError> {
        let source_bytes = learned_with.as_ref().map_or(0, |with| with.source.len());
        for (name, expected, good) in [
            ("spacing", "a positive number of metres", spacing_m > 0.0 && spacing_m.is_finite()),
            ("origin", "finite numbers", origin_m.iter().all(|metres| metres.is_finite())),
            ("source", "at most 4096 bytes", source_bytes <= MAX_SOURCE_BYTES),
        ] {
            if !good {
                return Err(SupportsError::Value { name, expected });
            }
        }
        let table = SupportTable::new(window, Arc::<[_]>::from(supports))?;
        let supports = table.supports();
        if supports.is_empty() {
            return Err(SupportsError::Empty);
        }
        for (index, support) in supports.iter().enumerate() {
            // What is not the support of its own numbers would come out of a file as another one.
            let (kind, numbers) = (support.name(), support.numbers());
            let finite = numbers.iter().all(|number| number.is_finite());
            if !finite || AnySupport::with_numbers(kind, &numbers) != Some(*support) {
                return Err(SupportsError::Numbers { node: node_of(&window, index), kind });
            }
        }
        let digest = digest_of(origin_m, spacing_m, &window, supports);
        Ok(Self { origin_m, spacing_m, table, learned_with, digest })
    }

    /// Where lattice node 0 sits, metres.
    #[must_use]
    pub fn origin_m(&self) -> [f32; 2] {
        self.origin_m
    }

    /// Distance between neighbouring nodes, metres.
    #[must_use]
    pub fn spacing_m(&self) -> f32 {
        self.spacing_m
    }

    /// Which nodes have a support of their own.
    #[must_use]
    pub fn window(&self) -> &Window<2> {
        self.table.window()
    }

    /// The nodes' supports, in the window's order.
    #[must_use]
    pub fn supports(&self) -> &[AnySupport<2>] {
        self.table.supports()
    }

    /// What the supports were learned with, where that is known: it does not travel through shared memory.
    #[must_use]
    pub fn learned_with(&self) -> Option<&LearnedWith> {
        self.learned_with.as_ref()
    }

    /// The supports as the core takes them.
    #[must_use]
    pub fn table(&self) -> &SupportTable<'static, 2> {
        &self.table
    }

    /// A checksum (CRC-32) of everything that decides what a map says: equal tables have equal digests, on every machine.
    /// Never 0, which stands for "no table". It finds accidents, not forgeries.
    #[must_use]
    pub fn digest(&self) -> u32 {
        self.digest
    }

    /// How many supports there are of each kind that occurs.
    pub fn kinds(&self) -> impl Iterator<Item = (&'static str, usize)> {
        let count = |kind| self.supports().iter().filter(|support| support.name() == kind).count();
        SupportSettings::ALL.iter().map(move |kind| (kind.name(), count(kind.name()))).filter(|(_, count)| *count > 0)
    }

    /// Whether they stand on the lattice of a map with these settings.
    ///
    /// # Errors
    /// [`SupportsError::Spacing`] and [`SupportsError::Origin`], with both values.
    pub fn matches(&self, settings: &Settings) -> Result<(), SupportsError> {
        // Exactly: a lattice that is off by a little is off by a node far from its origin.
        if self.spacing_m != settings.spacing_m {
            return Err(SupportsError::Spacing { learned_m: self.spacing_m, map_m: settings.spacing_m });
        }
        if self.origin_m != settings.origin_m {
            return Err(SupportsError::Origin { learned_m: self.origin_m, map_m: settings.origin_m });
        }
        Ok(())
    }
}

/// The table of supports that may be there.
pub(crate) fn table_of(supports: Option<&LearnedSupports>) -> SupportTable<'static, 2> {
    supports.map_or(SupportTable::EMPTY, |supports| supports.table.clone())
}

/// The node of a window's support of that number.
pub(super) fn node_of(window: &Window<2>, index: usize) -> [i32; 2] {
    let height = window.width[1].max(1);
    // In 64 bits, since neither summand is known to be small.
    let node = |first: i32, steps: usize| (i64::from(first) + steps as i64) as i32;
    [node(window.first[0], index / height), node(window.first[1], index % height)]
}

fn digest_of(origin_m: [f32; 2], spacing_m: f32, window: &Window<2>, supports: &[AnySupport<2>]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    for number in [origin_m[0], origin_m[1], spacing_m] {
        hasher.update(&number.to_le_bytes());
    }
    for axis in 0..2 {
        hasher.update(&window.first[axis].to_le_bytes());
        hasher.update(&(window.width[axis] as u64).to_le_bytes());
    }
    for support in supports {
        // The name and not its number: the order of the kinds may change.
        hasher.update(support.name().as_bytes());
        for number in support.numbers() {
            hasher.update(&number.to_le_bytes());
        }
    }
    hasher.finalize().max(1)
}
