//! What a backup keeps of a 3G3EV and in which order a restore writes it: so that none of the alarms OP1, OP2, OP4 and OP5 of
//! §5.3 comes on the way.

use drive_core::registers::{Holds, Relation, Restoring, Step};

use crate::registers::address::*;

/// See [`Restoring`].
pub(crate) const RESTORING: Restoring = Restoring {
    first: &[
        Step {
            registers: &[N06, N07, N08],
            why: "no two of n06 to n08 are equal at any moment, else OP1 (§5.3)",
        },
        Step { registers: &[N42, N41], why: "n42 ≤ n41 at every moment, else OP4 (§5.3)" },
        Step { registers: &[N58, N57, N56], why: "n58 ≤ n57 ≤ n56 at every moment, else OP5 (§5.3)" },
        Step { registers: &[N29, N27, N26, N24], why: "the V/f curve in one go, else OP2 (§5.3)" },
    ],
    last: &[Step {
        registers: &[N02],
        why: "who commands goes last, though it acts after the next power-up (§2.1)",
    }],
    // §2.1.
    communication: &[N63, N64, N65, N66, N67],
    acts_later: &[(
        &[N02, N39, N40, N63, N64, N65, N66, N67],
        "it acts after the next power-up (§2.1, note 3)",
    )],
    relations: &[
        Relation {
            holds: Holds::Distinct,
            registers: &[N06, N07, N08],
            why: "no two of n06 to n08 are equal (§5.3 OP1)",
        },
        Relation { holds: Holds::NotAbove, registers: &[N42, N41], why: "n42 ≤ n41 (§5.3 OP4)" },
        Relation {
            holds: Holds::NotAbove, registers: &[N58, N57, N56], why: "n58 ≤ n57 ≤ n56 (§5.3 OP5)"
        },
    ],
    control: &[N02],
    ..Restoring::NONE
};
