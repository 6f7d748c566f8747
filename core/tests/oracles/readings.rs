//! What a range reading means, against a table written from the documentation of `Scan` and `BeamLimits`.

use bhm_core::{
    beam::{AnyBeamRule, BeamLimits, BeamTally, PointSamples, RayEnd},
    geometry::{Point, Pose},
    map::{Map, Occupancy},
    profile::{COMPACT, Profile},
    scan::{Scan, ScanHeader},
    settings::Settings,
};

use crate::{
    common::{Stream, points_of, posterior_bits, read},
    map::TestMap,
};

/// The rule that profiles ship with.
const RULE: PointSamples = PointSamples::DEFAULT;

fn scan(ranges_m: &[f32]) -> Scan<'_> {
    Scan {
        header: ScanHeader {
            stamp_ns: 1,
            map_from_sensor: Pose::new(0.4, -0.3, 0.2),
            angle_min_rad: -1.5,
            angle_increment_rad: 0.02,
            range_min_m: 0.1,
            range_max_m: 12.0,
            ..ScanHeader::default()
        },
        ranges_m,
    }
}

/// The limits below, at, between and above those of the sensor.
fn limits() -> Vec<BeamLimits> {
    let ranges = [0.05, 0.1, 3.0, 8.0, 12.0, 20.0, f32::INFINITY];
    let free = [0.0, 2.0, 8.0, 30.0, f32::INFINITY];
    let both = |range_max_m| free.map(|no_return_free_m| BeamLimits { range_max_m, no_return_free_m });
    ranges.into_iter().flat_map(both).collect()
}

/// Readings at, just below and just above everything that is compared with, specials, and ordinary ones.
fn ranges() -> Vec<f32> {
    let mut stream = Stream::new(21);
    let edges = [0.0, 0.05, 0.1, 2.0, 3.0, 8.0, 12.0, 20.0, 30.0];
    let mut ranges: Vec<f32> = edges.iter().flat_map(|edge: &f32| [edge.next_down(), *edge, edge.next_up()]).collect();
    ranges.extend([f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, -1.0, f32::MAX, f32::MIN_POSITIVE]);
    ranges.extend((0..115).map(|_| stream.between(-1.0, 14.0) as f32));
    ranges
}

/// The kinds of reading, as the documentation lists them.
#[derive(Debug, PartialEq)]
enum Kind {
    NotANumber,
    Negative,
    TooNear,
    NoReturn,
    Beyond,
    Hit,
}

fn kind(range_m: f32, scan: &ScanHeader, limits: &BeamLimits) -> Kind {
    let range = f64::from(range_m);
    let matching: Vec<Kind> = [
        (range.is_nan(), Kind::NotANumber),
        (range < 0.0, Kind::Negative),
        ((0.0..f64::from(scan.range_min_m)).contains(&range), Kind::TooNear),
        (range >= f64::from(scan.range_max_m), Kind::NoReturn),
        (
            range >= f64::from(scan.range_min_m)
                && range < f64::from(scan.range_max_m)
                && range > f64::from(limits.range_max_m),
            Kind::Beyond,
        ),
        (
            range >= f64::from(scan.range_min_m)
                && range < f64::from(scan.range_max_m)
                && range <= f64::from(limits.range_max_m),
            Kind::Hit,
        ),
    ]
    .into_iter()
    .filter_map(|(is, kind)| is.then_some(kind))
    .collect();
    let [kind] = matching.try_into().expect("a reading is of one kind");
    kind
}

#[test]
fn every_reading_means_what_is_documented_and_is_counted_once() {
    let ranges = ranges();
    let scan = scan(&ranges);
    for limits in limits() {
        let mut expected = Vec::new();
        let mut tally = BeamTally::default();
        for (number, range_m) in scan.ranges_m.iter().enumerate() {
            let shorter_m =
                if limits.no_return_free_m < limits.range_max_m { limits.no_return_free_m } else { limits.range_max_m };
            let (count, end) = match kind(*range_m, &scan.header, &limits) {
                Kind::NotANumber => (&mut tally.not_a_number, None),
                Kind::Negative => (&mut tally.negative, None),
                Kind::TooNear => (&mut tally.too_near, None),
                Kind::NoReturn => (&mut tally.no_return, (shorter_m > 0.0).then_some(RayEnd::Free(shorter_m))),
                Kind::Beyond => (&mut tally.beyond_range, Some(RayEnd::Free(limits.range_max_m))),
                Kind::Hit => (&mut tally.hits, Some(RayEnd::Hit(*range_m))),
            };
            *count += 1;
            expected.extend(end.map(|end| (number, end)));
        }
        let (beams, got) = read(&scan, &limits);
        assert_eq!(got, tally, "{limits:?}");
        assert_eq!(beams, expected, "{limits:?}");
        assert_eq!(got.total() as usize, scan.ranges_m.len());
    }
}

/// The observations of a whole scan: one at the end of each hit and none at the end of another beam, and the free ones on
/// the beam before it.
#[test]
fn observations_lie_where_the_readings_say() {
    let ranges = ranges();
    let scan = scan(&ranges);
    for limits in limits().into_iter().filter(|limits| limits.no_return_free_m.min(limits.range_max_m).is_finite()) {
        let settings = Settings { limits, beam: AnyBeamRule::PointSamples(RULE), ..COMPACT.settings };
        let (mut hits, mut free) = (Vec::new(), 0);
        for (number, range_m) in scan.ranges_m.iter().enumerate() {
            let free_m = match kind(*range_m, &scan.header, &limits) {
                Kind::Hit => {
                    let pose = &scan.header.map_from_sensor;
                    let heading = f64::from(pose.theta_rad)
                        + f64::from(scan.header.angle_min_rad)
                        + number as f64 * f64::from(scan.header.angle_increment_rad);
                    let range = f64::from(*range_m);
                    hits.push([
                        f64::from(pose.x_m) + range * heading.cos(),
                        f64::from(pose.y_m) + range * heading.sin(),
                    ]);
                    *range_m - RULE.gap_m
                }
                Kind::Beyond => limits.range_max_m,
                Kind::NoReturn => limits.no_return_free_m.min(limits.range_max_m),
                _ => 0.0,
            };
            if free_m > 0.0 {
                free += (free_m / RULE.free_spacing_m).ceil() as usize;
            }
        }
        let points = points_of(&scan, &settings);
        let occupied: Vec<_> = points.iter().filter(|point| point.occupied).collect();
        assert_eq!((occupied.len(), points.len() - occupied.len()), (hits.len(), free), "{limits:?}");
        for (got, exact) in occupied.iter().zip(&hits) {
            // Twelve metres at an angle that is right to a few units in the last place of 4 rad.
            let middle = got.place.middle_m();
            let off = (f64::from(middle.x) - exact[0]).hypot(f64::from(middle.y) - exact[1]);
            assert!(off < 2e-5, "{limits:?}: {middle} for {exact:?}");
        }
    }
}

/// What a map makes of a scan is what it makes of the observations that were checked above, given as such.
#[test]
fn a_map_learns_the_observations_that_the_readings_give() {
    let ranges = ranges();
    let scan = scan(&ranges);
    let limits = BeamLimits { range_max_m: 8.0, no_return_free_m: 2.0 };
    let profile = Profile { settings: Settings { limits, ..COMPACT.settings }, ..COMPACT };
    let (mut whole, mut observed) = (TestMap::<144, 40>::new(&profile), TestMap::<144, 40>::new(&profile));
    whole.integrate(&scan).unwrap();
    observed.integrate_observations(&points_of(&scan, &profile.settings));
    let tiles = |map: &TestMap<144, 40>| -> Vec<_> {
        map.all_tiles().iter().map(|tile| (tile.index, posterior_bits(&tile.posterior))).collect()
    };
    assert!(tiles(&whole).len() > 4 && tiles(&whole) == tiles(&observed));
}

/// A wall beyond the range that is believed leaves free space up to that range, and nothing at the wall.
#[test]
fn a_map_learns_no_wall_beyond_the_range_it_believes() {
    let limits = BeamLimits { range_max_m: 5.0, no_return_free_m: 0.0 };
    let profile = Profile { settings: Settings { limits, ..COMPACT.settings }, ..COMPACT };
    let mut map = TestMap::<144, 40>::new(&profile);
    let far = scan(&[9.0; 150]);
    let report = map.integrate(&far).unwrap();
    assert_eq!(report.beams, BeamTally { beyond_range: 150, ..BeamTally::default() });
    for beam in [10, 75, 140] {
        let bearing_rad = far.header.angle_min_rad + beam as f32 * far.header.angle_increment_rad;
        let at = |range_m| map.mapper().occupancy(&far.header.map_from_sensor.point_along(bearing_rad, range_m));
        let wall: Occupancy = at(9.0);
        // More than two ranges of the prior away from what was learned.
        assert!((wall.probability - 0.5).abs() < 1e-3, "{wall:?}");
        assert!(at(3.0).probability < 0.2, "{:?}", at(3.0));
        assert!(at(4.9).probability < 0.5, "free up to the limit: {:?}", at(4.9));
    }
    let nowhere = map.mapper().occupancy(&Point::<2>::new(100.0, 100.0));
    assert_eq!((nowhere.mean, nowhere.probability), (0.0, 0.5));
}
