//! What the card's manual leaves open, as settings.

use std::time::Duration;

/// Which word is what, where the card's manual names a value without its address or a word without its bits.
///
/// **No default is confirmed for the Altivar 58, except [`message_watch`](Self::message_watch).** They are the Altivar 28's addresses and bits (BBV51701
/// p. 57), because the two drives share what the card's manual does print: W252 for the acceleration, W400 for the
/// control word, W401 for the reference, and the DRIVECOM value 6. Check them on your drive, or against the drive's
/// manual "Internal communication variables" (VVDED397057), before the motor is trusted to them: turn the motor from
/// the terminals and compare what [`status`](drive_core::Drive::status) says. What is `None` or 0 is not used: the
/// value is then absent from the status, and a command that needs it is [`Unsupported`](drive_core::Error::Unsupported).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Atv58Map {
    /// The word that holds the status register ETA, which the manual names in the reply to the UNI-TELWAY request F2
    /// (p. 13/37) without an address. Default 458.
    pub status: u16,
    /// The word that holds the signed output frequency in 0.1 Hz. Default 451.
    pub output_frequency: Option<u16>,
    /// The word that holds the reference before the ramp in 0.1 Hz. Default 450.
    pub reference: Option<u16>,
    /// The word that holds the motor current LCR (named on p. 13/37) in 0.1 A. Default 453.
    pub current: Option<u16>,
    /// The word that holds the line voltage in 0.1 V. Default 454.
    pub line_voltage: Option<u16>,
    /// The word that holds the thermal state of the motor in percent. Default 455.
    pub motor_thermal: Option<u16>,
    /// The word that holds the thermal state of the drive in percent. Default 456.
    pub drive_thermal: Option<u16>,
    /// The words that hold the low and the high speed in 0.1 Hz, between which a setpoint must be. Default 251 and 250.
    pub speed_limits: Option<(u16, u16)>,
    /// How many counts of the reference W401 are one hertz. Default 10: the manual writes 500 to it without a unit.
    pub reference_counts_per_hertz: u16,
    /// The bit of CMD that turns the motor in reverse, as a mask; 0: the drive cannot be told to. Default bit 11.
    pub reverse_command: u16,
    /// The control word that stops along the ramp. Default 7, which a user reports as "stop" and DRIVECOM calls "disable
    /// operation"; that the motor follows its ramp then is not confirmed. `None`: no ramp stop.
    pub ramp_stop: Option<u16>,
    /// The bit of ETA that is 1 while the output turns in reverse, as a mask. Default bit 15.
    pub reverse_status: u16,
    /// The bit of ETA that is 1 while an alarm is present, as a mask. Default bit 7.
    pub alarm: u16,
    /// The bit of ETA that is 1 while the line commands and 0 while local control is forced, as a mask; with 0 a start
    /// cannot be refused for it. Default bit 9.
    pub remote: u16,
    /// The bit of ETA that is 1 while the reference is reached, as a mask. Default bit 10.
    pub at_reference: u16,
    /// Whether the words that the drive alone writes are read by function 04 instead of 03. The manual has 03 for the
    /// words that a master can write and 04 for those that it can only read (p. 17–18/41–42), and reads W463 to W466 by 03
    /// (p. 20/44); whether each reads all words is not said. Default no.
    pub input_words: bool,
    /// How long the card waits for a message before it shows a communication fault. Default 10 s, which the manual prints
    /// for the bus (p. 24/48); it is 1 s in Modbus ASCII.
    pub message_watch: Duration,
}

impl Default for Atv58Map {
    fn default() -> Self {
        Self {
            status: 458,
            output_frequency: Some(451),
            reference: Some(450),
            current: Some(453),
            line_voltage: Some(454),
            motor_thermal: Some(455),
            drive_thermal: Some(456),
            speed_limits: Some((251, 250)),
            reference_counts_per_hertz: 10,
            reverse_command: 1 << 11,
            ramp_stop: Some(drive_drivecom::SWITCH_ON),
            reverse_status: 1 << 15,
            alarm: 1 << 7,
            remote: 1 << 9,
            at_reference: 1 << 10,
            input_words: false,
            message_watch: crate::MESSAGE_WATCH,
        }
    }
}
