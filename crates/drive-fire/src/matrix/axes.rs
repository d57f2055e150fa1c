//! What a cell is made of besides the fault of the wire: drives, ways to them, what stands between, what is asked, what happens.

use std::{
    fmt,
    sync::{Arc, OnceLock},
    time::Duration,
};

use drive_core::{Direction, StopMode, registers::Storage};
use drive_families::{Family, SetUp};
use drive_profile::{definition, shipped};
use drive_sim::Surroundings;

use super::Untold;

/// The profiles whose drives reach motion and have a simulated twin.
const PROFILES: [&str; 5] = ["danfoss-fc", "goodrive", "ig5a", "v20", "g120"];

/// Whose drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Subject(usize);

impl Subject {
    /// How many there are.
    pub const COUNT: usize = Family::BUILT_IN.len() + PROFILES.len();

    /// The one of this number.
    #[must_use]
    pub const fn of(number: usize) -> Self {
        Self(number)
    }

    /// Its family.
    ///
    /// # Panics
    /// When a profile that is shipped is not there.
    #[must_use]
    pub fn family(self) -> Family {
        static FAMILIES: OnceLock<Vec<Family>> = OnceLock::new();
        let all = FAMILIES.get_or_init(|| {
            let of_profile = |key: &&str| {
                let profile = shipped::find(key).unwrap_or_else(|| panic!("{key} is shipped"));
                Family::new(definition(&Arc::new(profile.clone())))
            };
            Family::BUILT_IN.into_iter().chain(PROFILES.iter().map(of_profile)).collect()
        });
        all[self.0]
    }

    /// What is around its drives.
    pub(super) fn around(self) -> &'static Surroundings {
        static AROUND: OnceLock<Vec<&'static Surroundings>> = OnceLock::new();
        let all = AROUND.get_or_init(|| {
            let of = |number| {
                Self(number)
                    .family()
                    .machine(SetUp::ForTheBus)
                    .map_or(&Surroundings::NONE, |machine| machine.surroundings())
            };
            (0..Self::COUNT).map(of).collect()
        });
        all[self.0]
    }

    /// Why its drives do not speak this, if they do not.
    #[must_use]
    pub fn impossible_on(self, way: Way) -> Option<&'static str> {
        let spoken = match way {
            Way::Ascii => "ascii",
            Way::UniTelway => "unitelway",
            _ => "rtu",
        };
        let speaks = self.family().capabilities().protocols.contains(&spoken);
        (!speaks).then_some("the drive does not speak the protocol")
    }
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.family().fmt(f)
    }
}

/// How a drive is reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Way {
    /// Modbus RTU on a wire.
    Rtu,
    /// Modbus ASCII on a wire.
    Ascii,
    /// UNI-TELWAY on a wire.
    UniTelway,
    /// Modbus RTU through a serial server.
    RtuOverTcp,
    /// Modbus TCP through a gateway.
    ModbusTcp,
}

impl Way {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Rtu, Self::Ascii, Self::UniTelway, Self::RtuOverTcp, Self::ModbusTcp];

    /// Whether a network stands between.
    #[must_use]
    pub const fn is_network(self) -> bool {
        matches!(self, Self::RtuOverTcp | Self::ModbusTcp)
    }
}

impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rtu => "RTU",
            Self::Ascii => "ASCII",
            Self::UniTelway => "UNI-TELWAY",
            Self::RtuOverTcp => "RTU over TCP",
            Self::ModbusTcp => "Modbus TCP",
        })
    }
}

/// What stands between, or sits beside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FarEnd {
    /// Nothing strange.
    Plain,
    /// What answers sooner than its speed allows.
    Fast,
    /// A second drive at the same address.
    Twins,
    /// A second master that asks the same drive for the same, heard whole.
    SecondMaster,
    /// A gateway that serves one request after the other, waits three seconds for the dead and says so.
    Serialising,
    /// One that says nothing.
    Silent,
    /// One that answers a read that it has answered within a second from what it has kept.
    Caching,
    /// One that gives its last answers once more to whoever connects.
    Replaying,
    /// One that gives each answer twice.
    Doubling,
    /// One whose connections go mute after a while.
    GoesMute,
    /// A second master that asks the same drive for the same, of which the drive's answers alone are heard: a bus of four wires.
    MasterHeardInAnswers,
    /// The same, of which its questions alone are heard: the cable is too bad for what it is answered.
    MasterHeardInQuestions,
}

impl FarEnd {
    /// So many of [`ALL`](Self::ALL) stand on each plane but the last; the others, which came later, on that alone: a number stays
    /// the cell that it was.
    pub const FIRST: usize = 10;

    /// All of them.
    pub const ALL: [Self; 12] = [
        Self::Plain,
        Self::Fast,
        Self::Twins,
        Self::SecondMaster,
        Self::Serialising,
        Self::Silent,
        Self::Caching,
        Self::Replaying,
        Self::Doubling,
        Self::GoesMute,
        Self::MasterHeardInAnswers,
        Self::MasterHeardInQuestions,
    ];

    /// Whether a second master sits on the line.
    #[must_use]
    pub const fn has_second_master(self) -> bool {
        matches!(self, Self::SecondMaster | Self::MasterHeardInAnswers | Self::MasterHeardInQuestions)
    }

    /// What comes of it, where a fault has `struck` besides, and cannot be told from what is right.
    #[must_use]
    pub fn untold(self, way: Way, struck: bool) -> Option<Untold> {
        match self {
            Self::Caching => {
                Some(Untold::own_words("a gateway that answers from what it has kept tells no age"))
            }
            Self::Twins => Some(Untold::anything("two that answer as one")),
            Self::Doubling if way == Way::RtuOverTcp => {
                Some(Untold::value("the first answer that comes twice, to a read that cannot differ"))
            }
            Self::SecondMaster if struck => Some(Untold::value(
                "the answer to a second master is struck, of which nobody knows any more whose it is",
            )),
            Self::MasterHeardInAnswers => Some(Untold::answer_to_another(
                "an answer to a second master that is not heard itself comes while one of this length is waited for",
            )),
            _ => None,
        }
    }

    /// Why it is not on this way.
    #[must_use]
    pub fn impossible_on(self, way: Way) -> Option<&'static str> {
        let is_on_the_wire = matches!(self, Self::Fast | Self::Twins) || self.has_second_master();
        match (self, way.is_network()) {
            (Self::Plain, _) => None,
            (_, true) if is_on_the_wire => {
                Some("what sits beside a wire is behind the gateway, which answers for it")
            }
            (_, false) if self.has_second_master() && way == Way::UniTelway => {
                Some("UNI-TELWAY has one master by its rules")
            }
            (_, false) if is_on_the_wire => None,
            (_, false) => Some("a wire has no gateway"),
            (_, true) => None,
        }
    }
}

impl fmt::Display for FarEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Plain => "nothing between",
            Self::Fast => "faster than its speed",
            Self::Twins => "two at its address",
            Self::SecondMaster => "a second master",
            Self::Serialising => "serialising gateway",
            Self::Silent => "silent gateway",
            Self::Caching => "caching gateway",
            Self::Replaying => "replaying gateway",
            Self::Doubling => "doubling gateway",
            Self::GoesMute => "connections go mute",
            Self::MasterHeardInAnswers => "a second master heard in its answers alone",
            Self::MasterHeardInQuestions => "a second master heard in its questions alone",
        })
    }
}

/// What is asked of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Operation {
    /// `status`.
    Status,
    /// `measurements`.
    Measurements,
    /// `faults`.
    Faults,
    /// `identify`.
    Identify,
    /// `keep_alive`.
    KeepAlive,
    /// `start`.
    Start(Direction),
    /// `set_setpoint`.
    Setpoint,
    /// `stop`.
    Stop(StopMode),
    /// `reset_faults`, of a trip.
    Reset,
    /// `release`.
    Release,
    /// `withdraw`.
    Withdraw,
    /// `read_parameter`.
    ReadParameter,
    /// `write_parameter`.
    WriteParameter,
    /// `persist`.
    Persist,
    /// `watchdog`.
    Watchdog,
    /// `arm_watchdog`.
    ArmWatchdog,
}

impl Operation {
    /// All of them.
    pub const ALL: [Self; 20] = [
        Self::Status,
        Self::Measurements,
        Self::Faults,
        Self::Identify,
        Self::KeepAlive,
        Self::Start(Direction::Forward),
        Self::Start(Direction::Reverse),
        Self::Setpoint,
        Self::Stop(StopMode::Ramp),
        Self::Stop(StopMode::Fast),
        Self::Stop(StopMode::Freewheel),
        Self::Stop(StopMode::DcInjection),
        Self::Reset,
        Self::Release,
        Self::Withdraw,
        Self::ReadParameter,
        Self::WriteParameter,
        Self::Persist,
        Self::Watchdog,
        Self::ArmWatchdog,
    ];

    /// Why it cannot be asked of this drive, or cannot happen to it, if it cannot.
    #[must_use]
    pub fn impossible_for(self, subject: Subject, runs: bool) -> Option<&'static str> {
        let family = subject.family();
        let claims = family.capabilities();
        match self {
            Self::Reset if runs => Some("a drive that has tripped does not run"),
            Self::Reset if family.simulated_trip().is_none() => Some("no trip is known that a reset clears"),
            Self::Persist if claims.persist.is_none() => Some("the drive has nothing to save"),
            Self::Release if !claims.release => Some("the drive cannot give control back"),
            Self::Watchdog | Self::ArmWatchdog if claims.watchdog.is_none() => {
                Some("the drive has no watchdog")
            }
            Self::ArmWatchdog if claims.watchdog.is_some_and(|own| !own.settable) => {
                Some("the drive's watchdog cannot be set")
            }
            Self::WriteParameter | Self::ReadParameter if parameter(subject).is_none() => {
                Some("the drive has no parameter that moves no control")
            }
            _ => None,
        }
    }
}

impl fmt::Display for Operation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start(direction) => write!(f, "start {direction}"),
            Self::Stop(mode) => write!(f, "stop by {mode}"),
            Self::Status => f.write_str("status"),
            Self::Measurements => f.write_str("measurements"),
            Self::Faults => f.write_str("faults"),
            Self::Identify => f.write_str("identify"),
            Self::KeepAlive => f.write_str("keep-alive"),
            Self::Setpoint => f.write_str("setpoint"),
            Self::Reset => f.write_str("reset"),
            Self::Release => f.write_str("release"),
            Self::Withdraw => f.write_str("withdraw"),
            Self::ReadParameter => f.write_str("read a parameter"),
            Self::WriteParameter => f.write_str("write a parameter"),
            Self::Persist => f.write_str("save"),
            Self::Watchdog => f.write_str("watchdog"),
            Self::ArmWatchdog => f.write_str("arm the watchdog"),
        }
    }
}

/// A parameter of the drive that moves no control: its acceleration.
pub(super) fn parameter(subject: Subject) -> Option<&'static drive_core::registers::Row> {
    let rows = subject.family().capabilities().rows;
    ["ACC", "n20"]
        .iter()
        .find_map(|code| rows.iter().find(|row| row.code.eq_ignore_ascii_case(code)))
        .filter(|row| row.access.is_writable() && row.storage != Storage::Volatile)
}

/// What somebody may set at the keypad of a drive that stands, so that its command words do something else from then on.
pub(super) fn settings(subject: Subject) -> &'static [&'static str] {
    match subject.family().capabilities().key {
        // A preset speed on bit 12 of CMD, another ramp on bit 11; no fast stop on bit 14; a normal stop that is a freewheel (BBV51701 p. 38 to 42).
        "atv312" => &["PS2 172", "rPS 171", "FSt 0", "Stt 2"],
        // The reference by the keypad, the command by the terminals (Modbus guide, 6.2).
        "atv21" => &["FMOD 3", "CMOD 0"],
        // No reverse (5.3).
        "3g3ev" => &["n05 1"],
        // Reference and run command by the terminals (B7 p. 342).
        "wj200" | "mx2" => &["A001 1", "A002 1"],
        _ => &[],
    }
}

/// What happens to the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Event {
    /// Nothing.
    Nothing,
    /// Its supply goes and comes back.
    PowerCycle,
    /// Its supply goes.
    PowerOff,
    /// It trips.
    Trip,
    /// Its cable is cut for four seconds, in which its watchdog may trip it.
    CableCut,
    /// The panel takes control.
    PanelTakes,
    /// The panel takes control and gives it back.
    PanelTakesAndGives,
    /// The panel takes control and runs the motor at another speed.
    PanelRuns,
    /// Somebody presses STOP.
    PanelStops,
    /// Somebody presses RESET.
    PanelResets,
    /// The supply of the power stage goes.
    OutputCut,
    /// It goes and comes back.
    OutputCutAndGiven,
    /// Its input of this number closes.
    InputCloses(u8),
    /// Its input of this number closes and opens.
    InputPulses(u8),
    /// Its first analog input goes to 60 %.
    Analog,
    /// A parameter is changed behind our back.
    ParameterChanged,
}

impl Event {
    /// All of them.
    pub const ALL: [Self; 21] = [
        Self::Nothing,
        Self::PowerCycle,
        Self::PowerOff,
        Self::Trip,
        Self::CableCut,
        Self::PanelTakes,
        Self::PanelTakesAndGives,
        Self::PanelRuns,
        Self::PanelStops,
        Self::PanelResets,
        Self::OutputCut,
        Self::OutputCutAndGiven,
        Self::InputCloses(0),
        Self::InputCloses(1),
        Self::InputCloses(2),
        Self::InputCloses(3),
        Self::InputPulses(0),
        Self::InputPulses(1),
        Self::InputPulses(2),
        Self::Analog,
        Self::ParameterChanged,
    ];

    /// Why it cannot be asked of this drive, or cannot happen to it, if it cannot.
    #[must_use]
    pub fn impossible_for(self, subject: Subject) -> Option<&'static str> {
        let around = subject.around();
        match self {
            Self::InputCloses(number) | Self::InputPulses(number)
                if usize::from(number) >= around.terminals.len() =>
            {
                Some("the simulated drive has no such input")
            }
            Self::Analog if around.analog_inputs.is_empty() => Some("the simulated drive has no such input"),
            Self::Trip if subject.family().simulated_trip().is_none() => {
                Some("no trip is known that a reset clears")
            }
            Self::ParameterChanged if parameter(subject).is_none() => {
                Some("the drive has no parameter that moves no control")
            }
            _ => None,
        }
    }

    /// What happens, as lines of the simulator's text without the drive's name, and what happens so much later.
    pub(super) fn deeds(self, subject: Subject) -> (Vec<String>, Option<(Duration, String)>) {
        let around = subject.around();
        let one = |deed: &str| (vec![deed.to_owned()], None);
        let then = |deed: &str, ms, later: &str| {
            (vec![deed.to_owned()], Some((Duration::from_millis(ms), later.to_owned())))
        };
        let input = |number: u8| around.terminals.get(usize::from(number)).copied().unwrap_or_default();
        match self {
            Self::Nothing => (Vec::new(), None),
            Self::PowerCycle => then("power off", 1_500, "power on"),
            Self::PowerOff => one("power off"),
            Self::Trip => one(&format!("trip {}", subject.family().simulated_trip().unwrap_or_default())),
            Self::CableCut => then("cable cut", 4_000, "cable join"),
            Self::PanelTakes => one("panel takes"),
            Self::PanelTakesAndGives => then("panel takes", 1_500, "panel releases"),
            Self::PanelRuns => {
                (["panel takes", "panel reference 35Hz", "panel run"].map(str::to_owned).to_vec(), None)
            }
            Self::PanelStops => one("panel stop"),
            Self::PanelResets => one("panel reset"),
            Self::OutputCut => one("motor-supply off"),
            Self::OutputCutAndGiven => then("motor-supply off", 1_500, "motor-supply on"),
            Self::InputCloses(number) => one(&format!("terminal {} on", input(number))),
            Self::InputPulses(number) => then(
                &format!("terminal {} on", input(number)),
                400,
                &format!("terminal {} off", input(number)),
            ),
            Self::Analog => {
                one(&format!("analog {} 60%", around.analog_inputs.first().copied().unwrap_or_default()))
            }
            Self::ParameterChanged => {
                one(&format!("set {} 37", parameter(subject).map_or("", |row| row.code)))
            }
        }
    }

    /// Whether the drive hears nothing any more.
    pub(super) const fn silences(self) -> bool {
        matches!(self, Self::PowerOff)
    }

    /// Whether its drive hears nothing then, or for a while.
    pub(super) const fn deafens(self) -> bool {
        matches!(self, Self::PowerOff | Self::PowerCycle | Self::CableCut)
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nothing => f.write_str("nothing"),
            Self::PowerCycle => f.write_str("power cycle"),
            Self::PowerOff => f.write_str("power off"),
            Self::Trip => f.write_str("trip"),
            Self::CableCut => f.write_str("cable cut for 4 s"),
            Self::PanelTakes => f.write_str("panel takes"),
            Self::PanelTakesAndGives => f.write_str("panel takes and gives"),
            Self::PanelRuns => f.write_str("panel runs"),
            Self::PanelStops => f.write_str("panel STOP"),
            Self::PanelResets => f.write_str("panel RESET"),
            Self::OutputCut => f.write_str("output cut"),
            Self::OutputCutAndGiven => f.write_str("output cut and given"),
            Self::InputCloses(number) => write!(f, "input {number} closes"),
            Self::InputPulses(number) => write!(f, "input {number} pulses"),
            Self::Analog => f.write_str("analog input at 60 %"),
            Self::ParameterChanged => f.write_str("parameter changed"),
        }
    }
}
