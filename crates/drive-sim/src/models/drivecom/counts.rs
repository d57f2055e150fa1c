//! What the words of these drives count (BBV51701 p. 16–19).

/// The motor has four poles: 50 Hz are 1500 rpm.
const RPM_PER_10_CENTIHERTZ: i32 = 3;

/// A number as a signed word of the drive.
pub(in crate::models) fn word(number: i32) -> u16 {
    i16::try_from(number).map_or(u16::MAX, i16::cast_unsigned)
}

/// Speed of the motor at a frequency in hundredths of a hertz.
pub(in crate::models) const fn rpm(centihertz: i32) -> i32 {
    centihertz * RPM_PER_10_CENTIHERTZ / 10
}

/// Frequency of a speed, in hundredths of a hertz.
pub(in crate::models) const fn centihertz(rpm: i32) -> i32 {
    rpm * 10 / RPM_PER_10_CENTIHERTZ
}

/// `ERRD` for a code of `LFt` (p. 17). Which code goes with LFt 55 is not printed; it is a short circuit.
pub(in crate::models) const fn profile_code(lft: u16) -> u16 {
    match lft {
        10 | 17 | 24 => 0x1000,
        9 => 0x2310,
        31 | 36 => 0x2320,
        32 | 55 => 0x2330,
        23 => 0x2340,
        19 => 0x3110,
        22 => 0x3120,
        21 => 0x3130,
        18 | 20 | 33 => 0x3310,
        16 => 0x4210,
        30 => 0x5520,
        26..=29 => 0x6100,
        3 | 4 => 0x6300,
        13 => 0x7300,
        5 | 7 => 0x7510,
        6 => 0x7520,
        34 => 0x8100,
        8 => 0x9000,
        25 => 0xFF00,
        35 => 0xFF01,
        _ => 0,
    }
}
