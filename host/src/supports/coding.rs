//! Supports as plain values, for files and messages: kinds by name, and numbers.

use bhm_core::{
    lattice::Window,
    support::{AnySupport, SupportNumbers, SupportSettings},
};
use serde::{Deserialize, Serialize};

use super::{LearnedSupports, LearnedWith, SupportsError, table::node_of};

/// Which kinds of support the numbers of a file or message stand for; `None` for a kind that this program does not have.
pub(crate) struct Kinds(Vec<Option<&'static str>>);

impl Kinds {
    /// From names in their order. There may be names of kinds that no support is of.
    pub(crate) fn named<'n>(names: impl IntoIterator<Item = &'n str>) -> Self {
        Self(names.into_iter().map(|name| Self::names().find(|known| *known == name)).collect())
    }

    /// The names of every kind there is, in the order in which they are written.
    pub(crate) fn names() -> impl Iterator<Item = &'static str> {
        SupportSettings::ALL.iter().map(SupportSettings::name)
    }

    /// The number of a support's kind among [`names`](Self::names).
    pub(crate) fn number_of(support: &AnySupport<2>) -> u32 {
        Self::names().position(|name| name == support.name()).unwrap_or_default() as u32
    }

    /// The supports of these kinds and numbers.
    ///
    /// # Errors
    /// The first kind that this program does not have, or numbers that are not those of their kind, with the support's node.
    pub(crate) fn supports(
        &self,
        window: &Window<2>,
        coded: impl ExactSizeIterator<Item = (u32, SupportNumbers)>,
    ) -> Result<Vec<AnySupport<2>>, SupportsError> {
        let support = |(index, (kind, numbers)): (usize, (u32, SupportNumbers))| {
            let node = node_of(window, index);
            let known = self.0.get(kind as usize).copied().flatten().ok_or(SupportsError::Kind { node, kind })?;
            let finite = numbers.iter().all(|number| number.is_finite());
            let support = finite.then(|| AnySupport::with_numbers(known, &numbers)).flatten();
            support.ok_or(SupportsError::Numbers { node, kind: known })
        };
        coded.enumerate().map(support).collect()
    }
}

/// Learned supports as a file holds them.
#[derive(Serialize, Deserialize)]
pub(crate) struct Coded {
    origin_m: [f32; 2],
    spacing_m: f32,
    first: [i32; 2],
    width: [u32; 2],
    learned_with: Option<LearnedWith>,
    /// Names of the kinds, a line each: a list of strings would take many times the memory of its bytes in a file.
    kinds: String,
    supports: Vec<(u32, SupportNumbers)>,
}

impl Coded {
    pub(crate) fn of(supports: &LearnedSupports) -> Self {
        Self {
            origin_m: supports.origin_m(),
            spacing_m: supports.spacing_m(),
            first: supports.window().first,
            width: supports.window().width.map(|width| width as u32),
            learned_with: supports.learned_with().cloned(),
            kinds: Kinds::names().collect::<Vec<_>>().join("\n"),
            supports: supports.supports().iter().map(|s| (Kinds::number_of(s), s.numbers())).collect(),
        }
    }

    pub(crate) fn supports(self) -> Result<LearnedSupports, SupportsError> {
        let window = Window { first: self.first, width: self.width.map(|width| width as usize) };
        let supports = Kinds::named(self.kinds.lines()).supports(&window, self.supports.into_iter())?;
        LearnedSupports::new(self.origin_m, self.spacing_m, window, supports, self.learned_with)
    }
}
