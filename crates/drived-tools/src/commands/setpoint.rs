//! `drived setpoint`: gives one drive a setpoint.

use drive_core::Setpoint;
use drive_fleet::{Order, Until};
use serde_json::json;

use crate::one_drive::OneDriveArgs;
use drived_client::Told;
use drived_plant::plant::commands::ActionWord;
use drived_words::{failure::Failure, meant::with_point};

/// Give a drive, or all of a group, a setpoint; a motor that runs follows its ramp to it
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The drive or the group of the running daemon, which --line and --drive stand for otherwise; and a frequency such as
    /// 47.5Hz, or a speed such as 1450rpm or a share such as 50% for the families that take one
    #[arg(value_name = "NAME|SETPOINT", allow_hyphen_values = true)]
    first: String,
    /// The setpoint, behind a name
    #[arg(value_name = "SETPOINT", conflicts_with = "line")]
    second: Option<String>,
    #[command(flatten)]
    one: OneDriveArgs,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let (name, wanted) = match &args.second {
        Some(wanted) => (Some(args.first.as_str()), wanted),
        None => (None, &args.first),
    };
    let setpoint = read(wanted)?;
    if !args.one.is_on_line() {
        let body = json!({ "setpoint": setpoint });
        let told =
            Told { action: ActionWord::Setpoint, body, done: format!("holds the setpoint {setpoint}") };
        return args.one.tell(name, &told).await;
    }
    let name = args.one.name()?;
    if matches!(setpoint, Setpoint::Speed(_)) && !name.family.capabilities().speed_setpoint {
        let family = name.family.capabilities().name;
        return Err(Failure::Input(format!(
            "{name}: {family} takes no speed in rpm: give a frequency, such as 47.5Hz"
        )));
    }
    let order = Order::Setpoint { setpoint, until: Until::InForce };
    args.one.order(order, &format!("holds the setpoint {setpoint}")).await
}

/// The setpoint that a text says. A decimal comma is understood; a number without its unit, or with a sign, is answered.
fn read(text: &str) -> Result<Setpoint, Failure> {
    let why = match text.parse::<Setpoint>() {
        Ok(setpoint) => return Ok(setpoint),
        Err(why) => why,
    };
    if let Some(setpoint) = with_point(text).and_then(|text| text.parse().ok()) {
        return Ok(setpoint);
    }
    let number = |text: &str| with_point(text).unwrap_or_else(|| text.to_owned()).parse::<f64>().is_ok();
    Err(Failure::Input(match text.trim().strip_prefix('-') {
        Some(rest) if read(rest).is_ok() => {
            format!(
                "{text:?}: a setpoint has no sign, the direction is that of the start (drived start --direction reverse): type {rest}"
            )
        }
        _ if number(text.trim()) => {
            format!("{text:?} of what? {text}Hz, or {text}rpm or {text}% where the drive takes it")
        }
        _ => format!("{text:?}: {why}"),
    }))
}

#[cfg(test)]
mod tests {
    use drive_core::Frequency;

    use super::*;

    #[test]
    fn a_setpoint_is_understood_where_nothing_else_can_be_meant_and_never_guessed() {
        let frequency = |centihertz| Ok(Setpoint::from(Frequency::from_centihertz(centihertz)));
        for (text, centihertz) in [("30hz", 3_000), ("30 Hz", 3_000), ("30,5Hz", 3_050), ("47,55 hz", 4_755)]
        {
            assert_eq!(read(text), frequency(centihertz), "{text}");
        }
        for (text, reason) in [
            ("30", "\"30\" of what? 30Hz, or 30rpm"),
            ("30,5", "\"30,5\" of what? "),
            (
                "-30Hz",
                "no sign, the direction is that of the start (drived start --direction reverse): type 30Hz",
            ),
            ("1,500rpm", "expected a frequency"),
            ("fast", "expected a frequency"),
        ] {
            let Err(Failure::Input(why)) = read(text) else { panic!("{text} was taken") };
            assert!(why.contains(reason), "{why}");
        }
    }
}
