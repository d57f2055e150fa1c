//! Who moves the motor: [`Lease`], the record that a run command of this side stands, and [`Verdict`], what a status says
//! of it.

#[cfg(feature = "serde")]
pub(crate) mod object;

use std::fmt;

use crate::{refusal::Refusal, setpoint::Direction};

#[cfg(feature = "schemars")]
pub(crate) use object::VerdictObject;

/// What a drive's own words say of the run command that this side has given. The family alone decides it; whoever sits
/// above carries it on and judges nothing by the [`State`](crate::State).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Verdict {
    /// It acts: the bus is the active source of commands and of the reference, the run command stands, the output is not
    /// blocked, and the motor is driven that way or comes down to turn that way.
    InForce,
    /// It may stand in the drive and does not act. **When what keeps it from acting goes away it may start the motor.**
    NotInForce {
        /// What it lacks.
        lacks: Lack,
        /// What decides instead, and what to do about it.
        because: Refusal,
    },
    /// These words do not tell.
    NotKnown,
}

impl Verdict {
    /// That something else decides.
    #[must_use]
    pub const fn lacks(lacks: Lack, because: Refusal) -> Self {
        Self::NotInForce { lacks, because }
    }

    /// Whether it acts, as far as the words tell.
    #[must_use]
    pub const fn is_in_force(&self) -> bool {
        matches!(self, Self::InForce)
    }

    /// Why it does not act, where the words tell that it does not.
    #[must_use]
    pub const fn because(&self) -> Option<Refusal> {
        match self {
            Self::NotInForce { because, .. } => Some(*because),
            Self::InForce | Self::NotKnown => None,
        }
    }

    /// Its word for programs.
    #[must_use]
    pub const fn word(&self) -> &'static str {
        match self {
            Self::InForce => "in_force",
            Self::NotInForce { .. } => "not_in_force",
            Self::NotKnown => "not_known",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InForce => f.write_str("in force"),
            Self::NotInForce { because, .. } => write!(f, "not in force: {because}"),
            Self::NotKnown => f.write_str("not known whether it is in force"),
        }
    }
}

/// What a run command lacks that is not in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Lack {
    /// Somebody else is the active source of commands, or another word stands where this side's was.
    Command,
    /// The motor follows another reference than that of the bus.
    Reference,
    /// The output is cut, braked or held: a stop input, a freewheel input, a stop key, no mains, a trip.
    Output,
}

crate::named! { Lack {
    Command => "command",
    Reference => "reference",
    Output => "output",
} }

/// The record that a run command of this side stands in the drive: **the motor may turn, now or later, because of us**.
///
/// The family makes it before the run command is sent, since an answer may be lost. It survives
/// [`forget`](crate::Drive::forget), a lost line, a reconnect and standstill, and ends only when the drive's own words showed
/// that the run command stands no more: after a stop or a withdrawal that was seen, or because somebody else's word or a
/// power cycle took its place. Withdrawal, exit policy and what a restart of the program adopts come from it and from
/// nothing else.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Lease {
    /// Which way it turns the motor.
    pub direction: Direction,
    /// The run command as it was written, by which the drive's own register tells it from somebody else's.
    pub word: u16,
}

impl Lease {
    /// A run command that is, or is about to be, on its way.
    #[must_use]
    pub const fn new(direction: Direction, word: u16) -> Self {
        Self { direction, word }
    }
}

/// What a contract with a drive rests on, beside who commands it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Ground {
    /// How its communication watchdog is set.
    Watchdog,
    /// What its frequencies count.
    Units,
    /// How fast it may turn.
    Limits,
    /// What its inputs do, and which channels command it.
    Inputs,
}

crate::named! { Ground {
    Watchdog => "watchdog",
    Units => "units",
    Limits => "limits",
    Inputs => "inputs",
} }

/// How a family tells its own drives from others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Recognised {
    /// The drive says what only this family says.
    Mine,
    /// The drive says what this family never says: it is read, stopped when that is asked for, and nothing else is written.
    NotMine {
        /// What it says it is, and which family fits, if one is known to.
        it_is: &'static str,
    },
    /// Nothing in this family's drives tells.
    CannotTell,
}

/// How the references of the Altivars begin, and what each is. The longer of two comes first.
const REFERENCES: &[(&str, &str)] = &[
    ("ATV212", "an Altivar 212, which no family here fits"),
    ("ATV21", "an Altivar 21: the family atv21 fits"),
    ("ATV28", "an Altivar 28: the family atv28 fits"),
    ("ATV312", "an Altivar 312: the family atv312 fits"),
    ("ATV31", "an Altivar 31, which no family here fits"),
    ("ATV32", "an Altivar 32, which no family here fits"),
    ("ATV58", "an Altivar 58: the family atv58 fits"),
    ("ATV61", "an Altivar 61, which no family here fits"),
    ("ATV71", "an Altivar 71, which no family here fits"),
    ("ATV12", "an Altivar 12, which no family here fits"),
    ("ATV", "another Altivar, which no family here fits"),
];

impl Recognised {
    /// What a Schneider reference says, such as function 43/14 tells, to the family whose own references begin with `own`;
    /// `None`: it is none of an Altivar.
    ///
    /// ```
    /// use drive_core::Recognised;
    ///
    /// assert_eq!(Recognised::by_reference("ATV312HU15N4", "ATV312"), Some(Recognised::Mine));
    /// let told = Recognised::by_reference("ATV312HU15N4", "ATV21");
    /// assert!(matches!(told, Some(Recognised::NotMine { it_is }) if it_is.contains("the family atv312 fits")));
    /// assert_eq!(Recognised::by_reference("3G3EV", "ATV21"), None);
    /// // As the manual of the Altivar 58's card prints it (VVDED397054, Identification).
    /// assert_eq!(Recognised::by_reference("ATV-58U18N4", "ATV58"), Some(Recognised::Mine));
    /// ```
    #[must_use]
    pub fn by_reference(reference: &str, own: &str) -> Option<Self> {
        let begins = |prefix: &str| {
            let mut told = reference.chars().filter(char::is_ascii_alphanumeric);
            prefix.chars().all(|wanted| told.next().is_some_and(|told| told.eq_ignore_ascii_case(&wanted)))
        };
        let &(prefix, it_is) = REFERENCES.iter().find(|(prefix, _)| begins(prefix))?;
        Some(if prefix == own { Self::Mine } else { Self::NotMine { it_is } })
    }
}
