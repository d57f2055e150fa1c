//! What a UART makes of characters that may come at another speed, or in another format, than its own: the waveform of the
//! speaker, looked at in the middle of each bit of the listener.
//!
//! A UART waits for a falling edge, looks half a bit later whether it is a start bit, and then once per bit: data, lowest
//! first, parity, and the first stop bit alone. After a stop bit that is none it waits until the line has been at rest
//! before it takes another edge for a start. Where it looks exactly at an edge it sees what comes after it, because it notices
//! the start of a character a little late and never early.

use drive_core::{
    SerialSettings,
    serial::{CharacterFormat, Parity},
};

use crate::defects::{Polarity, Rest};

/// A character as a listener hears it. Times are in bits of the speaker, from the start of its first character.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Character {
    pub(super) byte: u8,
    pub(super) begins: u32,
    pub(super) ends: u32,
    /// Whether parity and stop bit are right.
    pub(super) intact: bool,
}

/// What a listener hears of characters that follow each other without a pause, between two silences.
pub(super) fn heard(bytes: &[u8], speaker: SerialSettings, listener: SerialSettings) -> Vec<Character> {
    heard_as(Polarity::Right, bytes, speaker, listener)
}

/// The same where the wires may be swapped between the two.
pub(super) fn heard_as(
    polarity: Polarity,
    bytes: &[u8],
    speaker: SerialSettings,
    listener: SerialSettings,
) -> Vec<Character> {
    let wave = Wave { bytes, format: speaker.format(), polarity };
    let format = listener.format();
    // The bit of the speaker that the listener looks at in the middle of its own bit number so many after an edge.
    let (speed, own) = (u64::from(speaker.baud()), u64::from(listener.baud()));
    let look = |edge: u32, bit: u32| edge + narrow((2 * u64::from(bit) + 1) * speed / (2 * own));
    let mut characters = Vec::with_capacity(bytes.len());
    let mut from = 0;
    while let Some(begins) = wave.falling_edge(from) {
        from = look(begins, 0) + 1;
        if wave.is_high(look(begins, 0)) {
            continue;
        }
        let data = u32::from(format.data_bits());
        let byte = (0..data)
            .filter(|bit| wave.is_high(look(begins, 1 + bit)))
            .fold(0, |byte: u8, bit| byte | 1_u8.wrapping_shl(bit));
        let parity = parity_bit(byte, format);
        let is_parity_right = parity.is_none_or(|high| wave.is_high(look(begins, 1 + data)) == high);
        let stop = look(begins, 1 + data + u32::from(parity.is_some()));
        from = stop + 1;
        let ends = begins + narrow((u64::from(format.bits()) * speed).div_ceil(own));
        characters.push(Character { byte, begins, ends, intact: is_parity_right && wave.is_high(stop) });
    }
    characters
}

/// The levels of characters without a pause between them; at rest, a line is high.
struct Wave<'a> {
    bytes: &'a [u8],
    format: CharacterFormat,
    polarity: Polarity,
}

impl Wave<'_> {
    fn is_high(&self, bit: u32) -> bool {
        let is_over = u64::from(bit) >= self.bytes.len() as u64 * u64::from(self.format.bits());
        match self.polarity {
            Polarity::Right => self.is_high_as_sent(bit),
            Polarity::Swapped(rest) if is_over => rest == Rest::High,
            Polarity::Swapped(_) => !self.is_high_as_sent(bit),
        }
    }

    fn is_high_as_sent(&self, bit: u32) -> bool {
        let width = self.format.bits();
        let byte = usize::try_from(bit / width).ok().and_then(|index| self.bytes.get(index));
        let (Some(&byte), data) = (byte, u32::from(self.format.data_bits())) else { return true };
        match bit % width {
            0 => false,
            number if number <= data => byte >> (number - 1) & 1 == 1,
            number if number == data + 1 => parity_bit(byte, self.format).unwrap_or(true),
            _ => true,
        }
    }

    /// The next bit from this one on that is low after one that was high.
    fn falling_edge(&self, from: u32) -> Option<u32> {
        let bits = narrow(self.bytes.len() as u64 * u64::from(self.format.bits()));
        (from..bits).find(|&bit| !self.is_high(bit) && (bit == 0 || self.is_high(bit - 1)))
    }
}

/// The parity bit of a character, where its format has one.
fn parity_bit(byte: u8, format: CharacterFormat) -> Option<bool> {
    let is_odd = (byte & (u8::MAX >> (8 - format.data_bits()))).count_ones() % 2 == 1;
    match format.parity() {
        Parity::None => None,
        Parity::Even => Some(is_odd),
        Parity::Odd => Some(!is_odd),
    }
}

/// A piece of waveform is some thousand bits long.
fn narrow(bits: u64) -> u32 {
    u32::try_from(bits).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str) -> SerialSettings {
        text.parse().unwrap()
    }

    /// The bytes that are heard, and whether each is intact.
    fn hears(listener: &str, speaker: &str, bytes: &[u8]) -> Vec<(u8, bool)> {
        let characters = heard(bytes, at(speaker), at(listener));
        characters.into_iter().map(|character| (character.byte, character.intact)).collect()
    }

    /// Drawn on paper: nine low bits of 19200 are four and a half of 9600. The listener looks at 1, 3, 5, 7 (low), and
    /// at 9, where the stop bit begins: start, 0, 0, 0, then only ones.
    #[test]
    fn a_zero_at_twice_the_speed_is_f8() {
        assert_eq!(hears("9600 8N1", "19200 8N1", &[0x00]), [(0xF8, true)]);
    }

    /// Nine low bits of 9600 are eighteen of 19200: there is no stop bit where it should be.
    #[test]
    fn a_zero_at_half_the_speed_is_a_zero_without_stop_bit() {
        assert_eq!(hears("19200 8N1", "9600 8N1", &[0x00]), [(0x00, false)]);
    }

    /// Each low bit is over where the middle of a start bit would be.
    #[test]
    fn of_alternating_bits_at_twice_the_speed_nothing_is_heard() {
        assert_eq!(hears("9600 8N1", "19200 8N1", &[0x55]), []);
    }

    /// Levels of 19200: LL HH LL HH LL HH LL HH LL HH. Start L, data L HH LL HH L: 66h, and L for a stop bit. Next
    /// falling edge: the seventh pair. Start L, data L HH LL HHH: E6h.
    #[test]
    fn alternating_bits_at_half_the_speed_are_two_characters() {
        assert_eq!(hears("19200 8N1", "9600 8N1", &[0x55]), [(0x66, false), (0xE6, true)]);
    }

    /// The parity bit of 01h is 1, as a stop bit is; that of 03h is 0.
    #[test]
    fn who_expects_no_parity_takes_the_parity_bit_for_the_stop_bit() {
        let heard = [(0x01, true), (0x03, false), (0x07, true)];
        assert_eq!(hears("19200 8N1", "19200 8E1", &[0x01, 0x03, 0x07]), heard);
    }

    /// The stop bit of 01h is its even parity, and the next start bit no stop bit. After it 02h goes on L, H, LLLLLL, H:
    /// start at its third bit, five zeros, then ones, and a parity bit of 1 for three ones.
    #[test]
    fn who_expects_parity_loses_the_beginning_of_what_follows() {
        assert_eq!(hears("19200 8E1", "19200 8N1", &[0x01, 0x02]), [(0x01, false), (0xE0, true)]);
        assert_eq!(hears("19200 8E1", "19200 8N1", &[0x01]), [(0x01, true)]);
        assert_eq!(hears("19200 8E1", "19200 8N1", &[0x03]), [(0x03, false)]);
    }

    #[test]
    fn the_other_parity_is_wrong_for_every_character() {
        let heard = (0..=255).map(|byte| (byte, false)).collect::<Vec<_>>();
        let bytes: Vec<u8> = (0..=255).collect();
        assert_eq!(hears("9600 8O1", "9600 8E1", &bytes), heard);
    }

    #[test]
    fn a_second_stop_bit_is_missed_by_nobody_and_disturbs_nobody() {
        let bytes: Vec<u8> = (0..=255).collect();
        let whole: Vec<_> = bytes.iter().map(|byte| (*byte, true)).collect();
        assert_eq!(hears("9600 8N1", "9600 8N2", &bytes), whole);
        assert_eq!(hears("9600 8N2", "9600 8N1", &bytes), whole);
    }

    /// Seven bits with an odd parity of 0 and eight bits without parity: the eighth bit is the parity.
    #[test]
    fn eight_bits_without_parity_hear_the_parity_of_seven_as_their_highest_bit() {
        assert_eq!(hears("9600 8N1", "9600 7E1", &[0x01, 0x03]), [(0x81, true), (0x03, true)]);
    }

    /// Upside down 55h is H L H L H L H L H L: a start at its second bit, H L H L H L H L for data, and what the line is at
    /// rest for a stop bit. 00h is nine high bits and a low stop bit: a start, and what the
    /// line is at rest for all that follows.
    #[test]
    fn on_swapped_wires_a_character_is_heard_upside_down_from_its_first_low_bit_on() {
        let hears = |rest, byte| {
            let polarity = Polarity::Swapped(rest);
            let characters = heard_as(polarity, &[byte], at("9600 8N1"), at("9600 8N1"));
            characters.into_iter().map(|character| (character.byte, character.intact)).collect::<Vec<_>>()
        };
        assert_eq!(hears(Rest::High, 0x55), [(0x55, true)]);
        assert_eq!(hears(Rest::Low, 0x55), [(0x55, false)]);
        assert_eq!(hears(Rest::High, 0x00), [(0xFF, true)]);
        assert_eq!(hears(Rest::Low, 0x00), [(0x00, false)]);
    }

    #[test]
    fn with_equal_settings_every_character_is_heard_as_it_was_said_and_when() {
        let mut random = fastrand::Rng::with_seed(16);
        for format in ["7O1", "7E1", "7O2", "7E2", "8O1", "8E1", "8N1", "8N2", "8O2", "8E2"] {
            for baud in [300, 1_200, 9_600, 19_200, 38_400, 115_200, 1_000_000] {
                let settings = at(&format!("{baud} {format}"));
                let mask = u8::MAX >> (8 - settings.format().data_bits());
                let bytes: Vec<u8> = std::iter::repeat_with(|| random.u8(..) & mask).take(300).collect();
                let width = settings.format().bits();
                let said = bytes.iter().zip((0..).step_by(width as usize)).map(|(byte, begins)| Character {
                    byte: *byte,
                    begins,
                    ends: begins + width,
                    intact: true,
                });
                assert_eq!(heard(&bytes, settings, settings), said.collect::<Vec<_>>(), "{settings}");
            }
        }
    }

    #[test]
    fn whatever_is_said_at_whatever_speed_no_more_is_heard_than_fits_into_its_time() {
        let mut random = fastrand::Rng::with_seed(17);
        let speeds = [300, 1_200, 2_400, 4_800, 9_600, 19_200, 38_400, 57_600, 115_200];
        for _ in 0..2_000 {
            let [speaker, listener] = [(); 2].map(|()| {
                let format = random.choice(["7E1", "8E1", "8N1", "8O1", "8N2"]).unwrap();
                at(&format!("{} {format}", random.choice(speeds).unwrap()))
            });
            let count = random.usize(0..20);
            let bytes: Vec<u8> = std::iter::repeat_with(|| random.u8(..)).take(count).collect();
            let heard = heard(&bytes, speaker, listener);
            let time = speaker.characters(bytes.len()) + listener.characters(1);
            // Each begins at the earliest in the stop bit of the one before.
            let least = listener.bits(listener.format().bits() - u32::from(listener.format().stop_bits()));
            assert!(least * u32::try_from(heard.len()).unwrap() <= time, "{speaker} {listener} {bytes:?}");
            assert!(heard.is_sorted_by_key(|character| character.begins));
        }
    }
}
