//! What holds when a reload fails.

use std::{fs, time::Duration};

use drive_families::Family;
use drive_fleet::DriveSettings;

use super::*;
use crate::simulated;

/// Lines whose port is nowhere, with watched drives by line, address and name.
fn text(drives: &[(&str, u8, &str)]) -> String {
    let lines =
        "[lines.north]\nport = \"tcp://192.0.2.1:502\"\n[lines.south]\nport = \"tcp://192.0.2.2:502\"\n";
    let drive = |(line, address, name): &(&str, u8, &str)| {
        format!("[[drives]]\nline = \"{line}\"\ndrive = \"atv312@{address}\"\nname = \"{name}\"\n")
    };
    drives.iter().map(drive).fold(lines.to_owned(), |text, drive| text + &drive)
}

#[tokio::test]
async fn a_reload_that_fails_halfway_says_what_holds_and_goes_on_from_there() {
    let file = std::env::temp_dir().join(format!("drived-halfway-{}.toml", std::process::id()));
    let write = |drives: &[(&str, u8, &str)]| fs::write(&file, text(drives)).unwrap();
    write(&[("north", 1, "one"), ("north", 2, "two"), ("south", 1, "three")]);
    let config = Config::load_workable(&file).unwrap();
    let lines: Vec<Line> =
        config.lines.iter().map(|part| Line::start(part.config.clone()).unwrap()).collect();
    let fleet = super::super::build(&config, &lines).start().unwrap();
    let plant = Plant::start(fleet.clone(), Vec::new(), false);
    let reloader = Reloader::new(plant, Notify::start(), file.clone(), config);
    // Somebody else in the program has taken a name that the file does not know yet.
    let family = Family::Atv312;
    let stranger = DriveSettings::watched("four".to_owned());
    let options = simulated::options();
    fleet
        .extend(|builder| {
            builder
                .whatever_the_plan()
                .drive("south", 9, stranger, |port, slave| family.open_with(port, slave, &options))
        })
        .unwrap();
    write(&[("north", 1, "one"), ("north", 3, "two"), ("south", 4, "four")]);
    let Err(Failure::Drive(told)) = reloader.reload(false).await else { panic!("it fails") };
    for part in [
        "ONLY IN PART",
        "two ended by its policy of the exit and NOT begun anew",
        "three removed, by its policy of the exit",
        "four NOT added",
    ] {
        assert!(told.contains(part), "{told}");
    }
    let names =
        |fleet: &Fleet| fleet.drives().iter().map(|drive| drive.name().to_string()).collect::<Vec<_>>();
    assert_eq!(names(&fleet), ["one", "four"]);
    let again = reloader.reload(true).await.unwrap();
    assert_eq!(again, ["four added", "two added"], "what it believes is what there is");
    let _ = fleet.remove(&["four"], Duration::from_secs(1)).await;
    assert_eq!(reloader.reload(false).await.unwrap(), ["four added", "two added"]);
    assert_eq!(reloader.reload(true).await.unwrap(), Vec::<String>::new());
    fs::remove_file(&file).unwrap();
}
