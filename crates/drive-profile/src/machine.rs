//! A simulated drive from a profile: it does what the profile says, so that it proves that the profile agrees with itself, and not that it
//! is true.

mod bits;
mod model;
mod obeys;
mod shows;

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use drive_core::{Direction, Frequency};
use drive_sim::{Motor, Nameplate, Ramp, Ramps, Rules, Surroundings};

use crate::{
    format::{Register, Space},
    profile::Profile,
    scale::hundredths,
    written::Written,
};

/// What 100 % is on a simulated drive that counts in percent: its owner is to say so.
pub const FULL_SCALE: Frequency = Frequency::from_hertz(50);

/// Both ramps, measured to 50 Hz.
const RAMP: Ramp = Ramp { full_scale: 5_000, time: Duration::from_secs(3) };
/// The short ramp.
const FAST: Ramp = Ramp { full_scale: 5_000, time: Duration::from_secs(1) };

/// What the code of a trip is on a drive that tells none.
const NO_CODE: u16 = 1;

/// Registers, coils and inputs by their places.
type Cells = BTreeMap<(Space, u16), u16>;

/// A drive of a profile as somebody beside it sees it.
#[derive(Debug, Clone)]
pub struct Machine {
    profile: Arc<Profile>,
    rules: Rules,
    surroundings: &'static Surroundings,
    /// What was written, by its place.
    kept: Cells,
    /// The bits that the profile names of what commands it: another does nothing, whoever sets it.
    named: Arc<Cells>,
    motor: Motor,
    /// The run command that is in force.
    order: Option<Direction>,
    ramp: Ramp,
    fault: Option<u16>,
    local: bool,
    panel_runs: bool,
    panel_reference: Frequency,
    powered: bool,
    supplied: bool,
}

impl Machine {
    /// One that the bus commands. What is around it lives as long as the program: clone one rather than make several.
    #[must_use]
    pub fn new(profile: Arc<Profile>) -> Self {
        let claims = profile.capabilities();
        let rules = Rules {
            read_holding: claims.read_words,
            read_input: 0,
            write_single: claims.functions.contains(&6),
            write_multiple: if claims.functions.contains(&16) { claims.write_words } else { 0 },
            diagnostics: &[],
            event_counter: false,
            broadcast: &[],
            turnaround: Duration::from_millis(4),
        };
        let around = Surroundings {
            family: claims.key,
            trips: profile.fault_entries(),
            rows: claims.rows,
            ..Surroundings::NONE
        };
        Self {
            rules,
            surroundings: Box::leak(Box::new(around)),
            kept: BTreeMap::new(),
            named: Arc::new(named(&profile)),
            motor: Motor::new(Nameplate {
                nominal_frequency: FULL_SCALE.centihertz(),
                ..Nameplate::light(24)
            }),
            order: None,
            ramp: RAMP,
            fault: None,
            local: false,
            panel_runs: false,
            panel_reference: Frequency::ZERO,
            powered: true,
            supplied: true,
            profile,
        }
    }

    /// One that its panel commands.
    #[must_use]
    pub fn at_the_panel(mut self) -> Self {
        self.local = true;
        self
    }

    /// The register of a place: also where it is the second of two words.
    fn register(&self, (space, address): (Space, u16)) -> Option<&Register> {
        let file = self.profile.file();
        let has = |register: &&Register| {
            let Some((of, first)) = file.place(register) else { return false };
            let second = if crate::drive::is_double(register) { first.checked_add(1) } else { None };
            of == space && (first == address || second == Some(address))
        };
        file.register.values().map(crate::format::Spanned::get_ref).find(has)
    }

    fn ordered(&self) -> Option<Direction> {
        let runs = self.powered && self.supplied && self.fault.is_none();
        let order = if self.local { self.panel_runs.then_some(Direction::Forward) } else { self.order };
        order.filter(|_| runs)
    }

    /// The setpoint of the bus, in hundredths of a hertz.
    fn setpoint(&self) -> i64 {
        let file = self.profile.file();
        let name = file.setpoint.given().map(|setpoint| setpoint.get_ref().register.get_ref());
        let Some(register) = name.and_then(|name| file.named(name)) else { return 0 };
        let held = file.place(register).and_then(|place| self.kept.get(&place)).copied().unwrap_or(0);
        // A drive whose setpoint is its run command turns round by its sign; the run command says so already.
        let counts = if register.signed { i64::from(held.cast_signed()).abs() } else { held.into() };
        self.hertz(register).map_or(0, |[numerator, denominator]| hundredths(counts, numerator, denominator))
    }

    fn target(&self) -> i32 {
        let counts = if self.local { i64::from(self.panel_reference.centihertz()) } else { self.setpoint() };
        let counts = i32::try_from(counts).unwrap_or(0);
        if self.ordered() == Some(Direction::Reverse) { -counts } else { counts }
    }

    fn steer(&mut self) {
        if !self.powered || !self.supplied || self.fault.is_some() {
            self.motor.freewheel();
        } else if self.ordered().is_some() {
            self.motor.run(self.target(), Ramps { acceleration: RAMP, deceleration: RAMP });
        } else {
            self.motor.ramp_to_rest(self.ramp);
        }
    }
}

/// The bits that a profile names of each place at which its drive is commanded.
fn named(profile: &Profile) -> Cells {
    let file = profile.file();
    let runs = file.command.given().into_iter().flat_map(|command| &command.get_ref().runs);
    let mut named: Cells = BTreeMap::new();
    for run in runs.map(crate::format::Spanned::get_ref) {
        let place = file.named(run.register.get_ref()).and_then(|register| file.place(register));
        named.extend(
            place.map(|place| (place, named.get(&place).copied().unwrap_or(0) | *run.mask.get_ref())),
        );
    }
    let rungs = file.start.ladder.given().into_iter().flatten().map(crate::format::Spanned::get_ref);
    let rungs = rungs.filter_map(|rung| {
        let (space, address) = file.place(file.named(rung.register.as_ref()?.get_ref())?)?;
        Some(Written { space, address, value: rung.word? })
    });
    for written in file.actions().flat_map(|(_, action)| file.writes(action.get_ref())).chain(rungs) {
        // Where no bit of a register runs the motor, the whole word counts.
        if let Some(bits) = named.get_mut(&(written.space, written.address)) {
            *bits |= written.value;
        }
    }
    named
}
