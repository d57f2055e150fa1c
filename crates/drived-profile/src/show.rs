//! `drived profile show`: a profile as a page to read.

use std::collections::BTreeMap;

use drive_profile::{
    Profile,
    format::{Action, Answer, Bits, File, Guard, Mark, Space, Spanned},
};
use serde_json::{Value, json};

use drived_words::{
    failure::Failure,
    output::{self, JsonArgs, Table},
};

use crate::{check, named::named};

/// Show what a profile says of its drive, as a page to read: its level, what is not known, how it is read, stopped and started
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Its key, such as v20, or a file
    #[arg(value_name = "PROFILE")]
    profile: String,
    #[command(flatten)]
    json: JsonArgs,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let (profile, file) = named(&args.profile)?;
    args.json.say(
        || {
            let mut object = check::object(&profile);
            object["file"] = json!(file);
            object["page"] =
                page(&profile).into_iter().map(|(head, rows)| (head.to_owned(), section(rows))).collect();
            object
        },
        || tell(&profile),
    )
}

fn section(rows: Vec<(String, String)>) -> Value {
    let rows = rows.into_iter().map(|(label, text)| json!({ "what": label, "is": text }));
    Value::Array(rows.collect())
}

fn tell(profile: &Profile) -> Result<(), Failure> {
    output::say(format_args!("{}: {}, level {}", profile.key(), profile.name(), profile.level()))?;
    for (head, rows) in page(profile) {
        if rows.is_empty() {
            continue;
        }
        output::say("")?;
        output::say(head)?;
        let mut table = Table::texts();
        for (label, text) in rows {
            table.row([format!("  {label}"), text]);
        }
        output::say_table(table)?;
    }
    Ok(())
}

/// Its sections, each with what is said and what it is.
fn page(profile: &Profile) -> Vec<(&'static str, Vec<(String, String)>)> {
    let file = profile.file();
    let (keeps, not_known): (Vec<_>, Vec<_>) =
        profile.gaps().iter().partition(|gap| gap.keeps_from.is_some());
    let gap = |gap: &&drive_profile::Gap| {
        let level = gap.keeps_from.map_or_else(String::new, |level| format!("below {level}"));
        (level, format!("{}: {}", gap.what, gap.question))
    };
    vec![
        ("What it is", who(file)),
        ("What keeps it from the next level", keeps.iter().map(gap).collect()),
        ("What is not known", not_known.iter().map(|gap| (String::new(), gap.what.clone())).collect()),
        ("Its line", link(file)),
        ("What has to read so before anything but a stop is written", guards(file)),
        ("Its states, the first that fits", states(file)),
        ("How it is stopped", actions(file, "stop.")),
        ("How it is started", actions(file, "start.")),
        ("How a fault is reset", actions(file, "reset")),
        ("Its setpoint", setpoint(file)),
        ("Its registers", registers(file)),
        ("What is never written", never_written(file)),
        ("Where this is from", sources(file)),
        ("On which drives a person has tried it", tried(file)),
    ]
}

fn who(file: &File) -> Vec<(String, String)> {
    vec![
        ("maker".to_owned(), file.maker.get_ref().clone()),
        ("models".to_owned(), file.models.get_ref().clone()),
    ]
}

fn link(file: &File) -> Vec<(String, String)> {
    let link = file.link.get_ref();
    let functions: Vec<String> = link.functions.iter().map(|of| of.get_ref().to_string()).collect();
    let list = |all: &Vec<u32>| all.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let formats =
        |all: &Vec<Spanned<String>>| all.iter().map(|of| of.get_ref().clone()).collect::<Vec<_>>().join(", ");
    vec![
        ("speeds".to_owned(), answer(&link.speeds, list)),
        ("formats".to_owned(), answer(&link.formats, formats)),
        ("from the factory".to_owned(), answer(&link.factory, |of| of.get_ref().clone())),
        ("functions".to_owned(), functions.join(", ")),
        ("words in one read".to_owned(), answer(&link.read_words, ToString::to_string)),
        ("words in one write".to_owned(), answer(&link.write_words, ToString::to_string)),
        ("pause behind its answer".to_owned(), answer(&link.pause_ms, |of| format!("{of} ms"))),
        ("silent after a reset".to_owned(), answer(&link.after_reset_ms, |of| format!("{of} ms"))),
    ]
}

fn guards(file: &File) -> Vec<(String, String)> {
    let lists = [&file.who.fingerprints, &file.who.guards].into_iter().filter_map(Answer::given).flatten();
    lists.map(|guard| guarded(guard.get_ref())).collect()
}

fn guarded(guard: &Guard) -> (String, String) {
    let words = |all: &[u16]| all.iter().map(|word| format!("{word:04X}h")).collect::<Vec<_>>().join(", ");
    let masked = guard.mask.map(|mask| format!(" & {mask:04X}h")).unwrap_or_default();
    let is = match (&guard.is, &guard.is_not) {
        (Some(is), _) => format!("is one of {}", words(is)),
        (None, Some(is_not)) => format!("is none of {}", words(is_not)),
        (None, None) => String::new(),
    };
    (format!("{}{masked}", guard.register.get_ref()), format!("{is}: {}", guard.what))
}

fn states(file: &File) -> Vec<(String, String)> {
    let state = |is: &Spanned<drive_profile::format::StateIs>| {
        let is = is.get_ref();
        (is.state.state().to_string(), bits(is.bits.get_ref()))
    };
    file.state.is.iter().map(state).collect()
}

fn bits(bits: &Bits) -> String {
    let differs = if bits.differs { "is not" } else { "is" };
    format!("{} & {:04X}h {differs} {:04X}h", bits.register.get_ref(), bits.mask.get_ref(), bits.value)
}

fn actions(file: &File, of: &str) -> Vec<(String, String)> {
    let all = [
        ("stop.ramp", &file.stop.ramp),
        ("stop.fast", &file.stop.fast),
        ("stop.freewheel", &file.stop.freewheel),
        ("stop.dc_injection", &file.stop.dc_injection),
        ("start.forward", &file.start.forward),
        ("start.reverse", &file.start.reverse),
        ("reset", &file.reset),
    ];
    let of_it = all.into_iter().filter(|(name, _)| name.starts_with(of));
    of_it
        .map(|(name, action)| {
            let label = name.split_once('.').map_or(name, |(_, label)| label).replace('_', " ");
            (label, answer(action, |action| steps(action.get_ref())))
        })
        .collect()
}

fn steps(action: &Action) -> String {
    let step = |step: &Spanned<drive_profile::format::Step>| {
        let step = step.get_ref();
        match (&step.write, &step.awaits, &step.pause_ms) {
            (Some(to), ..) => {
                let words = step.words.iter().flatten().map(|word| format!("{word:04X}h"));
                let coils = step.coils.iter().flatten().map(|on| if *on { "on" } else { "off" }.to_owned());
                format!("write {} {}", to.get_ref(), words.chain(coils).collect::<Vec<_>>().join(" "))
            }
            (None, Some(awaited), _) => {
                let within = step.within_ms.as_ref().map_or(0, |within| *within.get_ref());
                format!("wait until {}, at most {within} ms", bits(awaited))
            }
            (None, None, Some(pause)) => format!("wait {} ms", pause.get_ref()),
            _ => String::new(),
        }
    };
    let steps: Vec<String> = action.steps.iter().map(step).collect();
    let seen = action.seen.iter().flat_map(Spanned::get_ref).map(|state| state.state().to_string());
    let seen: Vec<String> = seen.collect();
    match seen.is_empty() {
        true => steps.join(", then "),
        false => format!("{}; seen by: {}", steps.join(", then "), seen.join(", ")),
    }
}

fn setpoint(file: &File) -> Vec<(String, String)> {
    let Some(setpoint) = file.setpoint.given().map(Spanned::get_ref) else {
        return vec![(String::new(), answer(&file.setpoint, |_| String::new()))];
    };
    let limits = setpoint.limits.get_ref();
    let mut rows = vec![
        ("register".to_owned(), setpoint.register.get_ref().clone()),
        ("counts".to_owned(), format!("{} to {}", limits.low, limits.high)),
    ];
    if let Some(high) = &limits.high_in {
        rows.push(("the highest that is allowed".to_owned(), said_by(high.get_ref(), "highest")));
    }
    if let Some(full) = &setpoint.full_scale {
        rows.push(("100 %".to_owned(), said_by(full.get_ref(), "full-scale")));
    }
    rows
}

fn said_by(name: &str, option: &str) -> String {
    match name {
        "owner" => format!("its owner says it, by {option}"),
        register => format!("in register {register}"),
    }
}

fn registers(file: &File) -> Vec<(String, String)> {
    let place = |register: &drive_profile::format::Register| {
        let address = file.link.get_ref().numbering.wire(*register.address.get_ref());
        let space = register.space.unwrap_or(file.link.get_ref().space);
        let kind = match space {
            Space::Coil => "coil",
            Space::DiscreteInput => "input",
            Space::InputRegister => "input register",
            Space::HoldingRegister => "register",
        };
        format!("{kind} {}", address.map_or_else(|| "-".to_owned(), |address| format!("{address:04X}h")))
    };
    let row = |(name, register): (&String, &Spanned<drive_profile::format::Register>)| {
        let register = register.get_ref();
        let unit = register.scale.as_ref().map_or_else(String::new, |scale| {
            let [numerator, denominator] = *scale.get_ref();
            format!(", {numerator}/{denominator} {} a count", register.unit.symbol())
        });
        (name.clone(), format!("{} on the wire{unit}: {}", place(register), register.what))
    };
    file.register.iter().map(row).collect()
}

fn never_written(file: &File) -> Vec<(String, String)> {
    let all = file.never_written.given().into_iter().flatten().map(Spanned::get_ref);
    all.map(|of| (format!("{} to {}", of.from.get_ref(), of.to), of.why.clone())).collect()
}

fn sources(file: &File) -> Vec<(String, String)> {
    let all: &BTreeMap<String, Spanned<drive_profile::format::Source>> = &file.sources;
    let row = |(name, source): (&String, &Spanned<drive_profile::format::Source>)| {
        let source = source.get_ref();
        (
            format!("{name} ({:?})", source.mark),
            format!("{}, {}: {}", source.document, source.page, meaning(source.mark)),
        )
    };
    all.iter().map(row).collect()
}

const fn meaning(mark: Mark) -> &'static str {
    mark.meaning()
}

fn tried(file: &File) -> Vec<(String, String)> {
    let all = file.tried.given().into_iter().flatten().map(Spanned::get_ref);
    all.map(|tried| {
        (
            tried.day.clone(),
            format!("{} on {} ({}): {}", tried.person, tried.drive, tried.firmware, tried.seen),
        )
    })
    .collect()
}

/// What is said to a question, or that there is none or nobody knows.
fn answer<T>(answer: &Answer<T>, told: impl FnOnce(&T) -> String) -> String {
    match answer {
        Answer::Given(given) => told(given),
        Answer::None => "none".to_owned(),
        Answer::Unknown => "not known".to_owned(),
    }
}
