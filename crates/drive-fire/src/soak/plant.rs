//! What a soak lives through: a fleet over simulated lines full of drives.

use std::time::Duration;

use drive_bus::{Line, LineConfig};
use drive_core::{SerialSettings, serial::CharacterFormat};
use drive_families::{Family, SetUp};
use drive_fleet::{DriveSettings, Fleet, FleetBuilder, FrequencyLimits, Periods};
use drive_sim::{Fault, Faults, SimLine, Wiring};
use drive_testing::contract::Open;
use fastrand::Rng;

use super::LIMIT;

/// Something is commanded, or happens, this often on each line.
const EVERY: Duration = Duration::from_secs(3);

/// So many lines with so many drives each, for so long.
#[derive(Debug, Clone, Copy)]
pub struct Size {
    /// How many lines.
    pub lines: usize,
    /// How many drives on each.
    pub drives: u8,
    /// For how long, in virtual time.
    pub time: Duration,
    /// So many times as seldom something is commanded, and is asked what stands; above one, what is started is stopped again before the
    /// next command.
    pub calm: u32,
}

impl Size {
    pub(super) fn replay(self, seed: u64) -> String {
        let Self { lines, drives, time, calm } = self;
        format!(
            "drive-fire soak --seed {seed} --hours {} --lines {lines} --drives {drives} --calm {calm}",
            time.as_secs() / 3_600
        )
    }

    /// From one command of a line to the next.
    pub(super) fn every(self) -> Duration {
        EVERY * self.calm
    }

    /// How often a drive is asked.
    fn periods(self) -> Periods {
        let usual = Periods::default();
        Periods {
            rest: usual.rest * self.calm,
            slow: usual.slow * self.calm,
            max_age: usual.max_age * self.calm,
            ..usual
        }
    }

    /// For how long a motor runs; `None`: until somebody stops it.
    pub(super) fn runs_for(self, rng: &mut Rng) -> Option<Duration> {
        (self.calm > 1).then(|| self.every().mul_f64(rng.f64()))
    }
}

/// How its lines are spoken to.
pub(super) fn config() -> LineConfig {
    LineConfig::stream(serial())
}

fn serial() -> SerialSettings {
    SerialSettings::new(19_200, CharacterFormat::F8N1).expect("it is a speed")
}

/// Its fleet, to be started, and its lines by their names.
pub(super) fn build(
    size: Size,
    rng: &mut Rng,
    open: &dyn Fn(Family) -> Box<Open>,
) -> (FleetBuilder, Vec<(String, SimLine)>) {
    let mut builder = Fleet::builder().whatever_the_plan();
    let mut sites = Vec::new();
    let others: Vec<Family> =
        Family::BUILT_IN.into_iter().filter(|one| *one != Family::OMRON_3G3EV).collect();
    for number in 0..size.lines {
        let simulated = SimLine::new(Wiring::rtu(serial()));
        let line = Line::over(simulated.in_memory(), config());
        let name = format!("line {number}");
        builder = builder.line(name.clone(), line);
        // Two thirds of what a calm line asks keeps its Altivars 21 and 3G3EVs from tripping: there the first one has them for all.
        let is_unwatched = size.calm > 1 && number > 0;
        // The last one is commanded like every other, and only watched.
        for address in 1..=size.drives + 1 {
            let families = if is_unwatched { &others[..] } else { &Family::BUILT_IN[..] };
            let in_turn = families[usize::from(address) % families.len()];
            // Which takes any address.
            let family = if address <= size.drives { in_turn } else { Family::ATV312 };
            let machine = family.machine(SetUp::ForTheBus).expect("it has a twin");
            let machine = simulated.add_boxed(address, machine).expect("the address is free");
            if is_unwatched && family == Family::ATV21 {
                let said = simulated.control(&format!("{} set F803 0", machine.name()));
                said.expect("its owner may do without the watchdog");
            }
            let high = (address % 3 == 1).then_some(LIMIT);
            let drive = DriveSettings {
                control: address <= size.drives,
                periods: size.periods(),
                limits: FrequencyLimits { high, ..FrequencyLimits::default() },
                ..DriveSettings::watched(format!("{number}/{address}"))
            };
            builder = builder.drive(&name, address, drive, |port, slave| open(family)(Box::new(port), slave));
        }
        simulated.set_faults(faults(rng.u64(..)));
        sites.push((name, simulated));
    }
    (builder, sites)
}

/// One exchange in some fifty is struck.
fn faults(seed: u64) -> Faults {
    let kinds =
        [Fault::RequestFlipped, Fault::Flipped, Fault::Lost, Fault::Truncated, Fault::Noise, Fault::Late];
    kinds.into_iter().fold(Faults::seeded(seed), |faults, kind| faults.with(kind, 3_500))
}
