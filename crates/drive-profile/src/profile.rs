//! A profile that was checked: [`Profile`].

use drive_core::Direction;

use crate::{
    format::{Action, Answer, Bits, Denial, FedBy, File, Guard, Register, Sign, Space, Spanned, Step},
    ladder::{Gap, Level},
    read_back::ReadBack,
    source::grade,
    written::Written,
};

/// A profile that was checked. What its file holds is whole: each name that it uses is one of its own.
///
/// ```
/// use drive_profile::{Level, read, shipped};
///
/// let v20 = shipped::find("v20").expect("it is shipped");
/// assert_eq!((v20.key(), v20.level()), ("v20", Level::Motion));
///
/// // A text that is no profile is refused with its lines.
/// let refusals = read("profile = 1").unwrap_err();
/// assert!(refusals.0.iter().all(|refusal| refusal.line >= 1 && !refusal.write.is_empty()));
/// ```
#[derive(Debug, Clone)]
pub struct Profile {
    pub(crate) file: File,
    pub(crate) level: Level,
    pub(crate) gaps: Vec<Gap>,
    pub(crate) digest: String,
    pub(crate) substance: String,
}

impl Profile {
    /// The name by which configurations choose it.
    #[must_use]
    pub fn key(&self) -> &str {
        self.file.key.get_ref()
    }

    /// The drive, with its maker.
    #[must_use]
    pub fn name(&self) -> &str {
        self.file.name.get_ref()
    }

    /// What the file holds.
    #[must_use]
    pub const fn file(&self) -> &File {
        &self.file
    }

    /// The SHA-256 of its text, in hexadecimal digits: two profiles of one digest are one.
    #[must_use]
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// The SHA-256 of what decides how its drive is read, stopped and started: what a trial tries. Names, remarks and sources are none of it.
    #[must_use]
    pub fn substance(&self) -> &str {
        &self.substance
    }

    /// What the drive can be trusted with by this profile.
    #[must_use]
    pub const fn level(&self) -> Level {
        self.level
    }

    /// What is not known: first what keeps it from the next level, then what is only said. Each with the question that comes next.
    #[must_use]
    pub fn gaps(&self) -> &[Gap] {
        &self.gaps
    }

    /// What keeps its drive from a level, in words for whoever has asked for more; `None`: it reaches it.
    #[must_use]
    pub fn keeps_from(&self, level: Level) -> Option<String> {
        (self.level < level).then(|| {
            let gap = self.gaps.iter().find(|gap| gap.keeps_from.is_some_and(|of| of <= level));
            let because =
                gap.map(|gap| format!(": {}, line {} of its file", gap.what, gap.line)).unwrap_or_default();
            format!("its profile reaches {} and no further{because}", self.level)
        })
    }

    /// What cannot be seen of its drive and matters to whoever starts it, gives it a setpoint or resets it.
    pub fn not_known(&self) -> impl Iterator<Item = &str> {
        self.gaps.iter().filter(|gap| gap.matters).map(|gap| gap.what.as_str())
    }

    /// By what its drive says what it is, the same each time; `None`: by nothing.
    pub(crate) fn identification(&self) -> Option<&'static str> {
        let all = self.file.who.fingerprints.given().into_iter().flatten();
        let is_constant =
            |of: &crate::format::Spanned<Guard>| of.get_ref().is.as_ref().is_some_and(|is| is.len() == 1);
        all.into_iter().any(is_constant).then_some("registers that only this drive reads so")
    }

    /// Whether whatever is asked feeds its communication watchdog.
    pub(crate) fn is_fed_by_any_request(&self) -> bool {
        let watchdog = self.file.watchdog.given().map(Spanned::get_ref);
        watchdog.is_some_and(|watchdog| watchdog.fed_by == Answer::Given(FedBy::AnyRequest))
    }

    /// What an exception of its drive says of a write, where its file lists it by a source that is sound.
    pub(crate) fn denial(&self, code: u8) -> Option<Denial> {
        let exceptions = self.file.link.get_ref().exceptions.as_ref()?.get_ref();
        let listed = exceptions.list.iter().find(|(listed, _)| *listed == code)?;
        grade(&self.file, &exceptions.source).is_sound().then_some(listed.1)
    }

    /// How it is started in a direction.
    pub(crate) fn start(&self, direction: Direction) -> Option<&Action> {
        let start = match direction {
            Direction::Forward => &self.file.start.forward,
            Direction::Reverse => &self.file.start.reverse,
        };
        start.given().map(Spanned::get_ref)
    }

    /// Whether anything that its drive reads to be tells it from others.
    #[must_use]
    pub fn tells_itself(&self) -> bool {
        self.file.who.fingerprints.given().is_some_and(|all| !all.is_empty())
    }
}

impl File {
    /// The space and the wire address of a register.
    pub(crate) fn place(&self, register: &Register) -> Option<(Space, u16)> {
        let address = self.link.get_ref().numbering.wire(*register.address.get_ref())?;
        Some((register.space.unwrap_or(self.link.get_ref().space), address))
    }

    /// The registers of what is measured, and of the present fault: what changes while the drive works.
    pub(crate) fn measured(&self) -> [&Answer<Spanned<String>>; 7] {
        let see = &self.see;
        [
            &see.output,
            &see.setpoint,
            &see.current,
            &see.speed,
            &see.output_voltage,
            &see.dc_bus_voltage,
            &self.faults.present,
        ]
    }

    /// A register by its name.
    pub(crate) fn named(&self, name: &str) -> Option<&Register> {
        self.register.get(name).map(Spanned::get_ref)
    }

    /// The register that holds what 100 % of the setpoint is, where one does.
    pub(crate) fn full_scale(&self) -> Option<&str> {
        let full_scale = self.setpoint.given()?.get_ref().full_scale.as_ref()?.get_ref();
        (full_scale != "owner").then_some(full_scale)
    }

    /// What an action writes, in its order, register by register.
    pub(crate) fn writes(&self, action: &Action) -> Vec<Written> {
        action.steps.iter().flat_map(|step| self.written(step.get_ref(), None)).collect()
    }

    /// What a step writes; where that is the setpoint, so many counts of it, or the least where there is none.
    pub(crate) fn written(&self, step: &Step, setpoint: Option<i32>) -> Vec<Written> {
        let register = step.write.as_ref().and_then(|name| self.named(name.get_ref()));
        let Some((space, first)) = register.and_then(|register| self.place(register)) else {
            return Vec::new();
        };
        let least = || self.setpoint.given().map(|setpoint| setpoint.get_ref().limits.get_ref().low);
        let signed = step
            .setpoint
            .as_ref()
            .zip(setpoint.or_else(least))
            .map(|(sign, counts)| sign.get_ref().word(counts));
        let words = step.words.iter().flatten().copied().chain(signed);
        let coils = step.coils.iter().flatten().map(|&on| u16::from(on));
        let values = words.chain(coils).zip(0_u16..);
        values.map(|(value, at)| Written { space, address: first.saturating_add(at), value }).collect()
    }

    /// The word of a start that runs the motor. Of several words in its last step it is the one that [command] says, and of several of
    /// these the one in the register that reads back: by it a drive tells this side's run command from another's. Where it reads back in
    /// several it is what the whole start leaves there.
    pub(crate) fn run_word(&self, start: &Action, setpoint: Option<i32>) -> Option<u16> {
        if let Some(split) = ReadBack::of(self).filter(ReadBack::is_split) {
            return split.written(0, &self.writes(start));
        }
        let written = self.written(start.steps.last()?.get_ref(), setpoint);
        let read_back = self.read_back();
        let mut runs = written.iter().filter(|written| self.runs(**written));
        let reads_back = |of: &&Written| Some((of.space, of.address)) == read_back;
        let found = runs.clone().find(reads_back).or_else(|| runs.next()).or_else(|| written.last());
        found.map(|written| written.value)
    }

    /// The step of a reset that rises: the last that leaves at a place what does not stand there at its end, or that the drive clears by
    /// itself. What comes behind it clears it.
    pub(crate) fn rising(&self, reset: &Action) -> usize {
        let steps: Vec<Vec<Written>> =
            reset.steps.iter().map(|step| self.written(step.get_ref(), None)).collect();
        let stays = |of: &Written| {
            let place = |other: &&Written| (other.space, other.address) == (of.space, of.address);
            steps.iter().flatten().rev().find(place).is_some_and(|last| last.value == of.value)
        };
        let rises = |writes: &Vec<Written>| !writes.iter().all(stays);
        let clears_itself = reset.clears_itself == Some(true);
        let writing = steps.iter().enumerate().rev().filter(|(_, writes)| !writes.is_empty());
        let last = writing.map(|(at, _)| at).nth(usize::from(!clears_itself));
        steps.iter().rposition(rises).filter(|_| !clears_itself).or(last).unwrap_or(0)
    }

    /// The bits by which the reset resets: what rises in it, at each place of a command of bits, and at each coil.
    pub(crate) fn reset_bits(&self) -> Vec<Written> {
        let Some(reset) = self.reset.given().map(Spanned::get_ref) else { return Vec::new() };
        let steps: Vec<_> = reset.steps.iter().map(|step| self.written(step.get_ref(), None)).collect();
        let rising = steps.get(self.rising(reset)).into_iter().flatten();
        let bits = rising.filter(|rising| rising.space.is_bit() || self.is_of_bits(**rising)).map(|rising| {
            let at_place = |of: &&Written| (of.space, of.address) == (rising.space, rising.address);
            let left = steps.iter().flatten().rev().find(at_place).map_or(0, |left| left.value);
            Written { value: rising.value & !left, ..*rising }
        });
        bits.filter(|rising| rising.value != 0).collect()
    }

    /// Whether single bits of what is written there command the motor. Of a code the whole word does.
    fn is_of_bits(&self, written: Written) -> bool {
        let mut runs = self.runs_at(written).peekable();
        runs.peek().is_some() && runs.all(|run| *run.mask.get_ref() != u16::MAX)
    }

    /// The forms of a run command at the place of a word.
    fn runs_at(&self, written: Written) -> impl Iterator<Item = &Bits> {
        let runs = self.command.given().into_iter().flat_map(|command| &command.get_ref().runs);
        runs.map(Spanned::get_ref).filter(move |run| {
            let place = self.named(run.register.get_ref()).and_then(|register| self.place(register));
            place == Some((written.space, written.address))
        })
    }

    /// The bits of a word that [command] wants on for the run command that it is.
    pub(crate) fn needed_to_run(&self, written: Written) -> u16 {
        let its = self.runs_at(written).filter(|run| !run.differs && run.fit(written.value));
        its.fold(0, |all, run| all | run.mask.get_ref() & run.value)
    }

    /// Where the command reads back.
    pub(crate) fn read_back(&self) -> Option<(Space, u16)> {
        let read = self.ownership.reads_back.given()?;
        self.place(self.named(read.get_ref().register.get_ref())?)
    }

    /// Where the run words of [command] are written.
    pub(crate) fn commanded(&self) -> impl Iterator<Item = (Space, u16)> {
        let runs = self.command.given().into_iter().flat_map(|command| &command.get_ref().runs);
        runs.filter_map(|run| self.place(self.named(run.get_ref().register.get_ref())?))
    }

    /// Whether the setpoint is the run command: a start is the setpoint, written.
    pub(crate) fn starts_by_setpoint(&self) -> bool {
        let starts = [&self.start.forward, &self.start.reverse].into_iter().filter_map(Answer::given);
        starts.into_iter().any(|start| start.get_ref().starts_by_setpoint())
    }

    /// Every action with its name.
    pub(crate) fn actions(&self) -> impl Iterator<Item = (&'static str, &crate::format::Spanned<Action>)> {
        let all: [(&'static str, &Answer<_>); 8] = [
            ("stop.ramp", &self.stop.ramp),
            ("stop.fast", &self.stop.fast),
            ("stop.freewheel", &self.stop.freewheel),
            ("stop.dc_injection", &self.stop.dc_injection),
            ("start.forward", &self.start.forward),
            ("start.reverse", &self.start.reverse),
            ("reset", &self.reset),
            ("setup", &self.setup),
        ];
        all.into_iter().filter_map(|(name, action)| Some((name, action.given()?)))
    }

    /// Whether a word that is written runs the motor.
    pub(crate) fn runs(&self, written: Written) -> bool {
        self.runs_at(written).any(|run| run.fit(written.value))
    }
}

impl Action {
    /// Whether its last step writes the setpoint.
    pub(crate) fn starts_by_setpoint(&self) -> bool {
        self.steps.last().is_some_and(|step| step.get_ref().setpoint.is_some())
    }
}

impl Sign {
    /// The word of so many counts with this sign.
    pub(crate) fn word(self, counts: i32) -> u16 {
        let counts = if self == Self::Negative { counts.wrapping_neg() } else { counts };
        // The checker lets no limit pass that its register does not hold.
        let [_, _, high, low] = counts.to_be_bytes();
        u16::from_be_bytes([high, low])
    }
}
