//! `drived faults`: the faults of one drive, with what to do about them.

use drive_core::Fault;

use crate::{client, failure::Failure, json, one_drive::OneDriveArgs, output};

/// Read the present faults of one drive, its alarms and its fault history
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// A drive of the running daemon
    #[arg(value_name = "NAME", conflicts_with = "line")]
    name: Option<String>,
    #[command(flatten)]
    one: OneDriveArgs,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    if !args.one.is_on_line() {
        let name = args.name.as_deref();
        let mut daemon = args.one.daemon.connect().await?;
        let path = args.one.path(&mut daemon, name, &["faults"]).await?;
        let faults = daemon.get(&path).await?.done()?;
        return args.one.daemon.say(&faults, |faults| client::faults(name.unwrap_or_default(), faults));
    }
    let mut one = args.one.open().await?;
    let faults = one.drive.faults().await.map_err(|error| one.failure(&error))?;
    if args.one.daemon.is_json() {
        output::say_as_it_is(json::line(&faults))?;
        one.close().await;
        return Ok(());
    }
    if faults.present.is_empty() {
        output::say(format_args!("{} has no fault", one.name))?;
    }
    for fault in &faults.present {
        say_with_remedy(&format!("{} has tripped, fault", one.name), fault)?;
    }
    for warning in &faults.warnings {
        say_with_remedy("  warning", warning)?;
    }
    match faults.reset_allowed {
        Some(true) if !faults.present.is_empty() => {
            output::say("  the drive would accept a reset now: drived reset")?;
        }
        Some(false) => output::say("  the drive would not accept a reset now: its cause is still there")?,
        _ => {}
    }
    for (position, fault) in faults.history.iter().enumerate() {
        output::say(format_args!("  history {}: {fault}", position + 1))?;
    }
    one.close().await;
    Ok(())
}

fn say_with_remedy(what: &str, fault: &Fault) -> Result<(), Failure> {
    output::say(format_args!("{what} {fault}"))?;
    match fault.remedy() {
        Some(remedy) => output::say(format_args!("  what to do: {remedy}")),
        None => Ok(()),
    }
}
