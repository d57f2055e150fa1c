//! `drived setpoint`: gives one drive a setpoint.

use std::str::FromStr;

use drive_core::{Frequency, Setpoint, Speed};
use drive_fleet::{Order, Until};

use crate::{failure::Failure, one_drive::OneDriveArgs};

/// Give one drive a setpoint; a motor that runs follows its ramp to it
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    one: OneDriveArgs,
    /// A frequency such as 47.5Hz, or a speed such as 1450rpm for the families that take one
    #[arg(value_name = "SETPOINT")]
    setpoint: Wanted,
}

/// A setpoint as a person writes it: hertz unless it says rpm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Wanted(Setpoint);

impl FromStr for Wanted {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let text = text.trim().to_ascii_lowercase();
        if let Some(speed) = text.strip_suffix("rpm") {
            let speed = speed.trim_end().parse().map_err(|_| EXPECTED)?;
            return Ok(Self(Speed::from_rpm(speed).into()));
        }
        let number = text.strip_suffix("hz").unwrap_or(&text).trim_end();
        Ok(Self(Frequency::from_centihertz(hundredths(number).ok_or(EXPECTED)?).into()))
    }
}

const EXPECTED: &str =
    "expected a frequency with at most two decimals such as 47.5Hz, or a speed such as 1450rpm";

/// A decimal number in hundredths, exactly.
fn hundredths(text: &str) -> Option<u32> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || fraction.len() > 2 || !digits(whole) || !digits(fraction) {
        return None;
    }
    format!("{whole}{fraction:0<2}").parse().ok()
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let Wanted(setpoint) = args.setpoint;
    let name = args.one.name()?;
    if matches!(setpoint, Setpoint::Speed(_)) && !name.family.capabilities().speed_setpoint {
        let family = name.family.capabilities().name;
        return Err(Failure::Input(format!(
            "{name}: a {family} takes no speed in rpm: give a frequency, such as 47.5Hz"
        )));
    }
    let order = Order::Setpoint { setpoint, until: Until::InForce };
    args.one.order(order, &format!("holds the setpoint {setpoint}")).await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setpoint_is_a_frequency_unless_it_says_rpm() {
        for (text, setpoint) in [
            ("47.5", Frequency::from_centihertz(4_750).into()),
            ("47.5Hz", Frequency::from_centihertz(4_750).into()),
            ("0.01 hz", Frequency::from_centihertz(1).into()),
            ("1450rpm", Speed::from_rpm(1_450).into()),
        ] {
            assert_eq!(text.parse(), Ok(Wanted(setpoint)), "{text}");
        }
        for text in ["", "fast", "-5", "1.234", "1,5", "99999999999", "rpm", "14.5rpm"] {
            assert_eq!(text.parse::<Wanted>(), Err(EXPECTED), "{text}");
        }
    }
}
