//! A configuration in layers: a profile, a file over it, flags over that. Each layer names what it changes; what comes of them is
//! read by the definition of settings that the core has.

use bhm_core::{
    beam::AnyBeamRule,
    kernel::KernelSettings,
    prior::PriorSettings,
    profile::{self, Capacities},
    rule::AnyRule,
    settings::{BiasSettings, Settings},
    support::SupportSettings,
};
use serde::{Deserialize, Serialize};
use toml::{
    Spanned, Table, Value,
    de::{DeTable, DeValue, ValueDeserializer},
};

use tracing::info;

use super::map_option::{MapOption, VARIANT};

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
    path: &'static str,
    what: &'static str,
    names: fn() -> Vec<&'static str>,
    defaults: fn(&str) -> Option<Table>,
}

macro_rules! choices {
    ($($path:literal => $type:ty),* $(,)?) => {
        [$(Choice {
            path: $path,
            what: <$type>::WHAT,
            names: || <$type>::ALL.iter().map(<$type>::name).collect(),
            defaults: |name| <$type>::named(name).map(|variant| table_of(&variant)),
        }),*]
    };
}

const CHOICES: [Choice; 5] = choices! {
    "settings.kernel" => KernelSettings,
    "settings.support" => SupportSettings,
    "settings.prior" => PriorSettings,
    "settings.beam" => AnyBeamRule,
    "settings.rule" => AnyRule,
};

/// Keys that a configuration may have and a profile has not.
const OPTIONAL: [&str; 3] = ["supports", "max_range_m", "settings.tile.count"];

/// Where there is one key of several, with what belongs to it: another one takes its place.
const ONE_OF: [&str; 1] = ["settings.rule.jaakkola-jordan.start"];

/// Where a bias stands, which is there or not: a table, or on and off as `true` and `false`.
const BIAS: &str = "settings.bias";

/// A layer cannot be taken: what is wrong, and where in the layer's text, if it is a file.
#[derive(Debug)]
pub(super) struct Problem {
    pub(super) message: String,
    pub(super) at: Option<usize>,
}

impl From<String> for Problem {
    fn from(message: String) -> Self {
        Self { message, at: None }
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
        let mut kernel_alone = false;
        if let Some(DeValue::Table(capacities)) = parsed.get("capacities").map(Spanned::get_ref) {
            self.capacities_named.extend(capacities.keys().map(|key| key.get_ref().to_string()));
        }
        if let Some(DeValue::Table(settings)) = parsed.get("settings").map(Spanned::get_ref) {
            self.tile_named |= settings.contains_key("tile");
            kernel_alone = settings.contains_key("kernel") && !settings.contains_key("prior");
        }
        lay_table(&mut self.table, parsed, "")?;
        if kernel_alone {
            self.suit_prior();
        }
        Ok(())
    }

    /// Takes independent weights where the prior so far is not defined for the kernel that was chosen, and says so.
    fn suit_prior(&mut self) {
        let Some(Value::Table(settings)) = self.table.get_mut("settings") else { return };
        let chosen = |name: &str| settings.get(name).cloned();
        // What cannot be read is said when everything is.
        let kernel: Option<KernelSettings> = chosen("kernel").and_then(|kernel| kernel.try_into().ok());
        let prior: Option<PriorSettings> = chosen("prior").and_then(|prior| prior.try_into().ok());
        if let (Some(kernel), Some(prior)) = (kernel, prior)
            && prior.or_white(&kernel) != prior
        {
            info!("prior white: {} is not defined for the kernel {}", prior.name(), kernel.name());
            settings.insert("prior".to_owned(), Value::Table(table_of(&prior.or_white(&kernel))));
        }
    }

    /// Lays one option's value over what is there.
    pub(super) fn set(&mut self, option: &MapOption, value: Value) -> Result<(), String> {
        let mut parents: Vec<&str> = option.path.split('.').collect();
        let key = parents.pop().unwrap_or_default();
        if parents == ["capacities"] {
            self.capacities_named.push(key.to_owned());
        }
        let mut table = &mut self.table;
        let mut place = String::new();
        for parent in &parents {
            let name = match *parent {
                VARIANT => table.keys().next().cloned().unwrap_or_default(),
                name => name.to_owned(),
            };
            table = match table.entry(name.clone()).or_insert_with(|| Value::Table(Table::new())) {
                Value::Table(inner) => inner,
                _ => return Err(format!("--{}: `{name}` is no table", option.flag)),
            };
            place = name;
        }
        if parents.contains(&VARIANT) && !table.contains_key(key) {
            return Err(format!("--{}: {place} has no {}", option.flag, option.flag));
        }
        let choice = CHOICES.iter().find(|choice| choice.path == option.path);
        let value = match (choice, value) {
            (Some(choice), Value::String(name)) => Value::Table(choice.choose(&name, table.get(key))?),
            (None, Value::Boolean(on)) => {
                switch(table, key, on);
                return Ok(());
            }
            (_, value) => value,
        };
        table.insert(key.to_owned(), value);
        if option.path == "settings.kernel" {
            self.suit_prior();
        }
        Ok(())
    }

    /// The number at an option's place, or what is chosen there instead and has no such number.
    pub(super) fn number(&self, option: &MapOption) -> Result<f32, String> {
        let mut table = &self.table;
        let mut place = "configuration";
        let mut parents: Vec<&str> = option.path.split('.').collect();
        let key = parents.pop().unwrap_or_default();
        for parent in parents {
            let found = match parent {
                VARIANT => table.iter().next(),
                name => table.get_key_value(name),
            };
            let Some((name, Value::Table(inner))) = found else { break };
            (place, table) = (name, inner);
        }
        match table.get(key) {
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

/// What an option at this place chooses among.
pub(super) fn names(path: &str) -> Vec<&'static str> {
    match CHOICES.iter().find(|choice| choice.path == path) {
        Some(choice) => (choice.names)(),
        None => profile::ALL.map(|profile| profile.name).to_vec(),
    }
}

impl Choice {
    /// The variant of that name with its default settings, and what it has in common with the one that was chosen before.
    fn choose(&self, name: &str, before: Option<&Value>) -> Result<Table, String> {
        let mut table = (self.defaults)(name)
            .ok_or_else(|| format!("unknown {} `{name}`, expected one of {}", self.what, (self.names)().join(", ")))?;
        let Some(before) = before.and_then(Value::as_table) else { return Ok(table) };
        if before.contains_key(name) {
            return Ok(before.clone());
        }
        let old = before.values().next().and_then(Value::as_table);
        if let (Some(Value::Table(new)), Some(old)) = (table.get_mut(name), old) {
            for (key, value) in new.iter_mut() {
                *value = old.get(key).unwrap_or(value).clone();
            }
        }
        Ok(table)
    }
}

/// Lays a table of a file over that which stands at `parent`.
fn lay_table(base: &mut Table, layer: &DeTable<'_>, parent: &str) -> Result<(), Problem> {
    for (key, value) in layer {
        let at = |message: String| Problem { message, at: Some(key.span().start) };
        let name = key.get_ref().as_ref();
        let path = &below(parent, name);
        if let Some(choice) = CHOICES.iter().find(|choice| choice.path == path) {
            let chosen = match value.get_ref() {
                DeValue::String(variant) => choice.choose(variant, base.get(name)).map_err(at)?,
                DeValue::Table(layer) if layer.len() == 1 => {
                    let variant = layer.keys().next().map_or("", |key| key.get_ref());
                    let mut chosen = choice.choose(variant, base.get(name)).map_err(at)?;
                    lay_table(&mut chosen, layer, path)?;
                    chosen
                }
                _ => return Err(at(format!("expected the name of one {}, or a table of that name", choice.what))),
            };
            base.insert(name.to_owned(), Value::Table(chosen));
            continue;
        }
        match (base.get_mut(name), value.get_ref()) {
            (_, DeValue::Boolean(on)) if path == BIAS => switch(base, name, *on),
            (None, DeValue::Table(layer)) if path == BIAS => {
                let mut bias = table_of(&BiasSettings::DEFAULT);
                lay_table(&mut bias, layer, path)?;
                base.insert(name.to_owned(), Value::Table(bias));
            }
            (Some(Value::Table(inner)), DeValue::Table(layer)) if !ONE_OF.contains(&path.as_str()) => {
                lay_table(inner, layer, path)?;
            }
            (Some(before), _) => {
                let value = plain(value);
                if let Some(expected) = misfit(before, &value) {
                    return Err(at(format!("`{path}` is {value}, expected {expected}")));
                }
                *before = value;
            }
            (None, _) if OPTIONAL.contains(&path.as_str()) => {
                base.insert(name.to_owned(), plain(value));
            }
            (None, _) => {
                let known = fields(base, parent).join("`, `");
                return Err(at(format!("unknown field `{name}`, expected one of `{known}`")));
            }
        }
    }
    Ok(())
}

/// Where a key stands whose table is at `parent`; a key with a dot in it is quoted, as in a file.
fn below(parent: &str, key: &str) -> String {
    let key = if key.contains('.') { format!("{key:?}") } else { key.to_owned() };
    if parent.is_empty() { key } else { format!("{parent}.{key}") }
}

/// The fields that a table at this place may have: those that it has, and those that may be absent.
fn fields<'t>(table: &'t Table, path: &str) -> Vec<&'t str> {
    let absent = OPTIONAL.into_iter().chain([BIAS]).filter_map(|known| {
        let key = known.rsplit('.').next()?;
        (below(path, key) == known && !table.contains_key(key)).then_some(key)
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

/// A value without its places in the text; not a number if it is a whole number that is too large.
fn plain(value: &Spanned<DeValue<'_>>) -> Value {
    Value::deserialize(ValueDeserializer::from(value.clone())).unwrap_or(Value::Float(f64::NAN))
}
