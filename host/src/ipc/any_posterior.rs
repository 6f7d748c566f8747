use std::time::Duration;

use bhm_core::{
    map::ModelledMap,
    shape::{self, SHAPES, ShapeVisitor},
};

use super::{
    IpcError, Participant, PosteriorHeader, PosteriorRejected, PosteriorSample, PosteriorSubscriber, Received,
};
use crate::map::{PosteriorDigest, posterior_digest};

/// A posterior of any compiled shape, for programs that learn its shape at run time.
pub trait AnyPosterior: ModelledMap<2> {
    /// Which mapper published the posterior, and when.
    fn header(&self) -> &PosteriorHeader;

    /// What distinguishes the posterior from another, bit for bit: the digest of a map that holds these tiles and no others.
    fn digest(&self) -> PosteriorDigest;
}

impl<const M: usize, const B: usize> AnyPosterior for PosteriorSample<M, B> {
    fn header(&self) -> &PosteriorHeader {
        self.header()
    }

    fn digest(&self) -> PosteriorDigest {
        posterior_digest(self.tiles().iter().map(|tile| (tile.index, tile.view())))
    }
}

/// A reader of posteriors of any compiled shape.
pub trait AnyPosteriorSubscriber {
    /// See [`PosteriorSubscriber::receive`].
    ///
    /// # Errors
    /// If iceoryx2 failed.
    fn receive(&mut self, patience: Duration) -> Received<Box<dyn AnyPosterior>, PosteriorRejected>;
}

impl<const M: usize, const B: usize> AnyPosteriorSubscriber for PosteriorSubscriber<M, B> {
    fn receive(&mut self, patience: Duration) -> Received<Box<dyn AnyPosterior>, PosteriorRejected> {
        let received = self.receive(patience)?;
        Ok(received.map(|checked| checked.map(|sample| Box::new(sample) as Box<dyn AnyPosterior>)))
    }
}

/// A reader of the domain's posterior, whatever its tiles' shape, as long as it is compiled in.
///
/// # Errors
/// [`IpcError::Absent`] as long as no mapper was there, [`IpcError::Incompatible`] if its tiles have none of the compiled
/// shapes or another layout, [`IpcError::TooManyReaders`].
pub fn open_posterior_any(participant: &Participant) -> Result<Box<dyn AnyPosteriorSubscriber>, IpcError> {
    let incompatible = || IpcError::Incompatible { service: "posterior" };
    for shape in SHAPES {
        match shape::visit(shape, Open(participant)).unwrap_or_else(|_| Err(incompatible())) {
            Err(IpcError::Incompatible { .. }) => {}
            settled => return settled,
        }
    }
    Err(incompatible())
}

struct Open<'p>(&'p Participant);

impl ShapeVisitor for Open<'_> {
    type Output = Result<Box<dyn AnyPosteriorSubscriber>, IpcError>;

    fn visit<const M: usize, const B: usize>(self) -> Self::Output {
        Ok(Box::new(PosteriorSubscriber::<M, B>::open(self.0)?))
    }
}
