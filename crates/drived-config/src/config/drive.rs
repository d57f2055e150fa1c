//! `[[drives]]` and `[defaults]`: the table of what a drive is told, and the settings that come of it.

mod told;

use std::{collections::BTreeMap, ops::Range};

use drive_core::{StopMode, WatchdogCapability};
use drive_families::Options;
use drive_fleet::{
    Commanders, DriveSettings, OnExit, OnExitAdopted, OnFault, OnLoss, WatchdogContract, check_settings,
};
use toml::Spanned;

use super::{
    ConfigError,
    place::Source,
    table::{Entry, settings},
    values::{
        AdoptedPolicy, AlarmsEntry, ExitPolicy, FaultPolicy, FrequencyEntry, LackValue, LossPolicy,
        OptionValue, Parsed, TakenPolicy, WatchdogEntry, WatchdogPolicy,
    },
};
use drived_words::{
    drive_spec::{DriveName, DriveSpec},
    duration::Time,
};

/// The settings of a drive while they are read.
pub struct Draft {
    settings: DriveSettings,
    /// How the policies stop.
    stop_mode: StopMode,
}

settings! {
    /// `[[drives]]`, and `[defaults]` without the first four.
    DriveEntry sets Draft;

    /// the name of its line
    line: String = "must be given";
    /// one drive or several, such as `"atv312@1-31"`
    drive: Parsed<DriveSpec> = "must be given";
    /// its name; `{}` stands for the address
    name: String = "line and address";
    /// whether its family is a guess, which nobody has compared with the nameplate: the page says so before control of it is taken
    guessed: bool = "`false`";
    /// its number, from 0, in the [virtual unit](gateway.md#the-virtual-unit); of several drives that of the first, and the others follow
    slot: u16 = "the next that nobody has had";
    /// whether it may be commanded; otherwise it is only read
    control: bool = "`false`",
        |to, said| to.settings.control = *said,
        tells "commands" told::commands;
    /// who may command it, a list of names; anybody may stop it
    commanders: Vec<String> = "anyone",
        acts(_),
        |to, said| to.settings.commanders = Commanders::Only(said.clone());
    /// from one status to the next while the motor runs
    running: Parsed<Time> = "`\"500ms\"` ¹",
        |to, said| to.settings.periods.running = said.0.0,
        tells "status" told::status;
    /// the same while it is at rest
    rest: Parsed<Time> = "`\"1s\"` ¹", |to, said| to.settings.periods.rest = said.0.0;
    /// from one set of measurements to the next; `"0"`: never
    slow: Parsed<Time> = "`\"10s\"` ¹",
        |to, said| to.settings.periods.slow = said.0.0,
        tells "measurements" told::measurements;
    /// an older status is stale, and the drive counts as lost; so it does as soon as its line has asked it in vain often enough
    max_age: Parsed<Time> = "`\"3s\"` ¹", |to, said| to.settings.periods.max_age = said.0.0;
    /// `{ time = "10s", reaction = "ramp" }`: the drive's own communication watchdog, armed at standstill, verified and fed.
    /// Reactions: `ramp`, `fast`, `freewheel`, `dc-injection`, `trip`, as far as the family has them. In `[defaults]` it holds
    /// for the families whose watchdog the bus can set
    watchdog: WatchdogEntry = "left as it is found",
        acts(_),
        |to, said| to.settings.watchdog =
            Some(WatchdogContract { timeout: said.time.0.0, reaction: said.reaction.0.0 }),
        tells "watchdog" told::watchdog;
    /// `{ low = 20, high = 48.5, forbidden = [[30, 32]], change_per_second = 2 }`: setpoints outside or within a forbidden band,
    /// whose edges are allowed, are refused, and while the motor turns those that are further from the last one than
    /// `change_per_second` hertz for each second since; an output more than 5 % above `high`, whoever has given it, is an alarm
    /// (`limit_exceeded`)
    frequency: FrequencyEntry = "the drive's own limits",
        acts(_),
        |to, said| to.settings.limits = said.limits(),
        tells "setpoints" told::setpoints;
    /// `{ current = 12.5, drive_thermal = 100, motor_thermal = 110 }`: an event above it; it stops nothing
    alarms: AlarmsEntry = "none",
        |to, said| to.settings.alarms = said.alarms(),
        tells "alarms" told::alarms;
    /// how `on_exit`, `on_exit_adopted` and `on_loss` stop: `ramp`, `fast`, `freewheel`, `dc-injection`
    stop_mode: Parsed<StopMode> = "`ramp`",
        acts(_),
        |to, said| to.stop_mode = said.0;
    /// `stop` (what this program started), `release` (that, and control back to panel or terminals), `leave`. A stop that is
    /// under way is ended first in any case. `leave` is refused together with `watchdog`, which would trip the motor
    on_exit: Parsed<ExitPolicy> = "`stop`",
        acts(Parsed(ExitPolicy(OnExit::Stop(_) | OnExit::Release(_)))),
        |to, said| to.settings.on_exit = said.0.0,
        tells "at the exit" told::at_exit;
    /// what happens at the exit to a motor that turns and was not started here: `report` (left, an alarm, exit code 1), `stop`,
    /// `leave`
    on_exit_adopted: Parsed<AdoptedPolicy> = "`report`",
        acts(Parsed(AdoptedPolicy(OnExitAdopted::Stop(_)))),
        |to, said| to.settings.on_exit_adopted = said.0.0,
        tells "turning then" told::turning_at_exit;
    /// what happens at the exit to the watchdog of a drive that stands: `restore-in-ram` (put back where that writes to no
    /// EEPROM), `restore` (always), `leave` (stays armed)
    on_exit_watchdog: Parsed<WatchdogPolicy> = "`restore-in-ram`",
        acts(_),
        |to, said| to.settings.on_exit_watchdog = said.0.0,
        tells "its watchdog then" told::watchdog_at_exit;
    /// `report`, or `stop` as soon as the drive is there again, where there was no status for `max_age`
    on_loss: Parsed<LossPolicy> = "`report`",
        acts(Parsed(LossPolicy(OnLoss::Stop(_)))),
        |to, said| to.settings.on_loss = said.0.0,
        tells "when lost" told::when_lost;
    /// `report`, or `reset-watchdog-trip`: such a trip is reset once when the line is back
    on_fault: Parsed<FaultPolicy> = "`report`",
        acts(Parsed(FaultPolicy(OnFault::ResetWatchdogTrip))),
        |to, said| to.settings.on_fault = said.0.0,
        tells "when tripped" told::when_tripped;
    /// when panel, terminals or another bus take control of a drive that runs by our command: `withdraw` the run command, so
    /// that nothing starts by it when they give control back, or `report`
    on_control_taken: Parsed<TakenPolicy> = "`withdraw`",
        acts(_),
        |to, said| to.settings.on_control_taken = said.0.0,
        tells "control taken" told::control_taken;
    /// the settings of the drive, by their mnemonics, by which it may start again by itself, such as `["Atr"]`; with any other
    /// one a start is refused
    accept_self_restart: Vec<String> = "none",
        acts(_),
        |to, said| to.settings.accept_self_restart.clone_from(said),
        tells "starts by itself" told::self_restart;
    /// what a run command may lack for a while and then act again by itself: `output` (a stop input, a freewheel input, no
    /// mains), `reference`, `command`. Whatever else keeps it from acting has it withdrawn, so that nothing starts by it later
    accept_resume: Vec<Parsed<LackValue>> = "none",
        acts(_),
        |to, said| to.settings.accept_resume = said.iter().map(|lack| lack.0.0).collect(),
        tells "cut off" told::resume;
    /// how long the motor coasts at the most when its output is cut, was not there when it was first seen or behind a lost line, or
    /// was gone sooner than the drive is known to come down (a 28 or 58 from 50 Hz: 3 s); until then it is not told to be at rest.
    /// Without it "the shaft may coast" stands until the motor is driven again
    coast: Parsed<Time> = "none",
        |to, said| to.settings.coast = Some(said.0.0),
        tells "coasts" told::coasts;
    /// how long direct current takes to bring the motor to rest, up to 30 s: for so long a `dc-injection` stop holds it, unless it
    /// says for how long itself (`injection_ms`)
    injection: Parsed<Time> = "5 s",
        acts(_),
        |to, said| to.settings.injection = Some(said.0.0),
        tells "injection" told::injection;
    /// `{ fault-reset-function = 5 }`: what only you know of the drive, as `--option`. In `[defaults]` they hold for the drives
    /// of the option's family
    options: BTreeMap<Spanned<String>, Spanned<OptionValue>> = "none",
        tells "options" told::options;
}

impl DriveEntry {
    /// Whether it says how often a drive is asked.
    pub(super) fn has_periods(&self) -> bool {
        [&self.running, &self.rest, &self.slow, &self.max_age].into_iter().any(Option::is_some)
    }

    fn options(&self) -> impl Iterator<Item = (&Spanned<String>, &Spanned<OptionValue>)> {
        self.options.iter().flat_map(Spanned::get_ref)
    }
}

/// The option by which the owner of a drive by file says how its communication watchdog is set.
const WATCHDOG_TIME: &str = "watchdog-time";

/// The settings of one drive: what its entry says, else the defaults, else what holds anyway.
pub(super) fn settings(
    source: Source<'_>,
    entry: &DriveEntry,
    defaults: &DriveEntry,
    drive: DriveName,
    of: usize,
    capability: Option<WatchdogCapability>,
) -> Result<DriveSettings, ConfigError> {
    let settings = DriveSettings::watched(name(source, entry, drive, of)?);
    let mut draft = Draft { settings, stop_mode: StopMode::Ramp };
    defaults.set(source, &mut draft)?;
    if !capability.is_some_and(|watchdog| watchdog.settable) {
        // A default holds for the families whose watchdog the bus can set; what an entry says itself has to fit.
        draft.settings.watchdog = None;
    }
    entry.set(source, &mut draft)?;
    let Draft { mut settings, stop_mode } = draft;
    if let OnExit::Stop(mode) | OnExit::Release(mode) = &mut settings.on_exit {
        *mode = stop_mode;
    }
    if let OnExitAdopted::Stop(mode) = &mut settings.on_exit_adopted {
        *mode = stop_mode;
    }
    if let OnLoss::Stop(mode) = &mut settings.on_loss {
        *mode = stop_mode;
    }
    let place = |key: &str| entry.place(key).or_else(|| defaults.place(key));
    let refuse = |place: Option<Range<usize>>, problem: String| {
        let place = place.or_else(|| entry.place("drive")).unwrap_or_default();
        Err(source.error(place, format_args!("{}: {problem}", settings.name.escape_debug())))
    };
    let capabilities = drive.family.capabilities();
    if let Err(problem) = check_settings(&settings, capabilities, capability) {
        let keys: &[&str] = match problem.setting {
            "limits" => &["frequency"],
            "periods" => &["max_age", "running", "rest", "slow"],
            _ => std::slice::from_ref(&problem.setting),
        };
        // Of a drive by file it is set at the drive, and its owner says to what.
        let instead = (problem.setting == "watchdog" && drive.family.has_option(WATCHDOG_TIME)).then(|| {
            format!(
                ": set it at the drive, and say here to what, so that it is asked often enough: expected options = {{ {WATCHDOG_TIME} = \"2s\" }}"
            )
        });
        let problem_told = format!("{problem}{}", instead.unwrap_or_default());
        return refuse(keys.iter().find_map(|key| place(key)), problem_told);
    }
    if !settings.control {
        return match entry.said().into_iter().find(|said| said.acts) {
            Some(said) => {
                let problem = format_args!(
                    "{} without control = true: {} is only read, and nothing would act",
                    said.key,
                    settings.name.escape_debug()
                );
                Err(source.error(said.at, problem))
            }
            None => Ok(settings),
        };
    }
    let mode = place("stop_mode").filter(|_| !capabilities.stop_modes.contains(&stop_mode));
    if mode.is_some() {
        let has: Vec<String> = capabilities.stop_modes.iter().map(ToString::to_string).collect();
        let (family, has) = (capabilities.name, has.join(", "));
        return refuse(mode, format!("{family} has no {stop_mode} stop: expected one of {has}"));
    }
    if let (OnExit::Leave, Some(contract)) = (settings.on_exit, settings.watchdog) {
        let problem = format!(
            "a motor that is left at the exit would be tripped by its watchdog {:?} later: expected on_exit = \
             \"stop\" or \"release\", or no watchdog",
            contract.timeout
        );
        return refuse(place("on_exit"), problem);
    }
    Ok(settings)
}

/// The name of one drive of an entry: `{}` stands for its address.
fn name(source: Source<'_>, entry: &DriveEntry, drive: DriveName, of: usize) -> Result<String, ConfigError> {
    let address = drive.slave.to_string();
    match &entry.name {
        Some(name) if of > 1 && !name.get_ref().contains("{}") => Err(source
            .error(name.span(), format_args!("{of} drives have this name: expected {{}} for the address"))),
        Some(name) => Ok(name.get_ref().replace("{}", &address)),
        None => {
            let line = entry.line.as_ref().map_or("", |line| line.get_ref().as_str());
            Ok(format!("{line} {address}"))
        }
    }
}

/// The options of one drive: what its entry says, else the defaults of its family.
pub(super) fn options(
    source: Source<'_>,
    entry: &DriveEntry,
    defaults: &DriveEntry,
    drive: DriveName,
) -> Result<Options, ConfigError> {
    let mut own = Options::default();
    for (name, value) in entry.options() {
        let set = own.set(name.get_ref(), &value.get_ref().0);
        set.map_err(|error| source.error(value.span(), error))?;
        let checked = own.check(drive.family);
        checked.map_err(|error| source.error(name.span(), format_args!("{drive}: {error}")))?;
    }
    let mut said = Options::default();
    for (name, value) in defaults.options() {
        let set = said.set(name.get_ref(), &value.get_ref().0);
        set.map_err(|error| source.error(value.span(), error))?;
    }
    said = said.of(drive.family);
    said.extend(own);
    Ok(said)
}
