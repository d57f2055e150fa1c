//! `[[gateways]]`: doors for the SCADA that speaks Modbus TCP.

use std::{
    collections::{BTreeMap, BTreeSet},
    net::{IpAddr, Ipv4Addr, SocketAddr},
    ops::Range,
    time::Duration,
};

use drive_core::Class;
use toml::Spanned;

use drived_config::{
    config::{ConfigError, Entry as _, LinePart, Parsed, Source, of, settings, within, words},
    names::PLACES,
    rights::{Rights, Role},
};
use drived_doors::Network;
use drived_words::duration::Time;

/// A gateway.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GatewayConfig {
    /// By which it commands: it stands in `commanders`, in the audit log and in the events.
    pub name: String,
    pub listen: SocketAddr,
    /// Who may connect; empty: everybody who can reach it.
    pub allow: Vec<Network>,
    /// How many may be connected at once.
    pub clients: usize,
    /// How long a client may ask for nothing.
    pub idle: Duration,
    pub units: Units,
    /// How long a client waits for its answer.
    pub patience: Duration,
    /// The class of its reads.
    pub reads: Class,
    /// How much of each line it may use, in percent.
    pub share: u8,
    /// Whether what a slave does not answer is answered by silence instead of by 0Bh.
    pub silent: bool,
    /// Whether only registers of the family's map are read.
    pub mapped_only: bool,
    /// The unit that shows all drives of the daemon.
    pub virtual_unit: Option<u8>,
    /// How old an answer may be that is told again; zero: every read is an exchange.
    pub max_age: Duration,
    /// What its clients may do.
    pub rights: Rights,
    /// Whether parameters may be written,
    pub raw_writes: bool,
    /// also those that may go to an EEPROM.
    pub eeprom_writes: bool,
    /// Whether a stop for unit 0 stops all of its drives.
    pub broadcast: bool,
    /// How long a client that has started a motor may be silent; `None`: for ever.
    pub client_timeout: Option<Duration>,
    /// Whether the motor is stopped then.
    pub stops_when_silent: bool,
}

/// Who is behind a unit number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Units {
    /// The drives of a line, by their addresses on it.
    OfLine(String),
    /// Drives by their names.
    Table(BTreeMap<u8, String>),
}

words! {
    /// The class of reads.
    Reads(Class):
    "status" => Class::Status,
    "background" => Class::Background
}

words! {
    /// Whether what a slave does not answer is answered by silence.
    NoAnswer(bool):
    "exception" => false,
    "silence" => true
}

words! {
    /// Whether only registers of the family's map are read.
    Registers(bool):
    "any" => false,
    "map" => true
}

words! {
    /// What clients may write.
    Writes(Role):
    "nothing" => Role::View,
    "stop" => Role::Stop,
    "operate" => Role::Operate
}

words! {
    /// Whether a motor is stopped whose client is silent.
    OnSilence(bool):
    "report" => false,
    "stop" => true
}

settings! {
    /// `[[gateways]]`.
    GatewayEntry sets GatewayConfig;

    /// by which it is known to `commanders`, in the audit log and in the events
    name: String = "`\"gateway\"`";
    /// address and port
    listen: SocketAddr = "`\"127.0.0.1:1502\"`", |to, said| to.listen = *said;
    /// `true`: this address may be reached by others than this machine. Modbus TCP has neither login nor encryption: **whoever
    /// reaches it has the gateway's rights**
    plain: bool = "`false`";
    /// who may connect: addresses and networks, such as `["10.0.0.7", "10.1.0.0/16"]`
    allow: Vec<Parsed<Network>> = "everybody",
        |to, said| to.allow = said.iter().map(|network| network.0).collect();
    /// connections at once, 1 to 256; for one more makes room who has asked nothing the longest, 2 s at least. Where nobody has,
    /// 8 more are for stops alone: whatever else is asked there is refused (06h), closed and counted
    clients: usize = "`16`", |to, said| to.clients = within(*said, 1..=256, "")?;
    /// how long a client may ask for nothing
    idle: Parsed<Time> = "`\"60s\"`", |to, said| to.idle = within(said.0.0, SECOND..=DAY, "")?;
    /// the units are the addresses of the drives of this line
    line: String = "the only line";
    /// instead, for drives of many lines or with other numbers: `{ 1 = "pump 1", 2 = "fan 7", 255 = "pump 1" }`, 0 to 255
    units: BTreeMap<Spanned<String>, Spanned<String>> = "none";
    /// how long a client waits; a request that has no answer by then is refused, so that its answer is never taken for the next
    /// one's. Most SCADA give up after 1 s
    patience: Parsed<Time> = "`\"900ms\"`",
        |to, said| to.patience = within(said.0.0, Duration::from_millis(50)..=60 * SECOND, "")?;
    /// the class of its reads: `"status"`, in turn with the daemon's own polls, or `"background"`, behind them
    reads: Parsed<Reads> = "`\"status\"`", |to, said| to.reads = said.0.0;
    /// how much of each line it has in turn with the daemon's polls, in percent, 1 to 80; less where the line's plan leaves less, with
    /// 5 % kept free. What nobody else wants of the line its reads have besides, behind everything else
    share: u8 = "`30`", |to, said| to.share = within(*said, 1..=80, "")?;
    /// `"map"`: only registers of the family's list are read; `"any"`: the drive itself judges
    registers: Parsed<Registers> = "`\"any\"`", |to, said| to.mapped_only = said.0.0;
    /// a unit number, such as `247`, that shows all drives of the daemon: [below](#the-virtual-unit)
    virtual_unit: u8 = "none";
    /// how old a block may be that a client gets again without an exchange, up to 10 s: it lies whole in one that a client has
    /// read before, and nothing was written to the drive through this gateway since
    max_age: Parsed<Time> = "`\"0\"`: never",
        |to, said| to.max_age = within(said.0.0, Duration::ZERO..=10 * SECOND, "")?;
    /// what its clients may do: `"nothing"`, `"stop"`, or `"operate"`, to start, stop, give setpoints and reset, by the words of
    /// the drive's manual
    writes: Parsed<Writes> = "`\"nothing\"`", |to, said| to.rights = said.0.0.rights();
    /// `true`: parameters may be written too, with `writes = "operate"`
    raw_writes: bool = "`false`", |to, said| to.raw_writes = *said;
    /// `true`: also parameters that go to an EEPROM, or of which the manual does not say where they go
    eeprom_writes: bool = "`false`", |to, said| to.eeprom_writes = *said;
    /// `true`: a write to unit 0 that is a stop of any built-in family stops all drives of this gateway, unless it is a start of another family,
    /// and is confirmed when all have taken it;
    /// nothing else is carried out for unit 0
    broadcast: bool = "`false`", |to, said| to.broadcast = *said;
    /// how long a client that has started a motor may be silent, 1 s to a day
    client_timeout: Parsed<Time> = "for ever",
        |to, said| to.client_timeout = Some(within(said.0.0, SECOND..=DAY, "")?);
    /// what happens then: `"report"`, an alarm among the events, or `"stop"`, a ramp stop. Not of a motor that somebody else has
    /// started since by another door. A client is watched on when the drive or the gateway is called otherwise, when the gateway is
    /// gone, and by the next start where the run is taken up again after a kill
    on_client_silence: Parsed<OnSilence> = "`\"report\"`", |to, said| to.stops_when_silent = said.0.0;
    /// what stands for a drive that does not answer: `"exception"` (0Bh), or `"silence"` for a SCADA that takes the whole gateway
    /// off-line for a 0Bh (Citect)
    no_answer: Parsed<NoAnswer> = "`\"exception\"`", |to, said| to.silent = said.0.0;
}

/// Where a gateway listens unless the file says otherwise: 502 is for root.
const LISTEN: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 1502);
const SECOND: Duration = Duration::from_secs(1);
const DAY: Duration = Duration::from_secs(86_400);

/// The gateways of a file with these lines.
pub fn gateways(
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
        if !listen.ip().is_loopback() && !of(&self.plain).is_some_and(|plain| *plain) {
            let place = self.listen.as_ref().map_or(whole, Spanned::span);
            let problem = format_args!(
                "{listen}: others than this machine can reach it, and Modbus TCP has neither login nor encryption: \
                 expected plain = true where the network is trusted with what this gateway allows"
            );
            return Err(source.error(place, problem));
        }
        let mut gateway = GatewayConfig {
            name: name.to_owned(),
            listen,
            allow: Vec::new(),
            clients: 16,
            idle: 60 * SECOND,
            units: self.units_of(source, whole.clone(), lines)?,
            patience: Duration::from_millis(900),
            reads: Class::Status,
            share: 30,
            silent: false,
            mapped_only: false,
            virtual_unit: self.virtual_unit(source, whole.clone(), lines)?,
            max_age: Duration::ZERO,
            rights: Role::View.rights(),
            raw_writes: false,
            eeprom_writes: false,
            broadcast: false,
            client_timeout: None,
            stops_when_silent: false,
        };
        self.set(source, &mut gateway)?;
        let GatewayConfig { rights, raw_writes, eeprom_writes, broadcast, .. } = gateway;
        let missing = [
            (raw_writes && !rights.operate, "raw_writes = true needs writes = \"operate\""),
            (eeprom_writes && !raw_writes, "eeprom_writes = true needs raw_writes = true"),
            (broadcast && !rights.stop, "broadcast = true needs writes = \"stop\" or \"operate\""),
        ];
        if let Some((_, problem)) = missing.iter().find(|(is_so, _)| *is_so) {
            return Err(source.error(whole, problem));
        }
        if let (None, Some(said)) = (&self.client_timeout, &self.on_client_silence) {
            return Err(source.error(said.span(), "expected client_timeout with it, such as \"10s\""));
        }
        Ok(gateway)
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
        if drives > PLACES {
            let problem = format_args!("{drives} drives: it has room for {PLACES}");
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
        let entries = match (&self.line, of(&self.units), lines) {
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
