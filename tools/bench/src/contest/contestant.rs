use std::{fmt, str::FromStr};

use crate::baselines::{self, Entry, Size};

/// A baseline of a certain size.
#[derive(Clone, Copy)]
pub struct Contestant {
    /// What it is.
    pub entry: &'static Entry,
    /// Its size as given for a building; see [`size_on`](Self::size_on).
    pub size: f32,
}

/// No such contestant.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnknownContestant {
    /// There is no baseline of that name.
    #[error("there is no {0:?}; there are: {names}", names = names())]
    Name(String),
    /// The size is not a positive number.
    #[error("{0:?} has no usable size: expected NAME or NAME:SIZE, as in ours:0.25")]
    Size(String),
}

fn names() -> String {
    baselines::all().map(|entry| entry.name).collect::<Vec<_>>().join(", ")
}

impl Contestant {
    /// Every baseline in its default size.
    pub fn all() -> impl Iterator<Item = Self> {
        baselines::all().map(|entry| Self { entry, size: default_size(entry) })
    }

    /// The same, coarser: lengths so many times as long, numbers so many times smaller, at least one.
    #[must_use]
    pub fn coarser(&self, factor: f32) -> Self {
        let size = match self.entry.size {
            Size::Metres(_) => self.size * factor,
            Size::Count(..) => (self.size / factor).round().max(1.0),
        };
        Self { size, ..*self }
    }

    /// Its size on a dataset: lengths grow with the `scale` of places, numbers do not.
    #[must_use]
    pub fn size_on(&self, scale: f32) -> f32 {
        match self.entry.size {
            Size::Metres(_) => self.size * scale,
            Size::Count(..) => self.size,
        }
    }
}

fn default_size(entry: &Entry) -> f32 {
    match entry.size {
        Size::Metres(size) | Size::Count(size, _) => size,
    }
}

impl FromStr for Contestant {
    type Err = UnknownContestant;

    fn from_str(text: &str) -> Result<Self, UnknownContestant> {
        let (name, size) = text.split_once(':').map_or((text, None), |(name, size)| (name, Some(size)));
        let entry = baselines::all().find(|entry| entry.name == name);
        let entry = entry.ok_or_else(|| UnknownContestant::Name(name.to_owned()))?;
        let usable = |size: &f32| *size > 0.0 && size.is_finite();
        let size = match size {
            None => default_size(entry),
            Some(size) => {
                let size = size.parse().ok().filter(usable);
                size.ok_or_else(|| UnknownContestant::Size(text.to_owned()))?
            }
        };
        Ok(Self { entry, size })
    }
}

impl fmt::Display for Contestant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.entry.name, self.size)
    }
}

impl fmt::Debug for Contestant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl PartialEq for Contestant {
    fn eq(&self, other: &Self) -> bool {
        self.entry.name == other.entry.name && self.size == other.size
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contestant_is_a_name_and_a_size() {
        let ours: Contestant = "ours:0.25".parse().unwrap();
        assert_eq!((ours.entry.name, ours.size, ours.size_on(2.0)), ("ours", 0.25, 0.5));
        assert_eq!(ours.to_string().parse::<Contestant>().unwrap(), ours);
        for contestant in Contestant::all() {
            assert_eq!(contestant.to_string().parse::<Contestant>().unwrap(), contestant);
        }
    }

    #[test]
    fn what_is_none_is_refused_with_the_names_there_are() {
        let error = "our".parse::<Contestant>().unwrap_err().to_string();
        assert!(error.contains("ours") && error.contains("counting-grid"), "{error}");
        for text in ["ours:", "ours:0", "ours:-1", "ours:nan", "ours:inf", "ours:1:2"] {
            assert_eq!(text.parse::<Contestant>().unwrap_err(), UnknownContestant::Size(text.to_owned()));
        }
    }

    #[test]
    fn every_baseline_has_a_name_of_its_own_and_says_where_it_is_from() {
        let names: Vec<&str> = baselines::all().map(|entry| entry.name).collect();
        for (i, name) in names.iter().enumerate() {
            assert!(!names[..i].contains(name) && !name.contains([':', ',', ' ']), "{name}");
        }
        assert!(baselines::all().all(|entry| !entry.source.is_empty() && !entry.summary.is_empty()));
    }
}
