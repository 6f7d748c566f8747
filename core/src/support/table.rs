use core::fmt;

use super::AnySupport;
use crate::{
    lattice::{MAX_NODE, Node, Window},
    storage::Shared,
};

/// A support of its own for each node of a window, in memory that is lent or shared.
#[derive(Clone, Debug, PartialEq)]
pub struct SupportTable<'s, const D: usize> {
    window: Window<D>,
    supports: Shared<'s, [AnySupport<D>]>,
}

/// A table that cannot be used.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableError {
    /// The window reaches beyond the nodes that a lattice places points at.
    Window,
    /// It has not one support for each node of its window.
    Count {
        /// Nodes of the window.
        nodes: usize,
        /// Supports given.
        supports: usize,
    },
}

impl fmt::Display for TableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Window => write!(f, "the window of the supports reaches beyond {FARTHEST} nodes from the origin"),
            Self::Count { nodes, supports } => write!(f, "{supports} supports for a window of {nodes} nodes"),
        }
    }
}

/// No node of a window may be further from the origin: a little further than a point's, so that stencils fit.
const FARTHEST: i32 = 2 * MAX_NODE;

impl core::error::Error for TableError {}

impl<'s, const D: usize> SupportTable<'s, D> {
    /// No node has a support of its own.
    pub const EMPTY: Self = Self { window: Window { first: [0; D], width: [0; D] }, supports: Shared::Lent(&[]) };

    /// The supports of a window's nodes, in the window's order.
    ///
    /// # Errors
    /// [`TableError`] if they are not as many, or the window is further away than any point can be.
    pub fn new(window: Window<D>, supports: impl Into<Shared<'s, [AnySupport<D>]>>) -> Result<Self, TableError> {
        let supports = supports.into();
        let near = |first: i32, width: usize| first.unsigned_abs() <= FARTHEST as u32 && width <= 2 * FARTHEST as usize;
        if !window.first.iter().zip(window.width).all(|(first, width)| near(*first, width)) {
            return Err(TableError::Window);
        }
        // In 64 bits the product of two such widths is a number; of more, or in fewer bits, it need not be.
        let nodes = window.width.iter().try_fold(1_usize, |nodes, width| nodes.checked_mul(*width));
        let nodes = nodes.ok_or(TableError::Window)?;
        if nodes != supports.len() {
            return Err(TableError::Count { nodes, supports: supports.len() });
        }
        Ok(Self { window, supports })
    }

    /// Which nodes have a support of their own.
    #[must_use]
    pub const fn window(&self) -> &Window<D> {
        &self.window
    }

    /// Their supports, in the window's order.
    #[must_use]
    pub fn supports(&self) -> &[AnySupport<D>] {
        &self.supports
    }

    /// Whether no node has a support of its own.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.supports.is_empty()
    }

    /// The node's own support, if it has one.
    #[inline]
    #[must_use]
    pub fn get(&self, node: &Node<D>) -> Option<&AnySupport<D>> {
        self.supports.get(self.window.index_of_whole(node, 1)?)
    }
}

/// Which support stands at which node.
#[derive(Clone, Debug, PartialEq)]
pub struct Supports<'s, const D: usize> {
    /// What stands where the table has nothing.
    pub everywhere: AnySupport<D>,
    /// Nodes with a support of their own.
    pub table: SupportTable<'s, D>,
}

impl<const D: usize> Supports<'_, D> {
    /// A node's support.
    #[inline]
    #[must_use]
    pub fn at(&self, node: &Node<D>) -> &AnySupport<D> {
        self.table.get(node).unwrap_or(&self.everywhere)
    }

    /// Every support there is: the one that stands everywhere, then the table's.
    pub fn all(&self) -> impl Iterator<Item = &AnySupport<D>> {
        core::iter::once(&self.everywhere).chain(self.table.supports())
    }
}
