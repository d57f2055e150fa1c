//! `drived` with a sixth family: every subcommand, the daemon and its page know the FAN1 as they know the five.

#![forbid(unsafe_code)]

use std::process::ExitCode;

use drive_families::Family;

fn main() -> ExitCode {
    if let Err(taken) = Family::new(&drive_fan1::FAN1).add() {
        eprintln!("{taken}");
        return ExitCode::FAILURE;
    }
    drived::program()
}
