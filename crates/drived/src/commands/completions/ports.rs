//! The serial ports of this machine, by their names alone: none is opened.

use std::{fs, path::Path};

/// The paths of the serial ports, those first whose name tells the adapter wherever it is plugged in.
pub(super) fn all() -> Vec<String> {
    in_folders(Path::new("/dev"), Path::new("/sys/class/tty"))
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
