//! The ladder: with what a drive can be trusted by its profile, and what keeps it from more.

mod doubts;
mod tried;

use std::fmt;

use crate::format::Spanned;

use crate::{
    format::{Action, Answer, FedBy, File, Guard, Proves, Space, StateIs, StateName, Storage},
    source::{asked, grade, line},
};

/// Registers of commands that several makers have, each with words of its own: what stops one maker's drive runs another's.
const SHARED: &[u16] = &[0x1000, 0x2000];

/// Of so many bits each combination is looked at.
const FEW_BITS: u32 = 8;

/// With what a drive can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Level {
    /// It is read, and nothing else.
    Watch,
    /// It is read, and stopped.
    Stop,
    /// It is driven.
    Motion,
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Watch => "watch",
            Self::Stop => "stop",
            Self::Motion => "motion",
        })
    }
}

/// Something that is not known, and the question that comes next.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Gap {
    /// The level from which it keeps the drive; `None`: it is said to whom it matters, and keeps from nothing.
    pub keeps_from: Option<Level>,
    /// The line, from 1.
    pub line: usize,
    /// Whether it matters each time the drive is commanded: who else commands it, and what it does without this side.
    pub matters: bool,
    /// What is not known.
    pub what: String,
    /// What would tell.
    pub question: String,
}

impl fmt::Display for Gap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(level) = self.keeps_from {
            write!(f, "below {level}, line {}: ", self.line)?;
        }
        write!(f, "{}: {}", self.what, self.question)
    }
}

/// The level of a file that was checked, and its gaps: first what keeps it from the next level.
pub(crate) fn climb(text: &str, file: &File, substance: &str) -> (Level, Vec<Gap>) {
    let mut ladder = Ladder { text, file, substance, gaps: Vec::new() };
    ladder.stop();
    ladder.motion();
    ladder.said();
    let mut gaps = ladder.gaps;
    gaps.sort_by_key(|gap| (gap.keeps_from.unwrap_or(Level::Watch) != Level::Stop, gap.keeps_from.is_none()));
    let below = gaps.iter().filter_map(|gap| gap.keeps_from).min();
    let level = match below {
        Some(Level::Stop | Level::Watch) => Level::Watch,
        Some(Level::Motion) => Level::Stop,
        None => Level::Motion,
    };
    (level, gaps)
}

/// The word of a state, as a file has it.
pub(crate) const fn word(state: StateName) -> &'static str {
    match state {
        StateName::NotReady => "not_ready",
        StateName::Disabled => "disabled",
        StateName::Ready => "ready",
        StateName::Running => "running",
        StateName::Stopping => "stopping",
        StateName::QuickStop => "quick_stop",
        StateName::FaultReaction => "fault_reaction",
        StateName::Fault => "fault",
    }
}

struct Ladder<'a> {
    text: &'a str,
    file: &'a File,
    substance: &'a str,
    gaps: Vec<Gap>,
}

impl<'a> Ladder<'a> {
    fn stop(&mut self) {
        let file = self.file;
        let link = file.link.get_ref();
        self.sound(Level::Stop, "the line and its functions", &link.source);
        self.numbering();
        self.hex();
        let stops: Vec<_> = file.actions().filter(|(name, _)| name.starts_with("stop.")).collect();
        if stops.is_empty() {
            self.ask(
                Level::Stop,
                "ramp",
                "no stop of one write is known",
                "which one word stops it, whatever it does?",
            );
        }
        for (name, stop) in stops {
            self.action(Level::Stop, name, stop);
        }
    }

    fn motion(&mut self) {
        let file = self.file;
        self.rungs();
        for (state, name) in [(StateName::Running, "that it runs"), (StateName::Fault, "that it has tripped")]
        {
            let mut shows = file.state.is.iter().filter(|is| is.get_ref().state == state).peekable();
            if shows.peek().is_none() {
                let question = "which bits, or which number, of which register?";
                self.ask(Level::Motion, "is", &format!("nothing shows {name}"), question);
            }
        }
        for is in &file.state.is {
            let bits = is.get_ref().bits.get_ref();
            self.sound(Level::Motion, &format!("state \"{}\"", word(is.get_ref().state)), &bits.source);
            self.register(Level::Motion, bits.register.get_ref());
        }
        let starts =
            |is: &Spanned<StateIs>| matches!(is.get_ref().state, StateName::Ready | StateName::Disabled);
        if !file.state.is.iter().any(starts) {
            self.ask(
                Level::Motion,
                "is",
                "nothing shows that it can be started: every start would be refused",
                "which bits, or which number, show that it is ready?",
            );
        }
        self.seen();
        self.ownership();
        self.commands();
        self.who();
    }

    /// Words of its status that fit no state: all bits clear, as without supply, and what else a few bits can be.
    fn uncovered(&mut self) {
        let states = || self.file.state.is.iter().map(|is| is.get_ref().bits.get_ref());
        let Some(first) = states().next() else { return };
        let is_one = states().all(|bits| bits.register.get_ref() == first.register.get_ref());
        let counted = states().fold(0, |all, bits| all | bits.mask.get_ref());
        let all = if is_one && counted.count_ones() <= FEW_BITS { counted } else { 0 };
        // From one part of the bits to the next, and through 0 to the end.
        let parts = std::iter::successors(Some(0_u16), |part| {
            Some((part | !all).wrapping_add(1) & all).filter(|next| *next != 0)
        });
        let is_ready = |is: &&Spanned<StateIs>| is.get_ref().bits.get_ref().fit(0);
        let zero = self.file.state.is.iter().find(is_ready).map(|is| is.get_ref().state);
        let who = &self.file.who;
        let guards = [&who.fingerprints, &who.guards].into_iter().filter_map(Answer::given).flatten();
        let is_alive = |guard: &Spanned<Guard>| {
            let (is, is_not) = (&guard.get_ref().is, &guard.get_ref().is_not);
            is.as_ref().is_some_and(|is| !is.contains(&0))
                || is_not.as_ref().is_some_and(|not| not.contains(&0))
        };
        if zero == Some(StateName::Ready) && !guards.into_iter().any(is_alive) {
            self.say(
                "a status of 0000h is told as ready, and nothing tells it from one of a drive that has no supply or that answers 0 to whatever is asked",
                "which register is never 0 while it is alive? As a guard, it is read before each start",
            );
        }
        let none_fits = |word: &u16| !states().any(|bits| bits.fit(*word));
        if let Some(word) = parts.into_iter().find(none_fits) {
            self.say(
                &format!("a status of {word:04X}h fits no state: it is told as not known, and not started from there"),
                "what does the drive show without supply, and which state is that?",
            );
        }
    }

    /// A way to see the setpoint or the output.
    fn seen(&mut self) {
        let see = &self.file.see;
        let ways: Vec<_> = [&see.output, &see.setpoint].into_iter().filter_map(Answer::given).collect();
        if ways.is_empty() {
            self.ask(
                Level::Motion,
                "output",
                "neither its setpoint nor its output can be seen",
                "which register holds the output frequency?",
            );
        }
        for name in ways {
            self.register(Level::Motion, name.get_ref());
            if let Some(register) = self.file.named(name.get_ref()) {
                self.coarse(name.get_ref(), register);
            }
        }
        match (&see.direction, &self.file.start.reverse) {
            (Answer::Given(direction), _) => {
                self.sound(Level::Motion, "which way it turns", &direction.get_ref().source);
                self.register(Level::Motion, direction.get_ref().register.get_ref());
            }
            (Answer::None, Answer::None) => {}
            (Answer::None | Answer::Unknown, _) => self.warn(
                "which way it turns cannot be seen, as far as is known",
                "which bit tells it, or is the output signed?",
            ),
        }
    }

    fn ownership(&mut self) {
        let owner = &self.file.ownership;
        for (answer, what) in
            [(&owner.command, "who commands it"), (&owner.reference, "who gives its reference")]
        {
            match answer {
                Answer::Given(owner) => {
                    self.sound(Level::Motion, what, &owner.get_ref().bits.source);
                    self.register(Level::Motion, owner.get_ref().bits.register.get_ref());
                    if owner.get_ref().proves == Proves::Nothing {
                        self.warn(
                            &format!("the drive tells {what} only where it is not the bus"),
                            "see that nothing else commands it",
                        );
                    }
                }
                Answer::None => {
                    self.warn(
                        &format!("the drive does not tell {what}"),
                        "see that nothing else commands it",
                    );
                }
                Answer::Unknown => {
                    self.warn(
                        &format!("whether the drive tells {what} is not known"),
                        "which bit or register tells it?",
                    );
                }
            }
        }
        if let Some(read) = owner.reads_back.given() {
            self.sound(Level::Motion, "that its command reads back", &read.get_ref().source);
        } else {
            self.say(
                "its command does not read back, as far as is known",
                "which register holds the command in force?",
            );
        }
    }

    fn commands(&mut self) {
        let file = self.file;
        match file.command.given() {
            Some(command) => {
                self.sound(Level::Motion, "its command word", &command.get_ref().source);
                for run in &command.get_ref().runs {
                    self.sound(Level::Motion, "a form of its run command", &run.get_ref().source);
                }
                if command.get_ref().runs.is_empty() {
                    self.keep(
                        Level::Motion,
                        command.span().start,
                        "no word is said to run it",
                        "which words do?",
                    );
                }
            }
            None => self.ask(
                Level::Motion,
                "command",
                "which words run it is not known",
                "which bits of which register run it?",
            ),
        }
        match file.start.forward.given() {
            Some(start) => self.action(Level::Motion, "start.forward", start),
            None => self.ask(
                Level::Motion,
                "forward",
                "how it is started is not known",
                "what is written, in which order?",
            ),
        }
        match file.start.reverse.given() {
            Some(start) => self.action(Level::Motion, "start.reverse", start),
            None => self
                .say("how it is started in reverse is not known, or it does not turn so", "what is written?"),
        }
        match &file.start.ladder {
            Answer::Given(rungs) => {
                for rung in rungs {
                    self.sound(Level::Motion, "a rung of its ladder", &rung.get_ref().bits.source);
                }
            }
            Answer::None => {}
            Answer::Unknown => self.ask(
                Level::Motion,
                "ladder",
                "whether something has to be written before the run command is not known",
                "from which states does a run command act?",
            ),
        }
        if file.stop.ramp.given().is_none() {
            self.ask(
                Level::Motion,
                "ramp",
                "no stop along the ramp is known",
                "which one word stops it along its ramp?",
            );
        }
        match file.setpoint.given() {
            Some(setpoint) => {
                self.sound(Level::Motion, "its setpoint", &setpoint.get_ref().source);
                self.register(Level::Motion, setpoint.get_ref().register.get_ref());
                let fact = setpoint.get_ref();
                for name in [&fact.limits.get_ref().high_in, &fact.full_scale].into_iter().flatten() {
                    self.register(Level::Motion, name.get_ref());
                }
                self.highest(setpoint);
            }
            None => {
                self.ask(
                    Level::Motion,
                    "setpoint",
                    "its setpoint is not known",
                    "which register, in which unit?",
                );
            }
        }
        match &file.reset {
            Answer::Given(reset) => self.action(Level::Motion, "reset", reset),
            Answer::None | Answer::Unknown => {
                self.say("no reset over the bus is known", "reset it at the drive; which word resets it?");
            }
        }
    }

    fn who(&mut self) {
        let file = self.file;
        match &file.who.guards {
            Answer::Given(guards) => {
                for guard in guards {
                    self.sound(Level::Motion, "a guard", &guard.get_ref().source);
                    self.register(Level::Motion, guard.get_ref().register.get_ref());
                }
            }
            Answer::None => {}
            Answer::Unknown => self.ask(
                Level::Motion,
                "guards",
                "whether a setting of the drive changes what its words mean is not known",
                "which parameters choose its protocol, profile or map, and what do they have to hold?",
            ),
        }
        let told = file.who.fingerprints.given().is_some_and(|all| {
            // What may not be one number tells nothing: most registers of most drives are another.
            let tells = |of: &Spanned<Guard>| of.get_ref().is.is_some();
            all.iter().any(tells) && all.iter().all(|of| grade(file, &of.get_ref().source).is_sound())
        });
        let setpoint = file.setpoint.given().and_then(|of| file.named(of.get_ref().register.get_ref()));
        let commanded = file.actions().flat_map(|(_, action)| file.writes(action.get_ref()));
        let shared = commanded
            .map(|written| (written.space, written.address))
            .chain(setpoint.and_then(|register| file.place(register)))
            .any(|(space, address)| space == Space::HoldingRegister && SHARED.contains(&address));
        if shared && !told && !self.is_tried(Level::Motion) {
            self.ask(Level::Motion, "fingerprints",
                "its command stands where other makers have other words, and nothing tells this drive from theirs",
                "which register only this drive reads so? Or a person tries it on the drive, by name, under [[tried]]",
            );
        }
    }

    /// What keeps from nothing and is told all the same.
    fn said(&mut self) {
        let file = self.file;
        self.uncovered();
        self.trials();
        match &file.watchdog {
            Answer::Given(watchdog) => {
                let watchdog = watchdog.get_ref();
                if watchdog.from_factory.is_unknown() {
                    self.say(
                        "whether its communication watchdog is on from the factory is not known",
                        "see its setting",
                    );
                } else if watchdog.from_factory == Answer::Given(false) {
                    match (watchdog.time.given(), &watchdog.fed_by) {
                        (Some(_), Answer::Given(FedBy::AnyRequest)) => self.warn(
                            "its communication watchdog is off from the factory; whoever polls it reads how it is set, and feeds it",
                            "set it at the drive",
                        ),
                        _ => {
                            self.warn("its communication watchdog is off from the factory", "set it at the drive");
                        }
                    }
                }
                if watchdog.fed_by.is_unknown() {
                    self.say(
                        "what feeds its communication watchdog is not known",
                        "any request, or only a write?",
                    );
                }
                if watchdog.fed_by == Answer::Given(FedBy::CommandWrite) {
                    self.warn(
                        "a command word alone feeds its communication watchdog, and none is repeated: where it is set, it acts behind each",
                        "leave it off, and wire an emergency stop",
                    );
                }
                if watchdog.actions.is_unknown() {
                    self.say("what its communication watchdog does is not known", "which value does what?");
                }
            }
            Answer::None => self.warn(
                "it has no communication watchdog: it runs on when the line is lost",
                "wire an emergency stop",
            ),
            Answer::Unknown => self.warn(
                "whether it stops by itself when the line is lost is not known",
                "does it have a communication watchdog, and how is it set?",
            ),
        }
        let setpoint =
            file.setpoint.given().and_then(|setpoint| file.named(setpoint.get_ref().register.get_ref()));
        if let Some(Storage::Unknown) =
            setpoint.and_then(|register| register.storage.as_ref()).map(|of| *of.get_ref())
        {
            self.warn("whether each setpoint wears an EEPROM is not known", "where does its register live?");
        }
        if file.faults.present.given().is_none() {
            self.say("the code of its present fault is not known", "which register holds it?");
        } else if file.faults.codes.given().is_none() {
            self.say("what its fault codes mean is not known", "the list of its manual");
        }
        if let Some(command) = file.command.given()
            && command.get_ref().acts != crate::format::Acts::Edge
        {
            self.warn(
                "a run command that stands may start the motor when its power comes back",
                "give it a watchdog that ends it, or switch its supply off only when it was stopped",
            );
        }
    }

    /// An action, and the registers that it writes.
    fn action(&mut self, level: Level, name: &str, action: &'a Spanned<Action>) {
        self.sound(level, name, &action.get_ref().source);
        for to in action.get_ref().steps.iter().filter_map(|step| step.get_ref().write.as_ref()) {
            self.register(level, to.get_ref());
        }
    }

    fn register(&mut self, level: Level, name: &str) {
        let Some(register) = self.file.named(name) else { return };
        self.sound(level, &format!("register {name}"), &register.source);
        // What says how many decimals it has scales it as well. No register stands behind that one again.
        let decimals =
            register.decimals_in.as_ref().and_then(|of| Some((of.get_ref(), self.file.named(of.get_ref())?)));
        if let Some((name, decimals)) = decimals {
            self.sound(level, &format!("register {name}"), &decimals.source);
        }
    }

    /// A fact on which a level rests.
    fn sound(&mut self, level: Level, what: &str, source: &Spanned<String>) {
        let mark = grade(self.file, source);
        let settled = mark == crate::format::Mark::X && self.is_tried(level);
        if !mark.is_sound() && !settled {
            self.keep(
                level,
                source.span().start,
                &format!("{what} rests on what is not sure ({})", mark.meaning()),
                "what does the maker's manual say, on which page? Its source under [sources] has mark = \"P\" then",
            );
        }
    }

    /// What keeps from a level until a question of the file is answered.
    fn ask(&mut self, level: Level, key: &str, what: &str, question: &str) {
        self.keep(level, asked(self.text, key).unwrap_or(0), what, question);
    }

    fn keep(&mut self, level: Level, at: usize, what: &str, question: &str) {
        self.gap(Some(level), false, at, what, question);
    }

    fn say(&mut self, what: &str, question: &str) {
        self.gap(None, false, 0, what, question);
    }

    /// What matters each time the drive is commanded.
    fn warn(&mut self, what: &str, question: &str) {
        self.gap(None, true, 0, what, question);
    }

    fn gap(&mut self, keeps_from: Option<Level>, matters: bool, at: usize, what: &str, question: &str) {
        let line = line(self.text, &(at..at));
        let gap = Gap { keeps_from, line, matters, what: what.to_owned(), question: question.to_owned() };
        if !self.gaps.contains(&gap) {
            self.gaps.push(gap);
        }
    }
}
