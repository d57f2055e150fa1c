//! The registers of a drive, read and written in turns between its polls.

use std::{
    borrow::Cow,
    collections::BTreeMap,
    sync::{Mutex, PoisonError},
    time::Duration,
};

use drive_core::{
    Capabilities, Error, ErrorKind, Row, Written,
    registers::{Access, Place, Space, Storage},
};
use drive_fleet::{DriveHandle, Refused};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tokio::time::{Instant, timeout_at};

use super::{Plant, revisions::Subject};
use drived_config::rights::Caller;
use drived_words::{
    json::{milliseconds, unix},
    registers::{factory, range},
    way::Way,
};

/// A word that was read this lately is not read again for a list.
const YOUNG: Duration = Duration::from_secs(60);

/// Words that were read, by drive and place.
#[derive(Default)]
pub(super) struct Words(Mutex<BTreeMap<(String, Place), (u16, Instant)>>);

/// One register, and what the drive holds in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParameterView {
    pub mnemonic: Cow<'static, str>,
    pub address: u16,
    /// Where that address is: `coil`, `discrete_input` or `input_register`; absent of a holding register.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub space: Option<Space>,
    pub name: Cow<'static, str>,
    /// In its unit, or the mnemonic of a listed value; absent where it has not been read, or can only be written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<ValueView>,
    /// The value with its unit or its meaning.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// The word.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub raw: Option<u16>,
    /// How long ago it was read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub age_ms: Option<u64>,
    /// Why it could not be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    #[serde(default, skip_serializing_if = "str::is_empty")]
    pub unit: Cow<'static, str>,
    pub access: AccessWord,
    /// Where a written value lives: `RAM`, `RAM until saved`, `EEPROM` or `unknown`.
    pub storage: String,
    /// Which values it takes, in words; empty where the manual says nothing.
    pub range: String,
    /// The factory setting; empty where there is none.
    pub factory: String,
}

/// How a register may be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AccessWord {
    Read,
    ReadWrite,
    /// Written at standstill.
    WriteStopped,
    Write,
}

drive_core::named! { AccessWord {
    Read => "read",
    ReadWrite => "read write",
    WriteStopped => "write stopped",
    Write => "write",
} }

/// A value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ValueView {
    Number(f64),
    Text(String),
}

/// What became of a written register.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WrittenView {
    #[serde(flatten)]
    pub parameter: ParameterView,
    /// Whether the drive held another value before.
    pub changed: bool,
}

impl ParameterView {
    /// Where it stands.
    pub fn place(&self) -> Place {
        Place { space: self.space.unwrap_or(Space::HoldingRegister), address: self.address }
    }

    /// What was read a moment ago.
    pub fn read(capabilities: &Capabilities, row: &Row, raw: u16) -> Self {
        Self::of(capabilities, row, Some((raw, Instant::now())), None)
    }

    /// What the family's table says of a register that nobody has read.
    pub fn unasked(capabilities: &Capabilities, row: &Row) -> Self {
        Self::of(capabilities, row, None, None)
    }

    /// What could not be read, and why.
    pub fn unread(capabilities: &Capabilities, row: &Row, why: String) -> Self {
        Self::of(capabilities, row, None, Some(why))
    }

    fn of(
        capabilities: &Capabilities,
        row: &Row,
        word: Option<(u16, Instant)>,
        error: Option<String>,
    ) -> Self {
        let raw = word.map(|(raw, _)| raw);
        Self {
            mnemonic: row.code.into(),
            address: row.address,
            space: Some(row.space).filter(|space| *space != Space::HoldingRegister),
            name: row.name.into(),
            value: raw.map(|raw| ValueView::of(row, raw)),
            text: raw.map(|raw| row.show(raw)),
            raw,
            age_ms: word.map(|(_, at)| milliseconds(at.elapsed())),
            error,
            unit: row.unit.symbol.into(),
            access: match row.access {
                Access::Read => AccessWord::Read,
                Access::ReadWrite => AccessWord::ReadWrite,
                Access::WriteStopped => AccessWord::WriteStopped,
                Access::Write => AccessWord::Write,
            },
            storage: row.storage.to_string(),
            range: range(row),
            factory: factory(capabilities, row),
        }
    }
}

impl ValueView {
    fn of(row: &Row, raw: u16) -> Self {
        match row.choice(raw) {
            Some(choice) => Self::Text(choice.code.to_owned()),
            None if row.unit.is_number(raw) => {
                let step = 10_f64.powi(i32::from(row.unit.decimals));
                Self::Number(row.unit.shown(raw) as f64 / step)
            }
            None => Self::Text(row.unit.show(raw)),
        }
    }
}

impl Words {
    fn of(&self, drive: &DriveHandle, row: &Row) -> Option<(u16, Instant)> {
        let words = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        words.get(&(drive.name().to_string(), row.place())).copied()
    }

    /// Whether a word was read a moment ago.
    fn is_young(&self, drive: &DriveHandle, row: &Row) -> bool {
        self.of(drive, row).is_some_and(|(_, at)| at.elapsed() <= YOUNG)
    }

    /// A row in the unit that it has, as far as what chooses that has been read.
    fn in_units(&self, drive: &DriveHandle, row: &Row) -> Row {
        let capabilities = drive.capabilities();
        let by = capabilities.scaled_by(row.address).and_then(|by| self.of(drive, by));
        capabilities.in_units(row, |_| by.map(|(word, _)| word))
    }

    fn keep(&self, drive: &DriveHandle, row: &Row, word: Option<u16>) -> Option<(u16, Instant)> {
        let mut words = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (drive.name().to_string(), row.place());
        let word = word.map(|word| (word, Instant::now()));
        match word {
            Some(word) => words.insert(key, word),
            None => words.remove(&key),
        };
        word
    }
}

impl Plant {
    /// Every register of a drive, with what could be read of it until `wait` is over: one that was not read has no value,
    /// and the next call goes on there.
    pub async fn parameters(&self, drive: &DriveHandle, wait: Duration) -> Vec<ParameterView> {
        let until = Instant::now() + wait;
        let mut views = Vec::new();
        for row in drive.capabilities().rows {
            // What chooses the unit may stand behind it in the map, and a number without its unit would be another one.
            let by = drive.capabilities().scaled_by(row.address);
            if let Some(by) = by.filter(|by| !self.0.words.is_young(drive, by))
                && Instant::now() < until
                && let Ok(Ok(raw)) = timeout_at(until, drive.read_parameter(by)).await
            {
                self.0.words.keep(drive, by, Some(raw));
            }
            let mut word = self.0.words.of(drive, row);
            let (mut error, mut read) = (None, None);
            if row.access.is_readable() && !self.0.words.is_young(drive, row) && Instant::now() < until {
                match timeout_at(until, drive.read_parameter(row)).await {
                    Ok(Ok(raw)) => {
                        read = Some(raw);
                        word = self.0.words.keep(drive, row, Some(raw));
                    }
                    Ok(Err(refused)) => error = Some(refused.to_string()),
                    Err(_) => {}
                }
            }
            let shown = self.0.words.in_units(drive, row);
            if let Some(raw) = read {
                self.note_parameter(drive, &shown, raw);
            }
            views.push(ParameterView::of(drive.capabilities(), &shown, word, error));
        }
        views
    }

    /// One register of a drive, read now.
    ///
    /// # Errors
    /// Why it cannot be read.
    pub async fn parameter(&self, drive: &DriveHandle, row: &'static Row) -> Result<ParameterView, Refused> {
        let raw = drive.read_parameter(row).await?;
        let shown = self.in_units(drive, row).await?;
        self.note_parameter(drive, &shown, raw);
        let word = self.0.words.keep(drive, row, Some(raw));
        Ok(ParameterView::of(drive.capabilities(), &shown, word, None))
    }

    /// A row in the unit that it has in this drive now, which another register may choose: read only where one does.
    ///
    /// # Errors
    /// Why that one cannot be read.
    pub async fn in_units(&self, drive: &DriveHandle, row: &'static Row) -> Result<Row, Refused> {
        if let Some(by) = drive.capabilities().scaled_by(row.address) {
            let word = drive.read_parameter(by).await?;
            self.0.words.keep(drive, by, Some(word));
        }
        Ok(self.0.words.in_units(drive, row))
    }

    /// Why these words are not written to a drive one after the other, whoever asks: one would leave it with what its manual forbids among
    /// its registers. Those are read anew; what cannot be read forbids nothing.
    pub async fn forbids(&self, drive: &DriveHandle, writes: &[(&'static Row, u16)]) -> Option<String> {
        let mut way = Way::of(drive.capabilities(), std::iter::empty());
        for row in way.judged_by(writes) {
            if let Ok(word) = drive.read_parameter(row).await {
                self.0.words.keep(drive, row, Some(word));
                way.hold(row.place(), word);
            }
        }
        way.refuses(writes)
    }

    /// Writes one register of a drive, unless it holds the word already, and reads it back. It goes on when nobody waits.
    ///
    /// # Errors
    /// Why it is not written, or not confirmed.
    pub async fn write_parameter(
        &self,
        drive: &DriveHandle,
        row: &'static Row,
        word: u16,
    ) -> Result<WrittenView, Refused> {
        self.0.words.keep(drive, row, None);
        let Written { changed, storage } = drive.write_parameter(row, word).await?;
        let held = self.0.words.keep(drive, row, Some(word));
        let shown = self.0.words.in_units(drive, row);
        self.note_parameter(drive, &shown, word);
        let parameter = ParameterView::of(drive.capabilities(), &shown, held, None);
        let how = if changed { "is now" } else { "was already" };
        let kept = match storage {
            Storage::Volatile => "lost at power-off",
            Storage::RamUntilSaved => "lost at power-off unless it is saved",
            Storage::Eeprom => "kept in EEPROM",
            Storage::Unknown => "the manual does not say whether it is kept",
        };
        let later = drive.capabilities().restoring.acts_later(row.address);
        let later = later.map(|needs| format!("; {needs}")).unwrap_or_default();
        let text = Some(format!("{} {how} {} ({kept}){later}", row.code, shown.show(word)));
        Ok(WrittenView { parameter: ParameterView { text, ..parameter }, changed })
    }
}

impl Plant {
    /// Tells that somebody has written a parameter, and what the drive holds now: it is an act like a command.
    pub fn tell_written(&self, by: &Caller, drive: &DriveHandle, row: &Row, word: u16, changed: bool) {
        let shown = self.0.words.in_units(drive, row).show(word);
        let how = if changed { "written as" } else { "written, and it was already" };
        let Caller { name, origin, .. } = by;
        let event = serde_json::json!({
            "time_unix_ms": unix(Instant::now()),
            "drive": &**drive.name(),
            "event": "parameter_written",
            "alarm": false,
            "text": format!("parameter {} {how} {shown} by {name} from {origin}", row.code),
        });
        self.0.revisions.push(Subject::Event, &event);
    }
}

/// Whether a parameter that could not be written, or not be read back, may hold the new value.
pub fn may_have_written(error: &Error) -> bool {
    match (error, error.kind()) {
        (_, ErrorKind::OutcomeUnknown | ErrorKind::NotConfirmed) => true,
        (Error::Port { exchange, .. }, ErrorKind::NoAnswer) | (Error::Answer { exchange, .. }, _) => {
            exchange.is_write()
        }
        _ => false,
    }
}
