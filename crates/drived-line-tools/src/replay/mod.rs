//! `drived replay`: the slaves of a capture, played back on a pty.

mod image;
mod recorded;
#[cfg(test)]
mod tests;

use std::{collections::BTreeSet, path::PathBuf};

use drive_bus::{
    capture::{Captured, Direction, Dissector, Recording},
    config::SerialText,
    exchange::rtu,
};
use drive_core::{SerialSettings, serial::CharacterFormat};
use drive_sim::{Playback, SimLine, Wiring};
use tokio::sync::mpsc;

use self::{
    image::Image,
    recorded::{Exchanges, exchanges},
};
use super::{frames, sim};
use drived_words::explain::{Explainer, Known};
use drived_words::{
    drive_spec::{DriveSpec, on_one_line},
    failure::Failure,
    line_spec,
    output::{self, counted},
    signals::Ending,
};

/// Play the slaves of a capture back on a pty, until Ctrl-C: what was met in a plant is met again at the desk
///
/// To each request that the capture has they say what they said then, byte for byte the same request: the same answers,
/// exceptions, damaged answers and silences in the same order, each after the time that it took, and behind the last the
/// first again. To a request that the capture does not have nothing is said, and it is told once. So ask what was asked
/// then: the same program with the same drives. Of a line that was only listened to the times have the error that explain
/// tells. With --image each slave is an image of its registers instead, and answers any question of those that the capture has, in
/// whatever blocks, with the last word that was read or written; a write changes it, and nothing turns.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The capture, as `drived capture` makes it, or whatever `drived explain` reads
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Where the symbolic link to the pty is made; other programs open it as their serial port
    #[arg(long, value_name = "LINK")]
    pty: PathBuf,
    /// Speed and format that the line had; 19200,8E1 when they are not given, and 19200,8O1 for UNI-TELWAY
    #[arg(long, value_name = "BAUD[,FORMAT]")]
    serial: Option<SerialText>,
    /// Answer any question of the registers that the capture has
    #[arg(long)]
    image: bool,
    /// Which drives were on the line, for the words of what the capture does not have
    #[arg(long, value_name = "FAMILY@ADDRESSES")]
    drive: Vec<DriveSpec>,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let input = |error: &dyn std::fmt::Display| Failure::Input(error.to_string());
    let drives = on_one_line(&args.drive).map_err(|error| input(&error))?;
    let mut ending = Ending::listen()?;
    let named = |error: &dyn std::fmt::Display| Failure::Input(format!("{}: {error}", args.file.display()));
    let taken = frames::taken(Some(&args.file), false)?;
    let recording = Recording { dissector: taken.dissector, late: taken.late, frames: taken.frames };
    let protocol =
        spoken(&recording).ok_or_else(|| named(&"Modbus TCP is no line that could be played back"))?;
    let settings = match args.serial {
        Some(serial) => line_spec::settings(serial, &drives).map_err(|error| input(&error))?,
        None => usual(protocol),
    };
    let found = exchanges(&recording, settings);
    if found.is_empty() {
        return Err(named(&"it has no request of which it tells what became of it"));
    }
    let (unknown, mut asked) = mpsc::unbounded_channel();
    if args.image && protocol == drive_sim::Protocol::UniTelway {
        return Err(named(&"--image is of Modbus: UNI-TELWAY is played back as it was"));
    }
    let line = line(protocol, settings, &found, args.image, unknown).map_err(|error| input(&error))?;
    let mut serving =
        sim::serve(&line, &args.pty).map_err(|error| Failure::Input(format!("--pty: {error}")))?;
    taken.notes.iter().try_for_each(|note| output::say(format_args!("note: {note}")))?;
    output::say(format_args!("playing back at {settings} on {} (Ctrl-C ends it)", args.pty.display()))?;
    for (slave, of_slave) in &found {
        let requests: BTreeSet<&Vec<u8>> = of_slave.iter().map(|(request, _)| request).collect();
        let exchanges = counted(of_slave.len(), "exchange", "exchanges");
        let requests = counted(requests.len(), "different request", "different requests");
        let held = match args.image {
            true => format!(", {}", counted(image::words(of_slave).len(), "register", "registers")),
            false => String::new(),
        };
        output::say(format_args!("  slave {slave}: {exchanges}, {requests}{held}"))?;
    }
    let mut explainer = Explainer::new(Known { drives: super::explain::named(&drives), ..Known::default() });
    let (mut told, mut not_recorded) = (BTreeSet::new(), 0_usize);
    loop {
        tokio::select! {
            () = ending.asked() => break,
            ended = serving.ended() => {
                ended.map_err(|error| Failure::Drive(format!("the pty is gone: {error}")))?;
                break;
            }
            Some((slave, request)) = asked.recv() => {
                not_recorded += 1;
                if told.len() < TOLD && told.insert((slave, request.clone())) {
                    let words = in_words(&mut explainer, protocol, slave, &request);
                    output::say(format_args!("not in the capture: slave {slave}: {words}"))?;
                }
            }
        }
    }
    let stats = line.stats();
    output::say(format_args!(
        "{} requests, {} answers; {not_recorded} not in the capture",
        stats.requests, stats.answers
    ))
}

/// So many different requests that were not recorded are told, and not one by one what a scan asks for.
const TOLD: usize = 100;

/// A request that nobody could answer, for whoever tells of it.
type NotRecorded = (u8, Vec<u8>);

/// A line on which the slaves of a recording are played back.
fn line(
    protocol: drive_sim::Protocol,
    settings: SerialSettings,
    found: &Exchanges,
    as_image: bool,
    unknown: mpsc::UnboundedSender<NotRecorded>,
) -> Result<SimLine, drive_sim::AddressError> {
    let line = SimLine::new(Wiring { protocol, ..Wiring::rtu(settings) });
    for (&slave, exchanges) in found {
        let (unknown, asking) = (unknown.clone(), unknown.clone());
        // Nobody is told any more at the end.
        let tell = move |request: &[u8]| drop(unknown.send((slave, request.to_vec())));
        let playback = Playback::new(exchanges.iter().cloned(), tell);
        let is_unite = protocol == drive_sim::Protocol::UniTelway;
        if as_image {
            let missing = move |address: u16| {
                let [high, low] = address.to_be_bytes();
                drop(asking.send((slave, vec![3, high, low, 0, 1])));
            };
            line.add(slave, Image::new(image::words(exchanges), playback, missing))?;
        } else {
            line.add(slave, if is_unite { playback.speaking_unite() } else { playback })?;
        }
    }
    Ok(line)
}

/// What the line of a recording spoke; `None`: Modbus TCP.
fn spoken(recording: &Recording) -> Option<drive_sim::Protocol> {
    let is_ascii = |frame: &Captured| frame.bytes.first() == Some(&b':');
    match recording.dissector {
        Dissector::Rtu => Some(drive_sim::Protocol::Rtu),
        Dissector::Tcp => None,
        Dissector::Data if recording.frames.iter().any(is_ascii) => Some(drive_sim::Protocol::Ascii),
        Dissector::Data => Some(drive_sim::Protocol::UniTelway),
    }
}

fn usual(protocol: drive_sim::Protocol) -> SerialSettings {
    let odd = SerialSettings::new(SerialSettings::MODBUS_DEFAULT.baud(), CharacterFormat::F8O1);
    match protocol {
        drive_sim::Protocol::UniTelway => odd.unwrap_or(SerialSettings::MODBUS_DEFAULT),
        _ => SerialSettings::MODBUS_DEFAULT,
    }
}

fn in_words(explainer: &mut Explainer, protocol: drive_sim::Protocol, slave: u8, request: &[u8]) -> String {
    if protocol == drive_sim::Protocol::UniTelway {
        return format!("UNI-TE {request:02X?}");
    }
    let bytes = rtu::frame(slave, request);
    let frame = Captured { at: std::time::Duration::ZERO, direction: Direction::Sent, bytes };
    explainer.explain(Dissector::Rtu, &frame).text
}
