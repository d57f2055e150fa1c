//! The `low_latency` flag of a serial port, as `setserial` sets it: `TIOCGSERIAL`, `TIOCSSERIAL` (Linux
//! `include/uapi/linux/serial.h`). Every user who may open the port may set it.

#![expect(unsafe_code, reason = "no crate offers these two ioctls safely and builds without libclang")]

use std::{
    ffi::{c_char, c_int, c_uint, c_ulong, c_ushort},
    io,
    os::fd::{AsRawFd, BorrowedFd},
};

use rustix::{
    io::Errno,
    ioctl::{Getter, Opcode, Setter, ioctl},
};
use tokio_serial::SerialStream;

const IS_MIPS: bool = cfg!(any(
    target_arch = "mips",
    target_arch = "mips32r6",
    target_arch = "mips64",
    target_arch = "mips64r6"
));
/// `asm/ioctls.h`; MIPS has numbers of its own.
const TIOCGSERIAL: Opcode = if IS_MIPS { 0x5484 } else { 0x541E };
const TIOCSSERIAL: Opcode = if IS_MIPS { 0x5485 } else { 0x541F };

/// `include/uapi/linux/tty_flags.h`.
const ASYNC_LOW_LATENCY: c_int = 1 << 13;

/// The kernel's `struct serial_struct`. Only `flags` is ours; the rest goes back as it came.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct SerialStruct {
    kind: c_int,
    line: c_int,
    port: c_uint,
    irq: c_int,
    flags: c_int,
    xmit_fifo_size: c_int,
    custom_divisor: c_int,
    baud_base: c_int,
    close_delay: c_ushort,
    io_type: c_char,
    reserved: [c_char; 1],
    hub6: c_int,
    closing_wait: c_ushort,
    closing_wait2: c_ushort,
    /// A pointer that nobody here follows.
    iomem_base: usize,
    iomem_reg_shift: c_ushort,
    port_high: c_uint,
    iomap_base: c_ulong,
}

// What the two ioctls below rely on.
const _: () = assert!(size_of::<SerialStruct>() == if cfg!(target_pointer_width = "64") { 72 } else { 60 });
const _: () = assert!(std::mem::offset_of!(SerialStruct, flags) == 16);

/// Sets the flag. False: the port has none (a pty, some drivers).
///
/// # Errors
/// The driver's.
pub(super) fn set(port: &SerialStream) -> io::Result<bool> {
    let Some(settings) = read(port)? else { return Ok(false) };
    if settings.flags & ASYNC_LOW_LATENCY == 0 {
        write(port, SerialStruct { flags: settings.flags | ASYNC_LOW_LATENCY, ..settings })?;
    }
    Ok(true)
}

/// The settings of a port that has some.
fn read(port: &SerialStream) -> io::Result<Option<SerialStruct>> {
    // SAFETY: TIOCGSERIAL writes one `struct serial_struct`, whose layout `SerialStruct` has and of which every bit
    // pattern is valid.
    let read = unsafe { ioctl(descriptor(port), Getter::<TIOCGSERIAL, SerialStruct>::new()) };
    match read {
        Ok(settings) => Ok(Some(settings)),
        Err(Errno::NOTTY) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

fn write(port: &SerialStream, settings: SerialStruct) -> io::Result<()> {
    // SAFETY: TIOCSSERIAL reads one `struct serial_struct` and keeps no pointer to it. What it says is what the driver
    // itself has said, but for a flag that any user may change.
    unsafe { ioctl(descriptor(port), Setter::<TIOCSSERIAL, SerialStruct>::new(settings)) }?;
    Ok(())
}

fn descriptor(port: &SerialStream) -> BorrowedFd<'_> {
    // SAFETY: the stream owns this descriptor and is borrowed for as long as the result lives.
    unsafe { BorrowedFd::borrow_raw(port.as_raw_fd()) }
}

#[cfg(test)]
mod tests {
    use tokio_serial::SerialPortBuilderExt;

    use super::*;

    #[tokio::test]
    async fn a_pty_has_no_such_flag_and_that_is_no_error() {
        let (master, slave) = SerialStream::pair().unwrap();
        assert!(!set(&master).unwrap());
        assert!(!set(&slave).unwrap());
    }

    /// Only on a port that is named for it: nobody else's line is opened by a test.
    #[tokio::test]
    async fn the_flag_of_a_real_port_is_set_and_nothing_else_changes() {
        let Ok(path) = std::env::var("DRIVED_TEST_PORT") else {
            return println!("skipped, DRIVED_TEST_PORT names no serial port");
        };
        let port = match tokio_serial::new(&path, 19_200).open_native_async() {
            Ok(port) => port,
            Err(error) => return println!("skipped, {path}: {error}"),
        };
        let before = match read(&port) {
            Ok(Some(settings)) => settings,
            other => return println!("skipped, {path} has no settings: {other:?}"),
        };
        let flagged = |flags| SerialStruct { flags, ..before };
        if let Err(error) = write(&port, flagged(before.flags & !ASYNC_LOW_LATENCY)) {
            return println!("skipped, {path} takes no settings: {error}");
        }
        assert!(set(&port).unwrap());
        assert_eq!(read(&port).unwrap(), Some(flagged(before.flags | ASYNC_LOW_LATENCY)));
        assert!(set(&port).unwrap());
        write(&port, before).unwrap();
    }
}
