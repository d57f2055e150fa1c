//! A line that the command line describes: its drives are only read, as often as suits the line.

use drive_bus::LineConfig;
use drive_families::Options;
use drive_fleet::{DriveSettings, LineBudget, Periods};

use super::{
    DrivePart, LinePart,
    line::{Member, fitting_stretch},
};
use drived_words::drive_spec::DriveName;

impl LinePart {
    /// A line with drives that nothing is written to, each called as it is written: `atv312@1`. They are asked as often as
    /// these periods say, or more seldom where that leaves less than a fifth of the line to other questions.
    pub fn watched(
        name: &str,
        config: LineConfig,
        drives: &[DriveName],
        options: &Options,
        periods: Periods,
    ) -> Self {
        let member = |&drive: &DriveName| Member {
            drive,
            settings: DriveSettings { periods, ..DriveSettings::watched(drive.to_string()) },
            options: options.of(drive.family),
            slot: None,
            is_guess: false,
            has_own_periods: false,
        };
        let members: Vec<Member> = drives.iter().map(member).collect();
        let budget = LineBudget::of(&config);
        let stretch = fitting_stretch(budget, &members);
        let part = |member: Member| DrivePart {
            name: member.drive,
            settings: member.settings_with(stretch),
            options: member.options,
            slot: member.slot,
            is_guess: member.is_guess,
        };
        let drives = members.into_iter().map(part).collect();
        Self { name: name.to_owned(), config, budget, drives, problem: None }
    }
}
