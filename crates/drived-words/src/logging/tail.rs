//! The end of the log, while a table on the terminal shows it: nothing else is written to that terminal then.

use std::{
    collections::VecDeque,
    io::{self, IsTerminal as _, Write},
    sync::{Mutex, MutexGuard, PoisonError},
};

/// Lines that are kept for the table, and written when it ends.
const KEPT: usize = 500;

/// The lines of the table; `None`: there is none.
static SHOWN: Mutex<Option<VecDeque<String>>> = Mutex::new(None);

/// Where the log is written to: stderr, or the table.
pub(super) struct Tail;

impl Write for Tail {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let mut shown = kept();
        let Some(lines) = &mut *shown else {
            drop(shown);
            return io::stderr().write(line);
        };
        lines.extend(plain(&String::from_utf8_lossy(line)).lines().map(str::to_owned));
        lines.drain(..lines.len().saturating_sub(KEPT));
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// Shows the log in the table from now on.
pub fn show() {
    kept().get_or_insert_default();
}

/// Whether a table is shown.
pub fn is_shown() -> bool {
    kept().is_some()
}

/// The lines of the table, the newest last.
pub fn shown() -> Vec<String> {
    kept().iter().flatten().cloned().collect()
}

/// Writes the log to stderr again, from the lines that the table has shown on.
pub fn write_again() {
    let lines = kept().take();
    for line in lines.into_iter().flatten() {
        // Of a stderr that is gone nobody can be told.
        let _ = writeln!(io::stderr(), "{line}");
    }
}

/// Whether a table may show the log: it goes to a terminal, as the table does.
pub fn may_be_shown() -> bool {
    io::stdout().is_terminal() && io::stderr().is_terminal()
}

fn kept() -> MutexGuard<'static, Option<VecDeque<String>>> {
    SHOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A line without the colours of its level.
fn plain(line: &str) -> String {
    let mut plain = String::with_capacity(line.len());
    let mut rest = line;
    while let Some((before, after)) = rest.split_once("\u{1b}[") {
        plain.push_str(before);
        rest = after.split_once('m').map_or("", |(_, rest)| rest);
    }
    plain.push_str(rest);
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colour_of_a_level_is_no_part_of_a_line_in_the_table() {
        assert_eq!(plain("14:03 \u{1b}[1;31mERROR\u{1b}[0m pump 3 lost"), "14:03 ERROR pump 3 lost");
        assert_eq!(plain("as it is"), "as it is");
    }
}
