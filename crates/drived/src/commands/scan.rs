//! `drived scan`: which addresses of a line answer, and which family is likely there.

use std::{collections::BTreeMap, time::Duration};

use drive_bus::{Line, LineConfig, SlaveSettings};
use drive_core::{Drive, Error, Identity, PortError, SlaveAddress};
use drive_families::Family;
use drive_fleet::LineBudget;

use crate::{
    drive_spec::{Addresses, DriveName},
    duration::Time,
    failure::Failure,
    line_spec::{self, LineSpec},
    one_drive, output,
    signals::Ending,
};

/// Exceptions of a gateway: no path to the slave, and no answer from it (Modbus Application Protocol V1.1b3, section 7).
const GATEWAY: [u8; 2] = [0x0A, 0x0B];

/// Exchanges that a drive which answers is looked at with, at the most: the statuses and identities of all families.
const LOOKS: u32 = 25;

/// Find out which addresses of a line answer, and which family is likely there; nothing is written
///
/// Each address is asked for one register; whoever answers, even by refusing, is read as each family would be. Speed and
/// format have to be right. **A drive whose communication watchdog is armed may begin to expect messages by the first one
/// that it hears, and trip when the scan has gone on.** Scan while the motors stand. Exit code 1 when nobody answers.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    // The text has brackets that a doc comment would take for links.
    #[arg(long, value_name = "LINE", help = line_spec::HELP)]
    line: LineSpec,
    /// The addresses to ask, such as 1-31,40
    #[arg(long, value_name = "ADDRESSES", default_value = "1-247")]
    addresses: Addresses,
    /// How long to wait for each answer
    #[arg(long, value_name = "TIME", default_value = "100ms")]
    wait: Time,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let mut found = Found::default();
    let (config, _) = over(&args, |slave, answer| found.note(slave, answer)).await?;
    found.conclude(args.addresses.0.len(), &line_spec::written(&config))
}

/// Asks every address, and tells what is there. Gives how the line was asked, and whether all were asked: Ctrl-C ends it.
pub(super) async fn over(
    args: &Args,
    mut note: impl FnMut(SlaveAddress, Answer) -> Result<(), Failure>,
) -> Result<(LineConfig, bool), Failure> {
    if args.wait.0.is_zero() {
        return Err(Failure::Input("--wait 0: expected how long to wait for each answer".to_owned()));
    }
    let config = args.line.config(&[]).map_err(|error| Failure::Input(error.to_string()))?;
    let config = of_scan(config, args.wait.0);
    let mut ending = Ending::listen()?;
    let line = one_drive::open_line(config.clone()).await?;
    announce(&config, args.addresses.0.len())?;
    let scan = async {
        for &slave in &args.addresses.0 {
            let answer = look(&line, &config, slave).await?;
            note(slave, answer)?;
        }
        Ok(true)
    };
    let ended = tokio::select! {
        ended = scan => ended,
        () = ending.asked() => Ok(false),
    };
    one_drive::close(&line).await;
    Ok((config, ended?))
}

/// Each address is asked once, however many are silent.
/// Who answers is not known yet, so whoever has answered gets the longest pause that a family needs.
fn of_scan(config: LineConfig, wait: Duration) -> LineConfig {
    let pauses = Family::ALL.map(|family| family.capabilities().turnaround);
    let turnaround = pauses.into_iter().max().unwrap_or_default();
    let patient = LineConfig { response_timeout: wait, offline_after: 0, retries: 0, ..config };
    (1..=247).fold(patient, |config, address| {
        config.slave(address, SlaveSettings { turnaround, ..SlaveSettings::default() })
    })
}

/// Says how long it will take, before anything is sent.
fn announce(config: &LineConfig, addresses: usize) -> Result<(), Failure> {
    let budget = LineBudget::of(config);
    let number = u32::try_from(addresses).unwrap_or(u32::MAX);
    let silent = budget.lost_slot().saturating_mul(number);
    let look = budget.read_slot().max(Duration::from_millis(1)) * LOOKS;
    output::say(format_args!(
        "asking {} on {}: {} if none answers, up to about {} more for each that does; only reads",
        output::counted(addresses, "address", "addresses"),
        line_spec::describe(config),
        output::bound(silent),
        output::bound(look)
    ))
}

/// What is at an address.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Answer {
    Silence,
    /// Something answers that cannot be understood.
    Damaged(String),
    /// Something answers, and it could be a drive of these families.
    Slave(Vec<Likeness>),
}

/// A family that a slave could be of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Likeness {
    pub(super) family: Family,
    /// Whether it says so itself, by its name.
    pub(super) certain: bool,
    /// What it says it is.
    pub(super) says: Option<String>,
}

/// Asks one address.
async fn look(line: &Line, config: &LineConfig, slave: SlaveAddress) -> Result<Answer, Failure> {
    let open = |family: Family| {
        let mut drive = family.open(line.slave(slave.number()), slave);
        one_drive::wait_at_most(&mut *drive);
        drive
    };
    let noise = || line.stats().noise_bytes;
    let before = noise();
    // The shortest read that a family has; an exception is an answer too.
    match open(Family::Atv312).keep_alive().await {
        Err(Error::Port { problem: PortError::Timeout { .. }, .. }) => {
            return Ok(match noise() - before {
                0 => Answer::Silence,
                bytes => Answer::Damaged(format!("{bytes} bytes came that make no answer")),
            });
        }
        Err(Error::Exception { code, .. }) if GATEWAY.contains(&code) => return Ok(Answer::Silence),
        Err(Error::Port { problem: problem @ (PortError::Damaged(_) | PortError::Mismatch(_)), .. }) => {
            return Ok(Answer::Damaged(problem.to_string()));
        }
        Err(Error::Port { problem: PortError::Expired, .. }) => {
            return Err(Failure::Drive(one_drive::NEVER_QUIET.to_owned()));
        }
        Err(Error::Port { problem, .. }) => return Err(Failure::Input(problem.to_string())),
        Ok(()) | Err(_) => {}
    }
    let mut alike = Vec::new();
    for family in Family::ALL {
        if line_spec::check(config, &[DriveName { family, slave }]).is_err() {
            continue;
        }
        let mut drive = open(family);
        if drive.status().await.is_ok() {
            alike.push(likeness(family, drive.as_mut()).await);
        }
    }
    if alike.iter().any(|likeness| likeness.certain) {
        alike.retain(|likeness| likeness.certain);
    }
    Ok(Answer::Slave(alike))
}

async fn likeness(family: Family, drive: &mut dyn Drive) -> Likeness {
    let identity = drive.identify().await.ok();
    let says = identity.as_ref().and_then(says);
    let model = identity.and_then(|identity| identity.model).unwrap_or_default();
    let certain = model.to_ascii_lowercase().contains(family.capabilities().key);
    Likeness { family, certain, says }
}

fn says(identity: &Identity) -> Option<String> {
    let Identity { vendor, model, version, .. } = identity;
    let words: Vec<&str> = [vendor, model, version].into_iter().flatten().map(|text| text.trim()).collect();
    (!words.is_empty()).then(|| words.join(" "))
}

/// What has been found so far.
#[derive(Debug, Default)]
pub(super) struct Found {
    answered: usize,
    damaged: usize,
    /// The addresses of each family that is the only likely one there.
    known: BTreeMap<Family, Vec<SlaveAddress>>,
}

impl Found {
    /// Prints what is at an address, if anything is.
    pub(super) fn note(&mut self, slave: SlaveAddress, answer: Answer) -> Result<(), Failure> {
        let text = match answer {
            Answer::Silence => return Ok(()),
            Answer::Damaged(why) => {
                self.damaged += 1;
                format!(
                    "{why}: something else is sending, two slaves have this address, or speed, format or protocol are others"
                )
            }
            Answer::Slave(alike) => {
                self.answered += 1;
                if let [Likeness { family, .. }] = *alike {
                    self.known.entry(family).or_default().push(slave);
                }
                describe(&alike)
            }
        };
        output::say(format_args!("{slave:>5}  {text}"))
    }

    pub(super) fn conclude(self, addresses: usize, line: &str) -> Result<(), Failure> {
        let Self { answered, damaged, known } = self;
        if answered + damaged == 0 {
            return Err(Failure::Drive(format!(
                "nobody answers at {}: see that the drives are switched on and wired, and try the other \
                 speeds and formats that they can be set to (drived families)",
                output::counted(addresses, "address", "addresses")
            )));
        }
        output::say(format_args!(
            "{answered} of {} answer",
            output::counted(addresses, "address", "addresses")
        ))?;
        if !known.is_empty() {
            let drives = known
                .iter()
                .map(|(family, slaves)| format!(" --drive {family}@{}", Addresses(slaves.clone())));
            output::say(format_args!("to go on: drived poll --line {line}{}", drives.collect::<String>()))?;
        }
        Ok(())
    }
}

pub(super) fn describe(alike: &[Likeness]) -> String {
    let one = |likeness: &Likeness| match &likeness.says {
        Some(says) => format!("{} ({says})", likeness.family),
        None => likeness.family.to_string(),
    };
    match alike {
        [] => "a Modbus slave, and no drive of a family that is known here".to_owned(),
        [only] if only.certain => format!("{}, by its own words", one(only)),
        _ => {
            let families: Vec<String> = alike.iter().map(one).collect();
            format!("likely {}, by its registers", families.join(" or "))
        }
    }
}

#[cfg(test)]
mod tests {
    use drive_core::serial::{CharacterFormat, SerialSettings};
    use drive_sim::{ALWAYS, Fault, SimLine, Wiring};

    use super::*;
    use crate::simulated::{self, SetUp};

    fn like(family: Family, certain: bool, says: Option<&str>) -> Likeness {
        Likeness { family, certain, says: says.map(str::to_owned) }
    }

    #[tokio::test(start_paused = true)]
    async fn every_family_is_known_again_and_nothing_is_written_to_it() {
        for set_up in [SetUp::Factory, SetUp::ForTheBus] {
            let settings = SerialSettings::new(19_200, CharacterFormat::F8N1).unwrap();
            let simulated = SimLine::new(Wiring::rtu(settings));
            let config = of_scan(LineConfig::stream(settings), Duration::from_millis(100));
            let mut machines = Vec::new();
            for (family, number) in Family::ALL.into_iter().zip(1..) {
                let machine = simulated.add_boxed(number, simulated::model(family, set_up)).unwrap();
                machines.push((family, machine, SlaveAddress::try_from(number).unwrap()));
            }
            let line = Line::over(simulated.in_memory(), config.clone());
            for (family, machine, slave) in machines {
                let Answer::Slave(alike) = look(&line, &config, slave).await.unwrap() else {
                    panic!("{family}")
                };
                let [only] = &alike[..] else { panic!("{family}: {alike:?}") };
                assert_eq!(only.family, family);
                assert_eq!(only.certain, matches!(family, Family::Atv312 | Family::Atv21), "{only:?}");
                for write in [0x05, 0x06, 0x0F, 0x10, 0x16, 0x17] {
                    assert_eq!(machine.requests(write), 0, "{family}: function {write}");
                }
                assert!(machine.all_requests() <= u64::from(LOOKS), "{family}: {}", machine.all_requests());
                machine.mute();
                let answer = look(&line, &config, slave).await.unwrap();
                assert_eq!(answer, Answer::Silence, "{family}");
            }
            assert_eq!(simulated.violations(), []);
        }
    }

    #[tokio::test(start_paused = true)]
    async fn an_answer_that_cannot_be_understood_is_told_from_silence() {
        let settings = SerialSettings::MODBUS_DEFAULT;
        let simulated = SimLine::new(Wiring::rtu(settings));
        simulated.add_boxed(7, simulated::model(Family::Atv312, SetUp::ForTheBus)).unwrap();
        simulated.set_fault(Fault::Flipped, ALWAYS);
        let config = of_scan(LineConfig::stream(settings), Duration::from_millis(100));
        let line = Line::over(simulated.in_memory(), config.clone());
        let answer = look(&line, &config, SlaveAddress::try_from(7).unwrap()).await.unwrap();
        assert!(matches!(answer, Answer::Damaged(_)), "{answer:?}");
    }

    #[test]
    fn what_a_drive_says_of_itself_is_told_from_what_its_registers_look_like() {
        let sure = like(Family::Atv312, true, Some("TELEMECANIQUE ATV312HU15N4"));
        assert_eq!(describe(&[sure]), "atv312 (TELEMECANIQUE ATV312HU15N4), by its own words");
        let (one, other) = (like(Family::Atv28, false, None), like(Family::Atv58, false, None));
        assert_eq!(describe(std::slice::from_ref(&one)), "likely atv28, by its registers");
        assert_eq!(describe(&[one, other]), "likely atv28 or atv58, by its registers");
        assert!(describe(&[]).contains("no drive of a family"));
    }

    #[test]
    fn nobody_is_a_failure_and_somebody_is_not() {
        assert!(matches!(Found::default().conclude(247, "COM3"), Err(Failure::Drive(_))));
        let mut found = Found::default();
        let slave = SlaveAddress::try_from(7).unwrap();
        found.note(slave, Answer::Damaged("the answer was damaged (CRC)".to_owned())).unwrap();
        found.conclude(247, "COM3").unwrap();
    }
}
