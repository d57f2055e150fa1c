//! The log: to stderr, as much as `DRIVED_LOG` says (`debug`, `drive_bus=trace,warn`).
//!
//! A line is `2026-11-21 14:03:21.350+01:00 WARN  north: pump 3 lost at 30 Hz: no answer for 3.2 s`: the time on the wrist
//! of whoever stands beside the plant, the level, what happened. What a device or a caller sent stands in it with its
//! control characters escaped.
//!
//! Writing may block for as long as a terminal is held or a pipe is full, and may fail for ever. The tasks that feed the
//! drives' watchdogs write to the log, so they only hand their lines to a thread: what it cannot take is lost and counted.

mod tail;

use std::{
    fmt::{self, Write as _},
    io::{self, Write},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
        mpsc::{Receiver, SyncSender, sync_channel},
    },
    time::Duration,
};

use tracing::{Event, Level, Subscriber, field::Field};
use tracing_subscriber::{
    filter::{LevelFilter, Targets},
    fmt::{FmtContext, FormatEvent, FormatFields, format},
    layer::SubscriberExt as _,
    registry::LookupSpan,
    util::SubscriberInitExt as _,
};

pub use self::tail::{is_shown, may_be_shown, show, shown, write_again};
use crate::{failure::Failure, output};

const VARIABLE: &str = "DRIVED_LOG";
/// Lines that wait for the writer.
const WAITING: usize = 1_024;
/// How long the reader of stderr has for the last lines.
const LAST_WORDS: Duration = Duration::from_millis(500);

/// Starts the log at a level, or at what the environment says instead. `Ok(None)`: no log, because the screen is a table.
///
/// # Errors
/// What the environment says is no level.
pub fn start(level: Option<Level>) -> Result<Option<Log>, Failure> {
    let said = std::env::var(VARIABLE).unwrap_or_default();
    let said = wanted(&said)?;
    let Some(level) = level else { return Ok(None) };
    let filter = filter(said, level);
    let log = Log::to(tail::Tail);
    let lines = log.lines.clone();
    tracing_subscriber::fmt()
        .with_max_level(LevelFilter::TRACE)
        .with_writer(move || lines.clone())
        .with_ansi(output::is_coloured(&io::stderr()))
        // It would be told on stderr, by a panic where nobody reads that.
        .log_internal_errors(false)
        .event_format(Form)
        .finish()
        .with(filter)
        .init();
    Ok(Some(log))
}

/// What is said of one part says nothing of the others.
fn filter(said: Targets, level: Level) -> Targets {
    if said.default_level().is_some() { said } else { said.with_default(level) }
}

/// What the environment says: `LEVEL` or `PART=LEVEL`, several with commas.
fn wanted(said: &str) -> Result<Targets, Failure> {
    let mut directives = said.split(',').map(str::trim).filter(|directive| !directive.is_empty());
    directives.try_fold(Targets::new(), |wanted, directive| {
        let (part, level) = match directive.split_once('=') {
            Some((part, level)) => (Some(part.trim()), level.trim()),
            None => (None, directive),
        };
        let Ok(level) = level.parse::<LevelFilter>() else {
            return Err(Failure::Input(format!(
                "{VARIABLE}: {directive:?} is no level: expected off, error, warn, info, debug or trace, or a part of the \
                 program with one, such as drive_bus=debug"
            )));
        };
        Ok(match part {
            Some(part) => wanted.with_target(part, level),
            None => wanted.with_default(level),
        })
    })
}

/// How a line of the log looks.
struct Form;

impl<S, N> FormatEvent<S, N> for Form
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        _: &FmtContext<'_, S, N>,
        mut writer: format::Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        let mut text = Text::default();
        event.record(&mut text);
        let level = *event.metadata().level();
        let (on, off) = if writer.has_ansi_escapes() { colour(level) } else { ("", "") };
        let time = chrono::Local::now().format("%Y-%m-%d %H:%M:%S%.3f%:z");
        writeln!(writer, "{time} {on}{level:<5}{off} {}{}", text.message, text.fields)
    }
}

/// What switches the colour of a level on and off.
const fn colour(level: Level) -> (&'static str, &'static str) {
    match level {
        Level::ERROR => ("\u{1b}[1;31m", "\u{1b}[0m"),
        Level::WARN => ("\u{1b}[33m", "\u{1b}[0m"),
        Level::INFO => ("\u{1b}[32m", "\u{1b}[0m"),
        _ => ("\u{1b}[2m", "\u{1b}[0m"),
    }
}

/// What an event says, its control characters escaped.
#[derive(Default)]
struct Text {
    message: String,
    fields: String,
}

impl tracing::field::Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        let said = escaped(&format!("{value:?}"));
        if field.name() == "message" {
            self.message = said;
        } else {
            // A string takes it.
            let _ = write!(self.fields, " {}={said}", field.name());
        }
    }
}

/// A text that neither ends a line nor commands a terminal, nor turns its letters round.
pub fn escaped(text: &str) -> String {
    let turns = |character| matches!(character, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        if character.is_control() || turns(character) || matches!(character, '\u{2028}' | '\u{2029}') {
            escaped.extend(character.escape_default());
        } else {
            escaped.push(character);
        }
    }
    escaped
}

enum Message {
    Line(Vec<u8>),
    /// Everything before it has been written.
    End(SyncSender<()>),
}

/// The log and its thread.
pub struct Log {
    lines: Lines,
}

/// Where the lines are handed in; each write is one line.
#[derive(Clone)]
struct Lines {
    waiting: SyncSender<Message>,
    lost: Arc<AtomicU64>,
}

impl Log {
    fn to(writer: impl Write + Send + 'static) -> Self {
        let (waiting, lines) = sync_channel(WAITING);
        let lost = Arc::new(AtomicU64::new(0));
        let counted = Arc::clone(&lost);
        std::thread::spawn(move || write(&lines, &counted, writer));
        Self { lines: Lines { waiting, lost } }
    }

    /// Writes what is left, if it finds a reader in time.
    pub fn finish(self) {
        let (written, all) = sync_channel(1);
        if self.lines.waiting.try_send(Message::End(written)).is_ok() {
            // Nobody is left to be told that nobody reads.
            let _ = all.recv_timeout(LAST_WORDS);
        }
    }
}

impl Write for Lines {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        if self.waiting.try_send(Message::Line(line.to_vec())).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn write(lines: &Receiver<Message>, lost: &AtomicU64, mut writer: impl Write) {
    for message in lines {
        // What a closed stderr does not take is lost; there is no other place to tell it.
        match message {
            Message::Line(line) => {
                let _ = writer.write_all(&line);
            }
            Message::End(written) => {
                let _ = written.send(());
            }
        }
        match lost.swap(0, Ordering::Relaxed) {
            0 => {}
            lost => {
                let _ = writeln!(writer, "{lost} lines of the log are lost: it was not read in time");
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    /// Takes a line only when it is allowed to, and tells it.
    struct Slow {
        allowed: Receiver<()>,
        taken: std::sync::mpsc::Sender<String>,
    }

    impl Write for Slow {
        fn write(&mut self, line: &[u8]) -> io::Result<usize> {
            let _ = self.allowed.recv();
            let _ = self.taken.send(String::from_utf8_lossy(line).into_owned());
            Ok(line.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_log_that_is_not_read_holds_up_nobody_and_what_is_lost_is_counted() {
        let (allow, allowed) = channel();
        let (taken, told) = channel();
        let log = Log::to(Slow { allowed, taken });
        let mut lines = log.lines.clone();
        let written = 2 * WAITING;
        for number in 0..written {
            writeln!(lines, "{number}").unwrap();
        }
        drop((allow, lines));
        log.finish();
        let whole: String = told.iter().collect();
        assert!(whole.contains(" lines of the log are lost"), "{whole}");
        assert!(whole.contains("0\n") && !whole.contains(&format!("{}\n", written - 1)), "{whole}");
    }

    #[test]
    fn what_a_device_sent_commands_no_terminal_and_ends_no_line() {
        assert_eq!(escaped("ATV312\u{1b}[2J\n\u{9b}31m"), "ATV312\\u{1b}[2J\\n\\u{9b}31m");
        assert_eq!(escaped("Pumpe Süd → 30 Hz"), "Pumpe Süd → 30 Hz");
        assert_eq!(escaped("a\u{202e}b"), "a\\u{202e}b");
    }

    #[test]
    fn an_unknown_level_is_refused_and_a_part_with_its_level_is_not() {
        for (said, is_right) in [
            ("", true),
            ("debug", true),
            ("drive_bus=trace,warn", true),
            ("loud", false),
            ("drive_bus=loud", false),
        ] {
            assert_eq!(wanted(said).is_ok(), is_right, "{said}");
        }
    }

    #[test]
    fn what_is_said_of_one_part_says_nothing_of_the_others() {
        let shows = |said: &str, part: &str, level: Level| {
            filter(wanted(said).expect("it is right"), Level::INFO).would_enable(part, &level)
        };
        assert!(shows("drive_bus=trace", "drive_bus::task", Level::TRACE));
        assert!(shows("drive_bus=trace", "drived", Level::INFO));
        assert!(!shows("drive_bus=trace", "drived", Level::DEBUG));
        assert!(shows(" drive_bus = trace , warn", "drive_bus", Level::TRACE));
        assert!(!shows("drive_bus=trace,warn", "drived", Level::INFO));
        assert!(!shows("off", "drived", Level::ERROR));
        assert!(shows("", "drived", Level::INFO) && !shows("", "drived", Level::DEBUG));
    }

    #[test]
    fn a_log_that_cannot_be_written_is_no_reason_to_end() {
        struct Closed;
        impl Write for Closed {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::ErrorKind::BrokenPipe.into())
            }

            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let log = Log::to(Closed);
        assert!(writeln!(log.lines.clone(), "line").is_ok());
        log.finish();
    }
}
