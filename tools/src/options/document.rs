//! A configuration in layers: a profile, a file over it, flags over that. Each layer names what it changes; what comes of them is
//! read by the definition of settings that the core has.

use bhm_core::{
    beam::AnyBeamRule,
    kernel::KernelSettings,
    prior::PriorSettings,
    profile::Capacities,
    rule::AnyRule,
    settings::{BiasSettings, Settings},
    support::SupportSettings,
};
use serde::{Deserialize, Serialize};
use toml::{
    Spanned, Table, Value,
    de::{DeTable, DeValue},
};

use super::map_option::{Kind, MapOption, VARIANT};

/// Everything that a configuration says, whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Configuration {
    pub(super) profile: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) supports: Option<std::path::PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) max_range_m: Option<f32>,
    pub(super) pose_deviation_m: f32,
    pub(super) heading_deviation_rad: f32,
    pub(super) capacities: Capacities,
    pub(super) settings: Settings,
}

impl Configuration {
    /// The text of a file that says the same; without the tile where that follows from the rest.
    pub(super) fn text(&self, tile_follows: bool) -> Result<String, toml::ser::Error> {
        let mut table = table_of(self);
        if let Some(Value::Table(settings)) = table.get_mut("settings") {
            if tile_follows {
                settings.remove("tile");
            }
            if self.settings.bias.is_none() {
                settings.insert("bias".to_owned(), Value::Boolean(false));
            }
        }
        toml::to_string(&table)
    }
}

/// Where one of several variants is chosen, and what a configuration has of each.
struct Choice {
    path: &'static [&'static str],
    what: &'static str,
    names: fn() -> Vec<&'static str>,
    defaults: fn(&str) -> Option<Table>,
}

macro_rules! choices {
    ($($path:expr => $type:ty),* $(,)?) => {
        [$(Choice {
            path: &$path,
            what: <$type>::WHAT,
            names: || <$type>::ALL.iter().map(<$type>::name).collect(),
            defaults: |name| <$type>::named(name).map(|variant| table_of(&variant)),
        }),*]
    };
}

const CHOICES: [Choice; 5] = choices! {
    ["settings", "kernel"] => KernelSettings,
    ["settings", "support"] => SupportSettings,
    ["settings", "prior"] => PriorSettings,
    ["settings", "beam"] => AnyBeamRule,
    ["settings", "rule"] => AnyRule,
};

/// Keys that a configuration may have and a profile has not.
const OPTIONAL: [&[&str]; 3] = [&["supports"], &["max_range_m"], &["settings", "tile", "count"]];

/// Where there is one key of several, with what belongs to it: another one takes its place.
const ONE_OF: [&[&str]; 1] = [&["settings", "rule", "jaakkola-jordan", "start"]];

/// Where a bias stands, which is there or not: a table, or on and off as `true` and `false`.
const BIAS: [&str; 2] = ["settings", "bias"];

/// A layer cannot be taken: what is wrong, and where in the layer's text, if it is a file.
#[derive(Debug)]
pub(super) struct Problem {
    pub(super) message: String,
    pub(super) at: Option<usize>,
}

impl Problem {
    fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), at: None }
    }
}

/// A plain value as a table; numbers as a person writes them.
pub(super) fn table_of(value: &impl Serialize) -> Table {
    let mut value = Value::try_from(value).unwrap_or_else(|_| Value::Table(Table::new()));
    shorten(&mut value);
    match value {
        Value::Table(table) => table,
        _ => Table::new(),
    }
}

/// Every number is an `f32`: `0.1` and not `0.10000000149011612`.
fn shorten(value: &mut Value) {
    match value {
        Value::Float(number) => *number = (*number as f32).to_string().parse().unwrap_or(*number),
        Value::Array(values) => values.iter_mut().for_each(shorten),
        Value::Table(table) => table.iter_mut().for_each(|(_, value)| shorten(value)),
        _ => {}
    }
}

/// The layers so far.
#[derive(Clone, Debug)]
pub(super) struct Document {
    table: Table,
    /// Capacities that a layer named: the others follow from the spacing.
    pub(super) capacities_named: Vec<String>,
    /// Whether a layer named the tile: else it follows from kernel and supports.
    pub(super) tile_named: bool,
}

impl Document {
    /// What a configuration says whole, as the lowest layer.
    pub(super) fn of(configuration: &Configuration) -> Self {
        Self { table: table_of(configuration), capacities_named: Vec::new(), tile_named: false }
    }

    /// Lays a file's text over what is there.
    pub(super) fn lay_file(&mut self, text: &str) -> Result<(), Problem> {
        let parsed = DeTable::parse(text).map_err(|error| Problem {
            message: error.message().to_owned(),
            at: Some(error.span().map_or(0, |span| span.start)),
        })?;
        let parsed = parsed.get_ref();
        if let Some(DeValue::Table(capacities)) = parsed.get("capacities").map(Spanned::get_ref) {
            self.capacities_named.extend(capacities.keys().map(|key| key.get_ref().to_string()));
        }
        if let Some(DeValue::Table(settings)) = parsed.get("settings").map(Spanned::get_ref) {
            self.tile_named |= settings.contains_key("tile");
        }
        lay_table(&mut self.table, parsed, &mut Vec::new())
    }

    /// Lays one option's value over what is there.
    pub(super) fn set(&mut self, option: &MapOption, value: Value) -> Result<(), Problem> {
        let (key, parents) = option.path.split_last().unwrap_or((&"", &[]));
        if option.path.first() == Some(&"capacities") {
            self.capacities_named.push((*key).to_owned());
        }
        let mut table = &mut self.table;
        let mut path: Vec<String> = Vec::new();
        for parent in parents {
            let name = match *parent {
                VARIANT => table.keys().next().cloned().unwrap_or_default(),
                name => name.to_owned(),
            };
            table = match table.entry(name.clone()).or_insert_with(|| Value::Table(Table::new())) {
                Value::Table(inner) => inner,
                _ => return Err(Problem::new(format!("--{}: `{}` is no table", option.flag, path.join(".")))),
            };
            path.push(name);
        }
        let of_variant = parents.contains(&VARIANT);
        if of_variant && !table.contains_key(*key) {
            let variant = path.last().cloned().unwrap_or_default();
            return Err(Problem::new(format!("--{}: {variant} has no {}", option.flag, option.flag)));
        }
        let value = match (&option.kind, &value) {
            (Kind::Choice(_), Value::String(name)) if option.path.len() > 1 => {
                let current = table.get(*key).and_then(Value::as_table).cloned().unwrap_or_default();
                Value::Table(choose(option.path, name, &current)?)
            }
            (Kind::Switch, Value::Boolean(on)) => {
                switch(table, key, *on);
                return Ok(());
            }
            _ => value,
        };
        table.insert((*key).to_owned(), value);
        Ok(())
    }

    /// The number at an option's place, or what is chosen there instead and has no such number.
    pub(super) fn number(&self, option: &MapOption) -> Result<f32, String> {
        let mut table = &self.table;
        let mut place = "configuration";
        let (key, parents) = option.path.split_last().unwrap_or((&"", &[]));
        for parent in parents {
            let found = match *parent {
                VARIANT => table.iter().next(),
                name => table.get_key_value(name),
            };
            let Some((name, Value::Table(inner))) = found else { break };
            (place, table) = (name, inner);
        }
        match table.get(*key) {
            Some(Value::Float(number)) => Ok(*number as f32),
            Some(Value::Integer(number)) => Ok(*number as f32),
            _ => Err(format!("{place} has no {}", option.flag)),
        }
    }

    /// What the layers come to.
    pub(super) fn read(&self) -> Result<Configuration, String> {
        Value::Table(self.table.clone()).try_into().map_err(|error: toml::de::Error| {
            // Of the place, only the whole text of an error tells.
            let text = error.to_string();
            match text.lines().last().and_then(|line| line.strip_prefix("in ")) {
                Some(place) => format!("{place}: {}", error.message()),
                None => error.message().to_owned(),
            }
        })
    }
}

/// A bias is there or not: a switch keeps the settings of one that is.
fn switch(table: &mut Table, key: &str, on: bool) {
    if on {
        table.entry(key.to_owned()).or_insert_with(|| Value::Table(table_of(&BiasSettings::DEFAULT)));
    } else {
        table.remove(key);
    }
}

/// The variant of that name with its default settings, and what it has in common with the one that was chosen before.
fn choose(path: &[&str], name: &str, before: &Table) -> Result<Table, Problem> {
    let choice = CHOICES.iter().find(|choice| choice.path == path);
    let choice = choice.ok_or_else(|| Problem::new(format!("`{}` is not a choice", path.join("."))))?;
    let mut table = (choice.defaults)(name).ok_or_else(|| {
        let names = (choice.names)().join(", ");
        Problem::new(format!("unknown {} `{name}`, expected one of {names}", choice.what))
    })?;
    if before.contains_key(name) {
        return Ok(before.clone());
    }
    let old = before.values().next().and_then(Value::as_table);
    if let (Some(Value::Table(new)), Some(old)) = (table.get_mut(name), old) {
        for (key, value) in new.iter_mut() {
            if let Some(kept) = old.get(key) {
                *value = kept.clone();
            }
        }
    }
    Ok(table)
}

fn lay_table(base: &mut Table, layer: &DeTable<'_>, path: &mut Vec<String>) -> Result<(), Problem> {
    let is_at = |known: &[&str], path: &[String]| known.iter().copied().eq(path.iter().map(String::as_str));
    for (key, value) in layer {
        let at = |message: String| Problem { message, at: Some(key.span().start) };
        path.push(key.get_ref().to_string());
        let name = key.get_ref().as_ref();
        if let Some(choice) = CHOICES.iter().find(|choice| is_at(choice.path, path)) {
            let current = base.get(name).and_then(Value::as_table).cloned().unwrap_or_default();
            let located = |problem: Problem| at(problem.message);
            let chosen = match value.get_ref() {
                DeValue::String(variant) => choose(choice.path, variant, &current).map_err(located)?,
                DeValue::Table(layer) if layer.len() == 1 => {
                    let variant = layer.iter().next().map(|(key, _)| key.get_ref().to_string()).unwrap_or_default();
                    let mut chosen = choose(choice.path, &variant, &current).map_err(located)?;
                    lay_table(&mut chosen, layer, path)?;
                    chosen
                }
                _ => return Err(at(format!("expected the name of one {}, or a table of that name", choice.what))),
            };
            base.insert(name.to_owned(), Value::Table(chosen));
        } else {
            match (base.get_mut(name), value.get_ref()) {
                (_, DeValue::Boolean(on)) if is_at(&BIAS, path) => switch(base, name, *on),
                (None, DeValue::Table(layer)) if is_at(&BIAS, path) => {
                    let mut bias = table_of(&BiasSettings::DEFAULT);
                    lay_table(&mut bias, layer, path)?;
                    base.insert(name.to_owned(), Value::Table(bias));
                }
                (Some(Value::Table(inner)), DeValue::Table(layer))
                    if !ONE_OF.iter().any(|known| is_at(known, path)) =>
                {
                    lay_table(inner, layer, path)?;
                }
                (Some(before), _) => {
                    let value = plain(value);
                    if let Some(expected) = misfit(before, &value) {
                        return Err(at(format!("`{}` is {value}, expected {expected}", path.join("."))));
                    }
                    *before = value;
                }
                (None, _) if OPTIONAL.iter().any(|known| is_at(known, path)) => {
                    base.insert(name.to_owned(), plain(value));
                }
                (None, _) => {
                    let known = fields(base, &path[..path.len() - 1]).join("`, `");
                    return Err(at(format!("unknown field `{name}`, expected one of `{known}`")));
                }
            }
        }
        path.pop();
    }
    Ok(())
}

/// The fields that a table at this place may have: those that it has, and those that may be absent.
fn fields<'t>(table: &'t Table, path: &[String]) -> Vec<&'t str> {
    let absent =
        OPTIONAL.into_iter().chain([&BIAS[..]]).filter_map(|known| known.split_last()).filter_map(|(key, parents)| {
            (parents.iter().copied().eq(path.iter().map(String::as_str)) && !table.contains_key(*key)).then_some(*key)
        });
    let mut fields: Vec<_> = table.keys().map(String::as_str).chain(absent).collect();
    fields.sort_unstable();
    fields
}

/// What was expected of a value that cannot take the place of the one before.
fn misfit(before: &Value, value: &Value) -> Option<&'static str> {
    match (before, value) {
        (Value::Float(_), Value::Integer(_) | Value::Float(_)) => None,
        (Value::Float(_), _) => Some("a number"),
        (Value::Integer(_), Value::Integer(0..)) => None,
        (Value::Integer(_), _) => Some("a whole number of at least 0"),
        (Value::Array(_), Value::Array(_)) | (Value::String(_), Value::String(_)) => None,
        (Value::Array(_), _) => Some("a list"),
        (Value::String(_), _) => Some("a text"),
        (Value::Table(_), Value::Table(_)) => None,
        (Value::Table(_), _) => Some("a table"),
        _ => None,
    }
}

/// A value without its places in the text.
fn plain(value: &Spanned<DeValue<'_>>) -> Value {
    match value.get_ref() {
        DeValue::String(text) => Value::String(text.to_string()),
        DeValue::Integer(number) => {
            i64::from_str_radix(number.as_str(), number.radix()).map_or(Value::Float(f64::NAN), Value::Integer)
        }
        DeValue::Float(number) => Value::Float(number.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(on) => Value::Boolean(*on),
        DeValue::Datetime(time) => Value::Datetime(*time),
        DeValue::Array(values) => Value::Array(values.iter().map(plain).collect()),
        DeValue::Table(table) => {
            Value::Table(table.iter().map(|(key, value)| (key.get_ref().to_string(), plain(value))).collect())
        }
    }
}
