//! What holds whatever the drive answers: no machine, only words.

use std::time::Duration;

use drive_core::{
    Class, Direction, Drive, Error, ExceptionMeaning, Frequency, Reaction, Registers, Setpoint, Speed,
    StopMode, registers::Space,
};

use super::{Contract, ControlWord, StatusWord};
use crate::{babble::Babble, bench::address, words::Words};

/// How many drives answer any words, each its own.
const BABBLERS: u32 = 1_000;

impl Contract {
    /// Whatever a drive says, nothing panics, no request is outside the family's limits, and of the control word only what
    /// the manual allows is written.
    pub async fn survives_any_words(&self) {
        let mut seen = vec![false; self.control.map_or(0, |control| control.words.len())];
        for seed in 0..BABBLERS {
            let port = Babble::new(self.capabilities, self.plausible, seed);
            self.ask_everything(self.drive(port.clone()).as_mut()).await;
            let Some(ControlWord { register, words, others, .. }) = self.control else { continue };
            for written in port.written(register) {
                let index = words.iter().position(|&word| word == written);
                let index =
                    index.or_else(|| words.iter().position(|&word| word == written & !others(written)));
                seen[index.unwrap_or_else(|| panic!("{}: {written:04X}h was written", self.name()))] = true;
            }
        }
        let Some(ControlWord { words, unseen, .. }) = self.control else { return };
        let never = words.iter().zip(seen).filter(|&(word, seen)| !seen && !unseen.contains(word));
        let never: Vec<_> = never.map(|(word, _)| word).collect();
        assert!(never.is_empty(), "{}: never written: {never:04X?}", self.name());
    }

    /// Everything that a user can ask of a drive.
    async fn ask_everything(&self, drive: &mut dyn Drive) {
        let _ = drive.status().await;
        let _ = drive.measurements().await;
        let _ = drive.faults().await;
        let _ = drive.identify().await;
        let _ = drive.keep_alive().await;
        let _ = drive.set_setpoint(Setpoint::Frequency(Frequency::from_hertz(25))).await;
        let _ = drive.set_setpoint(Setpoint::Speed(Speed::from_rpm(100))).await;
        for direction in [Direction::Forward, Direction::Reverse] {
            let _ = drive.start(direction).await;
        }
        for mode in StopMode::ALL {
            let _ = drive.stop(mode).await;
        }
        let _ = drive.reset_faults().await;
        let _ = drive.watchdog().await;
        let _ = drive.arm_watchdog(Duration::from_secs(2), Reaction::Ramp).await;
        let _ = drive.release().await;
        // The register of the control word among them: it is no parameter.
        let control = self.control.map(|control| control.register);
        let rows = self.capabilities.rows;
        for row in rows.iter().filter(|row| Some(row.address) == control).chain(rows.iter().step_by(7)) {
            let _ = drive.read_parameter(row).await;
            let _ = drive.write_parameter(row, 1).await;
        }
        let _ = drive.persist().await;
    }

    /// Every status word is decoded and kept, and tells a trip where the manual says so.
    pub async fn decodes_every_status_word(&self) {
        let Some(StatusWord { register, others, is_tripped }) = self.status else { return };
        for word in 0..=u16::MAX {
            let mut words = Words::new(self.capabilities, others);
            words.words.insert(register, word);
            let status = self.drive(words).status().await.expect("it answers");
            assert_eq!(status.raw(register), Some(word), "{}", self.name());
            let state = status.state;
            assert_eq!(status.is_fault(), is_tripped(word), "{}: {word:04X}h is {state}", self.name());
        }
    }

    /// A request beyond the words of the family is never sent.
    pub async fn sends_no_request_that_is_too_long(&self) {
        let unsent = |_, _| ExceptionMeaning::Unknown;
        let port = Words::new(self.capabilities, &[]);
        let mut registers = Registers::new(port, address(1), self.capabilities, unsent);
        let mut calls = registers.at(Class::Background);
        let (read, written) = (self.capabilities.read_words + 1, self.capabilities.write_words + 1);
        let errors = [
            calls.read_words(0, read).await.expect_err("too many"),
            calls.read_words(0, 0).await.expect_err("none"),
            calls.write_words(0, &vec![0; usize::from(written)]).await.expect_err("too many"),
            calls.write_words(0, &[]).await.expect_err("none"),
        ];
        for error in errors {
            assert!(matches!(error, Error::TooManyWords { .. }), "{}: {error}", self.name());
        }
        assert_eq!(registers.into_port().asked, [], "{}", self.name());
    }

    /// Each exception has the meaning that the manual gives.
    pub async fn explains_its_exceptions(&self) {
        if self.exceptions.is_empty() {
            return;
        }
        let row = self
            .capabilities
            .rows
            .iter()
            .find(|row| row.space == Space::HoldingRegister && row.access.is_readable())
            .expect("it has one");
        for code in 1..=u8::MAX {
            let mut words = Words::new(self.capabilities, &[]);
            words.refused.insert(row.address, code);
            let error = self.drive(words).read_parameter(row).await;
            let Err(Error::Exception { code: told, meaning, .. }) = error else { panic!("{error:?}") };
            let listed = self.exceptions.iter().find(|(listed, _)| *listed == code);
            let expected =
                listed.map_or(ExceptionMeaning::Unknown, |(_, means)| *means).or_of_a_gateway(code);
            assert_eq!((told, meaning), (code, expected), "{}", self.name());
            // Only what the drive began and could not complete, or is too busy for, may succeed by itself.
            let retry = matches!(expected, ExceptionMeaning::Failed | ExceptionMeaning::Busy);
            assert_eq!(meaning.is_worth_a_retry(), retry, "{}: {code:02X}h", self.name());
        }
    }
}
