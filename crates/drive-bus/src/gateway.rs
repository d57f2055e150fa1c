//! What is known of a gateway, and how it is written.

use std::{fmt, str::FromStr, time::Duration};

use crate::protocol::time;

/// What is known of a gateway: a box, or a program, between a network and the drives' own line. It goes on with a question
/// after its master has given up, and most serve one question at a time, so that a drive that does not answer holds up all
/// others, and a stop. The line finds out what is not set, and asks no more than one such question at a time.
///
/// ```
/// use drive_bus::{Gateway, LineConfig};
/// use std::time::Duration;
///
/// let gateway: Gateway = "3x1s".parse()?;
/// assert_eq!((gateway.at_once, gateway.wait), (Some(1), Some(Duration::from_secs(3))));
/// let config = LineConfig { gateway: Some(gateway), ..LineConfig::modbus_tcp("10.0.0.5:502") };
/// // What it may be waiting for is in front of a stop.
/// assert!(config.worst_case_stop(5, 18) > Duration::from_secs(3));
/// # Ok::<(), drive_bus::GatewayError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Gateway {
    /// How many requests it serves at once. `None`: the line finds out.
    pub at_once: Option<usize>,
    /// How long it waits for a drive that does not answer, all its attempts together: 3 s for three attempts of one second.
    /// `None`: [`ASSUMED_WAIT`](Self::ASSUMED_WAIT), until the line has seen it. Zero: there is no gateway, each drive has
    /// its own connection.
    pub wait: Option<Duration>,
}

impl Gateway {
    /// How long a gateway is taken to wait of which nothing is known: three attempts of a second, as many come.
    pub const ASSUMED_WAIT: Duration = Duration::from_secs(3);

    /// There is none: what answers is the drive itself.
    pub const NONE: Self = Self { at_once: None, wait: Some(Duration::ZERO) };

    /// What it adds to the wait of a stop: one question in vain, and one more where it is not known how many it serves at
    /// once.
    #[must_use]
    pub fn stop_waits(&self) -> Duration {
        self.wait.unwrap_or(Self::ASSUMED_WAIT) * if self.at_once.is_some() { 1 } else { 2 }
    }
}

/// How often a gateway asks, at the most; more is somebody's mistake.
const MOST_ATTEMPTS: u32 = 20;

/// A text that says nothing of a gateway.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0:?}: expected none, unknown, or how long the gateway waits for a drive that does not answer, such as 3x1s for three attempts \
     of a second, with /N behind it where it serves N requests at once"
)]
pub struct GatewayError(String);

/// It is written `none`, `unknown`, or `[ATTEMPTSx]WAIT[/AT_ONCE]`: `3s` for one that serves one request at a time, as most do, `3s/4`
/// for four at once, `3s/unknown` where the line is to find out.
impl fmt::Display for Gateway {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.wait, self.at_once) {
            (Some(Duration::ZERO), _) => f.write_str("none"),
            (None, None) => f.write_str("unknown"),
            (wait, at_once) => {
                f.write_str(&wait.map_or_else(|| "unknown".to_owned(), time::said))?;
                match at_once {
                    Some(1) => Ok(()),
                    Some(at_once) => write!(f, "/{at_once}"),
                    None => f.write_str("/unknown"),
                }
            }
        }
    }
}

#[cfg(feature = "serde")]
drive_core::written_as_text!(Gateway);

impl FromStr for Gateway {
    type Err = GatewayError;

    fn from_str(text: &str) -> Result<Self, GatewayError> {
        read(text.trim()).ok_or_else(|| GatewayError(text.to_owned()))
    }
}

fn read(text: &str) -> Option<Gateway> {
    match text {
        "none" => return Some(Gateway::NONE),
        "unknown" => return Some(Gateway::default()),
        _ => {}
    }
    let (wait, at_once) = text.split_once('/').map_or((text, None), |(wait, at_once)| (wait, Some(at_once)));
    let at_once = match at_once {
        None => Some(1),
        Some("unknown") => None,
        Some(number) => Some(number.parse().ok().filter(|number| *number > 0)?),
    };
    let wait = match wait {
        "unknown" => None,
        wait => {
            let (attempts, each) =
                wait.split_once('x').map_or(("1", wait), |(attempts, each)| (attempts, each));
            let attempts =
                attempts.trim().parse().ok().filter(|attempts| (1..=MOST_ATTEMPTS).contains(attempts))?;
            Some(time::read(each.trim()).filter(|each| !each.is_zero())? * attempts)
        }
    };
    Some(Gateway { at_once, wait })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gateway_reads_back_as_it_is_written() {
        for (text, at_once, wait) in [
            ("none", None, Some(0)),
            ("unknown", None, None),
            ("3s", Some(1), Some(3_000)),
            ("500ms/4", Some(4), Some(500)),
            ("3s/unknown", None, Some(3_000)),
            ("unknown/2", Some(2), None),
        ] {
            let gateway: Gateway = text.parse().unwrap();
            assert_eq!((gateway.at_once, gateway.wait), (at_once, wait.map(Duration::from_millis)), "{text}");
            assert_eq!(gateway.to_string(), text);
        }
        assert_eq!("3x1s".parse::<Gateway>().unwrap().to_string(), "3s");
        assert_eq!("3 x 500ms/2".parse::<Gateway>().unwrap().to_string(), "1500ms/2");
    }

    #[test]
    fn what_says_nothing_of_a_gateway_is_refused_with_what_was_expected() {
        for text in ["", "yes", "3", "0s", "0x1s", "21x1s", "3x", "1s/0", "1s/many", "100s", "x1s"] {
            let error = text.parse::<Gateway>().unwrap_err().to_string();
            assert!(error.contains("expected none, unknown, or how long"), "{text}: {error}");
        }
    }
}
