//! How an array with one entry for each axis is written: as a tuple, whatever the dimension.

use core::{fmt, marker::PhantomData};

use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{Error, SeqAccess, Visitor},
    ser::SerializeTuple,
};

pub(super) fn serialize<S: Serializer, T: Serialize, const D: usize>(
    axes: &[T; D],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let mut tuple = serializer.serialize_tuple(D)?;
    for entry in axes {
        tuple.serialize_element(entry)?;
    }
    tuple.end()
}

struct AxesVisitor<T, const D: usize>(PhantomData<T>);

impl<'de, T: Deserialize<'de> + Copy + Default, const D: usize> Visitor<'de> for AxesVisitor<T, D> {
    type Value = [T; D];

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{D} numbers, one for each axis")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<[T; D], A::Error> {
        let mut axes = [T::default(); D];
        for (number, entry) in axes.iter_mut().enumerate() {
            *entry = sequence.next_element()?.ok_or_else(|| A::Error::invalid_length(number, &self))?;
        }
        Ok(axes)
    }
}

pub(super) fn deserialize<'de, De: Deserializer<'de>, T: Deserialize<'de> + Copy + Default, const D: usize>(
    deserializer: De,
) -> Result<[T; D], De::Error> {
    deserializer.deserialize_tuple(D, AxesVisitor(PhantomData))
}

/// The same where there may be none.
pub(super) mod optional {
    use super::{Deserialize, Deserializer, Serialize, Serializer};

    /// An array that writes itself as [`axes`](super) do.
    #[derive(Serialize, Deserialize)]
    #[serde(transparent, bound(serialize = "T: Serialize", deserialize = "T: Deserialize<'de> + Copy + Default"))]
    struct Axes<T, const D: usize>(#[serde(with = "super")] [T; D]);

    pub(in super::super) fn serialize<S: Serializer, T: Serialize + Copy, const D: usize>(
        axes: &Option<[T; D]>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        axes.map(Axes).serialize(serializer)
    }

    pub(in super::super) fn deserialize<
        'de,
        De: Deserializer<'de>,
        T: Deserialize<'de> + Copy + Default,
        const D: usize,
    >(
        deserializer: De,
    ) -> Result<Option<[T; D]>, De::Error> {
        Ok(Option::<Axes<T, D>>::deserialize(deserializer)?.map(|axes| axes.0))
    }
}
