//! `drived families`: the families of drives, and what their owner can say of one.

use drive_core::{Capabilities, WatchdogCapability};
use drive_families::{Family, Options};
use serde_json::{Value, json};

use drived_config::profiles;
use drived_words::{
    failure::Failure,
    output::{self, JsonArgs, Table},
};

/// List the families of drives; for one of them, what it can do and its options
#[derive(Debug, clap::Args)]
pub struct Args {
    /// One family, such as 3g3ev
    #[arg(value_name = "FAMILY")]
    family: Option<Family>,
    #[command(flatten)]
    json: JsonArgs,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    match args.family {
        Some(family) => args.json.say(|| object(family), || one(family)),
        None if args.json.is_json() => {
            Family::all().into_iter().try_for_each(|family| output::say_as_it_is(object(family)))
        }
        None => all(),
    }
}

/// What a file leaves open of the line of its drives. Something is taken for it, which any drive may have, and is no fact of this one.
#[derive(Clone, Copy, Default)]
struct Open {
    addresses: bool,
    speeds: bool,
    formats: bool,
    factory: bool,
}

impl Open {
    fn of(family: Family) -> Self {
        let profile = profiles::find(family.capabilities().key).map(|(profile, _)| profile);
        let link = profile.as_ref().map(|profile| profile.file().link.get_ref());
        link.map_or_else(Self::default, |link| Self {
            addresses: link.highest_address.is_unknown(),
            speeds: link.speeds.is_unknown(),
            formats: link.formats.is_unknown(),
            factory: link.factory.is_unknown(),
        })
    }
}

/// What a family can do, for a program. What is not known is null, and stands below `taken_for`.
fn object(family: Family) -> Value {
    let capabilities = family.capabilities();
    let texts = |all: &[&str]| all.iter().map(ToString::to_string).collect::<Vec<_>>();
    let open = Open::of(family);
    let known = |is_open: bool, value: Value| if is_open { Value::Null } else { value };
    let taken_for = |is_open: bool, value: Value| if is_open { value } else { Value::Null };
    let addresses = json!(capabilities.highest_address);
    let speeds = json!(capabilities.speeds);
    let formats = json!(capabilities.formats.iter().map(ToString::to_string).collect::<Vec<_>>());
    let factory = json!(capabilities.factory.to_string());
    let options = family
        .options()
        .iter()
        .map(|option| json!({ "name": option.name, "meaning": option.meaning, "value": option.value }));
    json!({
        "family": family.to_string(),
        "name": capabilities.name,
        "highest_address": known(open.addresses, addresses.clone()),
        "speeds": known(open.speeds, speeds.clone()),
        "formats": known(open.formats, formats.clone()),
        "protocols": texts(capabilities.protocols),
        "factory": known(open.factory, factory.clone()),
        "taken_for": {
            "highest_address": taken_for(open.addresses, addresses),
            "speeds": taken_for(open.speeds, speeds),
            "formats": taken_for(open.formats, formats),
            "factory": taken_for(open.factory, factory),
        },
        "stop_modes": capabilities.stop_modes.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "fault_reset": capabilities.fault_reset,
        "stations": capabilities.stations,
        "watchdog": watchdogs(family),
        "identification": capabilities.identification,
        "persist": capabilities.persist,
        "found_by_scan": family.tells_itself(),
        "not_known": family.not_known(),
        "options": options.collect::<Vec<_>>(),
    })
}

fn all() -> Result<(), Failure> {
    let mut table = Table::new(["family", "drive", "addresses", "speeds", "protocols"]);
    for family in Family::all() {
        let Capabilities { name, highest_address, speeds, .. } = family.capabilities();
        let open = Open::of(family);
        let known = |is_open: bool, value: String| if is_open { "not known".to_owned() } else { value };
        table.row([
            family.to_string(),
            (*name).to_owned(),
            known(open.addresses, format!("1-{highest_address}")),
            known(open.speeds, list(speeds)),
            list(family.capabilities().protocols),
        ]);
    }
    output::say_table(table)
}

fn one(family: Family) -> Result<(), Failure> {
    let capabilities = family.capabilities();
    output::say(format_args!("{family}: {}", capabilities.name))?;
    let mut facts = Table::texts();
    let mut fact = |label: &str, value: String| facts.row([format!("  {label}"), value]);
    let open = Open::of(family);
    let or_not_known = |is_open: bool, value: String| match is_open {
        true => format!("not known; taken for {value}"),
        false => value,
    };
    let addresses = format!("1 to {}", capabilities.highest_address);
    fact("addresses", or_not_known(open.addresses, addresses));
    fact("speeds", or_not_known(open.speeds, list(capabilities.speeds)));
    fact("formats", or_not_known(open.formats, list(capabilities.formats)));
    fact("protocols", list(family.capabilities().protocols));
    let factory = capabilities.factory.to_string();
    fact("factory setting", or_not_known(open.factory, factory));
    fact("stop modes", list(capabilities.stop_modes));
    fact("fault reset", capabilities.fault_reset.to_owned());
    fact("stations on a segment", capabilities.stations.to_string());
    fact("watchdog", watchdogs(family));
    fact("identification", capabilities.identification.unwrap_or("none").to_owned());
    fact("save to EEPROM", capabilities.persist.unwrap_or("no command").to_owned());
    let found = if family.tells_itself() {
        "yes"
    } else {
        "no: nothing that it reads tells it from other makers' drives"
    };
    fact("found by scan", found.to_owned());
    output::say_table(facts)?;
    let mut options = Table::new(["  --option", "what it says", "value"]);
    for option in family.options() {
        options.row([format!("  {}", option.name), option.meaning.to_owned(), option.value.to_owned()]);
    }
    if options.is_empty() { output::say("  no options") } else { output::say_table(options) }?;
    if !family.not_known().is_empty() {
        output::say("  what nobody can know of it:")?;
    }
    family.not_known().iter().try_for_each(|said| output::say(format_args!("    {said}")))
}

/// The watchdog on each of the family's protocols.
fn watchdogs(family: Family) -> String {
    let on = |ascii| watchdog(family.watchdog(ascii, &Options::default()));
    match on(false) == on(true) {
        true => on(false),
        false => format!("{}; in ASCII {}", on(false), on(true)),
    }
}

fn watchdog(capability: Option<WatchdogCapability>) -> String {
    let Some(watchdog) = capability else { return "none that the bus can read or set".to_owned() };
    let time = match watchdog.min == watchdog.max {
        true => format!("{:?}", watchdog.min),
        false => format!("{:?} to {:?}", watchdog.min, watchdog.max),
    };
    let by = if watchdog.settable { "set over the bus" } else { "not settable over the bus" };
    match watchdog.reactions {
        [] => format!("{time}, {by}"),
        reactions => format!("{time}, {by}; {}", list(reactions)),
    }
}

fn list<T: ToString>(values: &[T]) -> String {
    values.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}
