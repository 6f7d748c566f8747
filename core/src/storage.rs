//! Memory that is owned or lent, so that a microcontroller's `static` and a computer's heap are the same to a mapper.

#[cfg(feature = "alloc")]
use alloc::{boxed::Box, sync::Arc};
use core::ops::{Deref, DerefMut};

/// Memory to work in: lent for `'m`, or owned (feature `alloc`).
#[derive(Debug)]
pub enum Storage<'m, T: ?Sized> {
    /// Lent by somebody who outlives the borrower.
    Lent(&'m mut T),
    /// Owned.
    #[cfg(feature = "alloc")]
    Owned(Box<T>),
}

impl<T: ?Sized> Deref for Storage<'_, T> {
    type Target = T;

    #[inline(always)]
    fn deref(&self) -> &T {
        match self {
            Self::Lent(memory) => memory,
            #[cfg(feature = "alloc")]
            Self::Owned(memory) => memory,
        }
    }
}

impl<T: ?Sized> DerefMut for Storage<'_, T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut T {
        match self {
            Self::Lent(memory) => memory,
            #[cfg(feature = "alloc")]
            Self::Owned(memory) => memory,
        }
    }
}

impl<'m, T: ?Sized> From<&'m mut T> for Storage<'m, T> {
    fn from(memory: &'m mut T) -> Self {
        Self::Lent(memory)
    }
}

#[cfg(feature = "alloc")]
impl<T: ?Sized> From<Box<T>> for Storage<'_, T> {
    fn from(memory: Box<T>) -> Self {
        Self::Owned(memory)
    }
}

/// Data to read: lent for `'s`, or shared by counting (feature `alloc`). A copy refers to the same data.
#[derive(Debug)]
pub enum Shared<'s, T: ?Sized> {
    /// Lent by somebody who outlives the borrower.
    Lent(&'s T),
    /// Shared with every copy.
    #[cfg(feature = "alloc")]
    Counted(Arc<T>),
}

impl<T: ?Sized> Clone for Shared<'_, T> {
    fn clone(&self) -> Self {
        match self {
            Self::Lent(data) => Self::Lent(data),
            #[cfg(feature = "alloc")]
            Self::Counted(data) => Self::Counted(Arc::clone(data)),
        }
    }
}

impl<T: ?Sized> Deref for Shared<'_, T> {
    type Target = T;

    #[inline(always)]
    fn deref(&self) -> &T {
        match self {
            Self::Lent(data) => data,
            #[cfg(feature = "alloc")]
            Self::Counted(data) => data,
        }
    }
}

impl<T: ?Sized + PartialEq> PartialEq for Shared<'_, T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<'s, T: ?Sized> From<&'s T> for Shared<'s, T> {
    fn from(data: &'s T) -> Self {
        Self::Lent(data)
    }
}

#[cfg(feature = "alloc")]
impl<T: ?Sized> From<Arc<T>> for Shared<'_, T> {
    fn from(data: Arc<T>) -> Self {
        Self::Counted(data)
    }
}
