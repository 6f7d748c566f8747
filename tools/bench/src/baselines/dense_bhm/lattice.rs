use super::super::{Failed, Setup, lattice::Lattice};

/// Supports at most: the matrices of so many are 288 MB each.
const MOST_SUPPORTS: usize = 6_000;
/// By which a spacing with too many supports is widened.
const WIDER: f64 = 1.02;
/// Features below are taken as zero.
const LEAST_FEATURE: f64 = 1e-12;

/// Features that are not zero, by their support, in rising order.
pub(super) type Row = Vec<(usize, f64)>;

/// Over the area of a setup, as fine as its size says or as can be.
pub(super) fn over(setup: &Setup) -> Result<Lattice, Failed> {
    let origin_m = setup.area_m[0].map(f64::from);
    let extent_m = [0, 1].map(|axis| f64::from(setup.area_m[1][axis]) - origin_m[axis]);
    let mut spacing_m = f64::from(setup.size);
    let sound = spacing_m > 0.0 && origin_m.iter().chain(&extent_m).all(|x| x.is_finite() && x.abs() < 1e9);
    if !(sound && spacing_m.is_finite() && extent_m.iter().all(|x| *x >= 0.0)) {
        return Err(Failed(format!("no lattice of {spacing_m} m over {:?} m", setup.area_m)));
    }
    // Finer than this it cannot be: the nodes of either axis alone would be too many, or all of them.
    let [width_m, height_m] = extent_m;
    let most = MOST_SUPPORTS as f64;
    spacing_m = spacing_m.max(width_m / most).max(height_m / most).max((width_m * height_m / most).sqrt());
    loop {
        let shape = extent_m.map(|x| (x / spacing_m).ceil() as usize + 1);
        if shape[0] * shape[1] <= MOST_SUPPORTS {
            return Ok(Lattice { spacing_m, origin: origin_m.map(|x| x / spacing_m), shape });
        }
        spacing_m *= WIDER;
    }
}

/// Every feature near a point; empty where there is none, or the point is nowhere.
pub(super) fn row(lattice: &Lattice, point_m: [f32; 2]) -> Row {
    let mut row = Row::new();
    lattice.features(point_m, LEAST_FEATURE, |support, feature| row.push((support, feature)));
    row
}
