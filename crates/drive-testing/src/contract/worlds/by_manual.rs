//! The referee beside a drive: everything that is written on the wire or happens around the machine is told to the manual, by its own
//! transcription, which is asked then what it makes of the motor.

use drive_core::registers::{Place, Row, Space, Storage};
use drive_drivecom::ChartState;
use drive_sim::{Act, Intervened, Intervention, Observation, Panel, SimSlave};
use tokio::time::Instant;

use super::Judge;
use crate::{
    referee::{self, Answer, Change, Family, Key, Motion, Order, State, Verdict, Who, World},
    truth::TOLERANCE,
    words::words_written,
};

/// The manual's world of one machine of a family of the [`referee`].
pub struct ByManual {
    family: Family,
    rows: &'static [Row],
    machine: SimSlave,
    world: World,
    /// How many interventions of others were looked at.
    seen: u64,
    /// What happened and was not told to the manual yet.
    happened: Vec<(Instant, Vec<Change>)>,
    heard_until: Instant,
    /// Something happened that the referee has no word for.
    lost: bool,
    /// Another master has commanded the motor: what turns by the bus may turn by him.
    another: bool,
}

impl ByManual {
    /// A machine as it is set up now, at rest, before anything is written to it; `None` where nobody has transcribed the manual of its
    /// family.
    #[must_use]
    pub fn of(machine: &SimSlave) -> Option<Self> {
        let (around, machine) = (machine.surroundings(), machine.clone());
        let family = match around.family {
            "atv21" => Family::Atv21,
            "atv28" => Family::Atv28,
            "atv58" => Family::Atv58,
            "atv312" => Family::Atv312,
            "3g3ev" => Family::Omron3g3ev,
            _ => return None,
        };
        let rows = around.rows;
        let settings = rows.iter().filter(|row| is_setting(row));
        let words = settings.filter_map(|row| Some((row.address, machine.peek(row.address)?))).collect();
        let world = World::switched_on(family, words);
        let mut judge = Self {
            family,
            rows,
            seen: machine.interventions().last().map_or(0, |last| last.number + 1),
            machine,
            world,
            happened: Vec::new(),
            heard_until: Instant::now(),
            lost: false,
            another: false,
        };
        judge.world.inputs = match family {
            Family::Atv312 => judge.machine.peek(5240).unwrap_or(0) & 0x3F,
            Family::Atv28 => judge.machine.peek(478).unwrap_or(0) & 0x3F,
            _ => 0,
        };
        if let Some(state) = judge.chart() {
            judge.world.state = state;
        }
        Some(judge)
    }

    /// What an intervention is to the manual; `None`: it has no word for it.
    fn changes(&self, what: Intervention) -> Option<Vec<Change>> {
        let number = |name: &str| name.trim_start_matches(char::is_alphabetic).parse::<u8>().ok();
        let pressed = |key| vec![Change::Key { key, held: true }, Change::Key { key, held: false }];
        Some(match what {
            Intervention::World(Act::Terminal(name, closed)) => match self.family {
                Family::Atv21 => {
                    // ST has no bit in FD06.
                    let (_, bit) =
                        [("F", 0), ("R", 1), ("RES", 2), ("VIA", 7)].into_iter().find(|it| it.0 == name)?;
                    vec![Change::Input { bit, closed }]
                }
                // The manual knows none of them: what they do shows in 002Ch.
                Family::Omron3g3ev => Vec::new(),
                _ if name.starts_with("LI") => vec![Change::Input { bit: number(name)? - 1, closed }],
                _ => return None,
            },
            Intervention::World(Act::Analog(name, level)) => {
                let number = match name {
                    "AIV1" => 16,
                    "VIA" => 1,
                    "VIB" => 2,
                    _ => number(name)?,
                };
                vec![Change::Analog { number, value: i16::try_from(level.hundredths()).ok()? }]
            }
            Intervention::Panel(Panel::TakeControl | Panel::ReleaseControl)
                if self.family == Family::Atv21 =>
            {
                let held = what == Intervention::Panel(Panel::TakeControl);
                vec![Change::Key { key: Key::Local, held }]
            }
            // Whether its STOP acts while the bus commands, their manuals do not say.
            Intervention::Panel(Panel::Stop) if matches!(self.family, Family::Atv21 | Family::Omron3g3ev) => {
                return None;
            }
            Intervention::Panel(Panel::Run) => pressed(Key::Run),
            Intervention::Panel(Panel::Stop) => pressed(Key::Stop),
            // Forced local and the reference of the panel are read from the world that `ask` corrects.
            Intervention::Panel(Panel::TakeControl | Panel::ReleaseControl | Panel::Reference(_)) => {
                Vec::new()
            }
            Intervention::Power(on) => vec![Change::Mains(on)],
            Intervention::Trip(code) => vec![Change::Trip(code), Change::CauseGone],
            Intervention::Master(Place { space: Space::HoldingRegister, address }, value) => {
                vec![Change::Write { address, value }]
            }
            // A setting is one whoever makes it.
            Intervention::Set(place @ Place { space: Space::HoldingRegister, address }, value)
                if self.rows.iter().any(|row| row.place() == place && is_setting(row)) =>
            {
                vec![Change::Write { address, value }]
            }
            Intervention::Panel(Panel::Reset)
            | Intervention::Master(..)
            | Intervention::Set(..)
            | Intervention::World(_) => {
                return None;
            }
        })
    }

    /// What the drive's own words show stands for what the manual leaves open: forced local, and of a family without channels on
    /// its bus who commands.
    fn correct(&mut self) {
        match self.family {
            // Its manual follows the inputs and the keypad as far as it goes.
            Family::Atv21 => {}
            // n02 acts at the next power-up, and the panel is none of its: bits 9 and A of 002Ch show what is in force.
            Family::Omron3g3ev => {
                let state = self.machine.peek(0x002C).unwrap_or(0);
                let mode = match (state >> 0xA & 1 == 1, state >> 9 & 1 == 1) {
                    (false, false) => 5,
                    (false, true) => 2,
                    (true, false) => 4,
                    (true, true) => 0,
                };
                self.world.words.insert(0x0102, mode);
                // By which number an input resets a fault, S1 does not print: that one did shows in the drive alone.
                self.world.tripped = self.machine.observe().trip;
            }
            _ => self.correct_altivar(),
        }
    }

    fn correct_altivar(&mut self) {
        let seen = self.machine.observe();
        let word = |address| self.machine.peek(address).unwrap_or(0);
        let (eta, eti) = match self.family {
            Family::Atv312 => (word(3201), word(3206)),
            _ => (word(458), word(459)),
        };
        let forced = eta & 1 << 9 == 0;
        match self.family {
            Family::Atv312 => self.world.forced_local = Some(forced),
            Family::Atv28 => {
                self.world.told = Some(match (forced, eti >> 13 & 3) {
                    (false, 2) => Who::Bus,
                    (false, 1) => Who::RemoteTerminal,
                    _ => Who::Terminals,
                });
            }
            _ => self.world.told = Some(if forced { Who::Terminals } else { Who::Bus }),
        }
        if matches!(self.family, Family::Atv28 | Family::Atv58) {
            // Their inputs have no address: what they did shows in the chart.
            if let Some(state) = self.chart() {
                self.world.state = state;
                self.world.unsure = None;
            }
            self.world.tripped = seen.trip;
        }
    }

    fn chart(&self) -> Option<State> {
        if matches!(self.family, Family::Atv21 | Family::Omron3g3ev) {
            return None;
        }
        let eta = if self.family == Family::Atv312 { 3201 } else { 458 };
        Some(match ChartState::of(self.machine.peek(eta)?)? {
            ChartState::SwitchOnDisabled => State::SwitchOnDisabled,
            ChartState::ReadyToSwitchOn => State::Ready,
            ChartState::SwitchedOn => State::SwitchedOn,
            ChartState::OperationEnabled => State::OperationEnabled,
            ChartState::QuickStopActive => State::QuickStop,
            ChartState::Fault | ChartState::FaultReactionActive => State::Fault,
            ChartState::NotReadyToSwitchOn => return None,
        })
    }
}

impl Judge for ByManual {
    fn follow(&mut self) {
        let interventions = self.machine.interventions();
        for Intervened { number, at, what } in interventions {
            if number < self.seen {
                continue;
            }
            self.seen = number + 1;
            self.another |= matches!(what, Intervention::Master(..));
            match self.changes(what) {
                Some(changes) => self.happened.push((at, changes)),
                None => self.lost = true,
            }
        }
        let since = self.heard_until;
        for request in self.machine.received_since(since) {
            self.heard_until = request.at;
            let written = words_written(&request.pdu).into_iter();
            let writes = written.map(|(address, value)| Change::Write { address, value }).collect();
            self.happened.push((request.at, writes));
        }
        self.happened.sort_by_key(|(at, _)| *at);
        for (_, changes) in std::mem::take(&mut self.happened) {
            for change in changes {
                self.world = referee::next(&self.world, &change);
            }
        }
        let seen = self.machine.observe();
        self.world.turning = seen.running || seen.shaft_frequency.abs() > TOLERANCE;
    }

    fn objects(&mut self, held: bool, in_force: bool) -> Option<String> {
        self.follow();
        // Where the command word of the bus stands: CMD, FA00 and 0001h of the manuals.
        let cmd = match self.family {
            Family::Atv312 => 8501,
            Family::Atv28 | Family::Atv58 => 400,
            Family::Atv21 => 0xFA00,
            Family::Omron3g3ev => 0x0001,
        };
        // Of two words at the same moment the wire does not tell which was the later.
        let is_told = self.world.command.is_none_or(|command| self.machine.peek(cmd) == Some(command));
        if self.lost || !is_told {
            return None;
        }
        self.correct();
        let seen = self.machine.observe();
        let ruling = referee::ruling(&self.world, motion(&seen));
        if ruling.verdict == Verdict::MustNot {
            return Some(format!("{} ({}): {seen:?}", ruling.because, ruling.source));
        }
        match referee::order(&self.world) {
            Answer::Says(Order::Drive { by: Who::Bus, .. }, rule)
                if !held && !self.another && seen.running =>
            {
                Some(format!(
                    "it turns by a command of the bus ({}), and no lease stands: {seen:?}",
                    rule.source
                ))
            }
            Answer::Says(Order::Drive { by: Who::Bus, .. }, _) => None,
            Answer::Says(order, rule) if in_force => {
                Some(format!("told in force, and the manual says {order:?} ({}): {seen:?}", rule.source))
            }
            _ => None,
        }
    }

    fn decides(&self) -> bool {
        !self.lost && !referee::order(&self.world).is_silent()
    }
}

/// Whether it is kept through a loss of the supply.
fn is_setting(row: &Row) -> bool {
    row.access.is_writable() && row.storage != Storage::Volatile
}

fn motion(seen: &Observation) -> Motion {
    if seen.running && seen.output_frequency.abs() > TOLERANCE && seen.setpoint != 0 {
        Motion::Turning { reverse: seen.output_frequency < 0, tends: Some(seen.setpoint.unsigned_abs()) }
    } else if seen.shaft_frequency.abs() > TOLERANCE || seen.output_frequency.abs() > TOLERANCE {
        Motion::ComingDown
    } else {
        Motion::AtRest
    }
}
