//! Files that the program itself has written, or that others write, changed.

use std::{fs, io, time::Duration};

use drive_bus::capture::{Captured, Direction, Dissector, Writer};

use super::{Target, judge, misfortunes, plant::Plant};
use crate::{
    child,
    fuzz::{Source, change},
};

/// No tool needs so long for a small file.
const LONGEST: Duration = Duration::from_secs(20);

pub(super) struct Files {
    captures: [Vec<u8>; 2],
    config: Vec<u8>,
    backup: Vec<u8>,
    history: Vec<u8>,
    /// What SQLite has not written into it yet.
    log: Vec<u8>,
}

impl Files {
    /// As they are on this plant.
    pub(super) fn of(plant: &Plant) -> io::Result<Self> {
        let kept = plant.folder.join("kept.txt");
        let ended = child::run(
            plant
                .tool()
                .args(["param", "backup", "pump 1", "--to"])
                .arg(&kept)
                .arg("--socket")
                .arg(plant.folder.join("socket")),
            Duration::from_secs(120),
        )?;
        let backup = fs::read(&kept).map_err(|error| io::Error::other(format!("{error}: {ended:?}")))?;
        let found = misfortunes::find(&plant.folder.join("state"));
        let found = found.ok_or_else(|| io::Error::other("the daemon keeps no history"))?;
        let (history, log) = (fs::read(&found)?, fs::read(misfortunes::log_of(&found)).unwrap_or_default());
        Ok(Self {
            captures: [own_capture()?, pcap()],
            config: fs::read(plant.config())?,
            backup,
            history,
            log,
        })
    }

    /// One of them, changed, is read or refused.
    pub(super) fn execute(&self, target: Target, plant: &Plant, rng: &mut Source) -> Result<(), String> {
        let (mut bytes, name, arguments): (_, _, &[&str]) = match target {
            Target::Captures => {
                let which = rng.usize(..2);
                (self.captures[which].clone(), ["taken.pcapng", "taken.pcap"][which], &["explain"])
            }
            Target::Configuration => (self.config.clone(), "changed.toml", &["check", "--config"]),
            Target::Backup => (self.backup.clone(), "changed.txt", &["param", "diff"]),
            _ => (
                self.history.clone(),
                "changed.sqlite",
                &["history", "pump 1", "--from", "2020-01-01 00:00", "--file"],
            ),
        };
        match target {
            // A change in the middle of pages counts more than one byte more, behind which all is moved.
            Target::History => {
                let mut log = self.log.clone();
                let changed = if rng.bool() && !log.is_empty() { &mut log } else { &mut bytes };
                for _ in 0..rng.usize(1..40) {
                    let at = rng.usize(..changed.len());
                    changed[at] = rng.u8(..);
                }
                let path = misfortunes::log_of(&plant.folder.join(name));
                fs::write(path, log).map_err(|error| error.to_string())?;
            }
            _ => change(rng, &mut bytes),
        }
        let path = plant.folder.join(name);
        let written = fs::write(&path, &bytes);
        written.map_err(|error| error.to_string())?;
        let mut command = plant.tool();
        command.args(arguments).arg(&path);
        if target == Target::Backup {
            command.arg(plant.folder.join("kept.txt"));
        }
        let ended = child::run(&mut command, LONGEST).map_err(|error| error.to_string())?;
        judge::tool(&ended)
    }
}

fn own_capture() -> io::Result<Vec<u8>> {
    let mut file = Vec::new();
    let mut writer = Writer::new(&mut file, Dissector::Rtu)?;
    let frames: [&[u8]; 4] = [
        &[1, 3, 0x0C, 0x81, 0, 1, 0xD6, 0xB2],
        &[1, 3, 2, 0, 0x37, 0xF8, 0x52],
        &[1, 6, 0x21, 0x35, 0, 6, 0x12, 0x3A],
        &[1, 0x86, 4, 0x43, 0xA3],
    ];
    for (at, bytes) in (0..).zip(frames) {
        let direction = if at % 2 == 0 { Direction::Sent } else { Direction::Received };
        writer.write(&Captured {
            at: Duration::from_millis(at * 9),
            direction,
            bytes: bytes.to_vec().into(),
        })?;
    }
    Ok(file)
}

/// As tcpdump writes it (libpcap's file format: its header, then records): Modbus TCP in TCP in IPv4 in Ethernet.
fn pcap() -> Vec<u8> {
    let mut file =
        vec![0xD4, 0xC3, 0xB2, 0xA1, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0, 0, 1, 0, 0, 0];
    let frames: [(u16, u16, &[u8]); 3] = [
        (40_000, 502, &[0x15, 1, 0, 0, 0, 6, 1, 3, 0x0C, 0x81, 0, 1]),
        (502, 40_000, &[0x15, 1, 0, 0, 0, 5, 1, 3, 2, 0, 0x37]),
        (502, 40_000, &[0x15, 2, 0, 0, 0, 3, 1, 0x83, 4]),
    ];
    for (second, (from, to, data)) in (1_700_000_000_u32..).zip(frames) {
        let mut packet = vec![2, 0, 0, 0, 0, 1, 2, 0, 0, 0, 0, 2, 8, 0];
        let total = 40 + data.len() as u16;
        packet.extend([0x45, 0]);
        packet.extend(total.to_be_bytes());
        packet.extend([0, 0, 0x40, 0, 64, 6, 0, 0, 10, 0, 0, 1, 10, 0, 0, 2]);
        packet.extend(from.to_be_bytes());
        packet.extend(to.to_be_bytes());
        packet.extend([0, 0, 0, 1, 0, 0, 0, 1, 0x50, 0x18, 0xFF, 0xFF, 0, 0, 0, 0]);
        packet.extend(data);
        for word in [second, 0, packet.len() as u32, packet.len() as u32] {
            file.extend(word.to_le_bytes());
        }
        file.extend(packet);
    }
    file
}
