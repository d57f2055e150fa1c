//! `drived profile check`: what a file that is being written has reached.

use std::{fs, path::PathBuf};

use drive_bus::{exchange::rtu, pdu};
use drive_core::tokio_modbus::Request;
use drive_profile::{Profile, Refusals};
use serde_json::{Value, json};

use drived_config::profiles;
use drived_words::{
    failure::Failure,
    output::{self, JsonArgs},
};

/// Check a profile: what is refused, with its line and what to write; the level that it reaches, and the next question
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The file, in TOML
    #[arg(value_name = "FILE")]
    file: PathBuf,
    #[command(flatten)]
    json: JsonArgs,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    match profiles::profile(&args.file) {
        Ok(profile) => args.json.say(|| object(&profile), || tell(args, &profile)),
        Err(profiles::ProfilesError::Refused { refusals, .. }) => {
            args.json.say(|| refused(&refusals), || tell_refusals(args, &refusals))?;
            let number = output::counted(refusals.0.len(), "place is", "places are");
            Err(Failure::Input(format!("{}: {number} refused", args.file.display())))
        }
        Err(error) => {
            let key = args.file.to_str().filter(|said| profiles::find(said).is_some());
            Err(Failure::Input(match key {
                Some(key) => {
                    format!("{error}; the profile {key} is known, and read: drived profile show {key}")
                }
                None => error.to_string(),
            }))
        }
    }
}

/// What it has reached, and what comes next.
pub(crate) fn reached(profile: &Profile) -> [String; 2] {
    let next = profile.gaps().iter().find(|gap| gap.keeps_from.is_some());
    [
        format!("{}: it reaches {}", profile.name(), profile.level()),
        next.map_or_else(
            || "nothing keeps it from motion".to_owned(),
            |next| format!("next question, line {}: {} ({})", next.line, next.question, next.what),
        ),
    ]
}

fn tell(args: &Args, profile: &Profile) -> Result<(), Failure> {
    reached(profile).into_iter().try_for_each(output::say)?;
    let (keeps, said): (Vec<_>, Vec<_>) = profile.gaps().iter().partition(|gap| gap.keeps_from.is_some());
    for gap in keeps.iter().skip(1) {
        output::say(format_args!("  line {}: {}: {}", gap.line, gap.what, gap.question))?;
    }
    let frames = frames(profile);
    if !frames.is_empty() {
        output::say("to hold against the manual, to address 1:")?;
    }
    for (name, sent) in frames {
        output::say(format_args!("  {name}: {}", sent.join(", then ")))?;
    }
    let (file, folder) = (args.file.display(), args.file.parent().filter(|of| !of.as_os_str().is_empty()));
    let folder = folder.map_or_else(|| ".".to_owned(), |folder| folder.display().to_string());
    output::say(format_args!("try it on its simulated twin: drived profile try {file} --sim"))?;
    if profiles::is_taken(profile.key()) {
        output::say(format_args!(
            "its key, {}, is the name of a family that this program has: give it another, or it is left out of its folder",
            profile.key()
        ))?;
    } else {
        output::say(format_args!(
            "use it by its key, {}: DRIVED_PROFILES={folder} drived …, or profiles = \"{folder}\" in a configuration",
            profile.key()
        ))?;
    }
    if !said.is_empty() {
        output::say("not known, and told to whoever it matters to:")?;
    }
    said.iter().try_for_each(|gap| output::say(format_args!("  {}: {}", gap.what, gap.question)))
}

/// What its stops, starts and a setpoint are on the wire, in hexadecimal digits, as manuals print examples.
fn frames(profile: &Profile) -> Vec<(String, Vec<String>)> {
    let sent = |request: &Request<'static>| {
        let pdu = pdu::encode(request).ok()?;
        Some(rtu::frame(1, &pdu).iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" "))
    };
    let all = profile.requests().into_iter();
    all.map(|(name, requests)| (name, requests.iter().filter_map(sent).collect())).collect()
}

fn tell_refusals(args: &Args, refusals: &Refusals) -> Result<(), Failure> {
    let text = fs::read_to_string(&args.file).unwrap_or_default();
    for refusal in &refusals.0 {
        output::say(format_args!("{}:{}: {}", args.file.display(), refusal.line, refusal.reason))?;
        if let Some(line) = text.lines().nth(refusal.line.saturating_sub(1)) {
            output::say_as_it_is(format_args!("  | {}", line.trim_end()))?;
        }
        output::say(format_args!("  write {}", refusal.write))?;
    }
    output::say("what else there is may show once this is mended: check it again")
}

pub(crate) fn object(profile: &Profile) -> Value {
    let gaps = profile.gaps().iter().map(|gap| {
        json!({
            "keeps_from": gap.keeps_from.map(|level| level.to_string()),
            "line": gap.line,
            "what": gap.what,
            "question": gap.question,
            "told_when_commanded": gap.matters,
        })
    });
    json!({
        "profile": profile.key(),
        "name": profile.name(),
        "level": profile.level().to_string(),
        "sha256": profile.digest(),
        "frames": frames(profile).into_iter().map(|(name, sent)| json!({ "what": name, "sent": sent })).collect::<Vec<_>>(),
        "gaps": gaps.collect::<Vec<_>>(),
    })
}

fn refused(refusals: &Refusals) -> Value {
    let all = refusals.0.iter().map(|of| json!({ "line": of.line, "reason": of.reason, "write": of.write }));
    json!({ "refused": all.collect::<Vec<_>>() })
}
