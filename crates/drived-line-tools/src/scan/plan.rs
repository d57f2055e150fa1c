//! In which order what is tried, and how long it takes. No line and no clock.

use std::{cmp::Reverse, time::Duration};

use drive_bus::{LineConfig, Protocol};
use drive_core::{SerialSettings, SlaveAddress, serial::CharacterFormat};
use drive_families::Family;
use drive_fleet::LineBudget;

use super::feeding::Feeding;

/// Bytes of a read of one register and of its answer, without what its protocol puts round them.
const REQUEST: usize = 5;
const ANSWER: usize = 4;

/// Exchanges by which a drive is looked at, at the most: the first refusals of the families that it is none of, and all of its own.
pub(super) const LOOKS: u32 = 29;

/// Addresses that most drives have: of three of the families these are all there are. They are asked at every setting before
/// the others are.
const USUAL: u8 = 31;

/// Speed, format and protocol, and the addresses that are asked with them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Trial {
    pub serial: SerialSettings,
    pub protocol: Protocol,
    /// The highest address that a family has which can be set so.
    highest: u8,
}

impl Trial {
    /// The setting that the caller names: whoever may be there is asked, of whatever family.
    pub(super) const fn named(serial: SerialSettings, protocol: Protocol) -> Self {
        Self { serial, protocol, highest: 247 }
    }

    /// Whether one setting finds what the other would. The number of stop bits makes no difference: a UART looks at the first
    /// alone.
    fn hears(&self, other: &Self) -> bool {
        let sounds = |trial: &Self| {
            let format = trial.serial.format();
            (trial.serial.baud(), trial.protocol.name(), format.data_bits(), format.parity())
        };
        sounds(self) == sounds(other)
    }

    /// What an address takes that nobody has: the request, the wait, and the answer that could have begun at its end. The silence
    /// before the next request is over by then.
    pub(super) fn silent(&self, wait: Duration) -> Duration {
        match self.protocol {
            Protocol::Rtu | Protocol::Ascii(_) => {
                let exchange = self.protocol.exchange_time(self.serial, REQUEST, ANSWER);
                exchange.saturating_sub(self.protocol.silence(self.serial)) + wait
            }
            _ => LineBudget::of(&self.config(LineConfig::stream(self.serial), wait)).lost_slot(),
        }
    }

    /// What an exchange takes that is answered.
    pub(super) fn exchange(&self, wait: Duration) -> Duration {
        LineBudget::of(&self.config(LineConfig::stream(self.serial), wait)).read_slot()
    }

    /// What a short exchange takes that is answered.
    fn question(&self) -> Duration {
        let response = LineBudget::of(&LineConfig::stream(self.serial)).response * self.protocol.turns();
        self.protocol.exchange_time(self.serial, REQUEST, ANSWER) + response
    }

    /// A line with these settings.
    pub(super) fn config(&self, line: LineConfig, wait: Duration) -> LineConfig {
        LineConfig { serial: self.serial, protocol: self.protocol, response_timeout: wait, ..line }
    }
}

/// Which settings are tried besides the one that is named: those that are listed, or all where none is.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Others {
    pub speeds: Vec<u32>,
    pub formats: Vec<CharacterFormat>,
    pub protocols: Vec<Protocol>,
}

impl Others {
    /// The settings that are tried, the likeliest first: what is named, what each family has from the factory, then what most
    /// families can be set to.
    pub(super) fn trials(&self, named: Option<Trial>) -> Vec<Trial> {
        let mut others: Vec<(Trial, usize)> = Vec::new();
        for family in Family::all().into_iter().filter(|family| family.tells_itself()) {
            for trial in self.of(family) {
                match others.iter_mut().find(|(other, _)| other.hears(&trial)) {
                    Some((other, families)) => {
                        other.highest = other.highest.max(trial.highest);
                        *families += 1;
                    }
                    None => others.push((trial, 1)),
                }
            }
        }
        let rank = |(trial, families): &(Trial, usize)| {
            let factory = Family::all().iter().position(|family| {
                family.capabilities().factory == trial.serial && trial.protocol == Protocol::Rtu
            });
            let spoken = trial.protocol != Protocol::Rtu;
            (factory.is_none(), spoken, Reverse(*families), Reverse(trial.serial.baud()))
        };
        others.sort_by_key(rank);
        let others = others.into_iter().map(|(trial, _)| trial);
        let others = others.filter(|trial| named.is_none_or(|named| !named.hears(trial)));
        named.into_iter().chain(others).collect()
    }

    /// What a family can be set to, of what is listed; one of the formats that differ by stop bits alone.
    fn of(&self, family: Family) -> Vec<Trial> {
        let capabilities = family.capabilities();
        let mut trials: Vec<Trial> = Vec::new();
        for protocol in capabilities.protocols.iter().filter_map(|name| name.parse::<Protocol>().ok()) {
            let listed = self.protocols.iter().find(|listed| listed.name() == protocol.name());
            if listed.is_none() && !self.protocols.is_empty() {
                continue;
            }
            let protocol = listed.copied().unwrap_or(protocol);
            for baud in capabilities.speeds.iter().filter(|baud| lists(&self.speeds, baud)) {
                for format in capabilities.formats.iter().filter(|format| lists(&self.formats, format)) {
                    let Ok(serial) = SerialSettings::new(*baud, *format) else { continue };
                    let trial = Trial { serial, protocol, highest: capabilities.highest_address };
                    if protocol.check(serial).is_ok() && !trials.iter().any(|other| other.hears(&trial)) {
                        trials.push(trial);
                    }
                }
            }
        }
        trials
    }
}

fn lists<T: PartialEq>(listed: &[T], value: &T) -> bool {
    listed.is_empty() || listed.contains(value)
}

/// One address at one of the trials.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Step {
    pub trial: usize,
    pub slave: SlaveAddress,
}

/// What is asked in which order.
#[derive(Debug, Clone)]
pub(super) struct Plan {
    pub trials: Vec<Trial>,
    pub steps: Vec<Step>,
    wait: Duration,
    /// What it takes to open the port with other settings.
    switch: Duration,
}

impl Plan {
    /// Asks these addresses at each of the settings, the usual addresses at all of them first.
    pub(super) fn new(trials: Vec<Trial>, addresses: &[SlaveAddress], wait: Duration) -> Self {
        let mut steps = Vec::new();
        for is_usual in [true, false] {
            for (trial, setting) in trials.iter().enumerate() {
                let asked = addresses.iter().filter(|slave| {
                    (slave.number() <= USUAL) == is_usual && slave.number() <= setting.highest
                });
                steps.extend(asked.map(|slave| Step { trial, slave: *slave }));
            }
        }
        Self { trials, steps, wait, switch: Duration::ZERO }
    }

    /// The same where it takes so long to open the port with other settings.
    pub(super) fn switching_in(self, switch: Duration) -> Self {
        Self { switch, ..self }
    }

    /// What one drive adds that answers at the first setting and is fed once a second until the end.
    pub(super) fn one_more(&self) -> Duration {
        let Some(&step) = self.steps.first() else { return Duration::ZERO };
        let found = Found { step, exchanges: LOOKS, interval: Some(Duration::from_secs(1)) };
        self.time_with(&[found]).saturating_sub(self.time())
    }

    /// The longest that somebody waits who is to be fed before the next address is asked.
    pub(super) fn longest_step(&self) -> Duration {
        self.trials.iter().map(|trial| trial.silent(self.wait)).max().unwrap_or_default() + self.switch
    }

    /// How long it takes when nobody answers.
    pub(super) fn time(&self) -> Duration {
        self.time_with(&[])
    }

    /// How long it takes when these answer.
    pub(super) fn time_with(&self, found: &[Found]) -> Duration {
        let (mut now, mut at, mut feeding) = (Duration::ZERO, None, Feeding::default());
        for step in &self.steps {
            let Some(trial) = self.trials.get(step.trial) else { continue };
            for _ in 0..feeding.len() {
                let Some(fed) = feeding.next(now, trial.silent(self.wait), at) else { break };
                now += self.switch(&mut at, fed.step.trial);
                now += self.trials.get(fed.step.trial).map(Trial::question).unwrap_or_default();
                feeding.fed(fed.step, now);
            }
            now += self.switch(&mut at, step.trial);
            let Some(found) = found.iter().find(|found| found.step == *step) else {
                now += trial.silent(self.wait);
                continue;
            };
            now += trial.exchange(self.wait).saturating_mul(found.exchanges) + self.wait;
            if let Some(interval) = found.interval {
                feeding.add(*step, None, interval, now);
            }
        }
        now
    }

    fn switch(&self, at: &mut Option<usize>, trial: usize) -> Duration {
        if at.replace(trial) == Some(trial) { Duration::ZERO } else { self.switch }
    }
}

/// What a find adds to the time of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Found {
    pub step: Step,
    /// Exchanges by which it was looked at.
    pub exchanges: u32,
    /// How often it is fed from then on.
    pub interval: Option<Duration>,
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAIT: Duration = Duration::from_millis(100);
    const SWITCH: Duration = Duration::from_millis(5);

    fn slaves(numbers: impl IntoIterator<Item = u8>) -> Vec<SlaveAddress> {
        numbers.into_iter().map(|number| number.try_into().unwrap()).collect()
    }

    fn written(trials: &[Trial]) -> Vec<String> {
        trials
            .iter()
            .map(|trial| format!("{} {} {}", trial.serial, trial.protocol.name(), trial.highest))
            .collect()
    }

    /// Factory settings by the manuals: Altivar 28 19200 8N1, 312 and 21 19200 8E1, 3G3EV 9600 8E1; 8O1 is common to all
    /// protocols of the Altivar 58. All 247 addresses are those of the Altivar 21 and 312.
    #[test]
    fn the_factory_settings_come_first_and_then_what_most_families_can_have() {
        let trials = Others::default().trials(None);
        let mut first = written(&trials[..4]);
        first.sort();
        assert_eq!(
            first,
            ["19200 8E1 rtu 247", "19200 8N1 rtu 247", "19200 8O1 rtu 247", "9600 8E1 rtu 247"]
        );
        // 8N2 is heard as 8N1, and 7-bit formats with two stop bits as those with one. Three speeds of five formats in ASCII and
        // of one in UNI-TELWAY; four of three in RTU.
        let all = written(&trials);
        assert_eq!(all.iter().filter(|trial| trial.contains("rtu")).count(), 12);
        assert_eq!(all.iter().filter(|trial| trial.contains("ascii 31")).count(), 15);
        assert_eq!(all.iter().filter(|trial| trial.contains("unitelway 31")).count(), 3);
        assert_eq!(all.len(), 30);
        // At 2400 bit/s there is the 3G3EV alone, with 31 addresses.
        assert_eq!(all.iter().filter(|trial| trial.starts_with("2400")).count(), 3);
        assert!(all.iter().filter(|trial| trial.starts_with("2400")).all(|trial| trial.ends_with("rtu 31")));
    }

    #[test]
    fn what_is_named_comes_first_with_every_address_and_only_once() {
        let named = Trial::named("9600 8N2".parse().unwrap(), Protocol::Rtu);
        let trials = Others::default().trials(Some(named));
        assert_eq!(trials[0], named);
        assert_eq!(trials.len(), 30);
        assert!(!written(&trials).iter().any(|trial| trial.starts_with("9600 8N1 rtu")));
    }

    #[test]
    fn what_is_listed_limits_what_is_tried() {
        let others = Others {
            speeds: vec![9_600],
            formats: vec!["8N2".parse().unwrap(), "7E1".parse().unwrap()],
            protocols: vec![Protocol::Rtu, "ascii".parse().unwrap()],
        };
        let mut all = written(&others.trials(None));
        all.sort();
        assert_eq!(all, ["9600 7E1 ascii 31", "9600 8N2 ascii 31", "9600 8N2 rtu 247"]);
        let none = Others { speeds: vec![300], ..Others::default() };
        assert_eq!(none.trials(None), []);
    }

    #[test]
    fn the_usual_addresses_are_asked_at_every_setting_before_the_others_are() {
        let others =
            Others { speeds: vec![9_600, 2_400], formats: vec!["8E1".parse().unwrap()], ..Others::default() };
        let plan = Plan::new(others.trials(None), &slaves([1, 31, 32, 247]), WAIT);
        let asked: Vec<_> = plan.steps.iter().map(|step| (step.trial, step.slave.number())).collect();
        // 9600 8E1 rtu, then 2400 8E1 rtu and 9600 8E1 ascii, which no drive above 31 can have.
        assert_eq!(asked, [(0, 1), (0, 31), (1, 1), (1, 31), (2, 1), (2, 31), (0, 32), (0, 247)]);
    }

    /// 8 characters of 11 bits, 100 ms, and 7 characters: 108.59 ms at 19200 bit/s. A drive that answers costs its exchanges
    /// instead of that, and one more as often as it is fed.
    #[test]
    fn the_time_of_a_plan_is_that_of_its_silent_addresses_and_of_what_finds_add() {
        let trial = Trial::named(SerialSettings::MODBUS_DEFAULT, Protocol::Rtu);
        let plan = Plan::new(vec![trial], &slaves(1..=101), WAIT).switching_in(SWITCH);
        let silent = Duration::from_nanos(15 * 11 * 1_000_000_000 / 19_200) + WAIT;
        assert!(plan.time().abs_diff(silent * 101 + SWITCH) < Duration::from_micros(1));
        let found = Found { step: plan.steps[0], exchanges: 10, interval: None };
        let exchange = trial.exchange(WAIT);
        let with = silent * 100 + SWITCH + exchange * 10 + WAIT;
        assert!(plan.time_with(&[found]).abs_diff(with) < Duration::from_micros(1));
        // The other hundred take 10.86 s.
        let fed = Found { interval: Some(Duration::from_secs(1)), ..found };
        assert!(plan.time_with(&[fed]).abs_diff(with + trial.question() * 11) <= trial.question());
    }
}
