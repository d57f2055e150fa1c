//! What a manual can answer: rules with their source, silences, orders to the motor, and the verdict on a motion.

use super::Family;

/// How sure a rule is, by the marks of the register-level facts; what stands there only by analogy is no rule here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mark {
    /// Printed in the drive's own manual.
    A,
    /// Not printed there, confirmed by another public source or by the manual of a sister product.
    B,
}

/// One sentence of a manual that decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rule {
    /// Whose manual.
    pub family: Family,
    /// A short name.
    pub name: &'static str,
    /// How sure.
    pub mark: Mark,
    /// Manual, section and page.
    pub source: &'static str,
    /// What it says.
    pub says: &'static str,
}

/// A question that the manual does not answer, or answers twice and differently.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Silence {
    /// Whose manual.
    pub family: Family,
    /// A short name.
    pub name: &'static str,
    /// Where one would look for the answer.
    pub source: &'static str,
    /// What it does not say.
    pub question: &'static str,
    /// What the driver of this house does there, where it is written down.
    pub driver: Option<&'static str>,
}

/// An answer with its source, or the question that stays open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer<T> {
    /// The manual says so.
    Says(T, &'static Rule),
    /// The manual does not say, or contradicts itself.
    Silent(&'static Silence),
}

impl<T> Answer<T> {
    /// What is said, if anything is.
    pub fn said(self) -> Option<T> {
        match self {
            Self::Says(what, _) => Some(what),
            Self::Silent(_) => None,
        }
    }

    /// Where it is printed, or where it should be.
    pub fn source(&self) -> &'static str {
        match self {
            Self::Says(_, rule) => rule.source,
            Self::Silent(silence) => silence.source,
        }
    }

    /// Whether the manual leaves it open.
    pub fn is_silent(&self) -> bool {
        matches!(self, Self::Silent(_))
    }

    /// The same answer about something that follows from it.
    pub fn map<U>(self, follows: impl FnOnce(T) -> U) -> Answer<U> {
        match self {
            Self::Says(what, rule) => Answer::Says(follows(what), rule),
            Self::Silent(silence) => Answer::Silent(silence),
        }
    }
}

/// Who commands run and stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Who {
    /// The Modbus line.
    Bus,
    /// Another bus: CANopen or a communication card.
    OtherBus,
    /// The terminals.
    Terminals,
    /// The keys of the drive.
    Keypad,
    /// The remote display terminal.
    RemoteTerminal,
}

/// Where the reference comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// The Modbus line.
    Bus,
    /// Another bus.
    OtherBus,
    /// An analog input, counted from 1; the drive's own dial is 16, as `AIV1` is.
    Analog(u8),
    /// A preset speed.
    Preset,
    /// The jog frequency.
    Jog,
    /// The keypad.
    Keypad,
    /// The remote display terminal.
    RemoteTerminal,
    /// Faster and slower.
    UpDown,
}

/// The reference that counts. Frequencies are hundredths of a hertz.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reference {
    /// Where it comes from.
    pub origin: Origin,
    /// What it asks for, with its sign, before the limits; `None` if the manual gives no way to know.
    pub asks: Option<i32>,
    /// Whether it is negative; `None` if the manual gives no way to know.
    pub negative: Option<bool>,
    /// What the output tends to after the limits, without sign.
    pub tends: Option<u32>,
}

/// How a motor is brought to rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// On the ramp in force.
    Ramp,
    /// On a short ramp.
    Fast,
    /// Without voltage.
    Freewheel,
    /// By direct current, for so many tenths of a second, or as long as what asks for it stands.
    Injection {
        /// Tenths of a second.
        tenths: Option<u16>,
    },
    /// It stops; how is not said.
    Unsaid,
}

/// What the drive has to do with the motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Drive it.
    Drive {
        /// Whose run command stands.
        by: Who,
        /// In reverse.
        reverse: bool,
        /// Towards this frequency in hundredths of a hertz, if the manual lets it be known.
        tends: Option<u32>,
    },
    /// Bring it to rest.
    Stop(Stop),
    /// No voltage: whatever is asked, until the lock is taken away.
    Locked,
    /// Tripped: it comes down like this and stays at rest.
    Tripped(Stop),
    /// Nobody asks for motion.
    Rest,
}

/// What the motor is seen doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Not turning.
    AtRest,
    /// Driven, at this frequency or on its way to it.
    Turning {
        /// In reverse.
        reverse: bool,
        /// Hundredths of a hertz, if it is known where it tends.
        tends: Option<u32>,
    },
    /// Losing speed, by whatever means.
    ComingDown,
}

/// What the manual has to say about a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// This is where the manual leads.
    Must,
    /// On the way there: a ramp, a coast, a reversal.
    May,
    /// Nothing in the manual explains it.
    MustNot,
    /// The manual leaves it open.
    Silent,
}

/// Whether a change starts the motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// It may, or must.
    MayStart,
    /// It does not: the motor stays at rest, or was driven already.
    MayNot,
    /// The manual leaves it open.
    ManualSilent,
}

/// What a write of the bus does to the motor and to who commands it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// It is driven from now on.
    Starts {
        /// In reverse.
        reverse: bool,
    },
    /// It stays driven, perhaps elsewhere.
    Continues,
    /// It stops.
    Stops(Stop),
    /// The drive trips.
    Trips,
    /// A trip is reset.
    Resets,
    /// The bus commands or gives the reference from now on.
    Takes,
    /// The bus gives command or reference away.
    Releases,
    /// Settings are stored.
    Saves,
    /// Settings go back to others, and with them what terminals mean and who commands.
    Restores,
    /// Nothing happens to the motor.
    Nothing,
}

/// A verdict and where it comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ruling {
    /// The verdict.
    pub verdict: Verdict,
    /// Manual, section and page of the rule, or of the silence.
    pub source: &'static str,
    /// What is said there, or not said.
    pub because: &'static str,
}

/// How far two frequencies may lie apart and be the same: the 0.1 Hz that every family counts in.
const SAME: u32 = 10;

/// The verdict on a motion under an order.
pub(super) fn judge(order: Order, motion: Motion) -> Verdict {
    match (order, motion) {
        (Order::Drive { tends: Some(0), .. }, Motion::AtRest) => Verdict::Must,
        (Order::Drive { .. }, Motion::AtRest | Motion::ComingDown) => Verdict::May,
        (Order::Drive { reverse, .. }, Motion::Turning { reverse: seen, .. }) if reverse != seen => {
            Verdict::MustNot
        }
        (Order::Drive { tends, .. }, Motion::Turning { tends: seen, .. }) => match (tends, seen) {
            (Some(tends), Some(seen)) if tends.abs_diff(seen) > SAME => Verdict::MustNot,
            (None, Some(_)) => Verdict::May,
            _ => Verdict::Must,
        },
        (_, Motion::Turning { .. }) => Verdict::MustNot,
        (_, Motion::AtRest) => Verdict::Must,
        (_, Motion::ComingDown) => Verdict::May,
    }
}

/// The effect of what turned one order into another.
pub(super) fn effect(before: Answer<Order>, after: Answer<Order>) -> Answer<Effect> {
    let was_driven = matches!(before, Answer::Says(Order::Drive { .. }, _));
    after.map(|order| match order {
        Order::Drive { .. } if was_driven => Effect::Continues,
        Order::Drive { reverse, .. } => Effect::Starts { reverse },
        Order::Stop(stop) | Order::Tripped(stop) if was_driven => Effect::Stops(stop),
        Order::Locked if was_driven => Effect::Stops(Stop::Freewheel),
        Order::Rest if was_driven => Effect::Stops(Stop::Unsaid),
        _ => Effect::Nothing,
    })
}

/// Rules of one family, one line of the manual each.
macro_rules! rules {
    ($family:ident $all:ident $($name:ident $mark:ident $source:literal $says:literal;)*) => {
        $(pub(super) static $name: Rule = Rule {
            family: Family::$family,
            name: stringify!($name),
            mark: Mark::$mark,
            source: $source,
            says: $says,
        };)*
        pub(super) static $all: &[&Rule] = &[$(&$name),*];
    };
}

/// Silences of one family.
macro_rules! silences {
    (@driver) => { None };
    (@driver $driver:literal) => { Some($driver) };
    ($family:ident $all:ident $($name:ident $source:literal $question:literal $(=> $driver:literal)?;)*) => {
        $(pub(super) static $name: Silence = Silence {
            family: Family::$family,
            name: stringify!($name),
            source: $source,
            question: $question,
            driver: silences!(@driver $($driver)?),
        };)*
        pub(super) static $all: &[&Silence] = &[$(&$name),*];
    };
}

pub(super) use {rules, silences};
