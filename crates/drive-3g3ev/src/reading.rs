//! Reading the monitors.

use drive_core::{
    Class, Error, ExceptionMeaning, Exchange, Faults, Measurements, Port, Result, Setpoint, State, Status,
    Voltage,
};

use crate::{
    Drive3g3ev,
    blocks::{Block, FAST, OUTPUT, TERMINALS, Words},
    command::is_run,
    faults::{present, warnings},
    registers::{
        COMMAND, DC_BUS, ERRORS, INPUT_TERMINALS, LINK_ERROR, OUTPUT_CONTACTS, OUTPUT_VOLTAGE,
        REFERENCE_SEEN, SIGNALS, STATE,
    },
    status::FastWords,
    words::Errors,
};

impl<P: Port> Drive3g3ev<P> {
    pub(crate) async fn read_status(&mut self, class: Class) -> Result<Status> {
        let unit = self.unit(class).await?;
        self.registers.begin_snapshot();
        let mut words = Words::default();
        self.read_block(class, &FAST, &mut words).await?;
        let state = self.registers.at(class).read(STATE).await?;
        words.extend(STATE.address(), &[state]);
        let mut status = FastWords::of(words.clone()).status(unit, self.command);
        if status.state == State::Stopping && is_run(&status) {
            // So it is if the order that it was given last is still the one in force: another may have come since.
            let held = self.read_command(class).await?;
            words.extend(held.address, &[held.value]);
            status = FastWords::of(words).status(unit, self.command);
        }
        status.at = self.registers.snapshot_time();
        self.tell(&mut status);
        Ok(status)
    }

    /// Reads 0001h, where this status shows that it may be another word than is known: the next stop keeps its inputs
    /// without reading it. What cannot be read now, a later status tells. False: there was no need.
    pub(crate) async fn keep_stop_ready(&mut self, status: &Status) -> bool {
        let shown = (is_run(status), status.direction, status.control);
        let unproved = self.run.lease().is_some() && self.proof.word.is_none();
        let stale = self.command.is_none() || self.shown != Some(shown) || unproved;
        let was_read = status.raw(COMMAND.address()).is_some();
        if !stale || was_read {
            self.shown = Some(shown);
            return was_read;
        }
        self.shown = self.read_command(Class::Status).await.is_ok().then_some(shown);
        true
    }

    pub(crate) async fn read_measurements(&mut self) -> Result<Measurements> {
        let unit = self.unit(Class::Background).await?;
        self.registers.begin_snapshot();
        let mut words = Words::default();
        self.read_block(Class::Background, &OUTPUT, &mut words).await?;
        self.read_block(Class::Background, &TERMINALS, &mut words).await?;
        let reference = unit.and_then(|unit| unit.frequency(words.word(REFERENCE_SEEN)));
        let volts = |word: u16| Voltage::from_decivolts(u32::from(word) * 10);
        Ok(Measurements {
            at: self.registers.snapshot_time(),
            reference: reference.map(Setpoint::Frequency),
            output_voltage: Some(volts(words.word(OUTPUT_VOLTAGE))),
            dc_bus_voltage: Some(volts(words.word(DC_BUS))),
            inputs: Some(words.word(INPUT_TERMINALS)),
            outputs: Some(words.word(OUTPUT_CONTACTS)),
            raw: words.into_raw(),
            ..Measurements::default()
        })
    }

    pub(crate) async fn read_faults(&mut self) -> Result<Faults> {
        let mut calls = self.registers.at(Class::Background);
        let mut words = Words::default();
        for (first, count) in [(SIGNALS.address(), 3), (STATE.address(), 1), (LINK_ERROR.address(), 1)] {
            words.extend(first, &calls.read_words(first, count).await?);
        }
        Ok(Faults {
            present: present(Errors::from_bits_retain(words.word(ERRORS))),
            history: Vec::new(),
            warnings: warnings(&words.pairs()),
            reset_allowed: None,
        })
    }

    /// Reads a block whole, or in its parts once the drive has refused to read the reserved registers along.
    async fn read_block(&mut self, class: Class, block: &Block, words: &mut Words) -> Result<()> {
        let mut calls = self.registers.at(class);
        if !self.skips_reserved {
            let (first, count) = block.whole;
            match calls.read_words(first, count).await {
                Ok(values) => {
                    words.extend(first, &values);
                    return Ok(());
                }
                Err(Error::Exception { meaning: ExceptionMeaning::NoSuchRegister, exchange, .. })
                    if exchange == (Exchange { function: 0x03, register: Some(first) }) => {}
                Err(error) => return Err(error),
            }
        }
        for (first, count) in block.parts {
            words.extend(first, &calls.read_words(first, count).await?);
        }
        self.skips_reserved = true;
        Ok(())
    }
}
