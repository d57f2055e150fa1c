//! Whatever reads a stream, a file or a text.

use std::{io, time::Duration};

use drive_bus::{
    Gateway, LineConfig, Protocol,
    capture::{self, Captured, Direction, Dissector},
    listen::Ear,
};
use drive_core::{Setpoint, SlaveAddress, serial::SerialSettings};
use drive_profile::shipped;
use drive_sim::{SimLine, models::atv312::Atv312};

use super::{
    bytes::{LONGEST, ascii_frame, change, pieces, rtu_frame, telway_frame, text},
    source::Source,
};

/// Whoever only listens hears no more than was said, and keeps nothing for ever.
pub(super) fn ear(rng: &mut Source) -> Result<(), String> {
    let protocols = ["rtu", "ascii", "unitelway"];
    let which = rng.usize(..protocols.len());
    let protocol: Protocol = protocols[which].parse().map_err(|_| "it is a protocol")?;
    let config = LineConfig { protocol, ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT) };
    let Some(mut ear) = Ear::new(&config, Duration::ZERO) else { return Err("nobody listens".to_owned()) };
    let (mut now, mut said, mut heard) = (Duration::ZERO, 0, 0);
    let stream = match which {
        1 => pieces(rng, ascii_frame),
        2 => pieces(rng, telway_frame),
        _ => pieces(rng, rtu_frame),
    };
    for piece in stream {
        now += Duration::from_micros(rng.u64(..40_000));
        while ear.deadline().is_some_and(|deadline| deadline <= now) {
            ear.handle_timeout();
            heard += ear.by_ref().map(|heard| heard.bytes.len()).sum::<usize>();
        }
        said += piece.len();
        ear.hear(now, &piece);
        heard += ear.by_ref().map(|heard| heard.bytes.len()).sum::<usize>();
        if heard > said {
            return Err(format!("{heard} bytes heard of {said}"));
        }
    }
    ear.handle_timeout();
    heard += ear.by_ref().map(|heard| heard.bytes.len()).sum::<usize>();
    if ear.deadline().is_some() || heard > said {
        return Err(format!("{heard} bytes heard of {said}, {:?} is waited for", ear.deadline()));
    }
    Ok(())
}

/// A capture of a few frames, as it was written or changed.
fn written(rng: &mut Source) -> io::Result<Vec<u8>> {
    let mut file = Vec::new();
    let mut writer = capture::Writer::new(&mut file, Dissector::Rtu)?;
    for (at, piece) in (0..).zip(pieces(rng, rtu_frame)) {
        let direction = if at % 2 == 0 { Direction::Sent } else { Direction::Received };
        writer.write(&Captured { at: Duration::from_millis(at * 7), direction, bytes: piece.into() })?;
    }
    if rng.u8(..4) > 0 {
        change(rng, &mut file);
    }
    Ok(file)
}

/// A file that is read piece by piece gives what it gives as a whole.
pub(super) fn capture(rng: &mut Source) -> Result<(), String> {
    let mut is_written = Ok(());
    let file = rng.bytes(LONGEST, |rng| {
        written(rng).unwrap_or_else(|error| {
            is_written = Err(error.to_string());
            Vec::new()
        })
    });
    is_written?;
    let whole = capture::read(&file).map(|recording| recording.frames);
    let mut reader = capture::Reader::default();
    let (mut frames, mut rest, mut failed) = (Vec::new(), file.as_slice(), None);
    while !rest.is_empty() && failed.is_none() {
        let (piece, behind) = rest.split_at(rng.usize(1..=rest.len()));
        rest = behind;
        reader.push(piece);
        loop {
            match reader.next_frame() {
                Ok(Some(frame)) => frames.push(frame),
                Ok(None) => break,
                Err(error) => {
                    failed = Some(error);
                    break;
                }
            }
        }
    }
    let failed = failed.or_else(|| reader.finish().err());
    match (whole, failed) {
        (Ok(whole), None) if whole == frames => Ok(()),
        (Err(_), Some(_)) => Ok(()),
        (whole, failed) => {
            Err(format!("as a whole {whole:?}, in pieces {} frames and {failed:?}", frames.len()))
        }
    }
}

/// A shipped profile that was changed is one, or is refused.
pub(super) fn profile(rng: &mut Source) -> Result<(), String> {
    let texts: Vec<&str> = shipped::TEXTS.iter().map(|(_, text)| *text).collect();
    let text = text(rng, &texts);
    let text = String::from_utf8_lossy(&text);
    if let Err(refusals) = drive_profile::read(&text)
        && refusals.to_string().is_empty()
    {
        return Err("refused without a word".to_owned());
    }
    Ok(())
}

/// A line of text to the simulator is done or refused.
pub(super) fn control(rng: &mut Source) -> Result<(), String> {
    const LINES: &[&str] = &[
        "atv312@1 terminal LI1 on",
        "atv312@1 analog AI1 50%",
        "atv312@1 trip OCF",
        "atv312@1 power cycle",
        "atv312@1 set ACC 2.5",
        "atv312@1 master CMD 000Fh",
        "atv312@1 panel reference 25Hz",
        "atv312@1 load 80%",
        "line cut",
        "drives",
        "help",
    ];
    let line = SimLine::default();
    line.add(1, Atv312::under_bus_control()).map_err(|error| error.to_string())?;
    for _ in 0..8 {
        let text = String::from_utf8_lossy(&text(rng, LINES)).into_owned();
        if line.control(&text).is_err_and(|error| error.to_string().is_empty()) {
            return Err(format!("{text:?} is refused without a word"));
        }
    }
    Ok(())
}

/// What is read is written so that it is read again.
pub(super) fn words(rng: &mut Source) -> Result<(), String> {
    const WORDS: &[&str] = &[
        "/dev/ttyUSB0,19200,8E1",
        "tcp:gateway:502",
        "rtu-tcp:server:4001,9600,8N1",
        "ascii",
        "unitelway",
        "25.5Hz",
        "-1480rpm",
        "19200 8E1",
        "247",
        "at-once=2,wait=1s",
    ];
    let text = String::from_utf8_lossy(&text(rng, WORDS)).into_owned();
    again::<SlaveAddress>(&text)?;
    again::<SerialSettings>(&text)?;
    again::<Setpoint>(&text)?;
    let _ = (text.parse::<LineConfig>(), text.parse::<Protocol>(), text.parse::<Gateway>());
    Ok(())
}

fn again<T: std::str::FromStr + ToString + PartialEq>(text: &str) -> Result<(), String> {
    let Ok(read) = text.parse::<T>() else { return Ok(()) };
    let written = read.to_string();
    let same = written.parse::<T>().is_ok_and(|again| again == read);
    if same {
        Ok(())
    } else {
        Err(format!("{text:?} is read, written as {written:?}, and not the same again"))
    }
}
