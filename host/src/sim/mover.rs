//! Solids that drive. Depends on `solid`.

use super::solid::{Position, Solid, add, length, subtract};

/// Distance between the axles along the path, as part of the vehicle's length.
const WHEELBASE: f64 = 0.6;

/// A box on two axles that follows a line at constant speed; at its end it starts again, so that a road is never empty.
///
/// Where it is, is a function of the stamp alone. Both axles stay on the line and the box half-way between them, so that it
/// turns gradually where the line has a corner. Let lines begin and end where no sensor sees them: there the box jumps.
#[derive(Clone, Debug, PartialEq)]
pub struct Mover {
    path: Vec<Position>,
    length_m: f64,
    size_m: [f64; 2],
    lap_s: f64,
    phase: f64,
}

impl Mover {
    /// A box of length and width `size_m` that takes `lap_s` seconds from the first point of `path` to the last. At stamp 0
    /// its rear axle has covered the part `phase` of the path, 0 to 1.
    ///
    /// # Panics
    /// Unless the path has two points and no point twice in a row, the sides and the time are positive, the phase is in
    /// [0, 1] and all numbers are finite.
    #[must_use]
    pub fn along(path: Vec<Position>, size_m: [f64; 2], lap_s: f64, phase: f64) -> Self {
        let is_positive = |x: f64| x > 0.0 && x.is_finite();
        let lengths_m: Vec<f64> = path.windows(2).map(|leg| length(subtract(leg[1], leg[0]))).collect();
        let is_path = !lengths_m.is_empty() && lengths_m.iter().all(|length_m| is_positive(*length_m));
        assert!(is_path, "not a path: {path:?}");
        assert!(size_m.into_iter().all(is_positive), "not the size of a box: {size_m:?}");
        assert!(is_positive(lap_s) && (0.0..=1.0).contains(&phase), "not a way to drive: {lap_s} s, phase {phase}");
        Self { path, length_m: lengths_m.iter().sum(), size_m, lap_s, phase }
    }

    /// The box at a stamp, nanoseconds.
    #[must_use]
    pub fn at(&self, stamp_ns: u64) -> Solid {
        let laps = self.phase + stamp_ns as f64 * 1e-9 / self.lap_s;
        let rear_m = laps.fract() * self.length_m;
        let [rear, front] = [rear_m, rear_m + WHEELBASE * self.size_m[0]].map(|along_m| self.point_at(along_m));
        let ahead = subtract(front, rear);
        let centre = add(rear, ahead.map(|x| 0.5 * x));
        Solid::rectangle(centre, self.size_m, libm::atan2(ahead[1], ahead[0]))
    }

    /// Speed along the path, metres per second.
    #[must_use]
    pub fn speed_m_s(&self) -> f64 {
        self.length_m / self.lap_s
    }

    /// The point so far along the path, metres; beyond the end, straight on.
    fn point_at(&self, along_m: f64) -> Position {
        let last = self.path.len() - 2;
        let mut left_m = along_m;
        let mut leg = 0;
        loop {
            let (from, ahead) = (self.path[leg], subtract(self.path[leg + 1], self.path[leg]));
            let leg_m = length(ahead);
            if left_m <= leg_m || leg == last {
                return add(from, ahead.map(|x| x * left_m / leg_m));
            }
            left_m -= leg_m;
            leg += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::solid::dot;

    const SECOND_NS: u64 = 1_000_000_000;

    /// 100 m in 10 s; the axles of a 4 m long box are 2.4 m apart, with 0.8 m of box behind the rear one.
    fn straight(phase: f64) -> Mover {
        Mover::along(vec![[0.0, 5.0], [100.0, 5.0]], [4.0, 2.0], 10.0, phase)
    }

    fn centre(solid: &Solid) -> Position {
        solid.vertices().iter().fold([0.0; 2], |sum, vertex| add(sum, vertex.map(|x| 0.25 * x)))
    }

    #[test]
    fn on_a_straight_it_is_where_arithmetic_says() {
        let cases =
            [(0.0, 0, 0.0), (0.0, 25, 25.0), (0.0, 125, 25.0), (0.5, 25, 75.0), (0.5, 60, 10.0), (0.0, 99, 99.0)];
        for (phase, tenths, rear_m) in cases {
            let bounds = straight(phase).at(tenths * SECOND_NS / 10).bounds();
            let expected = [[rear_m - 0.8, 4.0], [rear_m + 3.2, 6.0]];
            for (side, expected) in [bounds.min, bounds.max].into_iter().zip(expected) {
                assert!(length(subtract(side, expected)) < 1e-9, "{side:?}, not {expected:?}");
            }
        }
        assert_eq!(straight(0.0).speed_m_s(), 10.0);
    }

    #[test]
    fn around_a_corner_it_neither_jumps_nor_leaves_the_line() {
        let mover = Mover::along(vec![[0.0, 0.0], [20.0, 0.0], [20.0, 30.0]], [4.0, 2.0], 10.0, 0.0);
        let mut before = mover.at(0);
        // 5 m/s in steps of 10 ms.
        for step in 1..1_000 {
            let now = mover.at(step * SECOND_NS / 100);
            let moved_m = length(subtract(centre(&now), centre(&before)));
            assert!(moved_m <= 0.05 + 1e-9, "{moved_m} m in one step");
            // Half-way between its axles, and its right side parallel to the line through them.
            let on_line = |along_m: f64| if along_m < 20.0 { [along_m, 0.0] } else { [20.0, along_m - 20.0] };
            let rear_m = 0.05 * step as f64;
            let (rear, front) = (on_line(rear_m), on_line(rear_m + 2.4));
            let off_m = length(subtract(centre(&now), add(rear, front).map(|x| 0.5 * x)));
            assert!(off_m < 1e-9, "{off_m} m off the line after {rear_m} m");
            let (side, ahead) = (subtract(now.vertices()[1], now.vertices()[0]), subtract(front, rear));
            let cosine = dot(side, ahead) / (length(side) * length(ahead));
            assert!(cosine > 1.0 - 1e-9, "heads elsewhere after {rear_m} m");
            before = now;
        }
        let bounds = mover.at(8 * SECOND_NS).bounds();
        assert!((bounds.max[1] - bounds.min[1] - 4.0).abs() < 1e-9, "it drives along y now");
    }

    #[test]
    #[should_panic(expected = "not a path")]
    fn refuses_a_path_that_stands_still() {
        let _ = Mover::along(vec![[1.0, 1.0], [1.0, 1.0]], [4.0, 2.0], 10.0, 0.0);
    }

    #[test]
    #[should_panic(expected = "not a way to drive")]
    fn refuses_a_lap_in_no_time() {
        let _ = Mover::along(vec![[1.0, 1.0], [2.0, 1.0]], [4.0, 2.0], 0.0, 0.0);
    }
}
