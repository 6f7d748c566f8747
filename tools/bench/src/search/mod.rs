//! The best of several numbers at once, by trying.
//!
//! Knows no mapper: a candidate is a list of numbers, and what it is worth is for the caller to say.

#[cfg(test)]
mod tests;

/// Steps to either side of the best value so far, where values lie [`Around`](Values::Around) it.
const STEPS: i32 = 2;

/// At which values a number is tried.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// At these.
    Given(Vec<f32>),
    /// At the best value so far, which must be positive, and two steps to either side of it, rounded to three digits.
    Around {
        /// The ratio of neighbouring values in the first round; every further round halves the step, as a logarithm.
        factor: f64,
    },
}

/// One of the numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Where the search begins.
    pub start: f32,
    /// Where it looks.
    pub values: Values,
}

/// In which order candidates are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// One number after the other, the rest held at the best so far; again in every round, until one brings nothing new.
    Coordinate {
        /// The most rounds.
        rounds: u32,
    },
    /// Every combination.
    Grid,
}

/// What a candidate is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worth {
    /// The smaller, the better.
    pub score: f64,
    /// What it costs, in any unit; positive.
    pub cost: f64,
}

/// The result of trying a candidate.
pub trait Judged {
    /// What it is worth; `None` if it failed and must not win. Neither does one whose worth is not finite.
    fn worth(&self) -> Option<Worth>;
}

/// A candidate, and what came of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Tried<T> {
    /// Its numbers, in the order of the axes.
    pub values: Vec<f32>,
    /// What came of it.
    pub result: T,
}

/// Everything that was tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Found<T> {
    /// In the order of trying, each once; the first is the start.
    pub tried: Vec<Tried<T>>,
    /// Position of the best; `None` if no candidate may win.
    pub best: Option<usize>,
}

impl Axis {
    /// The values of a round (from 0), when the best so far is `current`.
    fn at(&self, current: f32, round: u32) -> Vec<f32> {
        match &self.values {
            Values::Given(values) => values.clone(),
            Values::Around { factor } => {
                let step = factor.powf(0.5_f64.powi(round as i32));
                let value = |power| if power == 0 { current } else { round_off(f64::from(current) * step.powi(power)) };
                (-STEPS..=STEPS).map(value).collect()
            }
        }
    }
}

/// How many candidates a grid has, the start not counted; saturates.
#[must_use]
pub fn grid_len(axes: &[Axis]) -> usize {
    axes.iter().map(|axis| axis.at(axis.start, 0).len()).fold(1, usize::saturating_mul)
}

/// Tries candidates and finds the one of the smallest score among those that cost at most `max_cost` times what the start
/// costs. Of equal scores the start's wins, then the cheaper candidate, then the earlier.
///
/// `judge` is called once for each candidate, the start first, with its place in that order.
pub fn search<T: Judged>(
    axes: &[Axis],
    method: Method,
    max_cost: f64,
    judge: impl FnMut(usize, &[f32]) -> T,
) -> Found<T> {
    let start: Vec<f32> = axes.iter().map(|axis| axis.start).collect();
    let mut run = Run { tried: Vec::new(), max_cost, judge };
    run.try_once(start.clone());
    match method {
        Method::Coordinate { rounds } => {
            for round in 0..rounds {
                let before = run.tried.len();
                for (number, axis) in axes.iter().enumerate() {
                    let current = run.best().map_or(&start, |best| &run.tried[best].values).clone();
                    for value in axis.at(current[number], round) {
                        let mut candidate = current.clone();
                        candidate[number] = value;
                        run.try_once(candidate);
                    }
                }
                if run.tried.len() == before {
                    break;
                }
            }
        }
        Method::Grid => {
            let mut grid = vec![Vec::new()];
            for axis in axes {
                let values = axis.at(axis.start, 0);
                let with = |begun: Vec<f32>| values.iter().map(move |value| [&begun[..], &[*value]].concat());
                grid = grid.into_iter().flat_map(with).collect();
            }
            grid.into_iter().for_each(|candidate| run.try_once(candidate));
        }
    }
    Found { best: run.best(), tried: run.tried }
}

struct Run<T, F> {
    tried: Vec<Tried<T>>,
    max_cost: f64,
    judge: F,
}

impl<T: Judged, F: FnMut(usize, &[f32]) -> T> Run<T, F> {
    fn try_once(&mut self, values: Vec<f32>) {
        if self.tried.iter().all(|tried| tried.values != values) {
            let result = (self.judge)(self.tried.len(), &values);
            self.tried.push(Tried { values, result });
        }
    }

    fn best(&self) -> Option<usize> {
        let finite = |worth: &Worth| worth.score.is_finite() && worth.cost.is_finite();
        let worth = |tried: &Tried<T>| tried.result.worth().filter(finite);
        // A start that failed has no cost to compare with: then any candidate is better than none.
        let limit = self.tried.first().and_then(worth).map_or(f64::INFINITY, |start| self.max_cost * start.cost);
        let mut best: Option<(usize, Worth)> = None;
        for (place, tried) in self.tried.iter().enumerate() {
            let Some(this) = worth(tried).filter(|worth| worth.cost <= limit) else { continue };
            let better = best.is_none_or(|(at, best)| {
                this.score < best.score || (this.score == best.score && at > 0 && this.cost < best.cost)
            });
            if better {
                best = Some((place, this));
            }
        }
        best.map(|(place, _)| place)
    }
}

/// To three significant digits, so that what is written is what was tried and short.
fn round_off(value: f64) -> f32 {
    format!("{value:.2e}").parse().unwrap_or(value as f32)
}
