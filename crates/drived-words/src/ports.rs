//! The serial ports of this machine, by their names alone: none is opened.

use std::{fs, path::Path};

use drive_bus::OpenError;

/// So many ports are named behind a refusal.
const NAMED: usize = 6;

/// The paths of the serial ports, those first whose name tells the adapter wherever it is plugged in.
pub fn all() -> Vec<String> {
    in_folders(Path::new("/dev"), Path::new("/sys/class/tty"))
}

/// Why a port cannot be had, and what there is instead.
pub fn refused(error: &OpenError) -> String {
    match error {
        OpenError::NotFound { path } => {
            format!("there is no serial port {}{}", path.display(), instead(path, &all()))
        }
        OpenError::Serial { path, .. } if path.is_dir() => {
            format!("{} is a folder and no serial port{}", path.display(), instead(path, &all()))
        }
        OpenError::Serial { path, reason } if !is_terminal(path) => {
            let instead = instead(path, &all());
            format!("{} is no serial port ({reason}){instead}", path.display())
        }
        OpenError::Connect { .. } => {
            format!("{error}: see that host and port are those of the gateway, and that it is switched on")
        }
        error => error.to_string(),
    }
}

/// Whether a port is there that a driver made for characters: its own failure is worth more than the names of others.
fn is_terminal(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    path.starts_with("/dev") && name.starts_with("tty") || path.starts_with("/dev/pts")
}

/// The ports that are there, for whoever named another one.
fn instead(path: &Path, ports: &[String]) -> String {
    let name = path.file_name().map(|name| name.to_string_lossy().to_lowercase()).unwrap_or_default();
    let is_meant = |port: &&String| {
        Path::new(port).file_name().is_some_and(|last| last.to_string_lossy().to_lowercase() == name)
    };
    if let Some(meant) = ports.iter().find(is_meant) {
        return format!(": did you mean {meant}?");
    }
    let named = ports.iter().take(NAMED).map(String::as_str).collect::<Vec<_>>().join(", ");
    match ports.len() {
        0 => ": none is present, plug the adapter in (it comes as /dev/ttyUSB0 or /dev/ttyACM0)".to_owned(),
        1..=NAMED => format!(": present: {named}"),
        more => format!(": present: {named} and {} more", more - NAMED),
    }
}

fn in_folders(dev: &Path, tty: &Path) -> Vec<String> {
    let by_id = dev.join("serial/by-id");
    let mut ports: Vec<String> =
        names(&by_id).iter().map(|name| by_id.join(name).display().to_string()).collect();
    let is_port = |name: &String| match tty.is_dir() {
        true => is_real(&tty.join(name)),
        // macOS has no such folder; what is called cu is a port.
        false => name.starts_with("cu."),
    };
    let plain = if tty.is_dir() { names(tty) } else { names(dev) };
    ports.extend(plain.iter().filter(|name| is_port(name)).map(|name| dev.join(name).display().to_string()));
    ports
}

/// Linux lists a port for each of a hardware's possible ones; those that are not there have no type.
fn is_real(port: &Path) -> bool {
    let unknown = fs::read_to_string(port.join("type")).is_ok_and(|kind| kind.trim() == "0");
    port.join("device").exists() && !unknown
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_names_a_port_that_is_not_there_is_told_which_are() {
        let present = ["/dev/ttyUSB0".to_owned(), "/dev/ttyS4".to_owned()];
        let told = |path: &str| instead(Path::new(path), &present);
        assert_eq!(told("ttyUSB0"), ": did you mean /dev/ttyUSB0?");
        assert_eq!(told("/dev/ttyusb0"), ": did you mean /dev/ttyUSB0?");
        assert_eq!(told("COM3"), ": present: /dev/ttyUSB0, /dev/ttyS4");
        assert!(instead(Path::new("COM3"), &[]).contains("none is present"));
        let many: Vec<String> = (0..9).map(|number| format!("/dev/ttyS{number}")).collect();
        assert!(instead(Path::new("COM3"), &many).ends_with("/dev/ttyS5 and 3 more"));
    }

    #[test]
    fn ports_that_are_there_are_offered_and_those_that_could_be_are_not() {
        let root = std::env::temp_dir().join(format!("drived-ports-{}", std::process::id()));
        let (dev, tty) = (root.join("dev"), root.join("tty"));
        fs::create_dir_all(dev.join("serial/by-id")).unwrap();
        fs::write(dev.join("serial/by-id/usb-FTDI_RS485-if00"), "").unwrap();
        for (name, device, kind) in [
            ("ttyUSB0", true, None),
            ("ttyS0", true, Some("0\n")),
            ("ttyS4", true, Some("4\n")),
            ("tty1", false, None),
        ] {
            fs::create_dir_all(tty.join(name)).unwrap();
            if device {
                fs::create_dir_all(tty.join(name).join("device")).unwrap();
            }
            if let Some(kind) = kind {
                fs::write(tty.join(name).join("type"), kind).unwrap();
            }
        }
        let found = in_folders(&dev, &tty);
        let of = |name: &str| dev.join(name).display().to_string();
        assert_eq!(found, [of("serial/by-id/usb-FTDI_RS485-if00"), of("ttyS4"), of("ttyUSB0")]);
        assert_eq!(
            in_folders(&root.join("nothing"), &tty),
            [
                root.join("nothing/ttyS4").display().to_string(),
                root.join("nothing/ttyUSB0").display().to_string()
            ]
        );
        fs::remove_dir_all(&root).unwrap();
    }
}
