//! Who may write a register: as a value for tables and messages, and as types, so that the compiler refuses to
//! write what can only be read.

use std::fmt;

/// Who may write a register, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// Read only.
    Read,
    /// Read, and written at any time.
    ReadWrite,
    /// Read, and written only while the motor is stopped.
    WriteStopped,
    /// Written only; reading it is an error.
    Write,
}

impl Access {
    /// Whether the register can be read.
    #[must_use]
    pub const fn is_readable(self) -> bool {
        !matches!(self, Self::Write)
    }

    /// Whether the register can be written at all.
    #[must_use]
    pub const fn is_writable(self) -> bool {
        !matches!(self, Self::Read)
    }
}

impl fmt::Display for Access {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Read => "R",
            Self::ReadWrite => "R/W",
            Self::WriteStopped => "R/WS",
            Self::Write => "W",
        })
    }
}

/// An access kind.
pub trait Kind {
    /// The same as a value.
    const ACCESS: Access;
}
/// A kind that can be read.
pub trait Readable: Kind {}
/// A kind that can be written.
pub trait Writable: Kind {}

/// Read only.
#[derive(Debug, Clone, Copy)]
pub struct Read;
/// Read, and written at any time.
#[derive(Debug, Clone, Copy)]
pub struct ReadWrite;
/// Read, and written only while the motor is stopped.
#[derive(Debug, Clone, Copy)]
pub struct WriteStopped;
/// Written only.
#[derive(Debug, Clone, Copy)]
pub struct Write;

impl Kind for Read {
    const ACCESS: Access = Access::Read;
}
impl Kind for ReadWrite {
    const ACCESS: Access = Access::ReadWrite;
}
impl Kind for WriteStopped {
    const ACCESS: Access = Access::WriteStopped;
}
impl Kind for Write {
    const ACCESS: Access = Access::Write;
}
impl Readable for Read {}
impl Readable for ReadWrite {}
impl Readable for WriteStopped {}
impl Writable for ReadWrite {}
impl Writable for WriteStopped {}
impl Writable for Write {}
