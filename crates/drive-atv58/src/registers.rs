//! Every word of the Altivar 58 that the card's manual names (VVDED397054), and the words that may stand where the
//! Altivar 28 has them.
//!
//! The drive's "internal communication variables" (VVDED397057) are not public. A row whose confidence is `Manual` is
//! printed in the card's manual; all other rows are raw words without a unit, because only the analogy with the
//! Altivar 28 (BBV51701 p. 57) or one user's report speaks of them: the row's name says what is suspected. What the
//! driver makes of such a word is a setting, [`Atv58Map`](crate::Atv58Map). Whether a parameter goes to EEPROM when it is written is not known.

use drive_core::registers;

registers! {
    /// Every word of the Altivar 58 that is named or suspected, by ascending address.
    pub const ROWS;

    W250: Read(250, "W250", "raw word of the manual's sample W250 to W253; high speed HSP on the Altivar 28", Unknown, Unit::COUNT, Range::Any, Factory::None, Manual, "VVDED397054 p. 12/36");
    W251: Read(251, "W251", "raw word of the manual's sample W250 to W253; low speed LSP on the Altivar 28", Unknown, Unit::COUNT, Range::Any, Factory::None, Manual, "VVDED397054 p. 12/36");
    ACC: ReadWrite(252, "ACC", "acceleration time", Unknown, Unit::scaled("s", 1), Range::Any, Factory::None, Manual, "VVDED397054 p. 20/44: 789 is 78.9 s");
    W253: ReadWrite(253, "W253", "raw word of the manual's sample W250 to W253; deceleration time dEC on the Altivar 28", Unknown, Unit::COUNT, Range::Any, Factory::None, Manual, "VVDED397054 p. 12/36");
    CMD: ReadWrite(400, "CMD", "control word", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "VVDED397054 p. 13/37, 21/45: 6 is written to W400");
    W401: ReadWrite(401, "W401", "frequency reference in counts; 0.1 Hz on the Altivar 28", Volatile, Unit::COUNT.signed(), Range::Any, Factory::None, Manual, "VVDED397054 p. 10/34, 21/45: 500 is written to W401");
    W402: ReadWrite(402, "W402", "raw word; extended control word CMI on the Altivar 28", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "not in VVDED397054; BBV51701 p. 57 of the Altivar 28");
    W450: Read(450, "W450", "raw word; reference before the ramp FrH on the Altivar 28", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "not in VVDED397054; BBV51701 p. 57 of the Altivar 28");
    W451: Read(451, "W451", "raw word; output frequency rFr on the Altivar 28", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "not in VVDED397054; BBV51701 p. 57 of the Altivar 28");
    W452: Read(452, "W452", "raw word; unknown on the Altivar 28 too", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "not in VVDED397054; VVDED399092 of the Altivar 28, function 03");
    W453: Read(453, "W453", "raw word; motor current LCr on the Altivar 28", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "not in VVDED397054; BBV51701 p. 57 of the Altivar 28");
    W454: Read(454, "W454", "raw word; line voltage ULn on the Altivar 28", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "not in VVDED397054; BBV51701 p. 57 of the Altivar 28");
    W455: Read(455, "W455", "raw word; thermal state of the motor tHr on the Altivar 28", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "not in VVDED397054; BBV51701 p. 57 of the Altivar 28");
    W456: Read(456, "W456", "raw word; thermal state of the drive tHd on the Altivar 28", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "not in VVDED397054; BBV51701 p. 57 of the Altivar 28");
    W457: Read(457, "W457", "raw word; last fault LFt on the Altivar 28", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "not in VVDED397054; BBV51701 p. 57 of the Altivar 28");
    W458: Read(458, "W458", "raw word; status word ETA on the Altivar 28", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "not in VVDED397054; BBV51701 p. 57 of the Altivar 28, and a user's report of a status block W458 to W469");
    W459: Read(459, "W459", "raw word; extended status word ETI on the Altivar 28", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "not in VVDED397054; BBV51701 p. 57 of the Altivar 28, and a user's report of a status block W458 to W469");
    W463: Read(463, "W463", "raw word of the manual's sample W463 to W466", Volatile, Unit::COUNT, Range::Any, Factory::None, Manual, "VVDED397054 p. 20/44");
    W464: Read(464, "W464", "raw word of the manual's sample W463 to W466", Volatile, Unit::COUNT, Range::Any, Factory::None, Manual, "VVDED397054 p. 20/44");
    W465: Read(465, "W465", "raw word of the manual's sample W463 to W466", Volatile, Unit::COUNT, Range::Any, Factory::None, Manual, "VVDED397054 p. 20/44");
    W466: Read(466, "W466", "raw word of the manual's sample W463 to W466", Volatile, Unit::COUNT, Range::Any, Factory::None, Manual, "VVDED397054 p. 20/44");
    W483: Read(483, "W483", "fault register FLT: 16 fault bits, whose meanings are not public", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "VVDED397054 p. 10/34");
}
