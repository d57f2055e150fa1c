//! `drived accept`: takes a drive that says it is another than before for the right one.

use drive_fleet::IdentityCheck;
use serde_json::json;

use drived_client::{self as client, DaemonArgs, Target, Told};
use drived_plant::plant::{commands::ActionWord, views::DriveView};
use drived_words::{failure::Failure, values};

/// Accept a drive that says it is another than before: until then nothing is given to it but stops
///
/// Without --as it says what the drive is now and what it was, and accepts nothing.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A drive of the running daemon
    #[arg(value_name = "NAME")]
    name: String,
    /// What it says that it is, as it was told: where it says something else by now it is not accepted
    #[arg(long = "as", value_name = "IDENTITY")]
    shown: Option<String>,
    #[command(flatten)]
    daemon: DaemonArgs,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let mut daemon = args.daemon.connect().await?;
    let state = daemon.state().await?;
    let target = Target::find(&state, &args.name)?;
    let Some(drive) = state.drives.iter().find(|drive| target == Target::Drive(drive.name().to_owned()))
    else {
        return Err(Failure::Input(format!("{} is a group: name one drive", args.name)));
    };
    let body = body(drive, args.shown.as_deref()).map_err(Failure::Input)?;
    let told = Told { action: ActionWord::Accept, body, done: "is accepted".to_owned() };
    client::order(&args.daemon, daemon, &target, &told).await
}

/// The command by which a drive is accepted, or why it is not given.
fn body(drive: &DriveView, shown: Option<&str>) -> Result<serde_json::Value, String> {
    let (name, check) = (drive.name(), &drive.snapshot.identity);
    let Some(found) = values::identity(check) else {
        return Err(format!("{name}: {}: there is nothing to accept", values::identity_check(check)));
    };
    match (shown, check) {
        (Some(shown), _) if shown == found.to_string() => {
            let place = json!([{ "name": name, "place": drive.place }]);
            Ok(json!({ "identity": found, "expects": { "drives": place } }))
        }
        (Some(_), _) => Err(format!("{name} is not accepted: it is {found} now")),
        (None, IdentityCheck::Changed { remembered, .. }) => Err(format!(
            "{name} is {found} now, and was {remembered}: see that it is set up for its motor, then accept it by \
             drived accept {name:?} --as \"{found}\""
        )),
        (None, _) => Err(format!("{name} is {}: there is nothing to accept", values::identity_check(check))),
    }
}

#[cfg(test)]
mod tests {
    use drived_plant::plant::testing::{read, told};
    use serde_json::{Value, json};

    use super::*;

    fn is(identity: Value) -> DriveView {
        let mut drive = told("pump 1");
        drive["identity"] = identity;
        read(&drive)
    }

    #[test]
    fn what_was_not_told_is_not_accepted_and_what_was_is_given_on_whole() {
        let before = json!({ "model": "ATV312HU15N4", "codes": [] });
        let changed =
            is(json!({ "check": "changed", "model": "ATV312HU22N4", "codes": [], "remembered": before }));
        let asked = body(&changed, None).unwrap_err();
        assert!(asked.contains("pump 1 is ATV312HU22N4 now, and was ATV312HU15N4"), "{asked}");
        assert!(asked.ends_with("drived accept \"pump 1\" --as \"ATV312HU22N4\""), "{asked}");
        assert_eq!(
            body(&changed, Some("ATV312HU15N4")).unwrap_err(),
            "pump 1 is not accepted: it is ATV312HU22N4 now"
        );
        let given = body(&changed, Some("ATV312HU22N4")).unwrap();
        assert_eq!(given["identity"], json!({ "model": "ATV312HU22N4", "codes": [] }));
        assert_eq!(given["expects"]["drives"][0]["name"], "pump 1");
        for known in [json!({ "check": "same", "model": "A", "codes": [] }), json!({ "check": "cannot_say" })]
        {
            let none = body(&is(known), None).unwrap_err();
            assert!(none.ends_with("there is nothing to accept"), "{none}");
        }
    }
}
