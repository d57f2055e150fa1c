//! The world of the simulated drives by lines of text: [`SimLine::control`].

mod words;

use std::time::Duration;

use drive_core::registers::{Place, Row, Space};

use self::words::{Deed, Words};
use crate::{
    line::{SimLine, SimSlave},
    model::{Exception, Observation},
    world::UnknownName,
};

/// What `help` answers.
const HELP: &str = "\
help                              this list
drives                            the drives of the line, and what is around each
line cut | join                   the cable of all drives
DRIVE is the family and the address, such as atv312@1:
DRIVE show                        what an observer of the machine sees
DRIVE terminal NAME on | off      a logic input
DRIVE analog NAME 50%             an analog input
DRIVE panel takes | releases      who is in control
DRIVE panel run | stop | reset    a key
DRIVE panel reference 25Hz        the panel's own reference
DRIVE power on | off | cycle      the supply of the control, and with it the whole drive
DRIVE motor-supply on | off       the supply of the power stage alone
DRIVE trip OCF                    a fault by its mnemonic or its number
DRIVE load 80%                    the load at the shaft
DRIVE cable cut | join            the cable of this drive
DRIVE busy on | off               whether it answers every request that it is busy, exception 06
DRIVE get CMOD                    a register by its mnemonic or address, or `coil 14`, without the line
DRIVE set CMOD 2                  a setting made at the panel, or an input that changes, without the line
DRIVE master 0xFA00 0400h         a word, or a coil, that another master of the line writes
DRIVE reading NAME READING        how the drive does what its manual leaves open";

/// Longer than anybody simulates.
const FOR_GOOD: Duration = Duration::from_secs(365 * 86_400);

/// Why a line was not carried out.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ControlError {
    /// It is no line that there is.
    #[error("{0:?} is none of the lines that there are: say help for a list")]
    Unknown(String),
    /// A value cannot be read, or no drive can have it.
    #[error("{word:?} is not {expected}")]
    Value {
        /// As it was given.
        word: String,
        /// What was expected there.
        expected: &'static str,
    },
    /// No drive of the line has this name.
    #[error("{name:?} is no drive of this line: it has {known}")]
    NoDrive {
        /// As it was given.
        name: String,
        /// The drives of the line.
        known: String,
    },
    /// The drive has no such terminal, input, switch or reading.
    #[error(transparent)]
    Name(#[from] UnknownName),
    /// The drive has no such register, or it keeps no such value.
    #[error("{0} has no {1} that takes this")]
    Register(String, String),
    /// The drive refused what another master wrote.
    #[error("the drive answers exception {:02X}h", .0.0)]
    Refused(Exception),
}

impl SimLine {
    /// Carries out one line of text, such as `atv312@1 terminal LI1 on`, and says what came of it; `help` lists all of
    /// them. An empty line does nothing.
    ///
    /// `drived sim` reads such lines from its standard input; any program that serves simulated drives can do the same.
    ///
    /// # Errors
    /// [`ControlError`]; nothing was done then.
    pub fn control(&self, line: &str) -> Result<String, ControlError> {
        let mut words = Words::of(line);
        let done = || "done".to_owned();
        match words.next() {
            "" => Ok(String::new()),
            "help" => words.end().map(|()| HELP.to_owned()),
            "drives" => words.end().map(|()| self.described()),
            "line" => {
                let joins = words.either("join", "cut")?;
                words.end()?;
                if joins {
                    self.join();
                } else {
                    self.cut();
                }
                Ok(done())
            }
            name if name.contains('@') => {
                let drive = self.named(name)?;
                let deed = words.deed(drive.surroundings())?;
                words.end()?;
                drive.does(deed).map(|told| told.unwrap_or_else(done))
            }
            _ => Err(words.unknown()),
        }
    }

    fn named(&self, name: &str) -> Result<SimSlave, ControlError> {
        let slaves = self.slaves();
        let found = slaves.iter().find(|slave| slave.name().eq_ignore_ascii_case(name));
        found.cloned().ok_or_else(|| {
            let known: Vec<_> = slaves.iter().map(SimSlave::name).collect();
            ControlError::NoDrive { name: name.to_owned(), known: known.join(", ") }
        })
    }

    fn described(&self) -> String {
        let drives: Vec<_> = self.slaves().iter().map(SimSlave::described).collect();
        drives.join("\n")
    }
}

impl SimSlave {
    /// The family and the address at which it was put, as `atv312@1`.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{}@{}", self.surroundings().family, self.address())
    }

    fn described(&self) -> String {
        let around = self.surroundings();
        let mut text = self.name();
        for (what, names) in [("terminals", around.terminals), ("analog inputs", around.analog_inputs)] {
            if !names.is_empty() {
                text += &format!("\n  {what}: {}", names.join(", "));
            }
        }
        for switch in around.switches {
            text +=
                &format!("\n  reading {} {}: {}", switch.name, switch.readings.join(" | "), switch.question);
        }
        text
    }

    /// Does it; what there is to tell of it.
    fn does(&self, deed: Deed) -> Result<Option<String>, ControlError> {
        match deed {
            Deed::Act(act) => self.world(act),
            Deed::Panel(action) => self.panel(action),
            Deed::Power(on) => self.power(on),
            Deed::PowerCycle => self.power_cycle(),
            Deed::Trip(code) => self.trip(code),
            Deed::Load(percent) => self.set_load(percent),
            Deed::Cable(true) => self.unmute(),
            Deed::Cable(false) => self.mute(),
            Deed::Busy(on) => self.keep_busy(if on { FOR_GOOD } else { Duration::ZERO }),
            Deed::Set(register, value) if self.poke_at(register, value) => {}
            Deed::Set(register, _) => return Err(self.no_register(register)),
            Deed::Master(register, value) => {
                self.written_by_another_at(register, value).map_err(ControlError::Refused)?;
            }
            Deed::Get(register) => {
                let value = self.peek_at(register).ok_or_else(|| self.no_register(register))?;
                let row = self.surroundings().rows.iter().find(|row: &&Row| row.place() == register);
                return Ok(Some(row.map_or_else(|| format!("{value:04X}h"), |row| row.show(value))));
            }
            Deed::Show => return Ok(Some(seen(self.observe()))),
        }
        Ok(None)
    }

    fn no_register(&self, register: Place) -> ControlError {
        let place = match register.space {
            Space::HoldingRegister => format!("register {:04X}h", register.address),
            _ => register.to_string(),
        };
        ControlError::Register(self.name(), place)
    }
}

/// What an observer sees, in a line.
fn seen(observed: Observation) -> String {
    let hertz = |hundredths: i32| f64::from(hundredths) / 100.0;
    let mut text = format!(
        "{}, output {:.2} Hz, shaft {:.2} Hz, setpoint {:.2} Hz",
        if observed.running { "fed" } else { "not fed" },
        hertz(observed.output_frequency),
        hertz(observed.shaft_frequency),
        hertz(observed.setpoint),
    );
    if let Some(code) = observed.trip {
        text += &format!(", tripped ({code})");
    }
    if observed.local {
        text += ", control is at the machine";
    }
    text
}
