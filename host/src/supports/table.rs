use bhm_core::{
    kernel::KernelChoice,
    lattice::Window,
    settings::Settings,
    support::{AnySupport, SupportChoice, SupportTable},
};

use super::{SupportsError, intern};

/// Longest text that says where supports were learned, bytes.
pub const MAX_SOURCE_BYTES: usize = 1 << 12;

/// What supports were learned with: for people, and not part of what a map says.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedWith {
    /// The kernel.
    pub kernel: KernelChoice,
    /// The kernel's shape, in units of spacing².
    pub kernel_shape: f32,
    /// From what and how, in words; empty where that is not known.
    pub source: String,
}

/// A support of its own for each lattice node of a window.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedSupports {
    origin_m: [f32; 2],
    spacing_m: f32,
    window: Window<2>,
    supports: Vec<AnySupport<2>>,
    learned_with: LearnedWith,
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
        learned_with: LearnedWith,
    ) -> Result<Self, SupportsError> {
        let LearnedWith { kernel: _, kernel_shape, source } = &learned_with;
        for (name, expected, good) in [
            ("spacing", "a positive number of metres", spacing_m > 0.0 && spacing_m.is_finite()),
            ("origin", "finite numbers", origin_m.iter().all(|metres| metres.is_finite())),
            ("kernel shape", "a positive number", *kernel_shape > 0.0 && kernel_shape.is_finite()),
            ("source", "at most 4096 bytes", source.len() <= MAX_SOURCE_BYTES),
        ] {
            if !good {
                return Err(SupportsError::Value { name, expected });
            }
        }
        SupportTable::new(window, &supports)?;
        if supports.is_empty() {
            return Err(SupportsError::Empty);
        }
        for (index, support) in supports.iter().enumerate() {
            // What is not the support of its own numbers would come out of a file as another one.
            let (kind, numbers) = (support.choice(), support.numbers());
            let finite = numbers.iter().all(|number| number.is_finite());
            if !finite || kind.with_numbers::<2>(&numbers) != Some(*support) {
                return Err(SupportsError::Numbers { node: node_of(&window, index), kind: kind.name() });
            }
        }
        let digest = digest_of(origin_m, spacing_m, &window, &supports);
        Ok(Self { origin_m, spacing_m, window, supports, learned_with, digest })
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
        &self.window
    }

    /// The nodes' supports, in the window's order.
    #[must_use]
    pub fn supports(&self) -> &[AnySupport<2>] {
        &self.supports
    }

    /// What they were learned with.
    #[must_use]
    pub fn learned_with(&self) -> &LearnedWith {
        &self.learned_with
    }

    /// As the core takes them.
    #[must_use]
    pub fn table(&self) -> SupportTable<'_, 2> {
        // `new` made sure that it is one.
        SupportTable::new(self.window, &self.supports).unwrap_or(SupportTable::EMPTY)
    }

    /// A checksum (CRC-32) of everything that decides what a map says: equal tables have equal digests, on every machine.
    /// Never 0, which stands for "no table". It finds accidents, not forgeries.
    #[must_use]
    pub fn digest(&self) -> u32 {
        self.digest
    }

    /// How many supports there are of each kind that occurs.
    pub fn kinds(&self) -> impl Iterator<Item = (SupportChoice, usize)> {
        let count = |kind| self.supports.iter().filter(|support| support.choice() == kind).count();
        SupportChoice::ALL.iter().map(move |kind| (*kind, count(*kind))).filter(|(_, count)| *count > 0)
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

    /// The same supports for as long as the program runs; equal ones are the same memory.
    ///
    /// The core borrows a table, and a model that borrows is bound to where the table lies: maps, posteriors in shared
    /// memory and whatever is asked through them would each carry a lifetime, to no use, since a program meets one or two
    /// tables in its life. So a table is leaked, once for each distinct content however often it is loaded or received.
    #[must_use]
    pub fn interned(self) -> &'static Self {
        intern::interned(self)
    }
}

/// The table of supports that may be there.
pub(crate) fn table_of(supports: Option<&'static LearnedSupports>) -> SupportTable<'static, 2> {
    supports.map_or(SupportTable::EMPTY, LearnedSupports::table)
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
        hasher.update(support.choice().name().as_bytes());
        for number in support.numbers() {
            hasher.update(&number.to_le_bytes());
        }
    }
    hasher.finalize().max(1)
}
