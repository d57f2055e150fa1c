//! Actions: a stop that is one write and runs nothing, a start that runs, a reset that does neither.

use std::collections::BTreeMap;

use crate::format::Spanned;

use super::{Check, states::is_fault};
use crate::{
    format::{Access, Action, File, Register, Sign, Space, Step, Storage},
    written::Written,
};

/// The most steps of an action.
const STEPS: usize = 16;

/// The function that writes registers and reads others in one exchange.
const READ_WRITE: u8 = 23;

/// The longest pause or wait, in ms.
const LONGEST_WAIT: u16 = 10_000;

impl Check<'_> {
    pub(super) fn actions(&mut self) {
        let file = self.file;
        if let Some(command) = file.command.given() {
            self.source(&command.get_ref().source);
            for run in &command.get_ref().runs {
                // A register that is a command when written may be another thing when read.
                if let Some(register) = self.register(&run.get_ref().register) {
                    self.is_whole("[command]", &run.get_ref().register, register);
                }
                self.source(&run.get_ref().source);
                self.mask(run.get_ref());
            }
        }
        if self.is_inverted() {
            return;
        }
        for (name, action) in file.actions() {
            self.source(&action.get_ref().source);
            self.steps(name, action);
            match name.split_once('.') {
                Some(("stop", _)) => self.stop(name, action),
                Some(_) => {
                    self.start(name, action);
                    self.leaves_the_other_start(name, action);
                }
                None => self.runs_nothing(name, action),
            }
        }
        if let Some(reset) = file.reset.given() {
            self.reset(reset);
        }
        self.starts_differ();
        self.setup();
        self.by_setpoint();
        let unread = &file.stop.unread;
        let has_stops = file.actions().any(|(name, _)| name.starts_with("stop."));
        if has_stops && file.stop.of(*unread.get_ref()).given().is_none() {
            self.refuse(
                &unread.span(),
                "the stop of a drive that was not read is none that is known",
                "unread = one of the stops above that is a stop whatever the guards say",
            );
        }
    }

    /// Run words that are those of the stops: the starts, stops and resets would all be refused for what [command] has wrong.
    fn is_inverted(&mut self) -> bool {
        let file = self.file;
        let Some(command) = file.command.given() else { return false };
        let runs = |action: &Spanned<Action>| {
            file.writes(action.get_ref()).into_iter().any(|written| file.runs(written))
        };
        let of = |kind: &'static str| file.actions().filter(move |(name, _)| name.starts_with(kind));
        let is_it = of("stop.").next().is_some()
            && of("stop.").all(|(_, stop)| runs(stop))
            && of("start.").next().is_some()
            && !of("start.").any(|(_, start)| runs(start));
        if is_it {
            self.refuse(
                &command.span(),
                "by [command] the words of the stops run the motor, and those of the starts do not",
                "the mask and the value of the words that run it",
            );
        }
        is_it
    }

    fn steps(&mut self, name: &str, action: &Spanned<Action>) {
        let steps = &action.get_ref().steps;
        if steps.is_empty() || steps.len() > STEPS {
            self.refuse(
                &action.span(),
                format!("{name} has no steps, or too many"),
                format!("1 to {STEPS} steps"),
            );
        }
        for spanned in steps {
            let step = spanned.get_ref();
            let kinds = [step.write.is_some(), step.pause_ms.is_some(), step.awaits.is_some()];
            let written = [step.words.is_some(), step.coils.is_some(), step.setpoint.is_some()];
            let belongs = written.into_iter().filter(|is| *is).count() == usize::from(step.write.is_some())
                && step.within_ms.is_some() == step.awaits.is_some()
                && (step.function.is_none() || step.write.is_some());
            if kinds.into_iter().filter(|kind| *kind).count() != 1 || !belongs {
                self.refuse(
                    &spanned.span(),
                    "a step is one thing",
                    "{ write, words or coils }, { write, setpoint }, { pause_ms } or { await, within_ms }",
                );
            }
            for time in [&step.pause_ms, &step.within_ms].into_iter().flatten() {
                if !(1..=LONGEST_WAIT).contains(time.get_ref()) {
                    self.refuse(&time.span(), "nobody waits so long", format!("1 to {LONGEST_WAIT} ms"));
                }
            }
            if let Some(awaited) = &step.awaits {
                self.bits(awaited);
            }
            self.write(name, spanned);
        }
    }

    fn write(&mut self, name: &str, spanned: &Spanned<Step>) {
        let step = spanned.get_ref();
        let Some(to) = &step.write else { return };
        let Some(register) = self.register(to) else { return };
        let Some((space, _)) = self.file.place(register) else { return };
        let count = step.words.as_ref().map_or(0, Vec::len)
            + step.coils.as_ref().map_or(0, Vec::len)
            + usize::from(step.setpoint.is_some());
        let link = self.file.link.get_ref();
        let most = if space.is_bit() { &link.write_coils } else { &link.write_words };
        let most = usize::from(most.given().copied().unwrap_or(1));
        if count == 0 || count > most || space.is_bit() != step.coils.is_some() {
            self.refuse(
                &spanned.span(),
                format!("{name} writes what {} does not take", to.get_ref()),
                format!("1 to {most} words of a register, or coils of a coil"),
            );
        }
        let by = space.written_by();
        let usual = by.map(|[one, several]| if count == 1 && self.has(one) { one } else { several });
        let function = step.function.as_ref().map(|function| *function.get_ref()).or(usual);
        // Function 23 reads a register along, which it has to know.
        let both =
            |function| function == READ_WRITE && space == Space::HoldingRegister && self.tells_its_state();
        let can = |function| by.is_some_and(|by| by.contains(&function)) || both(function);
        let fits = |function| can(function) && self.has(function);
        // That no function writes its register at all is told of the register.
        let is_written = by.is_some_and(|by| by.into_iter().any(|function| self.has(function)));
        if is_written && !function.is_some_and(fits) || function == by.map(|[one, _]| one) && count != 1 {
            self.refuse(
                &spanned.span(),
                format!(
                    "{name} writes {} by a function that the drive has not, or that cannot",
                    to.get_ref()
                ),
                "one of `functions` for so many of them",
            );
        }
        if register.parameter && name != "setup" {
            self.refuse(
                &spanned.span(),
                format!("{name} writes {}, which is a parameter", to.get_ref()),
                "parameter = false: a command is no parameter",
            );
        }
        self.is_whole(name, to, register);
        // A block writes whatever lies in it.
        if let Some(why) = self.forbidden(register).or_else(|| self.forbidden_block(register, count)) {
            self.refuse(
                &spanned.span(),
                format!("{name} writes {}, or beyond it, which is never written: {why}", to.get_ref()),
                "another register, or take it out of never_written",
            );
        }
        self.passed_over(name, spanned);
        if register.access == Access::Read {
            self.refuse(
                &spanned.span(),
                format!("{} can only be read", to.get_ref()),
                "access = \"read_write\"",
            );
        }
        if name != "setup" {
            self.is_volatile(name, to, register);
        }
    }

    /// What a step writes behind its first register can be written as that one can.
    fn passed_over(&mut self, name: &str, spanned: &Spanned<Step>) {
        let file = self.file;
        for written in file.written(spanned.get_ref(), None).into_iter().skip(1) {
            let at =
                |of: &&Spanned<Register>| file.place(of.get_ref()) == Some((written.space, written.address));
            for register in file.register.values().filter(at).map(Spanned::get_ref) {
                if register.access == Access::Read {
                    self.refuse(
                        &spanned.span(),
                        format!("{name} writes {:04X}h, which can only be read", written.address),
                        "a block that ends before it",
                    );
                }
                let wears = |storage: &Spanned<Storage>| *storage.get_ref() == Storage::Eeprom;
                if name != "setup" && register.storage.as_ref().is_some_and(wears) {
                    self.refuse(
                        &spanned.span(),
                        format!("{name} writes {:04X}h, which wears an EEPROM", written.address),
                        "a block that ends before it",
                    );
                }
            }
        }
    }

    /// A command is one whole word: a run bit in the byte or the word that is not looked at is one that nobody finds.
    pub(super) fn is_whole(&mut self, what: &str, name: &Spanned<String>, register: &Register) {
        if register.byte.is_some() || what == "[command]" && register.words.is_some() {
            self.refuse(
                &name.span(),
                format!("{what} has {}, which is a part of what is written", name.get_ref()),
                "a register that is the whole word, without `byte` and `words`",
            );
        }
    }

    /// Whether a holding register tells the state.
    fn tells_its_state(&self) -> bool {
        let file = self.file;
        let named =
            file.state.is.iter().filter_map(|is| file.named(is.get_ref().bits.get_ref().register.get_ref()));
        named
            .into_iter()
            .any(|register| file.place(register).is_some_and(|(space, _)| space == Space::HoldingRegister))
    }

    fn has(&self, function: u8) -> bool {
        self.file.link.get_ref().functions.iter().any(|has| *has.get_ref() == function)
    }

    /// One write, and nothing before it: a stop that reads or unlocks first is late, or never comes.
    fn stop(&mut self, name: &str, action: &Spanned<Action>) {
        let steps = &action.get_ref().steps;
        let first = steps.first().map(Spanned::get_ref);
        if first.is_some_and(|step| step.awaits.is_some() || step.pause_ms.is_some()) {
            self.refuse(
                &action.span(),
                format!("{name} reads or waits before it stops"),
                "the one write that stops, whatever the drive does",
            );
        } else if steps.len() > 1 {
            self.refuse(
                &action.span(),
                format!("{name} is more than one write: what unlocks first stops late, or never"),
                "the one write that stops; \"unknown\" where the drive has none",
            );
        }
        self.runs_nothing(name, action);
        self.leaves_nothing_running(name, action);
        self.stands_in_no_start(name, action);
        self.is_no_quick_stop(name, action.get_ref());
        if action.get_ref().seen.as_ref().is_none_or(|seen| seen.get_ref().is_empty()) {
            self.refuse(
                &action.span(),
                format!("what shows that {name} is done is left in silence"),
                "seen = [\"ready\", ...], the states in which no run command acts",
            );
        }
        let seen = action.get_ref().seen.iter().flat_map(crate::format::Spanned::get_ref);
        if seen.clone().next().is_some() && seen.clone().all(|state| is_fault(*state)) {
            self.refuse(
                &action.span(),
                format!("{name} is said to be done only once the drive has tripped"),
                "the states in which the motor stands after it: seen = [\"ready\", \"fault\"]",
            );
        }
        if seen.clone().any(|state| *state == crate::format::StateName::Running) {
            self.refuse(
                &action.span(),
                format!("{name} is said to be done while the motor runs"),
                "other states",
            );
        }
    }

    /// No word of it runs the motor, or is one of a start's that does.
    fn runs_nothing(&mut self, name: &str, action: &Spanned<Action>) {
        let file = self.file;
        for written in file.writes(action.get_ref()) {
            if file.runs(written) {
                self.refuse(
                    &action.span(),
                    format!("{name} writes {:04X}h, which holds a run bit", written.value),
                    format!("a word by which {name} starts nothing"),
                );
            }
        }
        let steps = action.get_ref().steps.iter().map(|step| file.written(step.get_ref(), None));
        let steps: Vec<_> = steps.filter(|writes| !writes.iter().any(|of| file.runs(*of))).collect();
        // One of several coils stands in a start as in a stop: what ends a start is all that its last step writes.
        let ends_in = |writes: &Vec<Written>| {
            let is_start = |run: &Vec<Written>| !run.is_empty() && run.iter().all(|of| writes.contains(of));
            started(file).find(is_start)
        };
        if let Some(start) = steps.iter().find_map(ends_in) {
            let words: Vec<_> = start.iter().map(|of| format!("{:04X}h", of.value)).collect();
            self.refuse(
                &action.span(),
                format!("{name} writes {}, by which a start ends", words.join(", ")),
                "words that tell a start from a stop",
            );
        }
    }

    /// It ends with a word that runs, and has none before it.
    fn start(&mut self, name: &str, action: &Spanned<Action>) {
        let file = self.file;
        let steps = &action.get_ref().steps;
        let runs = |step: &Step| file.written(step, None).into_iter().any(|written| file.runs(written));
        let (last, before) = match steps.split_last() {
            Some((last, before)) => (runs(last.get_ref()), before.iter().any(|step| runs(step.get_ref()))),
            None => return,
        };
        if !last {
            self.refuse(
                &action.span(),
                format!("{name} does not end with a word that runs the motor, as [command] says it"),
                "the run command last, and every form of it in [command] runs",
            );
        }
        if before {
            self.refuse(
                &action.span(),
                format!("{name} runs the motor before its last step"),
                "what has to be written first, then the run command",
            );
        }
    }

    /// Two starts that leave the same words behind turn the motor the same way.
    fn starts_differ(&mut self) {
        let file = self.file;
        let left = |start: &Spanned<Action>| {
            let writes = file.writes(start.get_ref()).into_iter();
            writes.map(|of| ((of.space, of.address), of.value)).collect::<BTreeMap<_, _>>()
        };
        let (Some(forward), Some(reverse)) = (file.start.forward.given(), file.start.reverse.given()) else {
            return;
        };
        if left(forward) == left(reverse) {
            self.refuse(
                &reverse.span(),
                "start.reverse writes what start.forward writes: it would turn the same way",
                "the words that turn it the other way, or reverse = \"none\"",
            );
        }
    }

    /// A setpoint goes out in the last step of each start, or in none: what was given is written to the setpoint's register, never 0.
    fn by_setpoint(&mut self) {
        let file = self.file;
        let by_setpoint = file.starts_by_setpoint();
        let register = file.setpoint.given().map(|setpoint| setpoint.get_ref().register.get_ref());
        for (name, action) in file.actions() {
            let steps = &action.get_ref().steps;
            for (at, spanned) in steps.iter().enumerate() {
                let step = spanned.get_ref();
                let Some(sign) = &step.setpoint else { continue };
                let is_last = name.starts_with("start.") && at + 1 == steps.len();
                if !is_last || step.write.as_ref().map(Spanned::get_ref) != register {
                    self.refuse(
                        &sign.span(),
                        format!("{name} writes a setpoint where none belongs"),
                        "the register of [setpoint], in the last step of a start",
                    );
                }
                let fact = file.setpoint.given().map(Spanned::get_ref);
                if *sign.get_ref() == Sign::Negative && fact.is_none_or(|fact| !fact.sign_is_direction) {
                    self.refuse(
                        &sign.span(),
                        "a negative setpoint of a drive whose sign is no direction",
                        "sign_is_direction = true, or setpoint = \"positive\"",
                    );
                }
            }
            if by_setpoint && name.starts_with("start.") && !action.get_ref().starts_by_setpoint() {
                self.refuse(
                    &action.span(),
                    format!("{name} writes no setpoint, and the other start does"),
                    "setpoint = \"positive\" or \"negative\" in the last step of both",
                );
            }
        }
        let Some(setpoint) = file.setpoint.given().map(Spanned::get_ref) else { return };
        let Some((space, address)) = file.named(setpoint.register.get_ref()).and_then(|of| file.place(of))
        else {
            return;
        };
        let limits = &setpoint.limits;
        if by_setpoint && limits.get_ref().low < 1 {
            self.refuse(
                &limits.span(),
                "a setpoint that is the run command, and 0 among its limits: 0 is the stop",
                "low = the least that turns it, at least 1",
            );
        }
        let counts = [limits.get_ref().low, limits.get_ref().high];
        let signs = if setpoint.sign_is_direction {
            &[Sign::Positive, Sign::Negative][..]
        } else {
            &[Sign::Positive][..]
        };
        let words = signs.iter().flat_map(|sign| counts.map(|counts| sign.word(counts)));
        let runs: Vec<bool> = words.map(|value| file.runs(Written { space, address, value })).collect();
        if by_setpoint && runs.contains(&false) {
            self.refuse(
                &limits.span(),
                "a setpoint that is the run command, of which [command] says that it runs nothing",
                "runs = [{ register = the setpoint's, mask = 0xFFFF, value = 0, differs = true, ... }]",
            );
        } else if !by_setpoint && runs.contains(&true) {
            self.refuse(
                &setpoint.register.span(),
                format!("{} runs the motor by itself: whoever gives a setpoint would start it", setpoint.register.get_ref()),
                "starts whose last step is { write = the setpoint's register, setpoint = \"positive\" }, or another register",
            );
        }
    }

    /// What makes guards true is a setting. A command among them stops or starts a motor that somebody else drives.
    fn setup(&mut self) {
        let Some(setup) = self.file.setup.given() else { return };
        let file = self.file;
        // By its place, and not by its name: a block has no name for what lies behind its first register.
        let is_command = |step: &Step| {
            let places = file.written(step, None).into_iter().map(|written| (written.space, written.address));
            places.into_iter().any(|place| file.commanded().any(|command| command == place))
        };
        let steps = setup.get_ref().steps.iter().map(Spanned::get_ref);
        let commands = steps.into_iter().find(|step| is_command(step));
        if let Some(name) = commands.and_then(|step| step.write.as_ref()) {
            self.refuse(
                &name.span(),
                format!("setup writes {}, which commands the motor", name.get_ref()),
                "settings alone: a command belongs to stop, start or reset",
            );
        }
    }

    /// An edge is cleared: by the drive, or by a word that stops.
    fn reset(&mut self, reset: &Spanned<Action>) {
        let file = self.file;
        let action = reset.get_ref();
        let last = action.steps.iter().rev().map(|step| file.written(step.get_ref(), None));
        let last = last.into_iter().find(|writes| !writes.is_empty()).unwrap_or_default();
        let stops = |written: Written| {
            let stops = file.actions().filter(|(name, _)| name.starts_with("stop."));
            stops.flat_map(|(_, stop)| file.writes(stop.get_ref())).any(|stop| stop == written)
        };
        let ramp = file.stop.ramp.given().and_then(|ramp| file.writes(ramp.get_ref()).first().copied());
        let mut all = file.actions().filter(|(name, _)| name.starts_with("stop."));
        let wrong = all.any(|(_, stop)| file.writes(stop.get_ref()).into_iter().any(|of| file.runs(of)));
        match action.clears_itself {
            None => self.refuse(
                &reset.span(),
                "whether the reset clears itself is left in silence",
                "clears_itself = true or false",
            ),
            // A stop that runs the motor is told of the stop.
            Some(false) if (last.is_empty() || !last.iter().all(|of| stops(*of))) && !wrong => self.refuse(
                &reset.span(),
                match last.into_iter().find(|of| !stops(*of)) {
                    Some(last) => format!(
                        "the reset is left standing: it ends with {:04X}h, which is no word of a stop, and some drives reset again and \
                         again, or restart",
                        last.value
                    ),
                    None => "the reset is left standing: some drives reset again and again, or restart".to_owned(),
                },
                match ramp {
                    Some(ramp) => format!("a last step with the word of a stop, such as {:04X}h of stop.ramp", ramp.value),
                    None => "a last step with the word of a stop".to_owned(),
                },
            ),
            Some(_) => {}
        }
        // A reset begins and ends with a stop where the drive wants it so; what it does is the word that is none.
        let writes = file.writes(action);
        if !writes.is_empty() && writes.iter().all(|written| stops(*written)) {
            self.refuse(
                &reset.span(),
                "the reset writes nothing but what a stop writes: that word stops, or it resets",
                "the word that stops under [stop]; reset = \"none\" where that resets as well",
            );
        }
    }
}

/// What the last step of each start writes.
fn started(file: &File) -> impl Iterator<Item = Vec<Written>> {
    let starts = file.actions().filter(|(name, _)| name.starts_with("start."));
    starts.filter_map(|(_, start)| Some(file.written(start.get_ref().steps.last()?.get_ref(), None)))
}
