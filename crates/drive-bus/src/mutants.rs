//! Mutants that are chosen at run time: at a decisive line stands, beside what is right, what would be wrong. One build has them
//! all, one name chooses among them, and an attack that lets its mutant live is no attack.
//!
//! Without the feature `mutants`, which no build has that anybody is given, [`mutant!`](crate::mutant) is its first expression and
//! nothing else.

// Packages are built without debug assertions: none can have the feature, whoever asks for all of them at once.
#[cfg(all(feature = "mutants", not(debug_assertions)))]
compile_error!("the feature `mutants` of drive-bus is for attacks on a build of development alone");

/// `mutant!("its-name", right, wrong)`: what is right, unless this mutant is chosen.
#[cfg(not(feature = "mutants"))]
#[doc(hidden)]
#[macro_export]
macro_rules! mutant {
    ($name:literal, $right:expr, $wrong:expr) => {
        $right
    };
}

/// `mutant!("its-name", right, wrong)`: what is right, unless this mutant is chosen.
#[cfg(feature = "mutants")]
#[doc(hidden)]
#[macro_export]
macro_rules! mutant {
    ($name:literal, $right:expr, $wrong:expr) => {
        if $crate::mutants::is($name) { $wrong } else { $right }
    };
}

#[cfg(feature = "mutants")]
pub use chosen::{Chosen, choose, is, was_reached, went_on_for_ever};

/// A mutant: its name, and the promise that it breaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mutant {
    /// Its name, which stands at its line.
    pub name: &'static str,
    /// What no longer holds, in the words of the README.
    pub breaks: &'static str,
}

const fn mutant(name: &'static str, breaks: &'static str) -> Mutant {
    Mutant { name, breaks }
}

/// All of this crate.
pub const ALL: &[Mutant] = &[
    mutant("another-slaves-answer", "an answer is that of the slave that was asked"),
    mutant("crc-unchecked", "a damaged frame is no answer"),
    mutant("lrc-unchecked", "a damaged frame is no answer"),
    mutant("transaction-unchecked", "an answer has the number of its request"),
    mutant("confirmed-value-unchecked", "a confirmation names what was written"),
    mutant("confirmed-address-unchecked", "a confirmation names where it was written"),
    mutant("early-answer-believed", "no answer ends before its request can have left the wire"),
    mutant("damaged-echo-is-the-answer", "nobody is asked again while his answer is still to come"),
    mutant("two-answers-believed", "of two answers that differ none is believed"),
    mutant("late-answer-unfeared", "a late answer is not that to the next request"),
    mutant("doubtful-answer-believed", "an answer that may be that to an earlier request proves nothing"),
    mutant("row-out-of-step-believed", "an answer that comes twice is not that to the next read"),
    mutant("silence-unkept", "3.5 characters of silence stand before each request"),
    mutant("pause-unkept", "each slave has its pause"),
    mutant("edge-repeated", "an edge is written once"),
    mutant("command-repeated-behind-stop", "a command is not sent again behind a stop"),
    mutant("old-setpoint-repeated", "the latest setpoint counts"),
    mutant("command-sent-late", "a command expires and is never sent late"),
    mutant("sent-told-as-unsent", "what was told as not sent was never on the wire"),
    mutant("lost-write-told-as-expired", "a write whose answer was lost has an unknown outcome"),
    mutant(
        "refused-repetition-believed",
        "a write that was refused when it was repeated has an unknown outcome",
    ),
    mutant("stop-waits-its-turn", "a stop goes before everything"),
    mutant("stop-spares-commands", "a stop takes waiting commands with it"),
    mutant("order-goes-on-behind-stop", "an order ends with a stop that comes on its way"),
    mutant("stop-dropped-with-its-caller", "a stop is sent whether its caller waits or not"),
    mutant("stop-dropped-with-its-line", "a stop is sent whether its caller waits or not"),
    mutant("stop-dropped-offline", "a stop is sent to a slave that is off-line"),
    mutant("stop-waits-for-the-gateway", "a stop is sent whatever the far end owes"),
    mutant("stop-rests-for-others", "a stop waits for its own share of the line"),
    mutant("far-end-owes-nothing", "no more is owed than the bound of a stop allows"),
    mutant("far-end-owes-for-ever", "what is owed is over at its time"),
    mutant("far-end-serves-side-by-side", "a gateway is not asked while it is at a question in vain"),
    mutant("far-end-gives-up-early", "a gateway is not asked while it is at a question in vain"),
    mutant("far-end-asked-one-more", "a gateway is not asked while it is at a question in vain"),
    mutant("far-end-done-is-busy", "one that does one thing at a time is not taken for one that does more"),
    mutant("far-end-any-late-answer", "a late answer ends the question that it answers"),
    mutant("far-end-forgets-at-a-loss", "a lost connection ends no question"),
    mutant("far-end-free-after-a-loss", "a lost connection ends no question"),
    mutant("far-end-waits-since-it-was-asked", "a gateway is taken to wait as long as it does"),
    mutant("far-end-waits-for-one", "a gateway is taken to wait as long as it does"),
    mutant("age-of-the-telling", "a value is as old as its question"),
    mutant("first-answer-believed", "what the last port left behind is nobody's answer"),
];

#[cfg(feature = "mutants")]
mod chosen {
    use std::{
        cell::{Cell, RefCell},
        collections::BTreeSet,
        env,
        sync::OnceLock,
    };

    thread_local! {
        /// Of this thread alone, so that one test attacks without its neighbour.
        static CHOSEN: Cell<Option<&'static str>> = Cell::new(by_environment());
        /// How often the line of the chosen one was reached since it was chosen.
        static TIMES: Cell<u64> = const { Cell::new(0) };
        static REACHED: RefCell<BTreeSet<&'static str>> = const { RefCell::new(BTreeSet::new()) };
    }

    /// Whoever reaches its line so often goes round without end, also where his time stands still: a cell of `drive-fire` reaches
    /// one some ten thousand times.
    const WITHOUT_END: u64 = 2_000_000;

    /// What `DRIVED_MUTANT` names, of this crate or of one above it.
    fn by_environment() -> Option<&'static str> {
        static NAMED: OnceLock<Option<String>> = OnceLock::new();
        NAMED.get_or_init(|| env::var("DRIVED_MUTANT").ok()).as_deref()
    }

    /// Whether this mutant is chosen, asked at its line.
    ///
    /// # Panics
    /// When it was asked for ever.
    #[must_use]
    pub fn is(name: &'static str) -> bool {
        let chosen = CHOSEN.get() == Some(name);
        if chosen {
            REACHED.with_borrow_mut(|reached| reached.insert(name));
            TIMES.set(TIMES.get() + 1);
            if TIMES.get() >= WITHOUT_END {
                // Once: whoever goes on behind a panic, as a fleet does, would go on without end.
                CHOSEN.set(None);
                panic!("the line of {name} is reached without end");
            }
        }
        chosen
    }

    /// Whether its line was reached on this thread while it was chosen: one whose line is never reached has survived nothing.
    #[must_use]
    pub fn was_reached(name: &str) -> bool {
        REACHED.with_borrow(|reached| reached.contains(name))
    }

    /// Whether the line of the one that was chosen last was reached without end.
    #[must_use]
    pub fn went_on_for_ever() -> bool {
        TIMES.get() >= WITHOUT_END
    }

    /// A mutant is chosen on this thread for as long as this lives.
    #[derive(Debug)]
    pub struct Chosen(Option<&'static str>);

    /// Chooses a mutant on this thread.
    #[must_use]
    pub fn choose(name: &'static str) -> Chosen {
        REACHED.with_borrow_mut(|reached| reached.remove(name));
        TIMES.set(0);
        Chosen(CHOSEN.replace(Some(name)))
    }

    impl Drop for Chosen {
        fn drop(&mut self) {
            CHOSEN.set(self.0);
        }
    }
}
