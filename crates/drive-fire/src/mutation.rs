//! Mutants that a variable chooses, against the tests of the crate in which they stand. `mutants.txt` says of each which promise it
//! breaks and by which test it dies, or why it lives; whatever is not so any more is found. Some are found by no test and by the part
//! that attacks the built program from outside: they have its target there.

use std::{
    collections::{BTreeMap, BTreeSet},
    env, fs, io,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use crate::{
    child,
    report::{Find, Plant, Told},
};

/// The list.
const LIST: &str = include_str!("../mutants.txt");

/// The crates in which mutants stand.
const PACKAGES: [&str; 8] = [
    "drive-bus",
    "drive-fleet",
    "drived-broker",
    "drived-daemon",
    "drived-doors",
    "drived-gateway",
    "drived-history",
    "drived-plant",
];

/// No test of one mutant takes so long, all tests of a library neither.
const LONGEST: Duration = Duration::from_secs(120);

/// What is known of a mutant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// In which crate it stands.
    pub package: String,
    /// Its name, which stands at its line.
    pub name: String,
    /// The promise that it breaks.
    pub breaks: String,
    /// What becomes of it.
    pub fate: Fate,
}

/// What becomes of a mutant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Fate {
    /// A test falls.
    DiesBy {
        /// Of which test program.
        target: String,
        /// Its name there.
        test: String,
    },
    /// No test of its crate falls; why that is borne.
    Lives(String),
    /// The part `program` finds it, by this target.
    FoundBy(String),
}

/// The rows of a list: `crate | name | promise | target | test`; `lives` and the reason, or `program` and its target, in the place of the
/// last two.
///
/// # Errors
/// The first line that is none.
pub fn read(list: &str) -> Result<Vec<Row>, String> {
    let lines = list.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    let row = |line: &str| {
        let [package, name, breaks, target, last] = line.split(" | ").collect::<Vec<_>>()[..] else {
            return Err(format!("{line:?} has not five parts"));
        };
        let fate = match target {
            "lives" => Fate::Lives(last.to_owned()),
            "program" => Fate::FoundBy(last.to_owned()),
            target => Fate::DiesBy { target: target.to_owned(), test: last.to_owned() },
        };
        Ok(Row { package: package.to_owned(), name: name.to_owned(), breaks: breaks.to_owned(), fate })
    };
    lines.map(row).collect()
}

/// The list of this repository.
///
/// # Panics
/// When it is none.
#[must_use]
pub fn list() -> Vec<Row> {
    read(LIST).expect("the list has five parts a line")
}

/// The names of those in a crate.
#[cfg(feature = "plants")]
pub(crate) fn names_of(package: &str) -> impl Iterator<Item = &'static str> {
    let of = move |line: &'static str| {
        let mut parts = line.split(" | ");
        (parts.next()? == package).then(|| parts.next())?
    };
    LIST.lines().filter_map(of)
}

/// The names that stand at lines of the sources of these crates, each with its crate.
///
/// # Errors
/// A source cannot be read.
pub fn at_lines(root: &Path) -> io::Result<BTreeSet<(String, String)>> {
    let mut found = BTreeSet::new();
    for package in PACKAGES {
        let mut folders = vec![root.join("crates").join(package).join("src")];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder)? {
                let path = entry?.path();
                if path.is_dir() {
                    folders.push(path);
                } else if !path.ends_with("mutants.rs") {
                    let text = fs::read_to_string(&path)?;
                    let named = text.split("mutant!(").skip(1).filter_map(|behind| behind.split('"').nth(1));
                    found.extend(named.map(|name| (package.to_owned(), name.to_owned())));
                }
            }
        }
    }
    Ok(found)
}

/// These test programs of these crates, with all mutants in them: `drive-fleet` is the library's, `order` that of a file.
fn programs(
    root: &Path,
    packages: &BTreeSet<String>,
    targets: &BTreeSet<String>,
) -> io::Result<BTreeMap<String, PathBuf>> {
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    // Together with this crate, so that what it was built with is not built once more.
    command.current_dir(root).args([
        "test",
        "--no-run",
        "--features",
        "drive-fire/plants",
        "-p",
        "drive-fire",
        "--lib",
    ]);
    for package in packages {
        command.args(["-p", package]);
    }
    for target in targets.iter().filter(|target| !PACKAGES.contains(&target.as_str())) {
        command.args(["--test", target]);
    }
    let told = command.env("CARGO_TERM_COLOR", "never").stdin(Stdio::null()).output()?;
    let text = String::from_utf8_lossy(&told.stderr);
    if !told.status.success() {
        return Err(io::Error::other(text.into_owned()));
    }
    let program = |line: &str| {
        let (what, path) = line.trim().strip_prefix("Executable ")?.strip_suffix(')')?.rsplit_once(" (")?;
        let stem = Path::new(path).file_name()?.to_str()?.rsplit_once('-')?.0;
        let target = if what.starts_with("unittests") { stem.replace('_', "-") } else { stem.to_owned() };
        Some((target, root.join(path)))
    };
    Ok(text.lines().filter_map(program).collect())
}

/// The names of the test files of a crate.
fn files(root: &Path, package: &str) -> io::Result<BTreeSet<String>> {
    let mut names = BTreeSet::new();
    let Ok(folder) = fs::read_dir(root.join("crates").join(package).join("tests")) else { return Ok(names) };
    for entry in folder {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "rs") {
            names.extend(path.file_stem().and_then(|stem| stem.to_str()).map(str::to_owned));
        }
    }
    Ok(names)
}

/// What a test program said with this mutant, and whether it failed. One that has not ended by then is ended: by a mutant that goes round
/// for ever a test falls as well.
fn test(root: &Path, row: &Row, program: &Path, arguments: &[&str]) -> io::Result<Ran> {
    let mut command = Command::new(program);
    command.args(arguments).env("DRIVED_MUTANT", &row.name).env("RUST_BACKTRACE", "0");
    let ended = child::run(command.current_dir(root.join("crates").join(&row.package)), LONGEST)?;
    let died = ended.status.is_none_or(|status| !status.success());
    Ok(Ran { died, ended: ended.status.is_some(), said: ended.stdout })
}

/// What came of a test program.
struct Ran {
    died: bool,
    ended: bool,
    said: String,
}

/// Whether each mutant of the list behind the first so many dies by its test; those that live are tried against all tests of their
/// crate's library.
///
/// # Errors
/// The tests cannot be built or run.
pub fn run(root: &Path, behind: usize, mut go_on: impl FnMut() -> bool) -> io::Result<Told> {
    let begun = Instant::now();
    let mut told = Told::new("mutants, against the tests that own their promise", "mutants");
    let is_of_tests = |row: &Row| !matches!(row.fate, Fate::FoundBy(_));
    let rows: Vec<Row> = list().into_iter().filter(is_of_tests).skip(behind).collect();
    if rows.is_empty() {
        return Ok(told);
    }
    let targets = rows.iter().filter_map(|row| match &row.fate {
        Fate::DiesBy { target, .. } => Some(target.clone()),
        Fate::Lives(_) | Fate::FoundBy(_) => None,
    });
    let packages = rows.iter().map(|row| row.package.clone()).collect();
    let programs = programs(root, &packages, &targets.collect())?;
    let mut lives = 0;
    for row in rows {
        if !go_on() {
            break;
        }
        told.count += 1;
        let target = match &row.fate {
            Fate::DiesBy { target, .. } => target,
            Fate::Lives(_) | Fate::FoundBy(_) => &row.package,
        };
        let Some(program) = programs.get(target) else {
            return Err(io::Error::other(format!("{target} is no test program: {:?}", programs.keys())));
        };
        let arguments = match &row.fate {
            Fate::DiesBy { test, .. } => vec!["--exact", test],
            Fate::Lives(_) | Fate::FoundBy(_) => Vec::new(),
        };
        let began = Instant::now();
        let Ran { died, ended, said } = test(root, &row, program, &arguments)?;
        let how = match (died, ended) {
            (true, false) => "ended, it went on for ever",
            (true, true) => "dies",
            (false, _) => "lives",
        };
        eprintln!("{:>6.1} s {}: {how}", began.elapsed().as_secs_f64(), row.name);
        let (name, replay) =
            (row.name.clone(), format!("DRIVED_MUTANT={} {} {arguments:?}", row.name, program.display()));
        match row.fate {
            Fate::DiesBy { test, .. } if died => {
                told.plants.push(Plant { name, found_by: Some(format!("{test} ({})", row.breaks)) });
            }
            Fate::DiesBy { test, .. } => {
                let ran = said.contains("1 passed");
                let what = if ran { "it lives" } else { "there is no such test" };
                told.finds.push(Find { what: format!("{name}: {what} any more: {test}"), replay });
                told.plants.push(Plant { name, found_by: None });
            }
            Fate::Lives(_) if died => {
                let tests = fallen(&said).join(", ");
                told.finds.push(Find {
                    what: format!("{name} dies now, and the list says that it lives: {tests}"),
                    replay,
                });
            }
            Fate::Lives(why) | Fate::FoundBy(why) => {
                lives += 1;
                told.plants.push(Plant { name: format!("{name}: {why}"), found_by: None });
            }
        }
    }
    for (package, breaks) in by_package(&told, &list()) {
        told.details.push(format!("{package}: {breaks}"));
    }
    told.details.push(format!("{lives} live, and the list says why"));
    told.took = begun.elapsed();
    Ok(told)
}

/// How many of each crate died.
fn by_package(told: &Told, rows: &[Row]) -> Vec<(&'static str, String)> {
    let died =
        |row: &&Row| told.plants.iter().any(|plant| plant.name == row.name && plant.found_by.is_some());
    let of = |package: &'static str| {
        let is_of_tests = |row: &&Row| row.package == package && !matches!(row.fate, Fate::FoundBy(_));
        let of_package = rows.iter().filter(is_of_tests);
        (package, format!("{} of {} die", of_package.clone().filter(died).count(), of_package.count()))
    };
    PACKAGES
        .into_iter()
        .filter(|package| {
            rows.iter().any(|row| row.package == *package && !matches!(row.fate, Fate::FoundBy(_)))
        })
        .map(of)
        .collect()
}

/// The tests that fell, as libtest names them.
fn fallen(said: &str) -> Vec<String> {
    let named = said.lines().filter_map(|line| line.strip_prefix("test ")?.strip_suffix(" ... FAILED"));
    named.map(str::to_owned).collect()
}

/// Looks for a test that falls by each mutant at a line, and gives the list as it is to be; of one that lives the reason is left open.
///
/// # Errors
/// The tests cannot be built or run.
pub fn hunt(root: &Path, only: Option<&str>) -> io::Result<()> {
    let known = list();
    let wanted: Vec<(String, String)> = at_lines(root)?
        .into_iter()
        .filter(|(package, name)| {
            only.is_none_or(|only| [package, name].into_iter().any(|known| known == only))
        })
        .collect();
    for package in PACKAGES.iter().filter(|package| wanted.iter().any(|(of, _)| of == *package)) {
        let files = files(root, package)?;
        let programs = programs(root, &BTreeSet::from([(*package).to_owned()]), &files)?;
        // The library's tests first, then those that stand in files of the same crate.
        let targets: Vec<&str> = [*package].into_iter().chain(files.iter().map(String::as_str)).collect();
        for (_, name) in wanted.iter().filter(|(of, _)| of == package) {
            let of_list = known.iter().find(|row| row.name == *name);
            let breaks = of_list.map_or("?", |row| &row.breaks).to_owned();
            let (package, name) = ((*package).to_owned(), name.clone());
            let row = Row { package, name, breaks, fate: Fate::Lives("?".to_owned()) };
            let mut fate = "lives | ?".to_owned();
            for target in &targets {
                let Some(program) = programs.get(*target) else { continue };
                let ran = test(root, &row, program, &[])?;
                if let Some(first) = fallen(&ran.said).first() {
                    fate = format!("{target} | {first}");
                    break;
                }
            }
            println!("{} | {} | {} | {fate}", row.package, row.name, row.breaks);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_the_list_is_read_and_one_that_is_none_is_refused() {
        let rows =
            read("# of the line\n\ndrive-bus | a | b c | order | d\ndrive-bus | e | f | lives | why\nx | g | h | program | Mqtt\n")
                .unwrap();
        assert_eq!(rows[0].fate, Fate::DiesBy { target: "order".to_owned(), test: "d".to_owned() });
        assert_eq!(rows[1].fate, Fate::Lives("why".to_owned()));
        assert_eq!(rows[2].fate, Fate::FoundBy("Mqtt".to_owned()));
        assert!(read("drive-bus | a").is_err());
    }

    #[test]
    fn each_mutant_of_the_list_stands_at_a_line_and_each_at_a_line_is_in_the_list() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let listed: BTreeSet<(String, String)> =
            list().into_iter().map(|row| (row.package, row.name)).collect();
        assert_eq!(at_lines(&root).expect("they are sources"), listed);
        assert_eq!(listed.len(), list().len(), "each name once");
        let of_bus = drive_bus::mutants::ALL.iter().map(|mutant| mutant.name.to_owned());
        let of_bus: BTreeSet<String> = of_bus.collect();
        let in_bus = listed.into_iter().filter(|(package, _)| package == "drive-bus").map(|(_, name)| name);
        assert_eq!(in_bus.collect::<BTreeSet<_>>(), of_bus);
    }

    #[test]
    fn the_tests_that_fell_are_read_from_what_libtest_prints() {
        let said = "test a::b ... ok\ntest a::c ... FAILED\n\nfailures:\n    a::c\n";
        assert_eq!(fallen(said), ["a::c"]);
    }
}
