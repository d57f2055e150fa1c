//! A drive that is nothing but words: what is written stands there, what is not there is 0.

use std::{
    collections::{BTreeMap, VecDeque},
    io,
};

use async_trait::async_trait;
use drive_core::{Capabilities, Class, Drive, Lack, Port, PortError, Terms, Verdict};
use tokio_modbus::{ExceptionCode, Request, Response, Slave, client::Client, slave::SlaveContext};

/// A request that a [`Words`] was asked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Asked {
    /// Function 03: first register and number.
    Read(Class, u16, u16),
    /// Function 06 or 10h: first register and words.
    Write(Class, u16, Vec<u16>),
    /// Function 08, sub-code 00.
    LoopBack(Class),
}

impl Asked {
    /// Whether it reads this register, alone or among others.
    #[must_use]
    pub fn reads(&self, register: u16) -> bool {
        matches!(self, Self::Read(_, first, count) if (*first..first + count).contains(&register))
    }
}

/// A drive that is nothing but words. It refuses, by a panic, what the family does not have: a function, or more words
/// than one request may carry.
#[derive(Debug, Clone)]
pub struct Words {
    /// The words that are not 0.
    pub words: BTreeMap<u16, u16>,
    /// What was asked, in order.
    pub asked: Vec<Asked>,
    /// What becomes of the next writes: the failure that their caller sees, and whether they arrive all the same.
    pub writes: VecDeque<Option<(PortError, bool)>>,
    /// Whether it confirms writes and does nothing.
    pub deaf: bool,
    /// Registers that answer this exception.
    pub refused: BTreeMap<u16, u8>,
    /// The exception that every write is answered by.
    pub refuses_writes: Option<u8>,
    /// A word that is another at each reading, as that of an analog input is.
    pub wanders: Option<u16>,
    /// A word that a register is to have, and how many readings of it still find it as it is: one that monitors may be late.
    pub lags: Option<(u16, u16, u16)>,
    /// What function 08 answers, where that is not its request.
    pub loop_back: Option<Vec<u8>>,
    capabilities: &'static Capabilities,
    terms: Terms,
}

impl Words {
    /// A drive of a family with these words.
    #[must_use]
    pub fn new(capabilities: &'static Capabilities, words: &[(u16, u16)]) -> Self {
        Self {
            words: words.iter().copied().collect(),
            asked: Vec::new(),
            writes: VecDeque::new(),
            deaf: false,
            refused: BTreeMap::new(),
            refuses_writes: None,
            wanders: None,
            lags: None,
            loop_back: None,
            capabilities,
            terms: Terms::default(),
        }
    }

    /// What was written, in order; of several words the first.
    #[must_use]
    pub fn written(&self) -> Vec<(u16, u16)> {
        let one = |asked: &Asked| match asked {
            Asked::Write(_, at, values) => values.first().map(|&value| (*at, value)),
            Asked::Read(..) | Asked::LoopBack(_) => None,
        };
        self.asked.iter().filter_map(one).collect()
    }

    fn read(&mut self, first: u16, count: u16) -> Result<Response, ExceptionCode> {
        assert!(count <= self.capabilities.read_words, "{count} words in one read");
        self.asked.push(Asked::Read(self.terms.class, first, count));
        let registers = first..first + count;
        if let Some(code) = registers.clone().find_map(|register| self.refused.get(&register)) {
            return Err(ExceptionCode::new(*code));
        }
        if let Some((register, word, left)) = self.lags.as_mut().filter(|(at, ..)| registers.contains(at)) {
            match left.checked_sub(1) {
                Some(less) => *left = less,
                None => drop(self.words.insert(*register, *word)),
            }
        }
        let wanders = self.wanders.filter(|register| registers.contains(register));
        let values = registers.map(|register| self.words.get(&register).copied().unwrap_or(0));
        let answer = Response::ReadHoldingRegisters(values.collect());
        if let Some(register) = wanders {
            *self.words.entry(register).or_default() += 3;
        }
        Ok(answer)
    }

    fn write(&mut self, first: u16, values: &[u16], answer: Response) -> tokio_modbus::Result<Response> {
        assert!(values.len() <= usize::from(self.capabilities.write_words), "{} words", values.len());
        self.asked.push(Asked::Write(self.terms.class, first, values.to_vec()));
        if let Some(code) = self.refuses_writes {
            return Ok(Err(ExceptionCode::new(code)));
        }
        let fate = self.writes.pop_front().flatten();
        if !self.deaf && fate.as_ref().is_none_or(|(_, arrives)| *arrives) {
            self.words.extend((first..).zip(values.iter().copied()));
        }
        match fate {
            Some((problem, _)) => Err(tokio_modbus::Error::Transport(problem.into_io())),
            None => Ok(Ok(answer)),
        }
    }
}

/// What so many statuses say that a run command of ours which stands in a drive lacks, the last that was told of it: the first may
/// not know the reason yet. `None`: nothing was told in any of them.
///
/// # Panics
/// When a status is not told.
pub async fn lacks_within(drive: &mut dyn Drive, statuses: usize) -> Option<(Lack, String)> {
    let mut told = None;
    for _ in 0..statuses {
        let status = drive.status().await.expect("these words are told");
        if let Some(Verdict::NotInForce { lacks, because }) = status.verdict {
            told = Some((lacks, because.to_string()));
        }
    }
    told
}

impl Port for Words {
    fn set_terms(&mut self, terms: Terms) {
        self.terms = terms;
    }
}

impl SlaveContext for Words {
    fn set_slave(&mut self, _: Slave) {}
}

#[async_trait]
impl Client for Words {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        let function = request.function_code().value();
        assert!(
            self.capabilities.functions.contains(&function),
            "the family has no function {function:02X}h"
        );
        match request {
            Request::ReadHoldingRegisters(first, count) => Ok(self.read(first, count)),
            Request::WriteSingleRegister(at, value) => {
                self.write(at, &[value], Response::WriteSingleRegister(at, value))
            }
            Request::WriteMultipleRegisters(first, values) => {
                let answer = Response::WriteMultipleRegisters(first, values.len() as u16);
                self.write(first, &values, answer)
            }
            Request::Custom(0x08, data) => {
                self.asked.push(Asked::LoopBack(self.terms.class));
                let answer = self.loop_back.clone().unwrap_or_else(|| data.into_owned());
                Ok(Ok(Response::Custom(0x08, answer.into())))
            }
            // Whoever is asked what it is and is only words does not say.
            _ => Ok(Err(ExceptionCode::IllegalFunction)),
        }
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The words that a request writes, each with its register.
pub(crate) fn words_written(pdu: &[u8]) -> Vec<(u16, u16)> {
    let word = |at: usize| Some(u16::from_be_bytes([*pdu.get(at)?, *pdu.get(at + 1)?]));
    let (Some(function), Some(first)) = (pdu.first(), word(1)) else { return Vec::new() };
    let count = match function {
        0x06 => 1,
        0x10 => word(3).unwrap_or(0),
        _ => 0,
    };
    let begin = if *function == 0x06 { 3 } else { 6 };
    let value = |index: u16| word(begin + 2 * usize::from(index));
    (0..count).filter_map(|index| Some((first.checked_add(index)?, value(index)?))).collect()
}
