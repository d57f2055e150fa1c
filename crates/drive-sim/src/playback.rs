//! A slave that plays back what a real one has said: [`Playback`].

use std::{collections::BTreeMap, fmt, time::Duration};

use crate::{
    model::{Cast, Exception, Model, Observation, Played, Rules, Says, UniTe},
    world::Panel,
};

/// A slave nobody has recorded a rule of: it has its recording alone.
const RULES: Rules = Rules {
    read_holding: 0,
    read_input: 0,
    write_single: false,
    write_multiple: 0,
    diagnostics: &[],
    event_counter: false,
    broadcast: &[],
    turnaround: Duration::ZERO,
};

/// A slave that plays back what was recorded of a real one: to the same request, byte for byte, the same answers in the
/// same order with the times that they took, and behind the last of them the first again. To a request that was never
/// recorded it says nothing, and tells. It has no registers, no motor and no counters of its own.
pub struct Playback {
    takes: BTreeMap<Vec<u8>, Takes>,
    speaks_unite: bool,
    unknown: Tell,
}

/// Tells somebody of a request.
type Tell = Box<dyn FnMut(&[u8]) + Send>;

/// What was said to one request, and which of it comes next.
#[derive(Debug, Default)]
struct Takes {
    all: Vec<Played>,
    next: usize,
}

impl Playback {
    /// Plays back requests with what was said to them, in the order in which they were recorded: PDUs of Modbus, or UNI-TE
    /// requests. `unknown` is told each request that was not recorded.
    #[must_use]
    pub fn new(
        recorded: impl IntoIterator<Item = (Vec<u8>, Played)>,
        unknown: impl FnMut(&[u8]) + Send + 'static,
    ) -> Self {
        let mut takes: BTreeMap<Vec<u8>, Takes> = BTreeMap::new();
        for (request, played) in recorded {
            takes.entry(request).or_default().all.push(played);
        }
        Self { takes, speaks_unite: false, unknown: Box::new(unknown) }
    }

    /// The same for a slave that speaks UNI-TE. A request to mirror (FAh) is answered also where it was not recorded: the
    /// numbers in it are the master's own, and other ones each time.
    #[must_use]
    pub fn speaking_unite(self) -> Self {
        Self { speaks_unite: true, ..self }
    }
}

impl fmt::Debug for Playback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Playback").field("requests", &self.takes.len()).finish_non_exhaustive()
    }
}

impl Model for Playback {
    fn rules(&self) -> &Rules {
        &RULES
    }

    fn play(&mut self, request: &[u8], cast: Cast) -> Option<Played> {
        let nothing = Played { after: Duration::ZERO, says: Says::Nothing };
        if let Some(takes) = self.takes.get_mut(request) {
            let played = takes.all.get(takes.next).cloned();
            takes.next = (takes.next + 1) % takes.all.len().max(1);
            return Some(played.unwrap_or(nothing));
        }
        match *request {
            [0xFA, _, ref data @ ..] if self.speaks_unite => {
                let says = Says::Message([&[0xFB], data].concat());
                return Some(Played { after: Duration::ZERO, says });
            }
            _ if cast == Cast::Unicast => (self.unknown)(request),
            _ => {}
        }
        Some(nothing)
    }

    fn unite(&self) -> Option<UniTe> {
        let none = UniTe { product: [0; 3], name: "", command: [0; 4], report: [0; 4] };
        self.speaks_unite.then_some(none)
    }

    fn read(&mut self, _: u16) -> Result<u16, Exception> {
        Err(Exception::ILLEGAL_ADDRESS)
    }

    fn write(&mut self, _: u16, _: u16, _: Cast) -> Result<(), Exception> {
        Err(Exception::ILLEGAL_ADDRESS)
    }

    fn advance(&mut self, _: Duration) {}

    fn power(&mut self, _: bool) {}

    fn trip(&mut self, _: u16) {}

    fn set_load(&mut self, _: u16) {}

    fn panel(&mut self, _: Panel) {}

    fn observe(&self) -> Observation {
        Observation::default()
    }

    fn peek(&self, _: u16) -> Option<u16> {
        None
    }

    fn poke(&mut self, _: u16, _: u16) -> bool {
        false
    }
}
