//! What is wrong with a line by its evidence, in words, each with the next step.

use std::{fmt, time::Duration};

use drive_core::NEGATIVE_REPLY;

/// What is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Defect {
    /// Answers come sooner than the configured speed can carry them, so that none is taken.
    FarEndFaster,
    /// Answers lack their first byte.
    FirstByteCut,
    /// Answers lack their last byte.
    LastByteCut,
    /// Bytes follow each answer that belong to nothing.
    BytesBehind,
    /// Each answer comes with the next question.
    OneAnswerBehind,
    /// It refuses everything, with this exception.
    RefusesAll(u8),
    /// Two slaves answer for one.
    TwoAtOneAddress,
    /// Each answer comes twice.
    AnswersTwice,
    /// Another master asks, so often.
    SecondMaster(Option<Duration>),
    /// Answers bear the transaction number 0.
    NumberZero,
    /// Whoever answered does not any more, for so long.
    FellSilent(Duration),
    /// UNI-TELWAY: slaves acknowledge later than is waited for.
    LinkTimeout,
}

/// How sure that is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Certainty {
    /// It is proved.
    Certain,
    /// It is likely.
    Likely,
    /// A master cannot tell it from this.
    CannotBeToldFrom(Alike),
}

/// What sounds like a defect and is none, or another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Alike {
    /// A speed that is set too low.
    SpeedTooLow,
    /// Slaves that acknowledge everything and never reply.
    NeverReplies,
    /// Something between that gives old answers once more.
    OldAnswers,
    /// A cable that is damaged at that drive.
    DamagedCable,
    /// Two drives alike that have one address.
    Twins,
}

impl Alike {
    /// Its name, for programs.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::SpeedTooLow => "speed_too_low",
            Self::NeverReplies => "never_replies",
            Self::OldAnswers => "old_answers",
            Self::DamagedCable => "damaged_cable",
            Self::Twins => "twins",
        }
    }
}

impl fmt::Display for Alike {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::SpeedTooLow => "a speed that is set too low",
            Self::NeverReplies => "slaves that acknowledge everything and never reply",
            Self::OldAnswers => "something between that gives old answers once more",
            Self::DamagedCable => "a cable that is damaged at that drive",
            Self::Twins => "two drives alike that have one address",
        })
    }
}

/// One thing that is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Finding {
    /// What.
    pub defect: Defect,
    /// Whom it concerns; `None`: the line.
    pub slave: Option<u8>,
    /// How often it was seen, of how many.
    pub share: (u32, u32),
    /// How sure it is.
    pub certainty: Certainty,
}

impl Defect {
    /// Its name, for programs.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::FarEndFaster => "far_end_faster",
            Self::FirstByteCut => "first_byte_cut",
            Self::LastByteCut => "last_byte_cut",
            Self::BytesBehind => "bytes_behind",
            Self::OneAnswerBehind => "one_answer_behind",
            Self::RefusesAll(_) => "refuses_all",
            Self::TwoAtOneAddress => "two_at_one_address",
            Self::AnswersTwice => "answers_twice",
            Self::SecondMaster(_) => "second_master",
            Self::NumberZero => "number_zero",
            Self::FellSilent(_) => "fell_silent",
            Self::LinkTimeout => "link_timeout",
        }
    }
}

impl Finding {
    /// Whether it says that two drives may answer for one. Where another master was heard their answers to him are no second
    /// answers to us: then nothing says so.
    #[must_use]
    pub const fn is_of_two(&self) -> bool {
        matches!(self.defect, Defect::TwoAtOneAddress | Defect::AnswersTwice)
    }

    /// What to do next, the likeliest first.
    #[must_use]
    pub const fn next(&self) -> &'static [&'static str] {
        match self.defect {
            Defect::FarEndFaster => &[
                "an adapter without a UART, or a program, is faster than a line: say far-end-paces=no behind the port, or \
                 far_end_paces = false in the file",
                "else the speed is set too low: see in the drives' menus which it is",
            ],
            Defect::FirstByteCut => &[
                "the adapter begins to hear too late: let it switch its direction by itself, or set rs485's delay after sending to 0",
                "give the slave a longer pause before its answer, where it has such a setting (n65 of a 3G3EV)",
                "see the line's bias: without it the first character is often lost",
            ],
            Defect::LastByteCut => &[
                "the far end switches its transmitter off too soon: an adapter or a converter at the slave, with a setting for that",
                "take another adapter and compare",
            ],
            Defect::BytesBehind => &[
                "an adapter that hears its own switching, or a line without bias: see that the line has its bias once and its \
                 termination at both ends",
                "take another adapter and compare",
            ],
            Defect::OneAnswerBehind => &[
                "something between keeps each answer until the next question: see the buffer or packing settings of the serial \
                 server (such as \"packing length\", \"force transmit\"), and start it anew",
                "a longer timeout does not help: the answer comes with the next question, whenever that is",
            ],
            Defect::RefusesAll(0x0A | 0x0B) => &[
                "it is the gateway that says so: see that the drive behind it is switched on, and that speed and format are right \
                 on the gateway's line",
            ],
            Defect::RefusesAll(0x05 | 0x06) => &[
                "see what keeps the drive busy: another master, its keypad, a parameter that is being saved",
                "switch the drive off and on, while nothing depends on it",
            ],
            Defect::RefusesAll(_) => &[
                "another family than was named, or another device, such as a meter, has this address: see what stands there",
                "drived scan says which families it could be",
            ],
            Defect::TwoAtOneAddress | Defect::AnswersTwice => &[
                "switch one drive after the other off: if this address still answers when the drive that should have it is off, \
                 another one has it too",
                "else something between repeats what it hears: a repeater, a radio, a ring of two lines",
            ],
            Defect::SecondMaster(_) => &[
                "find the other master (a PLC, a panel, a gateway, a second program) and end its asking: a Modbus line has one",
            ],
            Defect::NumberZero => &[
                "the far end does not give the transaction number back, as Modbus TCP wants: see whether it speaks RTU over TCP \
                 (rtu+tcp://), or take its makers' newest firmware",
            ],
            Defect::FellSilent(_) => &[
                "see that the drives have power, and the cable at the adapter: nobody's settings change by themselves",
                "unplug the adapter and plug it in again: if they answer then it hung",
            ],
            Defect::LinkTimeout => &[
                "slaves acknowledge later than the line waits: say link-timeout=200ms or more behind unitelway",
            ],
        }
    }
}

/// What was found, with its figures; whom it concerns is said by whoever knows his name.
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (part, of) = self.share;
        match self.defect {
            Defect::FarEndFaster => write!(
                f,
                "{part} answers came sooner than the configured speed can carry them, and none in its time: none was taken"
            ),
            Defect::FirstByteCut => {
                write!(
                    f,
                    "{part} of {of} answers lack their first byte, and nothing else: their checks prove it"
                )
            }
            Defect::LastByteCut => {
                write!(
                    f,
                    "{part} of {of} answers lack their last byte, and nothing else: their checks prove it"
                )
            }
            Defect::BytesBehind => write!(f, "bytes that belong to nothing follow {part} of {of} answers"),
            Defect::OneAnswerBehind => {
                write!(f, "{part} of {of} answers came with the next question: something holds each one back")
            }
            Defect::RefusesAll(code) => {
                let all = if part == of { format!("all {of}") } else { format!("{part} of {of}") };
                let meaning = meaning(code);
                write!(
                    f,
                    "{all} questions were answered by exception {code:02X}h ({meaning}), none by a value"
                )
            }
            Defect::TwoAtOneAddress => {
                write!(
                    f,
                    "{part} of {of} questions had two answers that differ, or one that two spoke at once"
                )
            }
            Defect::AnswersTwice => write!(f, "{part} of {of} answers came twice"),
            Defect::SecondMaster(every) => {
                write!(f, "somebody else asks on this line: {part} requests were heard")?;
                every.map_or(Ok(()), |every| write!(f, ", one every {:.1} s", every.as_secs_f64()))
            }
            Defect::NumberZero => {
                write!(
                    f,
                    "{part} answers bear the transaction number 0, whatever that of their question: none was taken"
                )
            }
            Defect::FellSilent(since) => write!(
                f,
                "it answered, and has not for {} s: the last {part} questions brought not one byte",
                since.as_secs()
            ),
            Defect::LinkTimeout => {
                write!(
                    f,
                    "an acknowledgement came to {part} of {of} questions when the line had given them up, and nothing else"
                )
            }
        }
    }
}

/// What an exception says (Modbus Application Protocol V1.1b3, section 7).
const fn meaning(code: u8) -> &'static str {
    match code {
        0x01 => "it has no such function",
        0x02 => "it has no such register",
        0x03 => "it takes no such value or number",
        0x04 => "it has failed",
        0x05 => "it will take long",
        0x06 => "it is busy",
        0x0A => "the gateway has no path to it",
        0x0B => "the gateway had no answer from it",
        NEGATIVE_REPLY => "a negative reply of UNI-TE, which says no reason",
        _ => "which the specification does not name",
    }
}
