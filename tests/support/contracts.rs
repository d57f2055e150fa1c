//! What the manuals say of each family that its capabilities do not: control word, status word, exceptions.

use drive_core::ExceptionMeaning::{
    self, Accepted, Busy, Failed, NoSuchFunction, NoSuchRegister, NotNow, Refused, ValueRefused,
};
use drive_families::Family;
use drive_testing::{
    Contract,
    contract::{ControlWord, StatusWord},
};

use crate::{
    configurations::Around,
    drives::{self, Five, five},
};

/// The contract of a family.
#[must_use]
pub fn contract(family: Family) -> Contract {
    let (control, plausible) = control(family);
    Contract {
        trip: Some(drives::a_trip(family)),
        watchdog_trips: drives::communication_trips(family),
        plausible,
        control: Some(control),
        status: Some(status(family)),
        exceptions: exceptions(family),
        // The card of the Altivar 58 says it over UNI-TELWAY only.
        identifies_elsewhere: family == Family::ATV58,
        around: Some(Box::new(Around(family))),
        ..Contract::new(
            family.capabilities(),
            move |port, slave| drives::drive(family, port, slave),
            move || drives::machine(family),
        )
    }
}

/// The control word, and words that are plausible somewhere: the words of the chart, and 080Fh, reverse (BBV51701 p. 12, 19;
/// VVDED397054 p. 21/45).
fn control(family: Family) -> (ControlWord, &'static [u16]) {
    /// `ETA` of the chart's states, `ETI` with the bus in control, 0 and small numbers.
    const CHART: &[u16] = &[0x0240, 0x0221, 0x0223, 0x0227, 0x0227, 0x4000, 0, 0, 0, 1, 2, 0x0208];
    const fn control(register: u16, words: &'static [u16]) -> ControlWord {
        ControlWord { register, words, others: |_| 0, unseen: &[], once: &[] }
    }
    match five(family) {
        // Guide d'exploitation §8.4: the priorities, as far as CMOD and FMOD do not give the bus command, with run, reverse,
        // freewheel, DC braking, fault reset; 0 to release. Bits that belong to others are kept as they were read; no run
        // command, edge or reserved bit is among them.
        Five::Atv21 => {
            let words = &[
                0x0000, 0xC000, 0xC080, 0xC400, 0xC600, 0xC800, 0x2000, 0x6000, 0xA000, 0xE000, 0x0400,
                0x0600, 0x4400, 0x4600, 0x8400, 0x8600,
            ];
            let plausible = &[0x4000, 0x4000, 0x4000, 0x6400, 0x6600, 2, 2, 2, 4, 4, 4, 0, 0, 1, 8_000];
            let others = |written| if written & 0x3508 == 0 { 0xCAF7 } else { 0x0070 };
            // Words that answer anything seldom name the bus by CMOD and FMOD alike, or run in reverse.
            let unseen = &[0x0400, 0x0600, 0x4600, 0x8600];
            (ControlWord { others, unseen, ..control(0xFA00, words) }, plausible)
        }
        Five::Atv28 => {
            let words = &[0x0000, 0x0006, 0x0007, 0x000F, 0x0080, 0x080F, 0x100F, 0x200F, 0x400F];
            (control(400, words), CHART)
        }
        Five::Atv58 => {
            let words = &[0x0000, 0x0002, 0x0006, 0x0007, 0x000F, 0x0080, 0x080F];
            (control(400, words), CHART)
        }
        // No Altivar 312 whose settings are any words is started: one of them always decides something instead.
        Five::Atv312 => {
            let words = &[0x0000, 0x0002, 0x0006, 0x0007, 0x000F, 0x0080, 0x080F, 0x100F, 0x200F, 0x400F];
            let unseen = &[0x0006, 0x0007, 0x000F, 0x080F];
            (ControlWord { others: |_| 0xF800, unseen, ..control(8501, words) }, CHART)
        }
        // §5.1: run, reverse, and a pulse of the inputs of n06 to n08.
        Five::Omron3g3ev => {
            let words = &[0x0000, 0x0001, 0x0003, 0x0010, 0x0020, 0x0040];
            let plausible =
                &[0x0004, 0x0005, 0x0142, 0x0041, 0x0065, 0, 0, 0, 0, 0, 1, 5, drives::RESET_FUNCTION];
            (ControlWord { others: |_| 0x0070, ..control(0x0001, words) }, plausible)
        }
    }
}

/// The status word, what else a drive holds that stands ready at zero speed under the bus, and what tells a trip.
fn status(family: Family) -> StatusWord {
    const CHART: fn(u16) -> bool = |word| matches!(word & 0x006F, 0x0008 | 0x0028 | 0x000F | 0x002F);
    match five(family) {
        Five::Atv21 => StatusWord {
            register: 0xFD01,
            others: &[(0x0003, 2), (0x0004, 4)],
            is_tripped: |word| word & 0x0002 != 0,
        },
        Five::Atv28 | Five::Atv58 => {
            StatusWord { register: 458, others: &[(459, 0x4002)], is_tripped: CHART }
        }
        Five::Atv312 => StatusWord { register: 3201, others: &[(3206, 0x4002)], is_tripped: CHART },
        // Bit E, "major fault, incl. communication" (§5.2).
        Five::Omron3g3ev => StatusWord {
            register: 0x002C,
            others: &[(0x0020, 0x0004), (0x0102, 5)],
            is_tripped: |word| word & 0x4000 != 0,
        },
    }
}

/// As the Modbus specification has them, of which their manuals list 1 to 4; and last UNI-TE's negative reply (Altivar 58, p. 13/37).
static SPECIFIED: [(u8, ExceptionMeaning); 7] = [
    (1, NoSuchFunction),
    (2, NoSuchRegister),
    (3, ValueRefused),
    (4, Failed),
    (5, Accepted),
    (6, Busy),
    (0xFD, Refused),
];

fn exceptions(family: Family) -> &'static [(u8, ExceptionMeaning)] {
    match five(family) {
        Five::Atv21 => &[(1, NoSuchFunction), (2, NoSuchRegister), (3, ValueRefused), (4, NotNow)],
        Five::Atv28 | Five::Atv312 => &SPECIFIED[..6],
        Five::Atv58 => &SPECIFIED,
        Five::Omron3g3ev => &[
            (1, NoSuchFunction),
            (2, NoSuchRegister),
            (3, ValueRefused),
            (0x21, ValueRefused),
            (0x22, NotNow),
        ],
    }
}
