//! What can go wrong with a drive: which slave, which register, why.

use std::{fmt, time::Duration};

use crate::{
    access::Access,
    address::SlaveAddress,
    port::PortError,
    refusal::Refusal,
    setpoint::{Command, Setpoint},
    status::Status,
    units::{Frequency, Speed},
};

/// The result of everything that talks to a drive.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Which exchange failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Exchange {
    /// The function code.
    pub function: u8,
    /// The first register, for the functions that have one.
    pub register: Option<u16>,
}

impl Exchange {
    /// Whether it writes registers or coils.
    #[must_use]
    pub const fn is_write(self) -> bool {
        matches!(self.function, 0x05 | 0x06 | 0x0F | 0x10 | 0x16 | 0x17)
    }
}

impl fmt::Display for Exchange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verb = match self.function {
            0x03 | 0x04 => "reading",
            0x06 | 0x10 => "writing",
            _ => "function",
        };
        match self.register {
            Some(register) => write!(f, "{verb} register {register} ({register:04X}h)"),
            None => write!(f, "function {:02X}h", self.function),
        }
    }
}

/// Server device busy: the slave has done nothing, and wants to be asked again (Modbus Application Protocol V1.1b3, section 7).
pub(crate) const BUSY: u8 = 6;

/// The negative reply of UNI-TE (Altivar 58, p. 13/37), where it stands for an exception: no code of Modbus.
pub const NEGATIVE_REPLY: u8 = 0xFD;

/// What an exception means on a drive of this family, and so what to do about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ExceptionMeaning {
    /// The drive does not have this function.
    NoSuchFunction,
    /// The drive does not have this register, or not for this access.
    NoSuchRegister,
    /// The value or the quantity is outside what the drive takes.
    ValueRefused,
    /// The drive refuses it now: the motor runs (stop first), or it is under undervoltage or busy with a factory
    /// setting.
    NotNow,
    /// The drive began and could not complete; a retry may help.
    Failed,
    /// The drive has accepted it and takes long for it: whether it was carried out has to be read back.
    Accepted,
    /// The drive is busy with something else and has done nothing: it is asked again.
    Busy,
    /// The drive refuses it and says no reason, as a negative reply of UNI-TE does.
    Refused,
    /// What stands between, a gateway or a network, says that it has no way to the drive.
    NoPath,
    /// A code that the manual does not list.
    Unknown,
}

impl ExceptionMeaning {
    /// What the Modbus specification says of the codes 1 to 6, for families whose manual says the same.
    #[must_use]
    pub const fn standard(code: u8) -> Self {
        match code {
            1 => Self::NoSuchFunction,
            2 => Self::NoSuchRegister,
            3 => Self::ValueRefused,
            4 => Self::Failed,
            5 => Self::Accepted,
            BUSY => Self::Busy,
            _ => Self::Unknown,
        }
    }

    /// The same, where it means nothing on a drive and is what a gateway says.
    #[must_use]
    pub const fn or_of_a_gateway(self, code: u8) -> Self {
        match (self, code) {
            (Self::Unknown, 0x0A) => Self::NoPath,
            _ => self,
        }
    }

    /// Whether it says of a write that nothing was done by it. "Began and could not complete" (04h), "takes long" (05h), a
    /// gateway's or network's "no way to it" (0Ah) and "heard no answer" (0Bh), and a code of which the manual says nothing leave
    /// that open: the write may have been carried out, and a run word may turn the motor.
    #[must_use]
    pub const fn denies(self) -> bool {
        matches!(
            self,
            Self::NoSuchFunction
                | Self::NoSuchRegister
                | Self::ValueRefused
                | Self::NotNow
                | Self::Busy
                | Self::Refused
        )
    }

    /// Whether the same request may succeed later without anybody changing anything.
    #[must_use]
    pub const fn is_worth_a_retry(self) -> bool {
        matches!(self, Self::Failed | Self::Busy)
    }
}

impl fmt::Display for ExceptionMeaning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoSuchFunction => "the drive does not have this function",
            Self::NoSuchRegister => "the drive does not have this register, or not for this access",
            Self::ValueRefused => "the drive does not take this value or quantity",
            Self::NotNow => {
                "the drive refuses it now: stop the motor first, and see that it is supplied and not busy"
            }
            Self::Failed => "the drive could not complete it",
            Self::Accepted => "the drive has accepted it and takes long for it",
            Self::Busy => "the drive is busy",
            Self::Refused => "the drive refuses it and says no reason",
            Self::NoPath => "what stands between has no way to the drive",
            Self::Unknown => "a code that the manual does not list",
        })
    }
}

/// What the protocol that has this code calls it.
const fn name_of(code: u8) -> &'static str {
    match code {
        NEGATIVE_REPLY => "negative reply",
        _ => "exception",
    }
}

/// Why a setpoint cannot be given to the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SetpointProblem {
    /// The drive's own limits forbid it.
    OutsideFrequencyLimits {
        /// The lowest that is allowed.
        low: Frequency,
        /// The highest that is allowed.
        high: Frequency,
    },
    /// The drive's own limits forbid it.
    OutsideSpeedLimits {
        /// The lowest that is allowed.
        low: Speed,
        /// The highest that is allowed.
        high: Speed,
    },
    /// The drive tells no limit, and its owner has said that it is this.
    OutsideOwnersLimits {
        /// The lowest that is allowed.
        low: Frequency,
        /// The highest that its owner allows.
        high: Frequency,
    },
    /// The register's resolution cannot hold it exactly.
    Resolution(&'static str),
    /// The register cannot hold a number this large.
    TooLarge,
}

impl fmt::Display for SetpointProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutsideFrequencyLimits { low, high } => write!(f, "the drive allows {low} to {high}"),
            Self::OutsideSpeedLimits { low, high } => write!(f, "the drive allows {low} to {high}"),
            Self::OutsideOwnersLimits { low, high } => write!(f, "its owner allows {low} to {high}"),
            Self::Resolution(step) => write!(f, "the drive takes steps of {step}"),
            Self::TooLarge => f.write_str("the register cannot hold it"),
        }
    }
}

/// What went wrong with a drive.
///
/// ```
/// use drive_core::{Command, Direction, Error, ErrorKind, Refusal, SlaveAddress};
///
/// let error = Error::Refused {
///     slave: SlaveAddress::MIN,
///     command: Command::Start(Direction::Forward),
///     reason: Refusal::Fault(9),
/// };
/// // A program decides by the kind, a person reads the text.
/// assert_eq!(error.kind(), ErrorKind::Refused);
/// assert!(error.to_string().starts_with("slave 1: "), "{error}");
/// ```
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The line brought no valid answer.
    #[error("slave {slave}, {exchange}: {problem}")]
    Port {
        /// The slave that was asked.
        slave: SlaveAddress,
        /// What was asked.
        exchange: Exchange,
        /// What happened.
        problem: PortError,
    },
    /// The drive refused the request.
    #[error("slave {slave}, {exchange}: {} {code:02X}h, {meaning}", name_of(*code))]
    Exception {
        /// The slave that refused.
        slave: SlaveAddress,
        /// What was asked.
        exchange: Exchange,
        /// The exception code; [`NEGATIVE_REPLY`] for one of UNI-TE.
        code: u8,
        /// What it means on this family.
        meaning: ExceptionMeaning,
    },
    /// The drive answered intact and outside what its manual allows.
    #[error("slave {slave}, {exchange}: {reason}")]
    Answer {
        /// The slave that answered.
        slave: SlaveAddress,
        /// What was asked.
        exchange: Exchange,
        /// What is wrong with the answer.
        reason: &'static str,
    },
    /// This family, or this drive as it is set up, cannot do it.
    #[error("{what} is not supported: {reason}")]
    Unsupported {
        /// What was asked.
        what: &'static str,
        /// Why it cannot be.
        reason: &'static str,
    },
    /// The drive was made for one slave and its port leads to another. Nothing was sent.
    #[error("slave {slave}: its port leads to slave {made_for}")]
    OtherSlave {
        /// The slave that the drive was made for.
        slave: SlaveAddress,
        /// The slave that its port was made for.
        made_for: SlaveAddress,
    },
    /// More words than one request of this family may carry. Nothing was sent.
    #[error("slave {slave}: {words} words in one request, the family takes {limit}")]
    TooManyWords {
        /// The slave.
        slave: SlaveAddress,
        /// Words asked for.
        words: usize,
        /// Words the family takes.
        limit: u16,
    },
    /// The register does not take this value. Nothing was sent.
    #[error("slave {slave}, {code} ({register}): the value {value} is not allowed")]
    ValueNotAllowed {
        /// The slave.
        slave: SlaveAddress,
        /// The register's address.
        register: u16,
        /// The register's mnemonic.
        code: &'static str,
        /// The refused value, in counts.
        value: i32,
    },
    /// The register's access forbids it. Nothing was sent.
    #[error("slave {slave}, {code} ({register}): the register is {access}")]
    AccessForbidden {
        /// The slave.
        slave: SlaveAddress,
        /// The register's address.
        register: u16,
        /// The register's mnemonic.
        code: &'static str,
        /// Its access.
        access: Access,
    },
    /// The setpoint cannot be given to this drive. Nothing was sent.
    #[error("slave {slave}: setpoint {setpoint}: {problem}")]
    Setpoint {
        /// The slave.
        slave: SlaveAddress,
        /// The refused setpoint.
        setpoint: Setpoint,
        /// Why.
        problem: SetpointProblem,
    },
    /// A duration that the drive's watchdog cannot be set to. Nothing was sent.
    #[error(
        "slave {slave}: a watchdog time of {timeout:?}: the drive takes {min:?} to {max:?} in steps of {step:?}"
    )]
    WatchdogTime {
        /// The slave.
        slave: SlaveAddress,
        /// The refused time.
        timeout: Duration,
        /// The shortest.
        min: Duration,
        /// The longest.
        max: Duration,
        /// The step.
        step: Duration,
    },
    /// The command was refused before the motion was asked for.
    #[error("slave {slave}: {command} refused: {reason}")]
    Refused {
        /// The slave.
        slave: SlaveAddress,
        /// What was asked.
        command: Command,
        /// Why not.
        reason: Refusal,
    },
    /// The command was sent and the drive's own words do not show it. What was written stands in the drive and may take
    /// effect later: a start that is not confirmed is taken back by a stop, and by nothing else.
    #[error("slave {slave}: {command} not confirmed: {}{}", shown(command, status), because.map_or_else(String::new, |because| format!("; {because}")))]
    NotConfirmed {
        /// The slave.
        slave: SlaveAddress,
        /// What was asked.
        command: Command,
        /// The last status that was read.
        status: Box<Status>,
        /// What keeps the command from being in force, where the drive tells it.
        because: Option<Refusal>,
    },
    /// Its driver panicked in the call, and said this: a fault of the program and not of the drive. What the call was to write
    /// may have been written.
    #[error("its driver panicked: {0}")]
    DriverPanicked(String),
}

/// What the drive showed instead: of a parameter the word that was read back, else its status.
fn shown(command: &Command, status: &Status) -> String {
    match (command, &*status.raw) {
        (Command::WriteParameter(_), [read]) => {
            format!("{} reads back as {} ({:04X}h)", read.code, read.value, read.value)
        }
        _ => format!("the drive says {status}"),
    }
}

/// The kind of an [`Error`], for a program that decides by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum ErrorKind {
    /// No valid answer: the drive may be mute, the line disturbed.
    NoAnswer,
    /// It is not known whether the drive carried it out, or will.
    OutcomeUnknown,
    /// Nothing was sent: expired, superseded, off-line, queue full, line down.
    NotSent,
    /// The drive answered that it will not, and has not.
    Exception,
    /// The drive's answer breaks its manual.
    Answer,
    /// Refused here, by what is known of the drive.
    Refused,
    /// Sent and not seen in the drive's words; it may take effect later.
    NotConfirmed,
    /// The family cannot do it.
    Unsupported,
}

impl Error {
    /// A setpoint in percent, of a family that does not count so.
    #[must_use]
    pub const fn no_share() -> Self {
        Self::Unsupported { what: "a setpoint in percent", reason: "the drive takes a frequency" }
    }

    /// The same failure, of an exchange that was to show what an earlier write has done. Whether it was not sent, not
    /// answered or refused says nothing of that write: its outcome is unknown.
    #[must_use]
    pub fn after_write(self) -> Self {
        match self {
            Self::Port { slave, exchange, .. }
            | Self::Exception { slave, exchange, .. }
            | Self::Answer { slave, exchange, .. } => {
                let problem = PortError::OutcomeUnknown("what it has done could not be read");
                Self::Port { slave, exchange, problem }
            }
            error => error,
        }
    }

    /// Its kind.
    #[must_use]
    pub const fn kind(&self) -> ErrorKind {
        match self {
            Self::Port { problem: PortError::OutcomeUnknown(_), .. } | Self::DriverPanicked(_) => {
                ErrorKind::OutcomeUnknown
            }
            Self::Port { problem, .. } if problem.nothing_sent() => ErrorKind::NotSent,
            Self::Port { .. } => ErrorKind::NoAnswer,
            Self::Exception { meaning, exchange, .. } if exchange.is_write() && !meaning.denies() => {
                ErrorKind::OutcomeUnknown
            }
            Self::Exception { .. } => ErrorKind::Exception,
            Self::Answer { .. } => ErrorKind::Answer,
            Self::Unsupported { .. } => ErrorKind::Unsupported,
            Self::OtherSlave { .. }
            | Self::TooManyWords { .. }
            | Self::ValueNotAllowed { .. }
            | Self::AccessForbidden { .. }
            | Self::Setpoint { .. }
            | Self::WatchdogTime { .. }
            | Self::Refused { .. } => ErrorKind::Refused,
            Self::NotConfirmed { .. } => ErrorKind::NotConfirmed,
        }
    }

    /// Whether nothing was written before it that could move the motor or take its command: it was refused here, was not sent, or is of a
    /// reading that was to come before that. The steps of a chart that lead up to a run command count as nothing. An exchange that fails
    /// behind what does count says so by [`after_write`](Self::after_write).
    #[must_use]
    pub const fn has_written_nothing(&self) -> bool {
        match self.kind() {
            ErrorKind::Refused | ErrorKind::Unsupported | ErrorKind::NotSent => true,
            ErrorKind::OutcomeUnknown | ErrorKind::NotConfirmed => false,
            ErrorKind::NoAnswer | ErrorKind::Exception | ErrorKind::Answer => match self {
                Self::Port { exchange, .. }
                | Self::Exception { exchange, .. }
                | Self::Answer { exchange, .. } => !exchange.is_write(),
                _ => false,
            },
        }
    }

    /// Whether it says of a setpoint that nothing speaks against it, and that only a start shows it: a start may follow.
    #[must_use]
    pub const fn only_a_start_shows(&self) -> bool {
        matches!(self, Self::NotConfirmed { because: Some(Refusal::OnlyAStartShows(_)), .. })
    }

    /// Whether a family, or a drive, has nothing to say of what it is: an answer, and none of the identity.
    #[must_use]
    pub fn is_speechless(&self) -> bool {
        self.kind() == ErrorKind::Unsupported
            || matches!(self, Self::Exception { meaning: ExceptionMeaning::NoSuchFunction, .. })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exchange_that_fails_after_a_write_never_says_that_nothing_was_sent() {
        let slave = SlaveAddress::try_from(7).unwrap();
        let exchange = Exchange { function: 3, register: Some(3201) };
        let (code, meaning) = (4, ExceptionMeaning::Failed);
        for error in [
            Error::Port { slave, exchange, problem: PortError::Expired },
            Error::Port { slave, exchange, problem: PortError::Damaged("CRC") },
            Error::Exception { slave, exchange, code, meaning },
            Error::Answer { slave, exchange, reason: "the answer is of another function" },
        ] {
            assert_eq!(error.after_write().kind(), ErrorKind::OutcomeUnknown);
        }
    }

    /// Modbus Application Protocol V1.1b3, section 7: 04 "while the server was attempting to perform", 0B "no response was
    /// obtained from the target device".
    #[test]
    fn an_exception_that_does_not_deny_leaves_the_outcome_of_a_write_open() {
        let slave = SlaveAddress::try_from(7).unwrap();
        let kind = |function, code| {
            let exchange = Exchange { function, register: Some(8501) };
            Error::Exception { slave, exchange, code, meaning: ExceptionMeaning::standard(code) }.kind()
        };
        for code in 0x01..=0x0B {
            let open = matches!(code, 0x04 | 0x05 | 0x07..=0x0B);
            let of_a_write = if open { ErrorKind::OutcomeUnknown } else { ErrorKind::Exception };
            assert_eq!((kind(6, code), kind(16, code)), (of_a_write, of_a_write), "{code:02X}h");
            assert_eq!(kind(3, code), ErrorKind::Exception, "{code:02X}h");
        }
    }

    #[test]
    fn an_error_names_slave_register_and_reason() {
        let slave = SlaveAddress::try_from(7).unwrap();
        let error = Error::Exception {
            slave,
            exchange: Exchange { function: 6, register: Some(8501) },
            code: 4,
            meaning: ExceptionMeaning::Failed,
        };
        assert_eq!(
            error.to_string(),
            "slave 7, writing register 8501 (2135h): exception 04h, the drive could not complete it"
        );
    }
}
