//! What a metric holds: its type, its value, its quality.

/// The basic types of Sparkplug B, with their numbers (specification 3.0, 6.4.16).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DataType {
    /// 8 bits, signed.
    Int8 = 1,
    /// 16 bits, signed.
    Int16 = 2,
    /// 32 bits, signed.
    Int32 = 3,
    /// 64 bits, signed.
    Int64 = 4,
    /// 8 bits, unsigned.
    UInt8 = 5,
    /// 16 bits, unsigned.
    UInt16 = 6,
    /// 32 bits, unsigned.
    UInt32 = 7,
    /// 64 bits, unsigned.
    UInt64 = 8,
    /// IEEE 754, 32 bits.
    Float = 9,
    /// IEEE 754, 64 bits.
    Double = 10,
    /// True or false.
    Boolean = 11,
    /// UTF-8.
    String = 12,
    /// Milliseconds since 1970, UTC.
    DateTime = 13,
}

impl DataType {
    /// Its number on the wire.
    pub const fn code(self) -> u32 {
        self as u32
    }
}

/// A value with its type.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the types' names say it")]
pub enum Value {
    Int8(i8),
    Int16(i16),
    Int32(i32),
    Int64(i64),
    UInt8(u8),
    UInt16(u16),
    UInt32(u32),
    UInt64(u64),
    Float(f32),
    Double(f64),
    Boolean(bool),
    String(String),
    /// Milliseconds since 1970, UTC.
    DateTime(u64),
}

impl Value {
    /// Its type.
    pub const fn data_type(&self) -> DataType {
        match self {
            Self::Int8(_) => DataType::Int8,
            Self::Int16(_) => DataType::Int16,
            Self::Int32(_) => DataType::Int32,
            Self::Int64(_) => DataType::Int64,
            Self::UInt8(_) => DataType::UInt8,
            Self::UInt16(_) => DataType::UInt16,
            Self::UInt32(_) => DataType::UInt32,
            Self::UInt64(_) => DataType::UInt64,
            Self::Float(_) => DataType::Float,
            Self::Double(_) => DataType::Double,
            Self::Boolean(_) => DataType::Boolean,
            Self::String(_) => DataType::String,
            Self::DateTime(_) => DataType::DateTime,
        }
    }

    /// As it travels: signed numbers are sign-extended to the width of their field, two's complement.
    pub fn to_raw(&self) -> Raw {
        match self {
            Self::Int8(number) => Raw::Int(i32::from(*number) as u32),
            Self::Int16(number) => Raw::Int(i32::from(*number) as u32),
            Self::Int32(number) => Raw::Int(*number as u32),
            Self::Int64(number) => Raw::Long(*number as u64),
            Self::UInt8(number) => Raw::Int(u32::from(*number)),
            Self::UInt16(number) => Raw::Int(u32::from(*number)),
            Self::UInt32(number) => Raw::Int(*number),
            Self::UInt64(number) | Self::DateTime(number) => Raw::Long(*number),
            Self::Float(number) => Raw::Float(*number),
            Self::Double(number) => Raw::Double(*number),
            Self::Boolean(truth) => Raw::Boolean(*truth),
            Self::String(text) => Raw::String(text.clone()),
        }
    }

    /// Reads what has travelled as a value of this type. `None`: it is none.
    ///
    /// A short signed number is taken in both forms that are sent: sign-extended to 32 bits, and in its own bits only. A
    /// Float is taken for a Double.
    pub fn read(data_type: DataType, raw: &Raw) -> Option<Self> {
        Some(match (data_type, raw) {
            (DataType::Int8, Raw::Int(bits)) => {
                let own = u8::try_from(*bits).ok().map(|bits| bits as i8);
                Self::Int8(own.or_else(|| i8::try_from(*bits as i32).ok())?)
            }
            (DataType::Int16, Raw::Int(bits)) => {
                let own = u16::try_from(*bits).ok().map(|bits| bits as i16);
                Self::Int16(own.or_else(|| i16::try_from(*bits as i32).ok())?)
            }
            (DataType::Int32, Raw::Int(bits)) => Self::Int32(*bits as i32),
            (DataType::Int64, Raw::Long(bits)) => Self::Int64(*bits as i64),
            (DataType::UInt8, Raw::Int(bits)) => Self::UInt8(u8::try_from(*bits).ok()?),
            (DataType::UInt16, Raw::Int(bits)) => Self::UInt16(u16::try_from(*bits).ok()?),
            (DataType::UInt32, Raw::Int(bits)) => Self::UInt32(*bits),
            (DataType::UInt64, Raw::Long(bits)) => Self::UInt64(*bits),
            (DataType::DateTime, Raw::Long(bits)) => Self::DateTime(*bits),
            (DataType::Float, Raw::Float(number)) => Self::Float(*number),
            (DataType::Double, Raw::Double(number)) => Self::Double(*number),
            (DataType::Double, Raw::Float(number)) => Self::Double(f64::from(*number)),
            (DataType::Boolean, Raw::Boolean(truth)) => Self::Boolean(*truth),
            (DataType::String, Raw::String(text)) => Self::String(text.clone()),
            _ => return None,
        })
    }

    /// Whether it is a number that a machine can use, or no number at all.
    pub(crate) const fn is_sound(&self) -> bool {
        match self {
            Self::Float(number) => number.is_finite(),
            Self::Double(number) => number.is_finite(),
            _ => true,
        }
    }
}

/// A value as it travels: the field that it is in. What it means is said by the type that its birth has told.
#[derive(Debug, Clone, PartialEq)]
pub enum Raw {
    /// `int_value`: numbers of up to 32 bits.
    Int(u32),
    /// `long_value`: numbers of 64 bits, and times.
    Long(u64),
    /// `float_value`.
    Float(f32),
    /// `double_value`.
    Double(f64),
    /// `boolean_value`.
    Boolean(bool),
    /// `string_value`.
    String(String),
    /// Bytes, a data set, a template, an extension: not read by this crate.
    Other,
}

/// How good a value is (6.4.9.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quality {
    /// Nothing is known of it.
    Bad = 0,
    /// It is as it was read.
    Good = 192,
    /// It was so once.
    Stale = 500,
}

impl Quality {
    /// The quality of a number on the wire.
    pub const fn of(code: u32) -> Option<Self> {
        match code {
            0 => Some(Self::Bad),
            192 => Some(Self::Good),
            500 => Some(Self::Stale),
            _ => None,
        }
    }

    /// Its number on the wire.
    pub const fn code(self) -> u32 {
        self as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signed_numbers_travel_as_twos_complement() {
        for (value, raw) in [
            (Value::Int8(-1), Raw::Int(0xFFFF_FFFF)),
            (Value::Int16(-2), Raw::Int(0xFFFF_FFFE)),
            (Value::Int32(-3), Raw::Int(0xFFFF_FFFD)),
            (Value::Int64(-4), Raw::Long(0xFFFF_FFFF_FFFF_FFFC)),
            (Value::Int8(127), Raw::Int(127)),
            (Value::Int32(i32::MIN), Raw::Int(0x8000_0000)),
        ] {
            assert_eq!(value.to_raw(), raw);
            assert_eq!(Value::read(value.data_type(), &raw), Some(value));
        }
    }

    #[test]
    fn a_short_signed_number_is_read_in_both_forms_and_one_that_is_too_long_is_none() {
        assert_eq!(Value::read(DataType::Int8, &Raw::Int(0xFF)), Some(Value::Int8(-1)));
        assert_eq!(Value::read(DataType::Int16, &Raw::Int(0x8000)), Some(Value::Int16(-32_768)));
        assert_eq!(Value::read(DataType::Int8, &Raw::Int(0x100)), None);
        assert_eq!(Value::read(DataType::Int16, &Raw::Int(0xFFFF_0000)), None);
        assert_eq!(Value::read(DataType::UInt8, &Raw::Int(256)), None);
        assert_eq!(Value::read(DataType::UInt16, &Raw::Int(65_536)), None);
    }

    #[test]
    fn a_value_of_another_type_is_none() {
        assert_eq!(Value::read(DataType::Double, &Raw::String("40".to_owned())), None);
        assert_eq!(Value::read(DataType::Boolean, &Raw::Int(1)), None);
        assert_eq!(Value::read(DataType::String, &Raw::Other), None);
        assert_eq!(Value::read(DataType::Double, &Raw::Float(0.5)), Some(Value::Double(0.5)));
    }
}
