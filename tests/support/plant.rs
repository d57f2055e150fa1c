//! A plant: simulated lines full of simulated drives, in virtual time, and the fleet that watches them.

use std::{collections::BTreeMap, time::Duration};

use drive_bus::{Line, LineConfig};
use drive_core::{Frequency, Reaction, SerialSettings, WatchdogCapability, serial::CharacterFormat};
use drive_families::Family;
use drive_fleet::{
    DriveHandle, DriveSettings, EventKind, Events, Fleet, FleetBuilder, FleetError, LineBudget, Received,
    WatchdogContract,
};
use drive_sim::{SimLine, SimSlave, Wiring};
use drive_testing::witness::Witnesses;
use tokio::time::timeout;

use crate::drives;

/// The one drive of a plant that has one.
pub const MOTOR: &str = "motor";

/// Where it is.
pub const ADDRESS: u8 = 5;

/// How long anything may take here, in virtual time.
pub const PATIENCE: Duration = Duration::from_secs(300);

/// Speed and format that all families have.
#[must_use]
pub fn common_settings() -> SerialSettings {
    SerialSettings::new(19_200, CharacterFormat::F8N1).expect("it is a speed")
}

/// What a fleet wants of the watchdog of this family: the shortest that a line with one drive feeds; `None` where the
/// family has none.
#[must_use]
pub fn contract(family: Family) -> Option<WatchdogContract> {
    let WatchdogCapability { min, max, reactions, .. } = family.capabilities().watchdog?;
    let timeout = Duration::from_secs(2).clamp(min, max);
    let reaction = reactions.iter().copied().find(|reaction| *reaction != Reaction::Ignore);
    Some(WatchdogContract { timeout, reaction: reaction.unwrap_or(Reaction::Trip) })
}

/// Settings of a drive that is commanded, with its watchdog where the family has one.
#[must_use]
pub fn controlled(family: Family, name: &str) -> DriveSettings {
    DriveSettings { watchdog: contract(family), ..DriveSettings::controlled(name) }
}

/// One simulated line: its machines, and how to open it again and again.
pub struct Site {
    /// The simulated line.
    pub simulated: SimLine,
    /// Its drives: family, address and the settings that a fleet has for it.
    pub members: Vec<(Family, u8, DriveSettings)>,
}

impl Site {
    /// A line with these drives.
    ///
    /// # Panics
    /// When an address is taken.
    #[must_use]
    pub fn new(settings: SerialSettings, members: Vec<(Family, u8, DriveSettings)>) -> Self {
        let simulated = SimLine::new(Wiring::rtu(settings));
        for (family, address, _) in &members {
            simulated.add_boxed(*address, drives::machine(*family)).expect("the address is free");
        }
        Self { simulated, members }
    }

    /// How a line to this site is configured.
    #[must_use]
    pub fn config(&self) -> LineConfig {
        LineConfig {
            response_timeout: Duration::from_millis(150),
            ..LineConfig::stream(self.simulated.wiring().settings)
        }
    }
}

fn line_name(number: usize) -> String {
    format!("line {number}")
}

/// Sites and the fleet that watches them.
pub struct Plant {
    /// The sites.
    pub sites: Vec<Site>,
    /// The fleet.
    pub fleet: Fleet,
    /// What happens.
    pub events: Events,
    /// The lines between.
    pub lines: Vec<Line>,
    machines: BTreeMap<String, SimSlave>,
    /// Everything that the fleet tells is held against the machines; a contradiction is a panic at the end.
    witnesses: Witnesses,
}

impl Plant {
    /// A fleet over these sites.
    ///
    /// # Errors
    /// What the fleet finds wrong.
    pub fn open(sites: Vec<Site>) -> Result<Self, FleetError> {
        Self::built(sites, Fleet::builder())
    }

    /// The same on lines that cannot keep what is wanted of them.
    ///
    /// # Errors
    /// What else the fleet finds wrong.
    pub fn open_whatever_the_plan(sites: Vec<Site>) -> Result<Self, FleetError> {
        Self::built(sites, Fleet::builder().whatever_the_plan())
    }

    fn built(sites: Vec<Site>, mut builder: FleetBuilder) -> Result<Self, FleetError> {
        let mut machines = BTreeMap::new();
        let mut lines = Vec::new();
        for (number, site) in sites.iter().enumerate() {
            let config = site.config();
            // With a repeater in the middle: an Altivar 28 allows 18 stations on a segment.
            let line = Line::over(site.simulated.in_memory(), config);
            let name = line_name(number);
            let in_halves = |budget| LineBudget { segments: 2, ..budget };
            builder = builder.line_with(name.clone(), line.clone(), in_halves);
            for (family, address, settings) in &site.members {
                machines.insert(
                    settings.name.clone(),
                    site.simulated.slave(*address).expect("the machine is there"),
                );
                builder = builder.drive(&name, *address, settings.clone(), |port, slave| {
                    drives::drive(*family, port, slave)
                });
            }
            lines.push(line);
        }
        let fleet = builder.start()?;
        let events = fleet.events();
        let names: Vec<String> = (0..sites.len()).map(line_name).collect();
        let lines_by_name = names.iter().map(String::as_str).zip(sites.iter().map(|site| &site.simulated));
        let witnesses = Witnesses::of_fleet(&fleet, lines_by_name);
        Ok(Self { sites, fleet, events, lines, machines, witnesses })
    }

    /// One drive on one line, with its watchdog where it has one, and other settings as a test wants them.
    ///
    /// # Panics
    /// When the fleet refuses it.
    #[must_use]
    pub fn single(family: Family, change: impl FnOnce(&mut DriveSettings)) -> Self {
        let mut settings = controlled(family, MOTOR);
        change(&mut settings);
        let site = Site::new(common_settings(), vec![(family, ADDRESS, settings)]);
        Self::open(vec![site]).expect("it can be fed")
    }

    /// The same where nothing is held against the machines: for one that is set to what its manual gives no address of.
    #[must_use]
    pub fn without_witnesses(mut self) -> Self {
        self.witnesses = Witnesses::default();
        self
    }

    /// The fleet ends as a killed process does, and another one begins over the same machines.
    ///
    /// # Panics
    /// When the fleet refuses its settings.
    pub async fn restarted(self) -> Self {
        let Self { sites, fleet, lines, events, witnesses, .. } = self;
        drop((fleet, events, witnesses));
        for line in lines {
            line.close().await;
        }
        Self::open(sites).expect("it was there before")
    }

    /// The one drive.
    #[must_use]
    pub fn motor(&self) -> DriveHandle {
        self.drive(MOTOR)
    }

    /// The one machine.
    #[must_use]
    pub fn machine(&self) -> &SimSlave {
        self.machine_of(MOTOR)
    }

    /// Has something happen to the one motor's drive or its line: a line of the simulator's text without the drive's name.
    ///
    /// # Panics
    /// When the simulator does not know it.
    pub fn happens(&self, deed: &str) {
        match deed.strip_prefix("line ") {
            Some(_) => self.say(deed),
            None => self.say(&format!("{} {deed}", self.machine().name())),
        }
    }

    /// The same around the machine of this drive.
    ///
    /// # Panics
    /// When the simulator does not know it.
    pub fn happens_to(&self, drive: &str, deed: &str) {
        self.say(&format!("{} {deed}", self.machine_of(drive).name()));
    }

    fn say(&self, text: &str) {
        for site in &self.sites {
            site.simulated.control(text).unwrap_or_else(|error| panic!("{text}: {error}"));
        }
    }

    /// A drive.
    ///
    /// # Panics
    /// When there is none.
    #[must_use]
    pub fn drive(&self, name: &str) -> DriveHandle {
        self.fleet.drive(name).expect("the plant has it")
    }

    /// A machine.
    ///
    /// # Panics
    /// When there is none.
    #[must_use]
    pub fn machine_of(&self, name: &str) -> &SimSlave {
        &self.machines[name]
    }

    /// Waits for an event.
    ///
    /// # Panics
    /// When it does not come in five minutes of virtual time.
    pub async fn event(&mut self, what: &str, is_it: impl Fn(&EventKind) -> bool) -> EventKind {
        let wait = async {
            loop {
                match self.events.recv().await {
                    Received::Event(event) if is_it(&event.kind) => return event.kind,
                    Received::Event(_) => {}
                    other => panic!("{what}: {other:?}"),
                }
            }
        };
        timeout(PATIENCE, wait).await.unwrap_or_else(|_| panic!("{what}: it did not happen"))
    }

    /// The events so far.
    pub async fn events_so_far(&mut self) -> Vec<EventKind> {
        let mut events = Vec::new();
        while let Ok(Received::Event(event)) = timeout(Duration::ZERO, self.events.recv()).await {
            events.push(event.kind);
        }
        events
    }

    /// Brings the one motor to a frequency.
    ///
    /// # Panics
    /// When that is not confirmed.
    pub async fn run_at(&self, hertz: u16) {
        let motor = self.motor();
        motor.ready(PATIENCE).await.expect("it gets ready");
        let outcome = motor.run(drive_core::Direction::Forward, Frequency::from_hertz(hertz)).await;
        assert!(outcome.is_confirmed(), "{outcome}");
        // Where no bit tells it, it counts as reached a little before.
        let output = i32::from(hertz) * 100;
        assert!(self.machine().observe().output_frequency.abs_diff(output) <= 50);
        self.machine().wait_until(|machine| machine.output_frequency == output).await;
    }

    /// Requests of this machine that wrote something.
    #[must_use]
    pub fn writes(machine: &SimSlave) -> u64 {
        machine.requests(0x06) + machine.requests(0x10)
    }
}
