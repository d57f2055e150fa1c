//! What a person reads: lines, tables, numbers in their units, and how far something is.
//!
//! Results go to stdout. Why the program ends and how far it is go to stderr, so that what is piped on stays clean. With
//! `--json` why it ends is an object too, with the same words. Nothing depends on whether a terminal is there but where a
//! line breaks, whether progress is shown, and colours.

mod progress;
mod table;
mod terminal;

use std::{
    fmt,
    io::{self, Write},
    sync::OnceLock,
    time::Duration,
};

use drive_core::{Status, registers::Unit};
use serde_json::json;

pub use self::{
    progress::{Progress, during},
    table::{Table, hanging, wrapped},
    terminal::is_coloured,
};
use crate::failure::Failure;

/// Whether stderr is read by a program.
static FOR_PROGRAM: OnceLock<bool> = OnceLock::new();

/// Says once whether the words on stderr are objects, by the arguments of the program as they were typed: what cannot be
/// parsed is answered in the same form.
pub fn choose_form(arguments: impl IntoIterator<Item = std::ffi::OsString>) {
    let is_json = arguments.into_iter().take_while(|word| word != "--").any(|word| word == "--json");
    // Only the first word counts, and there is no other.
    let _ = FOR_PROGRAM.set(is_json);
}

/// Prints a line, on a terminal broken between its words. A reader who went away (`drived poll | head`) ends the program,
/// without a panic.
pub fn say(line: impl fmt::Display) -> Result<(), Failure> {
    match terminal::width(&io::stdout()) {
        Some(width) => {
            line.to_string().split('\n').flat_map(|line| hanging(line, width)).try_for_each(say_as_it_is)
        }
        None => say_as_it_is(line),
    }
}

/// Prints a text behind a head; on a terminal the lines that go on begin below it.
pub fn say_behind(head: &str, text: &str) -> Result<(), Failure> {
    let Some(width) = terminal::width(&io::stdout()) else {
        return say_as_it_is(format_args!("{head}{text}"));
    };
    let set_in = head.chars().count();
    let mut head = head.to_owned();
    for line in wrapped(text, width.saturating_sub(set_in).max(set_in)) {
        say_as_it_is(format_args!("{head}{line}"))?;
        head = " ".repeat(set_in);
    }
    Ok(())
}

/// Prints a line for a program, unbroken.
pub fn say_as_it_is(line: impl fmt::Display) -> Result<(), Failure> {
    progress::make_room();
    writeln!(io::stdout().lock(), "{line}").map_err(|error| Failure::output(&error))
}

/// Prints a table, on a terminal no wider than that.
pub fn say_table(table: Table) -> Result<(), Failure> {
    say_as_it_is(table.on_terminal())
}

/// `--json` of a subcommand that needs no daemon.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub struct JsonArgs {
    /// Print JSON: one object, or one a line
    #[arg(long)]
    json: bool,
}

impl JsonArgs {
    /// Prints an object for a program, else what a person reads.
    pub fn say(
        self,
        object: impl FnOnce() -> serde_json::Value,
        text: impl FnOnce() -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        if self.json { say_as_it_is(object()) } else { text() }
    }

    pub const fn is_json(self) -> bool {
        self.json
    }
}

/// What has been told of what is done: it is done whether or not anybody reads that, and only said on stderr where it cannot be written.
pub fn done(told: Result<(), Failure>) -> Result<(), Failure> {
    match told {
        Err(failure @ Failure::Output(_)) => {
            complain(failure);
            Ok(())
        }
        Err(Failure::OutputClosed) => Ok(()),
        told => told,
    }
}

/// Says on stderr what is not well on the way, if anybody reads that.
pub fn complain(what: impl fmt::Display) {
    tell(&what, |what| json!({ "warning": what }));
}

/// Says on stderr why the program ends, if anybody reads that: the exit code says it too.
pub fn end(why: &Failure) {
    tell(why, |what| json!({ "error": what, "exit_code": why.code() }));
}

fn tell(what: &dyn fmt::Display, object: impl FnOnce(String) -> serde_json::Value) {
    progress::make_room();
    let line = format!("drived: {what}");
    let lines = match (FOR_PROGRAM.get(), terminal::width(&io::stderr())) {
        (Some(true), _) => vec![object(what.to_string()).to_string()],
        (_, Some(width)) => hanging(&line, width),
        _ => vec![line],
    };
    for line in lines {
        // Nobody is left to be told that nobody reads.
        let _ = writeln!(io::stderr(), "{line}");
    }
}

/// A number of things: `1 drive`, `31 drives`.
pub fn counted(number: usize, one: &str, several: &str) -> String {
    format!("{number} {}", if number == 1 { one } else { several })
}

/// A value, or a dash where there is none.
pub fn or_dash(value: Option<impl fmt::Display>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| value.to_string())
}

/// An age or a length of time, in one unit that a person takes in at a glance.
pub fn age(time: Duration) -> String {
    let milliseconds = time.as_millis();
    match milliseconds {
        0..1_000 => format!("{milliseconds} ms"),
        1_000..10_000 => format!("{}.{} s", milliseconds / 1_000, milliseconds % 1_000 / 100),
        10_000..120_000 => format!("{} s", milliseconds / 1_000),
        120_000..7_200_000 => format!("{} min", milliseconds / 60_000),
        _ => format!("{} h", milliseconds / 3_600_000),
    }
}

/// A short time as a person compares it.
pub fn milliseconds(time: Duration) -> String {
    let micros = time.as_micros();
    format!("{}.{:02} ms", micros / 1_000, micros % 1_000 / 10)
}

/// A time that nothing takes longer than, rounded up.
pub fn bound(time: Duration) -> String {
    let millis = time.as_nanos().div_ceil(1_000_000);
    match millis {
        0..1_000 => format!("{millis} ms"),
        _ => {
            let hundredths = millis.div_ceil(10);
            format!("{}.{:02} s", hundredths / 100, hundredths % 100)
        }
    }
}

/// Millionths as a percentage.
pub fn percent(ppm: u64) -> String {
    let ppm = ppm.saturating_add(50);
    format!("{}.{:02} %", ppm / 10_000, ppm % 10_000 / 100)
}

/// A number of counts in a register's unit.
pub fn in_unit(unit: Unit, count: i32) -> String {
    let word = if unit.signed {
        i16::try_from(count).ok().map(i16::cast_unsigned)
    } else {
        u16::try_from(count).ok()
    };
    word.map_or_else(|| count.to_string(), |word| unit.show(word))
}

/// The motor current, in amperes or as a share of the drive's own.
pub fn current(status: &Status) -> Option<String> {
    let share = || status.current_share.map(|share| share.to_string());
    status.current.map(|current| current.to_string()).or_else(share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_is_shown_in_its_unit_with_its_sign() {
        assert_eq!(in_unit(Unit::scaled("Hz", 1), 500), "50.0 Hz");
        assert_eq!(in_unit(Unit::scaled("Hz", 1).signed(), -500), "-50.0 Hz");
        assert_eq!(in_unit(Unit::COUNT, 70_000), "70000");
    }

    #[test]
    fn shares_and_times_keep_two_decimals() {
        assert_eq!(percent(995_040), "99.50 %");
        assert_eq!(percent(680_150), "68.02 %");
        assert_eq!(milliseconds(Duration::from_micros(5_678)), "5.67 ms");
    }

    #[test]
    fn a_bound_is_never_shown_shorter_than_it_is() {
        for (micros, shown) in [
            (0, "0 ms"),
            (1, "1 ms"),
            (999_000, "999 ms"),
            (999_001, "1.00 s"),
            (1_000_001, "1.01 s"),
            (61_230_000, "61.23 s"),
        ] {
            assert_eq!(bound(Duration::from_micros(micros)), shown);
        }
    }
}
