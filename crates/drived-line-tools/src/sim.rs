//! `drived sim`: serves simulated drives on a pty.

use std::{
    io,
    path::{Path, PathBuf},
    thread,
};

use drive_bus::{
    Protocol,
    config::{CharacterText, SerialText, baud_of},
};
use drive_families::{Options, SetUp, simulated};
use drive_sim::{Serving, SimLine, Wiring};
use tokio::sync::mpsc;

use drived_words::{
    drive_spec::{self, DriveName, DriveSpec},
    failure::Failure,
    line_spec, output,
    signals::Ending,
};

/// Serve simulated drives on a pty, with the line's character times, until Ctrl-C
///
/// Lines on standard input act on the drives and on the world around them, such as `atv312@1 terminal LI1 on` or `line
/// cut`; `help` lists them. Each is answered by what it tells, by `done`, or by `refused:` and the reason.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Where the symbolic link to the pty is made; other programs open it as their serial port
    #[arg(long, value_name = "LINK")]
    pty: PathBuf,
    /// Drives, such as atv312@1-10,12; may be given several times
    #[arg(long = "drive", value_name = "FAMILY@ADDRESSES", required = true)]
    drives: Vec<DriveSpec>,
    /// Speed in bit/s; the drives' factory setting when it is not given
    #[arg(long, value_name = "N", value_parser = baud_of)]
    baud: Option<u32>,
    /// Character format, such as 8E1, and with a comma the protocol, such as 7E1,ascii or 8O1,unitelway; the drives'
    /// factory setting and Modbus RTU when they are not given
    #[arg(long, value_name = "FORMAT[,PROTOCOL]")]
    format: Option<CharacterText>,
    /// Serve drives in their factory setting instead of drives set up for the bus (atv21: its blocks of registers;
    /// atv312: access level L3, commands from Modbus; 3g3ev: a function that resets faults)
    #[arg(long)]
    factory: bool,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let input = |error: &dyn std::fmt::Display| Failure::Input(error.to_string());
    let drives = drive_spec::on_one_line(&args.drives).map_err(|error| input(&error))?;
    let CharacterText { format, protocol } = args.format.unwrap_or_default();
    let settings = line_spec::settings(SerialText { baud: args.baud, format, protocol }, &drives);
    let settings = settings.map_err(|error| input(&error))?;
    let mut ending = Ending::listen()?;
    let line = SimLine::new(Wiring { protocol: by(protocol), ..Wiring::rtu(settings) });
    let set_up = if args.factory { SetUp::Factory } else { SetUp::ForTheBus };
    for name in &drives {
        let model = simulated::model(name.family, set_up).map_err(|error| input(&error))?;
        line.add_boxed(name.slave.number(), model).map_err(|error| input(&error))?;
    }
    let served = serve(&line, &args.pty);
    let mut serving = served.map_err(|error| Failure::Input(format!("--pty: {error}")))?;

    output::say(format_args!("serving {settings} {protocol} on {} (Ctrl-C ends it)", args.pty.display()))?;
    for name in &drives {
        output::say(describe(name, set_up))?;
    }
    let mut lines = standard_input();
    loop {
        tokio::select! {
            () = ending.asked() => break,
            ended = serving.ended() => {
                ended.map_err(|error| Failure::Drive(format!("the pty is gone: {error}")))?;
                break;
            }
            Some(text) = lines.recv() => match line.control(&text) {
                Ok(answer) => output::say(answer)?,
                Err(refused) => output::say(format_args!("refused: {refused}"))?,
            },
        }
    }
    let stats = line.stats();
    output::say(format_args!(
        "served {} requests, {} answers; {} damaged frames, {} breaches of the line's rules",
        stats.requests, stats.answers, stats.bad_frames, stats.violations
    ))
}

/// The simulator's name of a protocol.
pub(crate) const fn by(protocol: Protocol) -> drive_sim::Protocol {
    match protocol {
        Protocol::Ascii(_) => drive_sim::Protocol::Ascii,
        Protocol::UniTelway(_) => drive_sim::Protocol::UniTelway,
        _ => drive_sim::Protocol::Rtu,
    }
}

/// The lines of standard input, until it ends. A thread reads them that is left behind when the program ends: nothing
/// else ends a read of a terminal.
fn standard_input() -> mpsc::Receiver<String> {
    let (lines, read) = mpsc::channel(1);
    thread::spawn(move || {
        io::stdin().lines().map_while(Result::ok).try_for_each(|line| lines.blocking_send(line))
    });
    read
}

#[cfg(unix)]
pub(super) fn serve(line: &SimLine, pty: &Path) -> io::Result<Serving> {
    line.serve_pty(pty)
}

#[cfg(not(unix))]
pub(super) fn serve(_: &SimLine, _: &Path) -> io::Result<Serving> {
    Err(io::Error::new(io::ErrorKind::Unsupported, "this system has no pseudo-terminals"))
}

/// The drive, and with what it has to be told of to whoever opens it.
fn describe(name: &DriveName, set_up: SetUp) -> String {
    let options =
        if set_up == SetUp::ForTheBus { simulated::options().of(name.family) } else { Options::default() };
    let told: Vec<String> = options.iter().map(|(name, text)| format!("--option {name}={text}")).collect();
    let told =
        if told.is_empty() { String::new() } else { format!(" (to be opened with {})", told.join(" ")) };
    format!("  {name:<12} {}{told}", name.family.capabilities().name)
}
