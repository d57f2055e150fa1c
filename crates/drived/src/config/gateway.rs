//! `[[gateways]]`: doors for the SCADA that speaks Modbus TCP.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
    net::{IpAddr, Ipv4Addr, SocketAddr},
    ops::{Range, RangeInclusive},
    str::FromStr,
    time::Duration,
};

use drive_core::Class;
use serde::Deserialize;
use toml::Spanned;

use super::{
    LinePart,
    place::{ConfigError, Source},
    values::Parsed,
};
use crate::{
    doors::{Rights, Role},
    duration::Time,
    gateway::virtual_unit::MOST_DRIVES,
};

/// A gateway.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct GatewayConfig {
    /// By which it commands: it stands in `commanders`, in the audit log and in the events.
    pub(crate) name: String,
    pub(crate) listen: SocketAddr,
    /// Who may connect; empty: everybody who can reach it.
    pub(crate) allow: Vec<Network>,
    /// How many may be connected at once.
    pub(crate) clients: usize,
    /// How long a client may ask for nothing.
    pub(crate) idle: Duration,
    pub(crate) units: Units,
    /// How long a client waits for its answer.
    pub(crate) patience: Duration,
    /// The class of its reads.
    pub(crate) reads: Class,
    /// How much of each line it may use, in percent.
    pub(crate) share: u8,
    /// Whether what a slave does not answer is answered by silence instead of by 0Bh.
    pub(crate) silent: bool,
    /// Whether only registers of the family's map are read.
    pub(crate) mapped_only: bool,
    /// The unit that shows all drives of the daemon.
    pub(crate) virtual_unit: Option<u8>,
    /// How old an answer may be that is told again; zero: every read is an exchange.
    pub(crate) max_age: Duration,
    /// What its clients may do.
    pub(crate) rights: Rights,
    /// Whether parameters may be written,
    pub(crate) raw_writes: bool,
    /// also those that may go to an EEPROM.
    pub(crate) eeprom_writes: bool,
    /// Whether a stop for unit 0 stops all of its drives.
    pub(crate) broadcast: bool,
    /// How long a client that has started a motor may be silent; `None`: for ever.
    pub(crate) client_timeout: Option<Duration>,
    /// Whether the motor is stopped then.
    pub(crate) stops_when_silent: bool,
}

/// Who is behind a unit number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Units {
    /// The drives of a line, by their addresses on it.
    OfLine(String),
    /// Drives by their names.
    Table(BTreeMap<u8, String>),
}

/// Addresses that begin alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Network {
    address: IpAddr,
    bits: u32,
}

impl Network {
    /// Whether an address is one of it.
    pub(crate) fn has(&self, address: IpAddr) -> bool {
        let begin = |address: u128, of: u32| address.checked_shr(of - self.bits.min(of)).unwrap_or(0);
        match (self.address, address.to_canonical()) {
            (IpAddr::V4(own), IpAddr::V4(other)) => {
                begin(u32::from(own).into(), 32) == begin(u32::from(other).into(), 32)
            }
            (IpAddr::V6(own), IpAddr::V6(other)) => begin(own.into(), 128) == begin(other.into(), 128),
            _ => false,
        }
    }
}

impl fmt::Display for Network {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.address, self.bits)
    }
}

impl FromStr for Network {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        const EXPECTED: &str = "expected an address or a network, such as 10.0.0.7 or 10.0.0.0/24";
        let (address, bits) =
            text.split_once('/').map_or((text, None), |(address, bits)| (address, Some(bits)));
        let address: IpAddr = address.parse().map_err(|_| EXPECTED)?;
        let most = if address.is_ipv4() { 32 } else { 128 };
        let bits = bits.map_or(Ok(most), str::parse).map_err(|_| EXPECTED)?;
        if bits > most { Err(EXPECTED) } else { Ok(Self { address, bits }) }
    }
}

/// The class of reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Reads(Class);

impl FromStr for Reads {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "status" => Ok(Self(Class::Status)),
            "background" => Ok(Self(Class::Background)),
            _ => Err("expected status or background"),
        }
    }
}

/// What is answered for a slave that does not answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct NoAnswer {
    silent: bool,
}

impl FromStr for NoAnswer {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "exception" => Ok(Self { silent: false }),
            "silence" => Ok(Self { silent: true }),
            _ => Err("expected exception or silence"),
        }
    }
}

/// Which registers are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Registers {
    mapped_only: bool,
}

impl FromStr for Registers {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "any" => Ok(Self { mapped_only: false }),
            "map" => Ok(Self { mapped_only: true }),
            _ => Err("expected any or map"),
        }
    }
}

/// What clients may write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Writes(Role);

impl FromStr for Writes {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "nothing" => Ok(Self(Role::View)),
            "stop" => Ok(Self(Role::Stop)),
            "operate" => Ok(Self(Role::Operate)),
            _ => Err("expected nothing, stop or operate"),
        }
    }
}

/// What happens to a motor whose client is silent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct OnSilence {
    stops: bool,
}

impl FromStr for OnSilence {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "report" => Ok(Self { stops: false }),
            "stop" => Ok(Self { stops: true }),
            _ => Err("expected report or stop"),
        }
    }
}

/// One entry as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GatewayEntry {
    name: Option<Spanned<String>>,
    listen: Option<Spanned<SocketAddr>>,
    #[serde(default)]
    plain: bool,
    #[serde(default)]
    allow: Vec<Parsed<Network>>,
    clients: Option<Spanned<usize>>,
    idle: Option<Spanned<Parsed<Time>>>,
    line: Option<Spanned<String>>,
    units: Option<BTreeMap<Spanned<String>, Spanned<String>>>,
    patience: Option<Spanned<Parsed<Time>>>,
    reads: Option<Parsed<Reads>>,
    share: Option<Spanned<u8>>,
    no_answer: Option<Parsed<NoAnswer>>,
    registers: Option<Parsed<Registers>>,
    virtual_unit: Option<Spanned<u8>>,
    max_age: Option<Spanned<Parsed<Time>>>,
    writes: Option<Spanned<Parsed<Writes>>>,
    #[serde(default)]
    raw_writes: bool,
    #[serde(default)]
    eeprom_writes: bool,
    #[serde(default)]
    broadcast: bool,
    client_timeout: Option<Spanned<Parsed<Time>>>,
    on_client_silence: Option<Spanned<Parsed<OnSilence>>>,
}

/// Where a gateway listens unless the file says otherwise: 502 is for root.
const LISTEN: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 1502);
const CLIENTS: usize = 16;
const IDLE: Duration = Duration::from_secs(60);
/// Most SCADA give up after one second.
const PATIENCE: Duration = Duration::from_millis(900);
const SHARE: u8 = 30;

/// The gateways of a file with these lines.
pub(super) fn gateways(
    source: Source<'_>,
    entries: &[Spanned<GatewayEntry>],
    lines: &[LinePart],
) -> Result<Vec<GatewayConfig>, ConfigError> {
    let (mut all, mut names, mut places) = (Vec::new(), BTreeSet::new(), BTreeSet::new());
    for entry in entries {
        let gateway = entry.get_ref().checked(source, entry.span(), lines)?;
        if !names.insert(gateway.name.clone()) {
            let problem = format_args!("two gateways are named {:?}", gateway.name);
            return Err(source.error(entry.get_ref().place_of_name(entry.span()), problem));
        }
        if !places.insert(gateway.listen) {
            let place = entry.get_ref().listen.as_ref().map_or(entry.span(), Spanned::span);
            let problem = format_args!("{} is another gateway's too", gateway.listen);
            return Err(source.error(place, problem));
        }
        all.push(gateway);
    }
    Ok(all)
}

impl GatewayEntry {
    fn place_of_name(&self, whole: Range<usize>) -> Range<usize> {
        self.name.as_ref().map_or(whole, Spanned::span)
    }

    fn checked(
        &self,
        source: Source<'_>,
        whole: Range<usize>,
        lines: &[LinePart],
    ) -> Result<GatewayConfig, ConfigError> {
        let name = self.name.as_ref().map_or("gateway", |name| name.get_ref().as_str());
        if name.trim().is_empty() || name.chars().any(char::is_control) {
            let problem = "expected a name without control characters for the gateway";
            return Err(source.error(self.place_of_name(whole), problem));
        }
        let listen = self.listen.as_ref().map_or(LISTEN, |listen| *listen.get_ref());
        if !listen.ip().is_loopback() && !self.plain {
            let place = self.listen.as_ref().map_or(whole, Spanned::span);
            let problem = format_args!(
                "{listen}: others than this machine can reach it, and Modbus TCP has neither login nor encryption: \
                 expected plain = true where the network is trusted with what this gateway allows"
            );
            return Err(source.error(place, problem));
        }
        let clients = within(source, self.clients.as_ref(), CLIENTS, 1..=256)?;
        let share = within(source, self.share.as_ref(), SHARE, 1..=80)?;
        let times = |said: &Option<Spanned<Parsed<Time>>>, usual, range| {
            let said = said.as_ref().map(|time| Spanned::new(time.span(), time.get_ref().0.0));
            within(source, said.as_ref(), usual, range)
        };
        let seconds = Duration::from_secs;
        let writes = self.writes.as_ref().map_or(Role::View, |writes| writes.get_ref().0.0);
        let missing = [
            (self.raw_writes && writes < Role::Operate, "raw_writes = true needs writes = \"operate\""),
            (self.eeprom_writes && !self.raw_writes, "eeprom_writes = true needs raw_writes = true"),
            (
                self.broadcast && writes < Role::Stop,
                "broadcast = true needs writes = \"stop\" or \"operate\"",
            ),
        ];
        if let Some((_, problem)) = missing.iter().find(|(is_so, _)| *is_so) {
            return Err(source.error(whole.clone(), problem));
        }
        if let (None, Some(said)) = (&self.client_timeout, &self.on_client_silence) {
            return Err(source.error(said.span(), "expected client_timeout with it, such as \"10s\""));
        }
        let client_timeout = times(&self.client_timeout, Duration::ZERO, seconds(1)..=seconds(86_400))?;
        Ok(GatewayConfig {
            name: name.to_owned(),
            listen,
            allow: self.allow.iter().map(|network| network.0).collect(),
            clients,
            idle: times(&self.idle, IDLE, seconds(1)..=seconds(86_400))?,
            units: self.units_of(source, whole.clone(), lines)?,
            patience: times(&self.patience, PATIENCE, Duration::from_millis(50)..=seconds(60))?,
            reads: self.reads.map_or(Class::Status, |reads| reads.0.0),
            share,
            silent: self.no_answer.is_some_and(|said| said.0.silent),
            mapped_only: self.registers.is_some_and(|said| said.0.mapped_only),
            virtual_unit: self.virtual_unit(source, whole, lines)?,
            max_age: times(&self.max_age, Duration::ZERO, Duration::ZERO..=seconds(10))?,
            rights: writes.rights(),
            raw_writes: self.raw_writes,
            eeprom_writes: self.eeprom_writes,
            broadcast: self.broadcast,
            client_timeout: (!client_timeout.is_zero()).then_some(client_timeout),
            stops_when_silent: self.on_client_silence.as_ref().is_some_and(|said| said.get_ref().0.stops),
        })
    }

    /// The unit of all drives: none of its drives has it.
    fn virtual_unit(
        &self,
        source: Source<'_>,
        whole: Range<usize>,
        lines: &[LinePart],
    ) -> Result<Option<u8>, ConfigError> {
        let Some(said) = &self.virtual_unit else { return Ok(None) };
        let unit = *said.get_ref();
        let taken = match self.units_of(source, whole, lines)? {
            Units::Table(units) => units.contains_key(&unit),
            Units::OfLine(name) => lines
                .iter()
                .filter(|line| line.name == name)
                .flat_map(|line| &line.drives)
                .any(|drive| drive.name.slave.number() == unit),
        };
        if unit == 0 || taken {
            let problem = format_args!("{unit}: expected a number from 1 on that none of its drives has");
            return Err(source.error(said.span(), problem));
        }
        let drives: usize = lines.iter().map(|line| line.drives.len()).sum();
        if drives > MOST_DRIVES {
            let problem = format_args!("{drives} drives: it has room for {MOST_DRIVES}");
            return Err(source.error(said.span(), problem));
        }
        Ok(Some(unit))
    }

    /// Who is behind its unit numbers: the drives of its line, or of the only one.
    fn units_of(
        &self,
        source: Source<'_>,
        whole: Range<usize>,
        lines: &[LinePart],
    ) -> Result<Units, ConfigError> {
        let refuse = |span, problem: String| Err(source.error(span, problem));
        let entries = match (&self.line, &self.units, lines) {
            (None, Some(units), _) => units,
            (Some(line), None, _) => {
                let name = line.get_ref();
                if !lines.iter().any(|part| part.name == *name) {
                    return refuse(line.span(), format!("there is no line {name:?}: expected a name of one"));
                }
                return Ok(Units::OfLine(name.clone()));
            }
            (None, None, [only]) => return Ok(Units::OfLine(only.name.clone())),
            (Some(line), Some(_), _) => {
                return refuse(line.span(), "expected line or units, not both".to_owned());
            }
            (None, None, _) => {
                let problem =
                    "expected line = \"NAME\", or units = { 1 = \"DRIVE\" } for drives of several lines";
                return refuse(whole, problem.to_owned());
            }
        };
        let mut units = BTreeMap::new();
        for (unit, drive) in entries {
            let Ok(number) = unit.get_ref().parse::<u8>() else {
                return refuse(
                    unit.span(),
                    format!("{:?}: expected a unit number, 0 to 255", unit.get_ref()),
                );
            };
            let name = drive.get_ref();
            if !lines.iter().flat_map(|line| &line.drives).any(|known| known.settings.name == *name) {
                return refuse(drive.span(), format!("there is no drive {name:?}: expected a name of one"));
            }
            units.insert(number, name.clone());
        }
        Ok(Units::Table(units))
    }
}

/// What is said, if it is within a range.
fn within<T: Copy + PartialOrd + fmt::Debug>(
    source: Source<'_>,
    said: Option<&Spanned<T>>,
    usual: T,
    range: RangeInclusive<T>,
) -> Result<T, ConfigError> {
    let Some(said) = said else { return Ok(usual) };
    let value = *said.get_ref();
    if range.contains(&value) {
        return Ok(value);
    }
    let problem = format_args!("{value:?}: expected {:?} to {:?}", range.start(), range.end());
    Err(source.error(said.span(), problem))
}
