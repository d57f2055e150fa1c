//! Where the writes to the EEPROM of a drive on a line are counted that no daemon writes: in the ledger of the daemon that has the
//! drive otherwise.

use std::path::PathBuf;

use drive_bus::LineConfig;
use drive_fleet::{EEPROM_WRITES_A_DAY, EepromLedger, Place};

use crate::Config;
use drived_config::{config::places, kept::Kept, names::places_before, places::Places, records::Records};
use drived_words::{drive_spec::DriveName, output};

/// The file of the state folder.
pub const FILE: &str = "eeprom.json";
/// What is said where a write is counted nowhere.
const NOT_COUNTED: &str = "the writes to the drive's EEPROM are counted nowhere";

/// Where writes to EEPROM over a line are counted.
#[derive(Debug, Clone, clap::Args)]
pub struct LedgerArgs {
    /// With --line: the configuration of the daemon that has the drive otherwise. The writes to the drive's EEPROM are counted in its
    /// state folder
    #[arg(long, value_name = "FILE", default_value = "drives.toml")]
    config: PathBuf,
}

/// The ledger of one drive.
#[derive(Debug)]
pub struct Ledger {
    /// Where it is, or why there is none.
    found: Result<Found, String>,
    is_told: bool,
}

/// The ledger of a daemon, and the drive in it.
#[derive(Debug)]
struct Found {
    file: PathBuf,
    places: Places,
    name: String,
    place: Place,
}

impl LedgerArgs {
    /// The ledger of a drive on a line.
    pub fn of(&self, name: DriveName, line: &LineConfig) -> Ledger {
        Ledger { found: self.find(name, line), is_told: false }
    }

    fn find(&self, name: DriveName, line: &LineConfig) -> Result<Found, String> {
        let config = Config::load(&self.config).map_err(|error| error.to_string())?;
        let file = self.config.display();
        let lines = config.lines.iter().filter(|part| part.config.endpoint == line.endpoint);
        let mut drives = lines.flat_map(|part| part.drives.iter().map(move |drive| (part, drive)));
        let drive = drives.find(|(_, drive)| drive.name == name);
        let (part, drive) = drive.ok_or_else(|| format!("{file} has no {name} on this line"))?;
        let (place, name) = (part.place(drive.name), drive.settings.name.clone());
        let folder = config.doors.state.folder.as_deref();
        let folder = folder.ok_or_else(|| format!("{file} has no state folder"))?;
        let places = places(&config.lines).collect::<Places>().after(places_before(Some(folder)));
        Ok(Found { file: folder.join(FILE), places, name, place })
    }
}

impl Ledger {
    /// The EEPROM was written so often, or may have been.
    pub fn count(&mut self, writes: usize) {
        if writes == 0 {
            return;
        }
        match &self.found {
            Ok(found) => match found.counted(writes) {
                Ok(ledger) if ledger.is_worn() => output::complain(format_args!(
                    "ALARM: the EEPROM of {} is written too often: {ledger}, and {EEPROM_WRITES_A_DAY} a day are an alarm",
                    found.name
                )),
                Ok(_) => {}
                Err(error) => {
                    output::complain(format_args!("{}: {error}: {}", found.file.display(), NOT_COUNTED));
                }
            },
            Err(why) if !self.is_told => {
                self.is_told = true;
                output::complain(format_args!("{}: {why}; --config names another", NOT_COUNTED));
            }
            Err(_) => {}
        }
    }
}

impl Found {
    fn counted(&self, writes: usize) -> std::io::Result<EepromLedger> {
        // Two at once would each forget what the other has written.
        let _lock = Kept::at(&self.file).lock()?;
        let records = Records::open(Some(&self.file), &self.places);
        let mut ledger: EepromLedger = records.of(&self.place).unwrap_or_default();
        (0..writes).for_each(|_| ledger.count());
        records.set(&self.place, &self.name, Some(ledger.clone()));
        records.write();
        Ok(ledger)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use drive_core::SerialSettings;
    use drive_fleet::WatchdogContract;

    use super::*;
    use drived_config::testing::Folder;

    const PLACE: &str = "/dev/ttyUSB0 atv312@1";

    /// Where the ledger of a drive on some line is.
    fn of(config: &Path) -> Result<Found, String> {
        let line = LineConfig::stream(SerialSettings::MODBUS_DEFAULT);
        LedgerArgs { config: config.to_owned() }
            .find("atv312@1".parse::<drived_words::drive_spec::DriveSpec>().unwrap().single().unwrap(), &line)
    }

    #[test]
    fn what_is_written_over_a_line_stands_in_the_ledger_of_the_daemon_beside_what_it_has_tried_in_vain() {
        let folder = Folder::new("ledger");
        let file = folder.file(FILE);
        let contract = WatchdogContract {
            timeout: std::time::Duration::from_secs(2),
            reaction: drive_core::Reaction::Ramp,
        };
        let in_vain = Some(drive_fleet::InVain { identity: None, contract });
        let places: Places = [("pump".to_owned(), PLACE.into())].into_iter().collect();
        let kept = || Records::<EepromLedger>::open(Some(&file), &places);
        let records = kept();
        let mut of_daemon = EepromLedger { in_vain: in_vain.clone(), ..EepromLedger::default() };
        of_daemon.count();
        records.set(&PLACE.into(), "pump", Some(of_daemon));
        records.write();
        let (name, place) = ("pump".to_owned(), PLACE.into());
        let found = Found { file: file.clone(), places: places.clone(), name, place };
        let mut ledger = Ledger { found: Ok(found), is_told: false };
        ledger.count(0);
        ledger.count(2);
        let now = kept().of(&PLACE.into()).unwrap();
        assert_eq!((now.writes, now.today, now.is_worn()), (3, 3, false));
        assert_eq!(now.in_vain, in_vain);
        ledger.count(usize::try_from(EEPROM_WRITES_A_DAY).unwrap());
        assert!(kept().of(&PLACE.into()).unwrap().is_worn());
    }

    #[test]
    fn a_configuration_that_does_not_name_the_drive_keeps_no_ledger_of_it_and_it_is_said_why() {
        let folder = Folder::new("no-ledger");
        let missing = of(&folder.file("drives.toml")).unwrap_err();
        assert!(missing.contains("cannot be read"), "{missing}");
        let file = folder.file("other.toml");
        let text = "[lines.bench]\nport = \"tcp://192.0.2.1:502\"\n[[drives]]\nline = \"bench\"\ndrive = \"atv312@1\"\nname = \"pump\"\n";
        std::fs::write(&file, text).unwrap();
        let other = of(&file).unwrap_err();
        assert!(other.contains("has no atv312@1 on this line"), "{other}");
    }
}
