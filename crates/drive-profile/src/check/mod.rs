//! The checker: what is malformed or lies is refused, each with its line, the reason and what to write.

mod actions;
mod fingerprints;
mod registers;
mod running;
mod seen;
mod setpoint;
mod standing;
mod states;
mod text;
mod who;

use std::{fmt, ops::Range};

use crate::format::Spanned;

use crate::{
    format::{File, Mark, Register, VERSION},
    ladder,
    profile::Profile,
    source::{asked, line, names},
    substance,
};

/// The longest text that is read, in bytes: ten times the longest profile that is shipped.
pub const LONGEST: usize = 256 * 1024;

/// The most refusals that are told of one text.
const TOLD: usize = 100;

/// The longest text of one value, in bytes.
const LONGEST_VALUE: usize = 2_000;

/// Framings that are not Modbus, by the words that a file may say, and what they are.
const NO_MODBUS: &[(&str, &str)] = &[
    (
        "huanyang",
        "the old Huanyang protocol has Modbus' check and functions of its own, whose third byte is a length",
    ),
    ("isaver", "the iSaver pump has functions C3h and D0h, which are none of Modbus"),
    (
        "h2a",
        "an H2A set to its non-standard protocol answers with a length of two bytes: set the drive to standard Modbus",
    ),
    (
        "computer_link",
        "Mitsubishi's computer link is a protocol of letters: set the drive to Modbus (Pr. 549 = 1)",
    ),
    ("uss", "USS is another protocol: set the drive to Modbus RTU"),
];

/// Why a text is no profile.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {reason}; write {write}")]
#[non_exhaustive]
pub struct Refusal {
    /// The line, from 1.
    pub line: usize,
    /// What is wrong.
    pub reason: String,
    /// What to write instead.
    pub write: String,
}

/// Everything for which a text is refused, in the order of its lines; at most a hundred.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct Refusals(pub Vec<Refusal>);

impl fmt::Display for Refusals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, refusal) in self.0.iter().enumerate() {
            if index > 0 {
                f.write_str("\n")?;
            }
            refusal.fmt(f)?;
        }
        Ok(())
    }
}

/// Reads a profile and checks it.
///
/// # Errors
/// [`Refusals`] of a text that is malformed or lies.
pub fn read(text: &str) -> Result<Profile, Refusals> {
    let file = text::parse(text).map_err(|refusal| Refusals(vec![refusal]))?;
    let mut check = Check { text, file: &file, refusals: Vec::new() };
    check.all();
    let mut refusals = check.refusals;
    if refusals.is_empty() {
        let substance = substance::of(text);
        let (level, gaps) = ladder::climb(text, &file, &substance);
        return Ok(Profile { file, level, gaps, digest: substance::digest(text), substance });
    }
    refusals.sort_by_key(|refusal| refusal.line);
    refusals.dedup();
    refusals.truncate(TOLD);
    Err(Refusals(refusals))
}

/// A file under check.
struct Check<'a> {
    text: &'a str,
    file: &'a File,
    refusals: Vec<Refusal>,
}

impl<'a> Check<'a> {
    fn all(&mut self) {
        let file = self.file;
        if *file.format.get_ref() != VERSION {
            self.refuse(
                &file.format.span(),
                format!("format {} is not read here", file.format.get_ref()),
                format!("format = {VERSION}, once the file is what this format says"),
            );
        }
        self.key();
        self.link();
        self.texts();
        self.sources();
        self.tried();
        self.registers();
        if file.register.values().any(|register| file.place(register.get_ref()).is_none()) {
            // Whatever names such a register would be refused for that, and not for what it says.
            return;
        }
        self.who();
        self.states();
        self.running();
        self.actions();
        self.setpoint();
    }

    fn refuse(&mut self, at: &Range<usize>, reason: impl Into<String>, write: impl Into<String>) {
        if self.refusals.len() < 4 * TOLD {
            let line = line(self.text, at);
            self.refusals.push(Refusal { line, reason: reason.into(), write: write.into() });
        }
    }

    /// Where the answer to a question stands that says no more than "none" or "unknown".
    fn line_of(&self, key: &str) -> Option<Range<usize>> {
        let at = asked(self.text, key)?;
        Some(at..at)
    }

    fn key(&mut self) {
        let key = &self.file.key;
        let fits = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-';
        let text = key.get_ref();
        if text.is_empty() || text.len() > 32 || !text.bytes().all(fits) {
            self.refuse(
                &key.span(),
                "the key is the name in configurations",
                "small letters, digits and hyphens, at most 32, such as key = \"wj200\"",
            );
        }
    }

    /// The framing, the functions and the settings of the line.
    fn link(&mut self) {
        let spanned = &self.file.link;
        let link = spanned.get_ref();
        let protocol = link.protocol.get_ref();
        if protocol != "modbus_rtu" {
            let known = NO_MODBUS.iter().find(|(word, _)| protocol.to_ascii_lowercase().contains(word));
            let what = known.map_or("it is no framing that is spoken here", |(_, what)| *what);
            self.refuse(
                &link.protocol.span(),
                format!("\"{protocol}\" is not Modbus RTU: {what}"),
                "protocol = \"modbus_rtu\" for a drive that speaks it; another cannot be driven by a profile",
            );
        }
        if link.functions.is_empty() {
            self.refuse(
                &spanned.span(),
                "no function is named",
                "functions = [3, 6], as the manual lists them",
            );
        }
        for function in &link.functions {
            if !matches!(function.get_ref(), 1..=6 | 15 | 16 | 23) {
                self.refuse(
                    &function.span(),
                    format!("function {} reads or writes no register", function.get_ref()),
                    "those of 1 to 6, 15, 16 and 23 that the drive answers",
                );
            }
        }
        for (what, limit, most) in [
            ("read_words", &link.read_words, 125),
            ("write_words", &link.write_words, 123),
            ("read_coils", &link.read_coils, 2_000),
            ("write_coils", &link.write_coils, 1_968),
        ] {
            if limit.given().is_some_and(|limit| !(1..=most).contains(limit)) {
                let at = asked(self.text, what).unwrap_or(0);
                self.refuse(
                    &(at..at),
                    format!("{what} is outside of what Modbus allows"),
                    format!("{what} = 1 to {most}, \"none\" or \"unknown\""),
                );
            }
        }
        for format in link.formats.given().into_iter().flatten() {
            if format.get_ref().parse::<drive_core::serial::CharacterFormat>().is_err() {
                self.refuse(&format.span(), "this is no character format", "one such as \"8E1\"");
            }
        }
        if let Some(exceptions) = &link.exceptions {
            self.source(&exceptions.get_ref().source);
            let mut codes: Vec<u8> = exceptions.get_ref().list.iter().map(|(code, _)| *code).collect();
            codes.sort_unstable();
            let is_twice = codes.windows(2).any(|pair| pair[0] == pair[1]);
            if codes.is_empty() || is_twice || codes.iter().any(|code| !(1..0x80).contains(code)) {
                self.refuse(
                    &exceptions.span(),
                    "these are no codes of exceptions: each is 1 to 127, and stands once",
                    "exceptions = { list = [[0x22, \"not_now\"]], source = \"...\" }, or nothing",
                );
            }
        }
        if let Some(factory) = link.factory.given()
            && factory.get_ref().parse::<drive_core::SerialSettings>().is_err()
        {
            self.refuse(&factory.span(), "this is no setting of a line", "one such as \"19200 8E1\"");
        }
        if let Some(highest) = link.highest_address.given()
            && !(1..=247).contains(highest.get_ref())
        {
            self.refuse(
                &highest.span(),
                "0 is everybody's address, and 248 to 255 are no addresses of Modbus over a serial line, whatever a manual prints: \
                 nothing is asked there",
                "highest_address = 247, and give the drive an address of 1 to 247",
            );
        }
    }

    /// Names that people read: short, and of printable characters.
    fn texts(&mut self) {
        let file = self.file;
        for text in [&file.maker, &file.name, &file.models] {
            let said = text.get_ref();
            if said.trim().is_empty() || said.len() > LONGEST_VALUE || said.chars().any(char::is_control) {
                self.refuse(
                    &text.span(),
                    "this is no name that a person can read",
                    "a short text of one line",
                );
            }
        }
    }

    fn sources(&mut self) {
        let file = self.file;
        for (name, source) in &file.sources {
            let said = source.get_ref();
            let is_none = |text: &str| text.trim().is_empty();
            let is_unknown = |text: &str| matches!(text.trim(), "none" | "unknown");
            let is_read = matches!(said.mark, Mark::P | Mark::R);
            if [&said.document, &said.page].into_iter().any(|of| is_none(of) || is_read && is_unknown(of)) {
                self.refuse(
                    &source.span(),
                    format!("source \"{name}\" names no document or no page"),
                    "document = \"...\", page = \"...\", so that another can open it; mark = \"M\" where nobody can",
                );
            }
        }
    }

    /// A trial has a day on which it was.
    fn tried(&mut self) {
        for tried in self.file.tried.given().into_iter().flatten() {
            let day = tried.get_ref().day.as_bytes();
            let is_day = day.len() == 10
                && day.iter().enumerate().all(|(at, byte)| match at {
                    4 | 7 => *byte == b'-',
                    _ => byte.is_ascii_digit(),
                });
            if !is_day {
                self.refuse(
                    &tried.span(),
                    format!("\"{}\" is no day on which it was tried", tried.get_ref().day),
                    "day = year, month and day, such as \"2026-11-24\"",
                );
            }
        }
    }

    /// The grade of a fact: that of the weakest source that it names. What names none that is listed is refused.
    fn source(&mut self, source: &Spanned<String>) {
        for name in names(source.get_ref()) {
            if !self.file.sources.contains_key(name) {
                self.refuse(
                    &source.span(),
                    format!("\"{name}\" is no source"),
                    format!("a table [sources.{name}], or the name of one that is there"),
                );
            }
        }
        if names(source.get_ref()).next().is_none() {
            self.refuse(&source.span(), "a fact without a source", "source = \"...\", one of [sources]");
        }
    }

    /// A register by its name; one that is not listed is refused.
    fn register(&mut self, name: &Spanned<String>) -> Option<&'a Register> {
        let found = self.file.named(name.get_ref());
        if found.is_none() {
            self.refuse(
                &name.span(),
                format!("there is no register \"{}\"", name.get_ref()),
                format!("a table [register.{}], or the name of one that is there", name.get_ref()),
            );
        }
        found
    }
}
