//! The README's table of families is made from their capabilities and rows, so it cannot say what is not so.

use std::{env, fmt::Write as _, fs, path::Path};

use drive_core::{Capabilities, SerialSettings};
use drive_families::Family;

const BEGIN: &str = "<!-- families: made by `cargo test -p behaviour --test readme_table`, do not edit -->\n";
const END: &str = "<!-- families: end -->\n";

#[test]
fn the_table_in_the_readme_is_what_the_families_say() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md");
    let readme = fs::read_to_string(&path).expect("the README stands beside the crates");
    let (before, rest) = readme.split_once(BEGIN).expect("the README has the mark where the table begins");
    let (table, after) = rest.split_once(END).expect("the README has the mark where the table ends");
    let expected = format!("\n{}\n", table_of_families());
    if table == expected {
        return;
    }
    if env::var_os("UPDATE_README").is_some() {
        fs::write(&path, format!("{before}{BEGIN}{expected}{END}{after}"))
            .expect("the README can be written");
        return;
    }
    panic!("the README's table is out of date: run this test with UPDATE_README=1\nexpected:\n{expected}");
}

fn table_of_families() -> String {
    let families = Family::BUILT_IN.map(|family| (family, family.capabilities()));
    let mut table = String::from("| |");
    for (_, capabilities) in &families {
        let _ = write!(table, " {} |", capabilities.name);
    }
    table.push_str("\n|---|");
    table.push_str(&"---|".repeat(families.len()));
    let mut row = |title: &str, cell: &dyn Fn(Family, &Capabilities) -> String| {
        let _ = write!(table, "\n| {title} |");
        for (family, capabilities) in &families {
            let _ = write!(table, " {} |", cell(*family, capabilities));
        }
    };
    row("name in configurations", &|_, drive| format!("`{}`", drive.key));
    row("registers listed", &|family, _| family.capabilities().rows.len().to_string());
    row("of them writable", &|family, _| {
        family.capabilities().rows.iter().filter(|row| row.access.is_writable()).count().to_string()
    });
    row("Modbus functions", &|_, drive| {
        join(drive.functions.iter().map(|function| format!("{function:02X}")))
    });
    row("words a read / a write", &|_, drive| format!("{} / {}", drive.read_words, drive.write_words));
    row("addresses", &|_, drive| format!("1–{}", drive.highest_address));
    row("bit/s", &|_, drive| join(drive.speeds.iter().map(ToString::to_string)));
    row("formats", &|_, drive| join(drive.formats.iter().map(ToString::to_string)));
    row("factory setting", &|_, drive| settings(drive.factory));
    row("frequency setpoint in steps of", &|_, drive| drive.frequency_step.to_owned());
    row("speed setpoint", &|_, drive| yes(drive.speed_setpoint));
    row("stop modes", &|_, drive| join(drive.stop_modes.iter().map(ToString::to_string)));
    row("stops by broadcast", &|_, drive| join(drive.broadcast_stops.iter().map(ToString::to_string)));
    row("fault reset", &|_, drive| drive.fault_reset.to_owned());
    row("fault history", &|_, drive| match drive.fault_history {
        0 => "–".to_owned(),
        length => length.to_string(),
    });
    row("communication watchdog", &|_, drive| match drive.watchdog {
        None => "not in the manual".to_owned(),
        Some(watchdog) if watchdog.min == watchdog.max => format!("{:?}", watchdog.min),
        Some(watchdog) => format!("{:?}–{:?}", watchdog.min, watchdog.max),
    });
    row("on its expiry", &|_, drive| match drive.watchdog {
        None => "–".to_owned(),
        Some(watchdog) => join(watchdog.reactions.iter().map(ToString::to_string)),
    });
    row("identification", &|_, drive| drive.identification.unwrap_or("–").to_owned());
    row("gives control back", &|_, drive| yes(drive.release));
    row("saves parameters by", &|_, drive| drive.persist.unwrap_or("–").to_owned());
    row("exchanges of a status / of measurements", &|_, drive| {
        format!("{} / {}", drive.status_exchanges, drive.measurement_exchanges)
    });
    table.push('\n');
    table
}

fn join(parts: impl Iterator<Item = String>) -> String {
    let text = parts.collect::<Vec<_>>().join(", ");
    if text.is_empty() { "–".to_owned() } else { text }
}

fn yes(it_does: bool) -> String {
    if it_does { "yes" } else { "–" }.to_owned()
}

fn settings(settings: SerialSettings) -> String {
    settings.to_string()
}
