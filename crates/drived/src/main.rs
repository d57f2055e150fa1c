//! Variable-speed drives over Modbus from the command line.

#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    drived::program()
}
