//! What is asked of the device itself: whether it hears and speaks, and what it is.

use std::borrow::Cow;

use tokio::time::Instant;
use tokio_modbus::{Request, Response, prelude::ReadCode};

use super::Calls;
use crate::{
    error::{Error, Exchange, Result},
    identity::Identity,
    port::{Class, Port},
};

impl<P: Port> Calls<'_, P> {
    /// Sends `data` round by function 08, sub-function 00, and checks that it comes back: the cheapest proof that the
    /// slave hears and speaks.
    pub async fn echo(&mut self, data: u16) -> Result<()> {
        let exchange = Exchange { function: 0x08, register: None };
        let [high, low] = data.to_be_bytes();
        let payload = [0, 0, high, low];
        match self.request(Request::Custom(0x08, Cow::Borrowed(&payload)), exchange).await? {
            Response::Custom(0x08, echoed) if echoed.as_ref() == payload => Ok(()),
            _ => Err(self.answer(exchange, "the echo differs")),
        }
    }

    /// Asks what the device is, by function 43/14 from object 00 on.
    pub async fn identification(&mut self, code: ReadCode) -> Result<Identity> {
        // Some gateways do not pass function 43 on and take their whole wait to say so: what was told once is kept.
        let exchange = Exchange { function: 0x2B, register: None };
        let is_kept = self.terms.class == Class::Background;
        if is_kept && let Some((told, at)) = self.registers.kept.named(Instant::now()) {
            self.registers.see(at);
            return told.map_err(|code| self.exception(exchange, code));
        }
        let told = self.ask_identification(code, exchange).await;
        let kept = match &told {
            Ok(identity) => Some(Ok(identity.clone())),
            Err(Error::Exception { code, .. }) => Some(Err(*code)),
            Err(_) => None,
        };
        if let Some(kept) = kept.filter(|_| is_kept) {
            let at = self.registers.port.asked_at().unwrap_or_else(Instant::now);
            self.registers.kept.keep_named(&kept, at);
        }
        told
    }

    async fn ask_identification(&mut self, code: ReadCode, exchange: Exchange) -> Result<Identity> {
        let response = self.request(Request::ReadDeviceIdentification(code, 0), exchange).await?;
        let Response::ReadDeviceIdentification(response) = response else {
            return Err(self.answer(exchange, "the answer is of another function"));
        };
        let object = |id| {
            let found = response.device_id_objects.iter().find(|object| object.id == id)?;
            Some(String::from_utf8_lossy(&found.value).trim_end_matches(['\0', ' ']).to_owned())
        };
        Ok(Identity { vendor: object(0), model: object(1), version: object(2), codes: Vec::new() })
    }
}
