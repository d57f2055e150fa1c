//! The requests by which a drive is commanded: what the engine sends, and what a person holds against the manual.

use std::borrow::Cow;

use drive_core::tokio_modbus::Request;

use crate::{
    format::{Spanned, UnitName},
    profile::Profile,
    scale::{counts, hundredths},
    written::Written,
};

/// The function that writes registers and reads others in one exchange.
pub(crate) const READ_WRITE: u8 = 23;

/// What is shown of a setpoint in hertz, in hundredths.
const SHOWN: i64 = 5_000;

impl Profile {
    /// What its stops, its starts and a setpoint write: each by its name, as the requests in their order. A setpoint in hertz is that of
    /// 50 Hz, or of its highest; in another unit its highest.
    ///
    /// ```
    /// let v20 = drive_profile::shipped::find("v20").expect("it is shipped");
    /// let (name, requests) = &v20.requests()[0];
    /// // STW1 without its ON bit, in register 40100: address 99.
    /// use drive_core::tokio_modbus::Request;
    /// assert_eq!((name.as_str(), &requests[..]), ("stop.ramp", &[Request::WriteSingleRegister(99, 0x047E)][..]));
    /// ```
    #[must_use]
    pub fn requests(&self) -> Vec<(String, Vec<Request<'static>>)> {
        let shown = |name: &str| name.starts_with("stop.") || name.starts_with("start.");
        let actions = self.file.actions().filter(|(name, _)| shown(name)).map(|(name, action)| {
            let steps = action.get_ref().steps.iter().map(Spanned::get_ref);
            let requests = steps.filter_map(|step| {
                let function = step.function.as_ref().map(|function| *function.get_ref());
                self.request(function, &self.file.written(step, None))
            });
            (name.to_owned(), requests.collect())
        });
        actions.chain(self.shown_setpoint()).collect()
    }

    fn shown_setpoint(&self) -> Option<(String, Vec<Request<'static>>)> {
        let setpoint = self.file.setpoint.given()?.get_ref();
        let register = self.file.named(setpoint.register.get_ref())?;
        let (space, address) = self.file.place(register)?;
        let [numerator, denominator] = *register.scale.as_ref()?.get_ref();
        let high = i64::from(setpoint.limits.get_ref().high);
        let fifty = counts(SHOWN, numerator, denominator);
        let count = fifty.filter(|count| *count <= high && register.unit == UnitName::Hertz).unwrap_or(high);
        let worth = hundredths(count, numerator, denominator);
        let name = format!("setpoint {}.{:02} {}", worth / 100, worth % 100, register.unit.symbol());
        let written = Written { space, address, value: u16::try_from(count).ok()? };
        Some((name, self.request(None, &[written]).into_iter().collect()))
    }

    /// The request of so many writes in a row, by a function where one is said; `None` where there is nothing to write.
    pub(crate) fn request(&self, function: Option<u8>, writes: &[Written]) -> Option<Request<'static>> {
        let &Written { space, address, value } = writes.first()?;
        let functions = &self.file.link.get_ref().functions;
        let has = |wanted: u8| functions.iter().any(|function| *function.get_ref() == wanted);
        let several = writes.len() > 1 || function.is_some_and(|function| function >= 15);
        let words = || Cow::Owned(writes.iter().map(|written| written.value).collect());
        if space.is_bit() {
            let coils = || Cow::Owned(writes.iter().map(|written| written.value != 0).collect());
            return Some(if several || !has(5) {
                Request::WriteMultipleCoils(address, coils())
            } else {
                Request::WriteSingleCoil(address, value != 0)
            });
        }
        let along = self.read_along().filter(|_| function == Some(READ_WRITE));
        Some(match along {
            Some(along) => Request::ReadWriteMultipleRegisters(along, 1, address, words()),
            None if several || !has(6) => Request::WriteMultipleRegisters(address, words()),
            None => Request::WriteSingleRegister(address, value),
        })
    }
}
