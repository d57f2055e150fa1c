//! What the registers of a slave held, by all that a capture has of it: an image that answers any question of them.

use std::{collections::BTreeMap, time::Duration};

use drive_sim::{Cast, Exception, Model, Observation, Panel, Playback, Played, Rules, Says};

/// Reads and writes of any size that Modbus has.
const RULES: Rules = Rules {
    read_holding: 125,
    read_input: 125,
    write_single: true,
    write_multiple: 123,
    diagnostics: &[],
    event_counter: false,
    broadcast: &[0x06, 0x10],
    turnaround: Duration::ZERO,
};

/// The last word that a capture has of each register of one slave.
pub(super) type Words = BTreeMap<u16, u16>;

/// What a capture says of the registers: answers to reads, and writes that were confirmed, the later over the earlier.
pub(super) fn words(exchanges: &[(Vec<u8>, Played)]) -> Words {
    let mut words = Words::new();
    for (request, played) in exchanges {
        let Says::Message(answer) = &played.says else { continue };
        match (&**request, &**answer) {
            ([function @ (3 | 4), high, low, _, count], [same, length, data @ ..])
                if function == same
                    && usize::from(*length) == data.len()
                    && data.len() == 2 * usize::from(*count) =>
            {
                put(&mut words, [*high, *low], data);
            }
            ([6, high, low, data @ ..], answer) if *request == answer => put(&mut words, [*high, *low], data),
            ([16, high, low, _, _, length, data @ ..], [16, ..]) if usize::from(*length) == data.len() => {
                put(&mut words, [*high, *low], data);
            }
            _ => {}
        }
    }
    words
}

fn put(words: &mut Words, first: [u8; 2], data: &[u8]) {
    let (pairs, _) = data.as_chunks::<2>();
    for (address, pair) in (u16::from_be_bytes(first)..=u16::MAX).zip(pairs) {
        words.insert(address, u16::from_be_bytes(*pair));
    }
}

/// A slave that holds an image. What is no question of a register is played back as it was.
pub(super) struct Image {
    words: Words,
    rest: Playback,
    missing: Box<dyn FnMut(u16) + Send>,
}

impl Image {
    /// `missing` is told each register that was asked for and that the capture does not have.
    pub(super) fn new(words: Words, rest: Playback, missing: impl FnMut(u16) + Send + 'static) -> Self {
        Self { words, rest, missing: Box::new(missing) }
    }

    fn known(&mut self, address: u16) -> Result<&mut u16, Exception> {
        if !self.words.contains_key(&address) {
            (self.missing)(address);
        }
        self.words.get_mut(&address).ok_or(Exception::ILLEGAL_ADDRESS)
    }
}

impl Model for Image {
    fn rules(&self) -> &Rules {
        &RULES
    }

    fn play(&mut self, request: &[u8], cast: Cast) -> Option<Played> {
        match request.first() {
            Some(3 | 4 | 6 | 16) => None,
            _ => self.rest.play(request, cast),
        }
    }

    fn read(&mut self, address: u16) -> Result<u16, Exception> {
        self.known(address).copied()
    }

    fn write(&mut self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        *self.known(address)? = value;
        Ok(())
    }

    fn advance(&mut self, _: Duration) {}

    fn power(&mut self, _: bool) {}

    fn trip(&mut self, _: u16) {}

    fn set_load(&mut self, _: u16) {}

    fn panel(&mut self, _: Panel) {}

    fn observe(&self) -> Observation {
        Observation::default()
    }

    fn peek(&self, address: u16) -> Option<u16> {
        self.words.get(&address).copied()
    }

    fn poke(&mut self, address: u16, value: u16) -> bool {
        self.words.insert(address, value).is_some()
    }
}
