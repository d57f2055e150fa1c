//! What was on a line lately.

use drive_bus::record::{Ending, Exchange};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{LineView, MeasuredLineView, PlannedLineView};
use drived_words::json::{microseconds, unix};

/// A line with what it was planned to be, what was measured on it, and its last exchanges.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LineDetailView {
    #[serde(flatten)]
    pub line: LineView,
    pub planned: PlannedLineView,
    pub measured: MeasuredLineView,
    /// The last exchanges, the newest last.
    pub last: Vec<ExchangeView>,
}

/// A request and what was heard of its answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ExchangeView {
    /// When the request was sent.
    pub time_unix_ms: u64,
    /// Whom it was for; 0 is a broadcast.
    pub slave: u8,
    /// What was sent, in hexadecimal, its check included.
    pub request: String,
    /// What was heard until the end, its check included; empty where nothing was.
    pub answer: String,
    /// `ok`, or why there is no answer.
    pub result: ResultWord,
    /// From the beginning of the request to the end.
    pub took_ms: f64,
}

/// How an exchange ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ResultWord {
    Ok,
    /// The slave refused it.
    Exception,
    NoAnswer,
    /// The answer failed its check.
    Damaged,
    /// The answer does not fit the request.
    Mismatched,
    /// The answer may be that to an earlier request.
    Doubted,
    /// The slave was busy for as long as it was repeated.
    Busy,
    /// Nobody answers it.
    Broadcast,
    /// It goes on later: the slave is not ready.
    PutAside,
    /// It made way for a stop.
    GivenUp,
    /// The port was lost meanwhile.
    LineLost,
    /// Otherwise.
    Other,
}

impl ExchangeView {
    pub fn of(exchange: &Exchange) -> Self {
        Self {
            time_unix_ms: unix(exchange.began),
            slave: exchange.slave,
            request: hexadecimal(&exchange.request),
            answer: hexadecimal(&exchange.answer),
            result: ResultWord::of(exchange.ending),
            took_ms: microseconds(exchange.took) as f64 / 1_000.0,
        }
    }
}

drive_core::named! { ResultWord {
    Ok => "ok",
    Exception => "exception",
    NoAnswer => "no answer",
    Damaged => "damaged",
    Mismatched => "mismatched",
    Doubted => "doubted",
    Busy => "busy",
    Broadcast => "broadcast",
    PutAside => "put aside",
    GivenUp => "given up",
    LineLost => "line lost",
    Other => "other",
} }

impl ResultWord {
    const fn of(ending: Ending) -> Self {
        match ending {
            Ending::Answered => Self::Ok,
            Ending::Exception => Self::Exception,
            Ending::NoAnswer => Self::NoAnswer,
            Ending::Damaged => Self::Damaged,
            Ending::Mismatch => Self::Mismatched,
            Ending::Doubted => Self::Doubted,
            Ending::Busy => Self::Busy,
            Ending::Unanswered => Self::Broadcast,
            Ending::PutAside => Self::PutAside,
            Ending::GivenUp => Self::GivenUp,
            Ending::LineLost => Self::LineLost,
            _ => Self::Other,
        }
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    let bytes: Vec<String> = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
    bytes.join(" ")
}
