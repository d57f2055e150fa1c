//! Every part in turn, round after round with other numbers, until its time is over: what attacks for as long as anybody lets it.

use std::{
    cell::Cell,
    env,
    ffi::OsStr,
    fmt, io,
    path::Path,
    time::{Duration, Instant},
};

use drive_testing::peers;

use crate::{
    differential::{self, Peer},
    fuzz,
    matrix::{self, story},
    model::{self, Model, gateway, identities, lease, master},
    mutation, program,
    report::Told,
    soak,
};

/// What a part has tried and found in all rounds, and against its planted defects.
#[derive(Debug, Clone)]
pub struct Row {
    name: &'static str,
    tried: Vec<Told>,
    hunted: Vec<Told>,
    /// Why it could not run, where it could not.
    lacks: Option<String>,
}

/// What came of a part's turn: what it tried, and what it hunted of what is planted.
type Came = io::Result<(Vec<Told>, Vec<Told>)>;

/// A part in a round: its numbers begin here, and it goes on until then.
struct Turn<'a> {
    is_first: bool,
    seed: u64,
    end: Instant,
    /// When the last round ends, whoever has had his share by then.
    end_of_all: Option<Instant>,
    /// How many this part has tried in the rounds before.
    before: u64,
    /// With which of its targets the program is attacked first.
    program: &'a Cell<program::Target>,
}

impl Turn<'_> {
    fn go_on(&self) -> impl FnMut() -> bool + use<> {
        let end = self.end;
        move || Instant::now() < end
    }

    /// What is planted is hunted in the first round alone: it would be found by the same in each.
    fn hunt<const N: usize>(&self, plants: impl FnOnce() -> [Told; N]) -> Vec<Told> {
        if self.is_first { plants().into() } else { Vec::new() }
    }
}

/// A part: its name, its share of a round in seconds, and what it does there.
type Part = (&'static str, u64, fn(&Turn<'_>) -> Came);

/// All of them.
const PARTS: [Part; 9] = [
    ("matrix", 40, |turn| {
        Ok((vec![matrix::run(turn.seed, u64::MAX, None, turn.go_on())], turn.hunt(|| [matrix::find_again()])))
    }),
    ("worlds", 30, |turn| {
        let tried = vec![story::run(turn.seed, u64::MAX, turn.go_on())];
        Ok((tried, turn.hunt(|| [matrix::find_again_by_stories()])))
    }),
    // Nothing is drawn in them: a second round would explore the same.
    ("model", 400, |turn| {
        let tried = turn.hunt(|| DEPTHS.map(|(model, depth, _)| model::run(model, depth, turn.go_on())));
        Ok((tried, turn.hunt(|| DEPTHS.map(|(model, _, depth)| model::find_plants(model, depth)))))
    }),
    ("fuzz", 30, |turn| {
        let of_each = Duration::from_secs(30) / fuzz::Target::ALL.len() as u32;
        let tried = vec![fuzz::run(&fuzz::Target::ALL, turn.seed, of_each, turn.go_on())];
        Ok((tried, if turn.is_first { fuzz::hunts(turn.seed, fuzz::ORDERS, None) } else { Vec::new() }))
    }),
    // From when it has begun, which takes as long where there is much else to do.
    ("program", 25, |turn| {
        let program = env::current_exe()?.with_file_name("drived");
        let (of_each, share) = (Duration::from_secs(3), Duration::from_secs(25));
        let round = program::Round { of_each, share, first: turn.program };
        let end = turn.end_of_all;
        let go_on = || end.is_none_or(|end| Instant::now() < end);
        let tried = program::run(&program, turn.seed, &round, None, go_on)
            .map_err(|error| io::Error::other(format!("{}: {error}", program.display())))?;
        Ok((vec![tried], turn.hunt(|| [program::find_plants(), program::find_plants_on_ptys()])))
    }),
    ("differential, pymodbus", 10, |turn| {
        let python = env::var_os("DRIVED_PYTHON").unwrap_or_else(|| "python3".into());
        has(&python, "import pymodbus", "a Python with pymodbus, see DRIVED_PYTHON")?;
        Ok((vec![differential::run(python.as_ref(), Peer::Pymodbus, turn.seed, 10_000)?], Vec::new()))
    }),
    ("differential, libmodbus", 10, |turn| {
        has("python3".as_ref(), "import ctypes; ctypes.CDLL('libmodbus.so.5')", "libmodbus")?;
        Ok((vec![differential::run("python3".as_ref(), Peer::Libmodbus, turn.seed, 2_000)?], Vec::new()))
    }),
    ("soak", 60, |turn| Ok((vec![soak::run(turn.seed, PLANT, turn.go_on())], Vec::new()))),
    ("mutants", 60, |turn| {
        if cfg!(not(feature = "plants")) {
            return Err(lacks("--features plants"));
        }
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        Ok((vec![mutation::run(&root, turn.before as usize, turn.go_on())?], Vec::new()))
    }),
];

/// The plant of a soak.
const PLANT: soak::Size = soak::Size { lines: 2, drives: 8, time: Duration::from_secs(3_600), calm: 1 };

/// How deep each model is explored, and against its planted defects.
const DEPTHS: [(Model, usize, usize); 4] =
    [(lease::MODEL, 5, 5), (identities::MODEL, 4, 4), (gateway::MODEL, 4, 3), (master::MODEL, 4, 3)];

fn lacks(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::NotFound, what.to_owned())
}

fn has(python: &OsStr, import: &str, what: &str) -> io::Result<()> {
    if peers::runs(python, &["-c", import]) { Ok(()) } else { Err(lacks(what)) }
}

/// What came of all rounds.
#[derive(Debug, Clone)]
pub struct Summary {
    /// Where the numbers began.
    pub seed: u64,
    /// How many rounds were begun.
    pub rounds: u64,
    /// How long it took.
    pub took: Duration,
    /// Each part.
    pub rows: Vec<Row>,
}

/// One round, or where there is an `end` rounds until then. `say` hears of each part when its turn is over, and of what it found.
pub fn run(seed: u64, end: Option<Instant>, mut say: impl FnMut(&str)) -> Summary {
    let begun = Instant::now();
    let row = |name| Row { name, tried: Vec::new(), hunted: Vec::new(), lacks: None };
    let rows = PARTS.iter().map(|(name, ..)| row(name)).collect();
    let mut summary = Summary { seed, rounds: 0, took: Duration::ZERO, rows };
    let program = Cell::new(program::Target::ALL[0]);
    while summary.rounds == 0 || end.is_some_and(|end| Instant::now() < end) {
        let seed = seed.wrapping_add(summary.rounds);
        summary.rounds += 1;
        for ((_, share, attack), row) in PARTS.iter().zip(&mut summary.rows) {
            let share = Instant::now() + Duration::from_secs(*share);
            let before = row.tried.iter().map(|told| told.count).sum();
            let turn = Turn {
                is_first: summary.rounds == 1,
                seed,
                end: end.map_or(share, |end| end.min(share)),
                end_of_all: end,
                before,
                program: &program,
            };
            match attack(&turn) {
                Ok((tried, hunted)) => {
                    for told in tried.iter().chain(&hunted).filter(|told| told.count > 0) {
                        let minutes = begun.elapsed().as_secs_f64() / 60.0;
                        say(&format!("{minutes:>6.1} min, round {}: {}", summary.rounds, told.in_a_line()));
                        told.finds.iter().for_each(|find| say(&find.to_string()));
                    }
                    tried.into_iter().for_each(|told| add(&mut row.tried, told));
                    hunted.into_iter().for_each(|told| add(&mut row.hunted, told));
                }
                Err(error) if row.lacks.is_none() => row.lacks = Some(error.to_string()),
                Err(_) => {}
            }
        }
    }
    summary.took = begun.elapsed();
    summary
}

fn add(to: &mut Vec<Told>, again: Told) {
    match to.iter_mut().find(|told| told.part == again.part) {
        Some(told) => told.add(again),
        None => to.push(again),
    }
}

impl Row {
    fn told(&self) -> impl Iterator<Item = &Told> {
        self.tried.iter().chain(&self.hunted)
    }

    /// What was tried, in words: its parts may count different things.
    fn counts(&self) -> String {
        let mut counts = Vec::<(&str, u64)>::new();
        for told in &self.tried {
            match counts.iter_mut().find(|(unit, _)| *unit == told.unit) {
                Some((_, count)) => *count += told.count,
                None => counts.push((told.unit, told.count)),
            }
        }
        counts.iter().map(|(unit, count)| format!("{count} {unit}")).collect::<Vec<_>>().join(", ")
    }

    fn plants(&self) -> String {
        let (found, all) = self
            .told()
            .fold((0, 0), |(found, all), told| (found + told.plants_found(), all + told.plants.len()));
        if all == 0 { "none".to_owned() } else { format!("{found} of {all}") }
    }
}

impl Summary {
    /// How much was found in all parts.
    #[must_use]
    pub fn found(&self) -> usize {
        self.rows.iter().flat_map(Row::told).map(|told| told.finds.len()).sum()
    }
}

/// Each part by itself, and behind that, where a terminal leaves it, one row of each.
impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seed, rounds, took, rows } = self;
        rows.iter().flat_map(Row::told).try_for_each(|told| write!(f, "{told}"))?;
        writeln!(f, "\n{:<24}{:<26}{:>7}{:>11}{:>8}", "part", "tried", "found", "plants", "time")?;
        for row in rows {
            let Row { name, lacks, .. } = row;
            if let Some(lacks) = lacks.as_ref().filter(|_| row.tried.is_empty()) {
                let mut lines = lacks.lines();
                let first = lines.clone().find(|line| line.starts_with("error")).or_else(|| lines.next());
                writeln!(f, "{name:<24}did not run, for want of: {}", first.unwrap_or_default())?;
                continue;
            }
            let found: usize = row.told().map(|told| told.finds.len()).sum();
            let took = row.told().map(|told| told.took).sum::<Duration>().as_secs();
            let (counts, plants) = (row.counts(), row.plants());
            writeln!(f, "{name:<24}{counts:<26}{found:>7}{plants:>11}{took:>6} s")?;
        }
        let minutes = took.as_secs_f64() / 60.0;
        writeln!(f, "\n{} found in {rounds} rounds from seed {seed}, {minutes:.1} minutes.", self.found())?;
        writeln!(f, "Found: what breaks a promise; each stands above, with the command that does it again.")?;
        writeln!(
            f,
            "Plants: defects put in on purpose, as many as the part found; a part is worth what it finds of them."
        )
    }
}
