//! `drived` with a sixth family and a face of one's own: every subcommand, the daemon and its page know the FAN1 as they know the
//! five, and alarms are posted to a receiver.

#![forbid(unsafe_code)]

mod webhook;

use std::{error::Error, process::ExitCode};

use drive_families::Family;

fn main() -> ExitCode {
    if let Err(taken) = with_what_is_ours() {
        eprintln!("{taken}");
        return ExitCode::FAILURE;
    }
    drived::program()
}

fn with_what_is_ours() -> Result<(), Box<dyn Error>> {
    Family::new(&drive_fan1::FAN1).add()?;
    Ok(drived_face::add(&webhook::Webhook)?)
}
