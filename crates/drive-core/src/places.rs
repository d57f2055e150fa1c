//! Reading and writing in all four spaces: [`Calls::read_place`] and its like, beside the calls for holding registers.

use tokio_modbus::{Request, Response};

use crate::{
    calls::Calls,
    error::{Exchange, Result},
    port::Port,
    registers::{Place, Space},
};

impl<P: Port> Calls<'_, P> {
    /// Reads one register, or a bit as 0 or 1.
    pub async fn read_place(&mut self, place: Place) -> Result<u16> {
        let read = self.read_places(place, 1).await?;
        Ok(read.first().copied().unwrap_or_default())
    }

    /// Reads so many of one space in a row, bits as 0 and 1, in one request.
    ///
    /// # Errors
    /// Of words also [`Error::TooManyWords`](crate::Error::TooManyWords) when the family's limit forbids the request; nothing is sent then.
    pub async fn read_places(&mut self, first: Place, count: u16) -> Result<Vec<u16>> {
        let Place { space, address } = first;
        let exchange = Exchange { function: space.read_by(), register: Some(address) };
        let request = match space {
            Space::HoldingRegister => return self.read_words(address, count).await,
            Space::InputRegister => Request::ReadInputRegisters(address, count),
            Space::Coil => Request::ReadCoils(address, count),
            Space::DiscreteInput => Request::ReadDiscreteInputs(address, count),
        };
        let read = match (space, self.request(request, exchange).await?) {
            (Space::InputRegister, Response::ReadInputRegisters(words)) => words,
            // The last byte is filled with bits that nobody has asked for.
            (Space::Coil, Response::ReadCoils(bits))
            | (Space::DiscreteInput, Response::ReadDiscreteInputs(bits)) => {
                bits.into_iter().take(count.into()).map(u16::from).collect()
            }
            _ => return Err(self.answer(exchange, "the answer is of another function")),
        };
        if read.len() != usize::from(count) {
            return Err(self.answer(exchange, "the answer holds another number of registers"));
        }
        Ok(read)
    }

    /// Writes one register, or a coil: whatever is not 0 is on.
    pub(crate) async fn write_place(&mut self, place: Place, value: u16) -> Result<()> {
        if place.space != Space::Coil {
            return self.write_word(place.address, value).await;
        }
        let (function, echo) = if self.has(0x05) {
            (0x05, Response::WriteSingleCoil(place.address, value != 0))
        } else {
            (0x0F, Response::WriteMultipleCoils(place.address, 1))
        };
        let request = match function {
            0x05 => Request::WriteSingleCoil(place.address, value != 0),
            _ => Request::WriteMultipleCoils(place.address, vec![value != 0].into()),
        };
        let exchange = Exchange { function, register: Some(place.address) };
        match self.request(request, exchange).await? {
            response if response == echo => Ok(()),
            _ => Err(self.answer(exchange, "the confirmation does not echo the write")),
        }
    }
}
