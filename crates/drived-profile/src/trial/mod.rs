//! `drived profile try`: the ladder of a profile, climbed on the real drive, step by step, each asked for.

mod console;
mod protocol;
mod steps;
mod twin;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use drive_bus::Endpoint;
use drive_core::{Frequency, SlaveAddress};
use drive_families::Family;
use drive_profile::{
    Profile, definition,
    format::{Reached, TriedOn},
    shipped,
};

use drived_client::own_line::{close, open_line_of};
use drived_config::profiles::ProfilesError;
use drived_words::{
    drive_options::OptionArgs,
    drive_spec::DriveName,
    failure::Failure,
    line_spec::{self, LineSpec},
    output,
};

use self::{console::Console, protocol::Protocol, steps::Steps};

/// Try a profile on the real drive, step by step: read all, watch a start from the panel, test the stop, start at the lowest speed
///
/// Each step is asked for, and a step further is only done where the one before was right. The motor is started by this program in
/// the last step alone, when the profile reaches motion and somebody has confirmed by the drive's name that the motor is uncoupled.
/// What was seen is written into the file, signed with name, drive, firmware and day. Ctrl-C ends it, with the motor stopped.
///
/// With --sim the simulated drive that is made from the same file is driven instead: that needs no line, no motor and no person, and shows
/// whether the file agrees with itself.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The profile: its file, into which the protocol is written, or the key of one that is shipped
    #[arg(value_name = "PROFILE")]
    profile: String,
    /// On the simulated drive that is made from the same file, and on no line; nothing is signed
    #[arg(long, conflicts_with_all = ["line", "address", "person", "drive", "firmware"])]
    sim: bool,
    // The text has brackets that a doc comment would take for links.
    #[arg(long, value_name = "LINE", help = line_spec::HELP, required_unless_present = "sim")]
    line: Option<LineSpec>,
    /// The drive's address
    #[arg(long, value_name = "ADDRESS", required_unless_present = "sim")]
    address: Option<u8>,
    /// Who tries it
    #[arg(long, value_name = "PERSON", required_unless_present = "sim")]
    person: Option<String>,
    /// On which drive, with its rating
    #[arg(long, value_name = "TEXT", required_unless_present = "sim")]
    drive: Option<String>,
    /// Its firmware, as its display shows it
    #[arg(long, value_name = "TEXT", required_unless_present = "sim")]
    firmware: Option<String>,
    /// The speed of the start
    #[arg(long, value_name = "FREQUENCY", default_value = "5Hz")]
    lowest: Frequency,
    #[command(flatten)]
    options: OptionArgs,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let (text, file) = text(&args.profile)?;
    if args.sim {
        let profile = drive_profile::read(&text).map_err(|refusals| Failure::Input(refusals.to_string()))?;
        return twin::try_on_twin(profile).await;
    }
    // Without --sim all of them are there.
    let Args {
        line: Some(line),
        address: Some(address),
        person: Some(person),
        drive: Some(drive),
        firmware: Some(firmware),
        ..
    } = &args
    else {
        return Err(Failure::Input(
            "a trial on the drive needs --line, --address, --person, --drive and --firmware".to_owned(),
        ));
    };
    let slave = SlaveAddress::try_from(*address).map_err(|error| Failure::Input(error.to_string()))?;
    let mut protocol = Protocol {
        person: person.clone(),
        drive: drive.clone(),
        firmware: firmware.clone(),
        day: chrono::Local::now().format("%Y-%m-%d").to_string(),
        seen: Vec::new(),
        // What is to be tried; what came of it is noted behind it.
        reached: Reached::Started,
        on: TriedOn::Drive,
    };
    // By what it is, and by what it is once it was tried: only the last step needs more.
    let (_, tried) = protocol.written_into(&text).map_err(Failure::Input)?;
    let name = DriveName { family: family(tried), slave };
    let options = args.options.of(&[name])?;
    let config = line.config(&[name]).map_err(|error| Failure::Input(error.to_string()))?;
    protocol.seen.extend(behind_a_pseudo_terminal(&config.endpoint));
    let opened = open_line_of(Some(name), config.clone()).await?;
    let mut console = Console::of_terminal();
    protocol.on = match said_on(&mut console).await {
        Ok(on) => on,
        Err(failure) => {
            close(&opened).await;
            return Err(failure);
        }
    };
    let steps = Steps { name, line: opened.clone(), config, options, lowest: args.lowest };
    let climbed = steps.climb(&mut console, &mut protocol.seen).await;
    close(&opened).await;
    protocol.reached = climbed?;
    let (with, profile) = protocol.written_into(&text).map_err(Failure::Input)?;
    output::say(format_args!("{}: it reaches {} now", profile.key(), profile.level()))?;
    if protocol.on == TriedOn::Simulator {
        output::say(
            "it was tried on a simulator: that stands in the protocol, and lifts nothing for a drive",
        )?;
    } else if protocol.reached != Reached::Started {
        output::say(
            "the trial ended before the start: that stands in the protocol, and lifts nothing to motion",
        )?;
    }
    match file {
        Some(file) => {
            fs::write(&file, with).map_err(|error| Failure::Input(format!("{}: {error}", file.display())))?;
            output::say(format_args!("the protocol stands in {}", file.display()))
        }
        None => {
            output::say("the profile is shipped: put this into a copy of its file, under a key of its own")?;
            output::say_as_it_is(protocol.table(profile.substance()).trim_end())
        }
    }
}

/// What the line leads to: no request shows it, for a simulator answers like a drive. So the person says it, and signs it.
async fn said_on(console: &mut Console) -> Result<TriedOn, Failure> {
    let question = "What is on this line: a drive with its motor, or a simulated one (drived sim, or another program)? A trial on a \
                    simulator proves nothing of a drive. Type drive or simulator";
    loop {
        match console.ask(question).await?.to_ascii_lowercase().as_str() {
            "drive" => return Ok(TriedOn::Drive),
            "simulator" => return Ok(TriedOn::Simulator),
            _ => {}
        }
    }
}

/// The text of a profile, and its file where it has one of its own.
fn text(said: &str) -> Result<(String, Option<PathBuf>), Failure> {
    if let Some(profile) = shipped::find(said) {
        let found = shipped::TEXTS.iter().find(|(_, text)| drive_profile::digest(text) == profile.digest());
        return Ok((found.map(|(_, text)| (*text).to_owned()).unwrap_or_default(), None));
    }
    let (_, file) = crate::named::named(said)?;
    let file = file.unwrap_or_else(|| Path::new(said).to_owned());
    let read = fs::read_to_string(&file);
    let read = read.map_err(|error| ProfilesError::File { file: file.clone(), why: error.to_string() });
    Ok((read.map_err(|error| Failure::Input(error.to_string()))?, Some(file)))
}

/// What has to stand in the protocol of a drive that may be a simulated one.
fn behind_a_pseudo_terminal(endpoint: &Endpoint) -> Option<String> {
    let Endpoint::Serial(path) = endpoint else { return None };
    let device = fs::canonicalize(path).ok()?;
    device.starts_with("/dev/pts").then(|| {
        "over a pseudo-terminal, behind which may be a simulated drive: that shows nothing of a real one"
            .to_owned()
    })
}

fn family(profile: Profile) -> Family {
    Family::new(definition(&Arc::new(profile)))
}

#[cfg(test)]
mod tests;
