//! The numbers of a posterior, in the order in which they stand in a file.

use std::array;
use std::io;

use bhm_core::posterior::Posterior;

/// Bytes of a tile's record.
pub(super) const fn record_bytes(supports: usize, band: usize) -> usize {
    // Two bands; the mean and two borders; the bias's three numbers; the log determinant's two.
    (2 * supports * band + 3 * supports + 3 + 2) * size_of::<f32>()
}

const PARTS: usize = 9;

/// The parts of a posterior in their order, lent as the posterior is. Taken apart whole, so that a field added to it fails to
/// compile here.
macro_rules! parts {
    ($posterior:expr, $flattened:ident, $one:path) => {{
        let Posterior {
            information,
            covariance,
            mean,
            border_information,
            border_covariance,
            bias_information,
            bias_covariance,
            bias_mean,
            log_determinant,
        } = $posterior;
        [
            information.$flattened(),
            covariance.$flattened(),
            mean,
            border_information,
            border_covariance,
            $one(bias_information),
            $one(bias_covariance),
            $one(bias_mean),
            log_determinant,
        ]
    }};
}

fn parts<const M: usize, const B: usize>(posterior: &Posterior<M, B>) -> [&[f32]; PARTS] {
    parts!(posterior, as_flattened, array::from_ref)
}

fn parts_mut<const M: usize, const B: usize>(posterior: &mut Posterior<M, B>) -> [&mut [f32]; PARTS] {
    parts!(posterior, as_flattened_mut, array::from_mut)
}

/// Writes a record.
pub(super) fn write<const M: usize, const B: usize>(
    posterior: &Posterior<M, B>,
    to: &mut dyn io::Write,
) -> io::Result<()> {
    let bytes: Vec<u8> = parts(posterior).into_iter().flatten().flat_map(|number| number.to_le_bytes()).collect();
    to.write_all(&bytes)
}

/// Reads a record of [`record_bytes`]; says what was expected of its numbers if they cannot be a posterior's.
pub(super) fn read<const M: usize, const B: usize>(
    record: &[u8],
    posterior: &mut Posterior<M, B>,
) -> Result<(), &'static str> {
    let (numbers, _) = record.as_chunks();
    for (to, from) in parts_mut(posterior).into_iter().flatten().zip(numbers) {
        *to = f32::from_le_bytes(*from);
    }
    if !parts(posterior).into_iter().flatten().all(|number| number.is_finite()) {
        return Err("finite numbers");
    }
    let diagonals = posterior.information.iter().chain(&posterior.covariance).map(|row| row[0]);
    if !diagonals.chain([posterior.bias_information, posterior.bias_covariance]).all(|variance| variance > 0.0) {
        return Err("positive precisions and variances");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_is_postcard_and_as_long_as_promised() {
        let posterior = Posterior::<2, 2> {
            information: [[1.0, 2.0], [3.0, 4.0]],
            covariance: [[5.0, 6.0], [7.0, 8.0]],
            mean: [9.0, 10.0],
            border_information: [11.0, 12.0],
            border_covariance: [13.0, 14.0],
            bias_information: 15.0,
            bias_covariance: 16.0,
            bias_mean: 17.0,
            log_determinant: [18.0, 19.0],
        };
        let mut record = Vec::new();
        write(&posterior, &mut record).unwrap();
        let expected: [f32; 19] = array::from_fn(|i| (i + 1) as f32);
        assert_eq!(record, postcard::to_allocvec(&expected).unwrap());
        assert_eq!(record.len(), record_bytes(2, 2));
        let mut back = Posterior { mean: [0.0; 2], ..posterior.clone() };
        read(&record, &mut back).unwrap();
        assert_eq!(back, posterior);
    }
}
