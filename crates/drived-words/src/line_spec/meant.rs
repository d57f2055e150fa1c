//! A line in other people's spellings, where nothing else can be meant: spaces, colons, `19.2k`, speed and format changed round.

use drive_core::serial::CharacterFormat;

use crate::meant::speed;

/// The line as it is written here.
pub(super) fn meant(text: &str) -> String {
    let mut parts: Vec<String> = text.split(',').map(|part| part.trim().to_owned()).collect();
    if let [alone] = &*parts {
        parts = by_colons(alone);
    }
    for part in parts.iter_mut().skip(1) {
        if let Some(baud) = speed(part) {
            *part = baud.to_string();
        }
    }
    if let [_, first, second, ..] = &mut *parts
        && is_format(first)
        && speed(second).is_some()
    {
        std::mem::swap(first, second);
    }
    parts.join(",")
}

/// `PORT:19200:8E1` as its parts. A port may have colons in its own name, and a host has one before its own port: only what is a
/// speed behind them is one.
fn by_colons(text: &str) -> Vec<String> {
    let whole = || vec![text.to_owned()];
    if text.starts_with("tcp://") {
        return whole();
    }
    let (rest, format) = match text.rsplit_once(':') {
        Some((rest, format)) if is_format(format) => (rest, Some(format)),
        _ => (text, None),
    };
    match rest.rsplit_once(':') {
        // Of a serial server the first number is its TCP port.
        Some((port, _))
            if port.ends_with("rtu+tcp") || text.starts_with("rtu+tcp://") && !port[10..].contains(':') =>
        {
            whole()
        }
        Some((port, baud)) if speed(baud).is_some() => {
            [port, baud].into_iter().chain(format).map(str::to_owned).collect()
        }
        _ => whole(),
    }
}

/// The character format whose signs stand in another order in this line: `E81` for `8E1`.
pub(super) fn format(line: &str) -> Option<String> {
    let mixed = line.split(',').skip(1).find(|part| part.len() == 3 && !is_format(part))?;
    let one_of = |signs: &str| {
        let mut found =
            mixed.chars().map(|sign| sign.to_ascii_uppercase()).filter(|sign| signs.contains(*sign));
        found.next().filter(|_| found.next().is_none())
    };
    Some([one_of("78")?, one_of("NEO")?, one_of("12")?].iter().collect())
}

fn is_format(text: &str) -> bool {
    text.parse::<CharacterFormat>().is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_in_other_peoples_spellings_are_understood() {
        for (text, line) in [
            ("COM3, 19200, 8E1", "COM3,19200,8E1"),
            ("COM3:19200:8e1", "COM3,19200,8e1"),
            ("COM3:9600", "COM3,9600"),
            ("/dev/ttyUSB0,19.2k,8E1", "/dev/ttyUSB0,19200,8E1"),
            ("/dev/ttyUSB0,8E1,19200", "/dev/ttyUSB0,19200,8E1"),
            ("rtu+tcp://plant:4001:9600:8N1", "rtu+tcp://plant:4001,9600,8N1"),
        ] {
            assert_eq!(meant(text), line);
        }
    }

    #[test]
    fn a_format_in_another_order_is_asked_about() {
        assert_eq!(format("COM3,19200,E81").as_deref(), Some("8E1"));
        assert_eq!(format("COM3,9600,n18").as_deref(), Some("8N1"));
        for line in ["COM3,19200,8E1", "COM3,300,9X9", "COM3,300", "E81"] {
            assert_eq!(format(line), None, "{line}");
        }
    }

    #[test]
    fn what_is_written_as_it_should_be_stays_so() {
        for line in [
            "/dev/ttyUSB0",
            "/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0",
            "/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0,19200,8E1",
            "tcp://plant:502",
            "tcp://[::1]:9600",
            "rtu+tcp://plant:9600",
            "COM3,19200,8O1,unitelway,header=simplified,link-timeout=200ms",
            "tcp://plant:502,gateway=3x1s",
            "",
            ",9600",
        ] {
            assert_eq!(meant(line), line);
        }
    }
}
