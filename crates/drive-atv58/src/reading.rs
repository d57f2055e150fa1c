//! Reading the mapped words, and what they say.

use drive_core::{
    Absent, Calls, Control, Current, Direction, Frequency, Measurements, Percent, Port, RawWord, Result, Row,
    Setpoint, State, Status, Voltage,
};
use drive_drivecom::ChartState;

use crate::{
    Atv58Map, CAPABILITIES, ROWS,
    diagnostics::read_input_words,
    registers::{CMD, W483},
    words::FaultRegister,
};

/// Words as they were read, each with its address.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Words {
    words: Vec<RawWord>,
}

impl Words {
    /// Reads those of these words that the drive has: in one request from the lowest to the highest where the limit of words
    /// allows it, else one by one. `input`: by function 04.
    pub(crate) async fn read<P: Port>(
        absent: &mut Absent,
        calls: &mut Calls<'_, P>,
        input: bool,
        addresses: &[u16],
    ) -> Result<Self> {
        let mut words = Self::default();
        let (Some(&first), Some(&last)) = (addresses.iter().min(), addresses.iter().max()) else {
            return Ok(words);
        };
        let blocks = if last - first < CAPABILITIES.read_words {
            vec![(first, last)]
        } else {
            addresses.iter().map(|&address| (address, address)).collect()
        };
        for (first, last) in blocks {
            let mut at = first;
            while let Some((from, count)) = absent.next(at, last + 1) {
                if let Some(values) = absent.told(from, count, request(calls, input, from, count).await)? {
                    words.extend(from, values);
                    at = from + count;
                }
            }
        }
        Ok(words)
    }

    /// Reads `count` more words from `first` on, which the drive has.
    pub(crate) async fn append<P: Port>(
        &mut self,
        calls: &mut Calls<'_, P>,
        input: bool,
        first: u16,
        count: u16,
    ) -> Result<()> {
        self.extend(first, request(calls, input, first, count).await?);
        Ok(())
    }

    pub(crate) fn join(&mut self, more: Self) {
        self.words.extend(more.words);
    }

    fn extend(&mut self, first: u16, values: Vec<u16>) {
        let words = (first..=u16::MAX).zip(values);
        self.words.extend(words.map(|(address, value)| RawWord { address, code: code(address), value }));
    }

    pub(crate) fn at(&self, address: Option<u16>) -> Option<u16> {
        self.words.iter().find(|word| Some(word.address) == address).map(|word| word.value)
    }

    pub(crate) fn eta(&self, map: &Atv58Map) -> u16 {
        self.at(Some(map.status)).unwrap_or(0)
    }

    pub(crate) fn chart(&self, map: &Atv58Map) -> Option<ChartState> {
        ChartState::of(self.eta(map))
    }

    pub(crate) fn is_tripped(&self, map: &Atv58Map) -> bool {
        self.chart(map).is_some_and(ChartState::is_fault)
    }

    /// Whether the output turns the motor, where a word tells it.
    pub(crate) fn is_turning(&self, map: &Atv58Map) -> bool {
        self.at(map.output_frequency).is_some_and(|word| word != 0)
    }

    pub(crate) fn control(&self, map: &Atv58Map) -> Option<Control> {
        // While local control is not forced, nothing tells whether the line commands or the terminals.
        (self.flag(map, map.remote) == Some(false)).then_some(Control::Local)
    }

    pub(crate) fn status(&self, map: &Atv58Map) -> Status {
        let reverse = self.flag(map, map.reverse_status);
        Status {
            state: self.state(map),
            direction: reverse.map(|reverse| if reverse { Direction::Reverse } else { Direction::Forward }),
            output_frequency: self
                .at(map.output_frequency)
                .map(|word| Frequency::from_decihertz(word.cast_signed().unsigned_abs())),
            current: self.at(map.current).map(|word| Current::from_deciamperes(u32::from(word))),
            reference: self.at(map.reference).map(Frequency::from_decihertz),
            at_reference: self.flag(map, map.at_reference),
            warning: self.flag(map, map.alarm),
            fault_code: self
                .at(Some(W483.address()))
                .filter(|_| self.is_tripped(map))
                .and_then(|word| FaultRegister(word).bits().next()),
            control: self.control(map),
            raw: self.words.clone(),
            ..Status::default()
        }
    }

    pub(crate) fn measurements(self, map: &Atv58Map) -> Measurements {
        let percent = |word: u16| Percent::from_hundredths(i32::from(word) * 100);
        let reference = |word: u16| Setpoint::Frequency(Frequency::from_decihertz(word));
        Measurements {
            reference: self.at(map.reference).map(reference),
            line_voltage: self.at(map.line_voltage).map(|word| Voltage::from_decivolts(u32::from(word))),
            drive_thermal: self.at(map.drive_thermal).map(percent),
            motor_thermal: self.at(map.motor_thermal).map(percent),
            raw: self.words,
            ..Measurements::default()
        }
    }

    fn flag(&self, map: &Atv58Map, mask: u16) -> Option<bool> {
        (mask != 0).then(|| self.eta(map) & mask != 0)
    }

    fn state(&self, map: &Atv58Map) -> State {
        let enabled = self.enabled(map);
        self.chart(map).map_or(State::Unknown, |chart| chart.state(self.is_turning(map), enabled))
    }

    /// In the state "operation enabled" a run command is in force, unless the control word was read with these words, is
    /// the ramp stop, and acts: in forced local mode it does not.
    fn enabled(&self, map: &Atv58Map) -> State {
        let command = self.at(Some(CMD.address())).filter(|_| self.control(map).is_none());
        let stop = command.filter(|command| Some(*command) == map.ramp_stop);
        match stop {
            Some(_) if self.is_turning(map) => State::Stopping,
            Some(_) => State::Ready,
            None => State::Running,
        }
    }
}

async fn request<P: Port>(calls: &mut Calls<'_, P>, input: bool, first: u16, count: u16) -> Result<Vec<u16>> {
    if input { read_input_words(calls, first, count).await } else { calls.read_words(first, count).await }
}

fn code(address: u16) -> &'static str {
    let row: Option<&Row> = ROWS.iter().find(|row| row.address == address);
    row.map_or("?", |row| row.code)
}
