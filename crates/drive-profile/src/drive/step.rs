//! One step of an action on the wire: the pause before it, what it waits for, and what it writes.

use drive_core::{
    Class, Command as Order, Confirming, Exchange, Port, Result,
    tokio_modbus::{Request, Response},
};
use tokio::time::{Duration, sleep};

use super::ProfileDrive;
use crate::{
    format::{Spanned, Step},
    requests::READ_WRITE,
    written::Written,
};

impl<P: Port> ProfileDrive<P> {
    /// Steps of a command, each a level, up to the first that fails.
    pub(super) async fn steps(&mut self, steps: &[Spanned<Step>], order: Order) -> Result<()> {
        for step in steps {
            self.step(step.get_ref(), Class::Command, order).await?;
        }
        Ok(())
    }

    /// One step of an action, a level: what it writes may be written again.
    pub(super) async fn step(&mut self, step: &Step, class: Class, order: Order) -> Result<()> {
        self.take_step(step, class, order, false).await
    }

    pub(super) async fn take_step(
        &mut self,
        step: &Step,
        class: Class,
        order: Order,
        is_edge: bool,
    ) -> Result<()> {
        if let Some(pause) = &step.pause_ms {
            sleep(Duration::from_millis((*pause.get_ref()).into())).await;
        }
        if let (Some(bits), Some(within)) = (&step.awaits, &step.within_ms) {
            let profile = self.profile.clone();
            let blocks = profile.blocks(&[bits.register.get_ref().as_str()].into());
            let mut confirming = Confirming::within(Duration::from_millis((*within.get_ref()).into()));
            loop {
                let words = self.read_blocks(class, &blocks).await?;
                if profile.fits(&words, bits) == Some(true) {
                    return Ok(());
                }
                if !confirming.again().await {
                    let (status, _) = self.read_status(class).await?;
                    return Err(self.not_confirmed(order, status, None));
                }
            }
        }
        let writes = self.profile.file().written(step, self.kept);
        self.write(step, &writes, class, is_edge).await.map_err(|error| self.explained(error))
    }

    /// What is about to be written. A command word is what reads back as one: a word for another register says nothing of it.
    pub(super) fn sends(&mut self, writes: &[Written]) {
        let held = self.watch.run.held().unwrap_or(0);
        let command = self.sight.reads_back.as_ref().and_then(|of| of.written(held, writes));
        if let Some(command) = command {
            self.watch.run.sends(command);
        }
    }

    async fn write(&mut self, step: &Step, writes: &[Written], class: Class, is_edge: bool) -> Result<()> {
        let function = step.function.as_ref().map(|function| *function.get_ref());
        let Some(request) = self.profile.request(function, writes) else { return Ok(()) };
        self.sends(writes);
        let mut calls = self.registers.at(class);
        if is_edge {
            calls = calls.edge();
        }
        let by = |function, address| Exchange { function, register: Some(address) };
        let (exchange, echo) = match &request {
            Request::WriteSingleRegister(address, word) => return calls.write_word(*address, *word).await,
            Request::WriteMultipleRegisters(first, words) => return calls.write_words(*first, words).await,
            Request::ReadWriteMultipleRegisters(_, _, address, _) => {
                let exchange = by(READ_WRITE, *address);
                return match calls.request(request, exchange).await? {
                    Response::ReadWriteMultipleRegisters(read) if read.len() == 1 => Ok(()),
                    _ => Err(calls.answer(exchange, "the answer holds another number of registers")),
                };
            }
            Request::WriteSingleCoil(address, on) => {
                (by(5, *address), Response::WriteSingleCoil(*address, *on))
            }
            Request::WriteMultipleCoils(first, coils) => {
                let count = u16::try_from(coils.len()).unwrap_or(u16::MAX);
                (by(15, *first), Response::WriteMultipleCoils(*first, count))
            }
            _ => return Ok(()),
        };
        match calls.request(request, exchange).await? {
            response if response == echo => Ok(()),
            _ => Err(calls.answer(exchange, "the confirmation does not echo the write")),
        }
    }
}
