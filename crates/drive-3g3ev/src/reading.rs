//! Reading the monitors.

use drive_core::{Class, Faults, Measurements, Port, Result, State, Status, Voltage};

use crate::{
    Drive3g3ev,
    blocks::{FAST, OUTPUT, Run, TERMINALS, Words},
    faults::{present, warnings},
    registers::{
        COMMAND, DC_BUS, ERRORS, INPUT_TERMINALS, LINK_ERROR, OUTPUT_CONTACTS, OUTPUT_VOLTAGE,
        REFERENCE_SEEN, SIGNALS, STATE,
    },
    status::{FastWords, is_run},
    words::Errors,
};

impl<P: Port> Drive3g3ev<P> {
    pub(crate) async fn read_status(&mut self, class: Class) -> Result<Status> {
        let unit = self.unit(class).await?;
        self.registers.begin_snapshot();
        let mut words = Words::default();
        self.read_run(class, FAST, &mut words).await?;
        if words.word(SIGNALS).is_none() {
            // Without it nothing is known of the drive: its exception says so.
            self.registers.at(class).read(SIGNALS).await?;
        }
        let state = self.registers.at(class).read(STATE).await?;
        words.extend(STATE.address(), [Some(state)]);
        let mut status = FastWords::of(words.clone()).status(unit, self.command);
        if status.state == State::Stopping && is_run(&status) {
            // So it is if the order that it was given last is still the one in force: another may have come since.
            let held = self.read_command(class).await?;
            words.extend(held.address, [Some(held.value)]);
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
        let unproved = self.watch.run.lease().is_some() && self.watch.run.held().is_none();
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
        self.read_run(Class::Background, OUTPUT, &mut words).await?;
        self.read_run(Class::Background, TERMINALS, &mut words).await?;
        let reference = unit.zip(words.word(REFERENCE_SEEN)).and_then(|(unit, word)| unit.setpoint(word));
        let volts = |word: u16| Voltage::from_decivolts(u32::from(word) * 10);
        Ok(Measurements {
            at: self.registers.snapshot_time(),
            reference,
            output_voltage: words.word(OUTPUT_VOLTAGE).map(volts),
            dc_bus_voltage: words.word(DC_BUS).map(volts),
            inputs: words.word(INPUT_TERMINALS),
            outputs: words.word(OUTPUT_CONTACTS),
            raw: words.into_raw(),
            ..Measurements::default()
        })
    }

    pub(crate) async fn read_faults(&mut self) -> Result<Faults> {
        let mut words = Words::default();
        for run in [(SIGNALS.address(), 3), (STATE.address(), 1), (LINK_ERROR.address(), 1)] {
            self.read_run(Class::Background, run, &mut words).await?;
        }
        let errors = match words.word(ERRORS) {
            Some(errors) => errors,
            // Without it no fault is known, and that there is none is not either: its exception says so.
            None => self.registers.at(Class::Background).read(ERRORS).await?,
        };
        let tripped = errors != 0 || FastWords::of(words.clone()).is_tripped();
        Ok(Faults {
            present: present(Errors::from_bits_retain(errors)),
            history: Vec::new(),
            warnings: warnings(&words.pairs()),
            tripped,
            reset_allowed: None,
        })
    }

    /// Reads a run of registers, as far as this drive has them.
    async fn read_run(&mut self, class: Class, (first, count): Run, words: &mut Words) -> Result<()> {
        let mut calls = self.registers.at(class);
        words.extend(first, self.absent.read(&mut calls, first, count).await?);
        Ok(())
    }
}
