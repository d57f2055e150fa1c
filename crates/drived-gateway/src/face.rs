//! `[[gateways]]` as a [`Face`].

use std::pin::Pin;

use drived_config::{config::Entry as _, rights::Rights};
use drived_face::{
    ConfigError, Configured, Face, Failure, Key, Meaning, Open, Opening, Samples, Site, Written, same,
};
use serde_json::{Map, Value, json};
use toml::Spanned;

use crate::{
    Gateways,
    config::{GatewayConfig, GatewayEntry, Units, gateways},
};

/// What a program adds that has gateways.
pub const FACE: &dyn Face = &ForScada;

struct ForScada;

const ROW: Key = Key::of_table("[[gateways]]", &["[Modbus TCP gateways](gateway.md)"], "none");

impl Face for ForScada {
    fn table(&self) -> &'static str {
        "gateways"
    }

    fn row(&self) -> &'static Key {
        &ROW
    }

    fn keys(&self) -> &'static [Key] {
        GatewayEntry::KEYS
    }

    fn configure(&self, written: Written<'_>, site: &Site<'_>) -> Result<Box<dyn Configured>, ConfigError> {
        let source = written.source();
        let entries: Vec<Spanned<GatewayEntry>> = written.read()?;
        Ok(Box::new(All(gateways(source, &entries, site.lines)?)))
    }
}

/// The gateways of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct All(pub Vec<GatewayConfig>);

impl Configured for All {
    fn is_same(&self, other: &dyn Configured) -> bool {
        same(self, other)
    }

    fn names(&self) -> Option<(&'static str, Vec<&str>)> {
        Some(("gateway", self.0.iter().map(|gateway| gateway.name.as_str()).collect()))
    }

    fn meaning(&self) -> Vec<Meaning> {
        let meaning = |gateway: &GatewayConfig| Meaning {
            head: format!("gateway {}: Modbus TCP at {}", gateway.name, gateway.listen),
            rows: meaning(gateway),
        };
        self.0.iter().map(meaning).collect()
    }

    fn object(&self) -> Map<String, Value> {
        let object = |gateway: &GatewayConfig| {
            let rows = meaning(gateway).into_iter();
            let meaning: Map<String, Value> =
                rows.map(|(label, text)| (label.to_owned(), text.into())).collect();
            json!({ "name": gateway.name, "listen": gateway.listen.to_string(), "meaning": meaning })
        };
        Map::from_iter([("gateways".to_owned(), self.0.iter().map(object).collect())])
    }

    fn prepare(&self) -> Result<Opening, Failure> {
        let gateways = self.0.clone();
        Ok(Box::new(move |around| Box::new(Gateways::open(&gateways, around))))
    }
}

impl Open for Gateways {
    fn collect(&self, samples: &mut Samples) {
        for desk in &self.desks {
            desk.counters.collect(&desk.config.name, samples);
        }
    }

    fn tell(&self) {
        for desk in &self.desks {
            tracing::info!("gateway {}: {}", desk.config.name, desk.counters.in_words());
        }
    }

    fn close(self: Box<Self>) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        self.end.send_replace(true);
        Box::pin(async move {
            for door in self.doors {
                // One that has failed is closed too.
                let _ = door.await;
            }
        })
    }
}

/// What a gateway lets its clients do, each with its label.
fn meaning(gateway: &GatewayConfig) -> Vec<(&'static str, String)> {
    let GatewayConfig { clients, idle, patience, share, .. } = gateway;
    let who = match gateway.allow.iter().map(ToString::to_string).collect::<Vec<_>>() {
        all if !all.is_empty() => all.join(", "),
        _ if gateway.listen.ip().is_loopback() => "programs of this machine".to_owned(),
        _ => "EVERYBODY WHO REACHES IT: Modbus TCP has no login".to_owned(),
    };
    let units = match &gateway.units {
        Units::OfLine(line) => format!("the addresses of the drives of line {line}"),
        Units::Table(units) => {
            let units: Vec<String> = units.iter().map(|(unit, drive)| format!("{unit} {drive}")).collect();
            units.join(", ")
        }
    };
    let reads = format!(
        "as {}, together with the rest within {share} % of a line, as far as its plan leaves that; behind everything else what is left",
        gateway.reads
    );
    let writes = match gateway.rights {
        Rights { operate: true, .. } => {
            "commands, by the rules of motion, and stops ahead of everything; of drives by file stops alone"
        }
        Rights { stop: true, .. } => "stops only",
        _ => "none: it only reads",
    };
    let parameters = match (gateway.raw_writes, gateway.eeprom_writes) {
        (true, true) => "also parameters, WITH THOSE THAT WEAR OUT AN EEPROM",
        (true, false) => "also parameters, but none that goes to an EEPROM",
        _ => "no parameters",
    };
    let silence = gateway.client_timeout.map(|limit| {
        let then = if gateway.stops_when_silent { "its motors are stopped" } else { "that is an alarm" };
        ("silence", format!("of a client that has started a motor, for {limit:?}: {then}"))
    });
    let mut lines = vec![
        ("clients", format!("{clients} at once, each put out after {idle:?} without a request: {who}")),
        ("units", units),
        ("reads", reads),
        ("patience", format!("{patience:?}: what has not come by then is refused")),
        ("writes", writes.to_owned()),
    ];
    if gateway.rights.operate {
        lines.push(("parameters", parameters.to_owned()));
    }
    if gateway.broadcast {
        lines.push(("unit 0", "a stop for it stops all of these drives".to_owned()));
    }
    lines.extend(silence);
    lines
}
