//! Where the writes to the EEPROM of a drive on a line are counted that no daemon writes: in the ledger of the daemon that has the
//! drive otherwise.

use std::path::{Path, PathBuf};

use drive_bus::LineConfig;
use drive_fleet::{EEPROM_WRITES_A_DAY, EepromLedger};

use crate::Config;
use drived_config::{kept::Kept, records::Records};
use drived_words::{drive_spec::DriveName, output};

/// The file of the state folder.
pub const FILE: &str = "eeprom.json";
/// What is not so where they cannot be kept.
pub const LOSS: &str = "the next run of this program counts the writes to EEPROM anew";
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
    /// The file and the drive's name in it, or why there is none.
    place: Result<(PathBuf, String), String>,
    is_told: bool,
}

impl LedgerArgs {
    /// The ledger of a drive on a line.
    pub fn of(&self, name: DriveName, line: &LineConfig) -> Ledger {
        Ledger { place: self.place(name, line), is_told: false }
    }

    fn place(&self, name: DriveName, line: &LineConfig) -> Result<(PathBuf, String), String> {
        let config = Config::load(&self.config).map_err(|error| error.to_string())?;
        let file = self.config.display();
        let lines = config.lines.iter().filter(|part| part.config.endpoint == line.endpoint);
        let mut drives = lines.flat_map(|line| &line.drives);
        let drive = drives.find(|drive| drive.name == name);
        let drive = drive.ok_or_else(|| format!("{file} has no {name} on this line"))?;
        let folder = config.doors.state.folder.ok_or_else(|| format!("{file} has no state folder"))?;
        Ok((folder.join(FILE), drive.settings.name.clone()))
    }
}

impl Ledger {
    /// The EEPROM was written so often, or may have been.
    pub fn count(&mut self, writes: usize) {
        if writes == 0 {
            return;
        }
        match &self.place {
            Ok((file, drive)) => match counted(file, drive, writes) {
                Ok(ledger) if ledger.is_worn() => output::complain(format_args!(
                    "ALARM: the EEPROM of {drive} is written too often: {ledger}, and {EEPROM_WRITES_A_DAY} a day are an alarm"
                )),
                Ok(_) => {}
                Err(error) => {
                    output::complain(format_args!("{}: {error}: {}", file.display(), NOT_COUNTED));
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

fn counted(file: &Path, drive: &str, writes: usize) -> std::io::Result<EepromLedger> {
    // Two at once would each forget what the other has written.
    let _lock = Kept::at(file).lock()?;
    let mut records = Records::open(Some(file), LOSS);
    let mut ledger: EepromLedger = records.of(drive).cloned().unwrap_or_default();
    (0..writes).for_each(|_| ledger.count());
    records.set(drive, Some(ledger.clone()));
    records.write();
    Ok(ledger)
}

#[cfg(test)]
mod tests {
    use drive_core::SerialSettings;
    use drive_fleet::WatchdogContract;

    use super::*;
    use drived_config::testing::Folder;

    /// Where the ledger of a drive on some line is.
    fn of(config: &Path) -> Result<(PathBuf, String), String> {
        let line = LineConfig::stream(SerialSettings::MODBUS_DEFAULT);
        LedgerArgs { config: config.to_owned() }.place(
            "atv312@1".parse::<drived_words::drive_spec::DriveSpec>().unwrap().single().unwrap(),
            &line,
        )
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
        let mut records = Records::open(Some(&file), LOSS);
        let mut of_daemon = EepromLedger { in_vain: in_vain.clone(), ..EepromLedger::default() };
        of_daemon.count();
        records.set("pump", Some(of_daemon));
        records.write();
        let mut ledger = Ledger { place: Ok((file.clone(), "pump".to_owned())), is_told: false };
        ledger.count(0);
        ledger.count(2);
        let kept: EepromLedger = Records::open(Some(&file), LOSS).of("pump").cloned().unwrap();
        assert_eq!((kept.writes, kept.today, kept.is_worn()), (3, 3, false));
        assert_eq!(kept.in_vain, in_vain);
        ledger.count(usize::try_from(EEPROM_WRITES_A_DAY).unwrap());
        assert!(Records::<EepromLedger>::open(Some(&file), LOSS).of("pump").unwrap().is_worn());
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
