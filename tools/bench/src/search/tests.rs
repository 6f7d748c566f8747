use super::*;

/// A made-up result: a score and a cost, or a refusal.
impl Judged for Option<(f64, f64)> {
    fn worth(&self) -> Option<Worth> {
        self.map(|(score, cost)| Worth { score, cost })
    }
}

fn given(start: f32, values: &[f32]) -> Axis {
    Axis { start, values: Values::Given(values.to_vec()) }
}

fn best<T: Clone>(found: &Found<T>) -> Vec<f32> {
    found.tried[found.best.unwrap()].values.clone()
}

/// A bowl, quadratic in logarithms, with its bottom at (0.3, 20) and a ridge across: no coordinate stands alone.
fn bowl(values: &[f32]) -> f64 {
    let [x, y] = [f64::from(values[0] / 0.3).ln(), f64::from(values[1] / 20.0).ln()];
    x * x + y * y + 0.8 * x * y
}

#[test]
fn a_coordinate_search_closes_in_on_a_known_bottom() {
    let around = |start, factor| Axis { start, values: Values::Around { factor } };
    let axes = [around(1.0, 2.0), around(1.0, 10.0)];
    let found = search(&axes, Method::Coordinate { rounds: 6 }, f64::INFINITY, |_, values| Some((bowl(values), 1.0)));
    let [x, y] = best(&found)[..] else { panic!("two numbers") };
    // The last step is 2^(1/32) and 10^(1/32), three and a half of them with the ridge and the rounding.
    assert!((x / 0.3).ln().abs() < 0.08 && (y / 20.0).ln().abs() < 0.25, "{x} {y}");
    assert_eq!(found.tried[0].values, [1.0, 1.0]);
    for (place, tried) in found.tried.iter().enumerate() {
        assert!(found.tried[..place].iter().all(|earlier| earlier.values != tried.values), "{:?} twice", tried.values);
    }
}

#[test]
fn a_grid_is_every_combination_and_the_start() {
    let axes = [given(1.0, &[0.1, 0.3, 1.0]), given(7.0, &[10.0, 20.0])];
    let mut places = Vec::new();
    let found = search(&axes, Method::Grid, f64::INFINITY, |place, values| {
        places.push(place);
        Some((bowl(values), 1.0))
    });
    assert_eq!((grid_len(&axes), places), (6, (0..7).collect()));
    let values: Vec<_> = found.tried.iter().map(|tried| [tried.values[0], tried.values[1]]).collect();
    let expected = [[1.0, 7.0], [0.1, 10.0], [0.1, 20.0], [0.3, 10.0], [0.3, 20.0], [1.0, 10.0], [1.0, 20.0]];
    assert_eq!(values, expected);
    assert_eq!(best(&found), [0.3, 20.0]);
}

#[test]
fn a_coordinate_search_stops_when_a_round_brings_nothing_new() {
    let axes = [given(2.0, &[1.0, 2.0, 3.0]), given(5.0, &[5.0, 4.0])];
    let mut calls = 0;
    let found = search(&axes, Method::Coordinate { rounds: u32::MAX }, f64::INFINITY, |_, values| {
        calls += 1;
        Some((f64::from(values[0] + values[1]), 1.0))
    });
    // Start; 1 and 3; (1, 4); then 2 and 3 beside the new second number; then nothing.
    assert_eq!((best(&found), calls, found.tried.len()), (vec![1.0, 4.0], 6, 6));
}

#[test]
fn of_equal_scores_the_start_wins_and_then_the_cheaper() {
    let axes = [given(2.0, &[1.0, 3.0, 4.0])];
    let pick = |score: fn(f32) -> f64, cost: fn(f32) -> f64| {
        let judge = |_: usize, values: &[f32]| Some((score(values[0]), cost(values[0])));
        best(&search(&axes, Method::Grid, f64::INFINITY, judge))[0]
    };
    assert_eq!(pick(|_| 1.0, f64::from), 2.0, "the start, though 1 is cheaper");
    assert_eq!(
        pick(|x| if x == 2.0 { 2.0 } else { 1.0 }, |x| 10.0 - f64::from(x)),
        4.0,
        "the cheapest of the better ones"
    );
    assert_eq!(pick(|x| if x == 2.0 { 2.0 } else { 1.0 }, |_| 1.0), 1.0, "the first of the better ones");
}

#[test]
fn what_is_refused_or_not_finite_or_too_dear_never_wins() {
    let axes = [given(2.0, &[1.0, 3.0, 4.0, 5.0, 6.0])];
    let judge = |_: usize, values: &[f32]| match values[0] {
        1.0 => None,
        3.0 => Some((f64::NEG_INFINITY, 1.0)),
        4.0 => Some((f64::NAN, 1.0)),
        5.0 => Some((-3.0, 2.1)),
        6.0 => Some((-2.0, 2.0)),
        _ => Some((0.0, 1.0)),
    };
    for method in [Method::Grid, Method::Coordinate { rounds: 3 }] {
        let found = search(&axes, method, 2.0, judge);
        assert_eq!((best(&found)[0], found.tried.len()), (6.0, 6));
        assert_eq!(best(&search(&axes, method, 3.0, judge))[0], 5.0);
        assert_eq!(best(&search(&axes, method, 1.0, judge))[0], 2.0);
        assert_eq!(search(&axes, method, 0.5, judge).best, None, "not even the start is that cheap");
        assert_eq!(search(&axes, method, 2.0, |_, _| None::<(f64, f64)>).best, None);
    }
    // A start that fails is no end.
    let found = search(&axes, Method::Coordinate { rounds: 2 }, 1.0, |place, values| {
        (place > 0).then(|| (f64::from(values[0]), 1.0))
    });
    assert_eq!(best(&found)[0], 1.0);
}

#[test]
fn steps_are_geometric_and_halve() {
    let axis = Axis { start: 1e-4, values: Values::Around { factor: 10.0 } };
    assert_eq!(axis.at(1e-4, 0), [1e-6, 1e-5, 1e-4, 1e-3, 1e-2]);
    assert_eq!(axis.at(1e-3, 1), [1e-4, 3.16e-4, 1e-3, 3.16e-3, 1e-2]);
}
