//! The blocks of the monitors: what is read together, within the limit of eight registers.

use drive_core::{
    Class, Error, ExceptionMeaning, Exchange, Faults, Measurements, Port, RawWord, Result, Row, Setpoint,
    Status, Voltage,
    registers::{Register, access::Readable},
};

use crate::{
    Drive3g3ev,
    faults::{present, warnings},
    registers::{
        CURRENT, DC_BUS, ERRORS, INPUT_TERMINALS, LINK, LINK_ERROR, OUTPUT_CONTACTS, OUTPUT_VOLTAGE,
        REFERENCE_SEEN, ROWS, SIGNALS, STATE,
    },
    status::FastWords,
    words::Errors,
};

/// A run of registers: the first and how many.
type Run = (u16, u16);

/// Registers that are read in one exchange, and the runs that they fall into when the reserved ones between them
/// cannot be read along: the manual does not say what those answer.
struct Block {
    whole: Run,
    parts: [Run; 2],
}

/// 0020h to 0027h, eight registers: 0025h and 0026h are reserved.
const FAST: Block =
    Block { whole: (SIGNALS.address(), 8), parts: [(SIGNALS.address(), 5), (CURRENT.address(), 1)] };
/// 0022h to 0028h: 0025h and 0026h are reserved.
const OUTPUT: Block =
    Block { whole: (LINK.address(), 7), parts: [(LINK.address(), 3), (CURRENT.address(), 2)] };
/// 002Bh to 0031h: 002Eh to 0030h are reserved.
const TERMINALS: Block = Block {
    whole: (INPUT_TERMINALS.address(), 7),
    parts: [(INPUT_TERMINALS.address(), 3), (DC_BUS.address(), 1)],
};

/// Words as they were read, reserved ones left out.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Words(Vec<RawWord>);

impl Words {
    fn extend(&mut self, first: u16, values: &[u16]) {
        let named = |address| ROWS.iter().find(|row: &&Row| row.address == address);
        let words = (first..).zip(values).filter_map(|(address, &value)| {
            named(address).map(|row| RawWord { address, code: row.code, value })
        });
        self.0.extend(words);
    }

    /// The word of a register that one of the blocks holds.
    pub(crate) fn word(&self, register: Register<impl Readable>) -> u16 {
        let found = self.0.iter().find(|word| word.address == register.address());
        found.map_or(0, |word| word.value)
    }

    pub(crate) fn into_raw(self) -> Vec<RawWord> {
        self.0
    }
}

impl<P: Port> Drive3g3ev<P> {
    pub(crate) async fn read_status(&mut self, class: Class) -> Result<Status> {
        let unit = self.unit(class).await?;
        let mut words = Words::default();
        self.read_block(class, &FAST, &mut words).await?;
        let state = self.registers.at(class).read(STATE).await?;
        words.extend(STATE.address(), &[state]);
        Ok(FastWords::of(words).status(unit, self.command))
    }

    pub(crate) async fn read_measurements(&mut self) -> Result<Measurements> {
        let unit = self.unit(Class::Background).await?;
        let mut words = Words::default();
        self.read_block(Class::Background, &OUTPUT, &mut words).await?;
        self.read_block(Class::Background, &TERMINALS, &mut words).await?;
        let reference = unit.and_then(|unit| unit.frequency(words.word(REFERENCE_SEEN)));
        let volts = |word: u16| Voltage::from_decivolts(u32::from(word) * 10);
        Ok(Measurements {
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
        let pairs: Vec<_> = words.0.iter().map(|word| (word.address, word.value)).collect();
        Ok(Faults {
            present: present(Errors::from_bits_retain(words.word(ERRORS))),
            history: Vec::new(),
            warnings: warnings(&pairs),
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
