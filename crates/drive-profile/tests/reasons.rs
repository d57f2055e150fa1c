//! Every reason for which a file is refused: each stands in `REFUSED.md` with what to write instead, and each was seen.

use std::fmt::Write as _;

use drive_profile::{read, shipped};

/// The sources of the checker.
const CHECKER: [&str; 10] = [
    include_str!("../src/check/mod.rs"),
    include_str!("../src/check/who.rs"),
    include_str!("../src/check/fingerprints.rs"),
    include_str!("../src/check/registers.rs"),
    include_str!("../src/check/states.rs"),
    include_str!("../src/check/running.rs"),
    include_str!("../src/check/actions.rs"),
    include_str!("../src/check/standing.rs"),
    include_str!("../src/check/seen.rs"),
    include_str!("../src/check/setpoint.rs"),
];

const SIGNED: &str = include_str!("data/signed.toml");
const SPACES: &str = include_str!("data/spaces.toml");
const DIRECTIONS: &str = include_str!("data/directions.toml");

/// What a place of a good file becomes, and why that is refused. Those that want more than one place are in `refused.rs`.
const SEEN: &[(&str, &str, &str, &str)] = &[
    (
        "ig5a",
        "list = [[0x14, \"not_now\"]]",
        "list = [[0x94, \"not_now\"]]",
        "these are no codes of exceptions",
    ),
    (
        "directions",
        "{ register = \"STATUS\", mask = 0x0004, value = 0x0004, source = \"made\" }",
        "{ register = \"STATUS\", mask = 0x0001, value = 0x0001, source = \"made\" }",
        "at_setpoint is told of every motor that runs",
    ),
    (
        "directions",
        "command = { bits = { register = \"STATUS\", mask = 0x0200, value = 0x0200,",
        "command = { bits = { register = \"STATUS\", mask = 0x0001, value = 0x0001,",
        "is told to be the bus's by the bits that show that the motor runs",
    ),
    (
        "directions",
        "mask = 0x0002, forward = 0x0000, reverse = 0x0002,",
        "mask = 0x0001, forward = 0x0001, reverse = 0x0000,",
        "which way it turns is told by bits that are 0001h in every motor that runs",
    ),
    (
        "directions",
        "    { state = \"running\", ",
        "    { state = \"ready\", bits = { register = \"STATUS\", mask = 0x0010, value = 0x0010, source = \"made\" } },\n    { state = \"running\", ",
        "a motor that runs may be told as \"ready\", which stands before it",
    ),
    (
        "directions",
        "forward = { steps = [",
        "forward = { steps = [{ await = { register = \"STATUS\", mask = 1, value = 1, source = \"made\" }, within_ms = 1000 }, ",
        "start.forward waits for a motor that runs before it writes the run command",
    ),
    (
        "goodrive",
        "forward = { steps = [",
        "forward = { steps = [{ await = { register = \"STATE\", mask = 0xFFFF, value = 1, source = \"manuals\" }, within_ms = 1000 }, ",
        "start.forward waits for a motor that runs before it writes the run command",
    ),
    (
        "vfs15",
        "forward = { steps = [{ write = \"FA00\", words = [0xC400] }]",
        "forward = { steps = [{ write = \"FA00\", words = [0xE400] }]",
        "start.forward writes E400h, which holds the bit by which the reset resets (2000h)",
    ),
    (
        "directions",
        "forward = { steps = [{ write = \"FORWARD\", coils = [true, false] }]",
        "forward = { steps = [{ write = \"FORWARD\", coils = [true] }]",
        "start.forward leaves the run command of the other start standing",
    ),
    (
        "directions",
        "what = \"run in reverse\"\naddress = 2\nspace = \"coil\"\naccess = \"read_write\"",
        "what = \"run in reverse\"\naddress = 2\nspace = \"coil\"\naccess = \"write\"",
        "a start runs by REVERSE and not by FORWARD, and REVERSE can only be written",
    ),
    (
        "directions",
        "{ write = \"RESET\", coils = [false] }, { write = \"FORWARD\", coils = [false, false] }]",
        "{ write = \"REVERSE\", coils = [false, true] }]",
        "the reset is left standing: it ends with 0001h",
    ),
    ("v20", "format = 1\n", "format = 2\n", "format 2 is not read here"),
    ("v20", "key = \"v20\"", "key = \"V 20\"", "the key is the name in configurations"),
    ("v20", "functions = [3, 6, 16]", "functions = []", "no function is named"),
    ("v20", "functions = [3, 6, 16]", "functions = [3, 6, 16, 8]", "function 8 reads or writes no register"),
    ("v20", "read_words = 125", "read_words = 126", "read_words is outside of what Modbus allows"),
    ("v20", "formats = [\"8E1\"]", "formats = [\"8X1\"]", "this is no character format"),
    (
        "v20",
        "factory = \"unknown\"\nhighest",
        "factory = \"fast 8E1\"\nhighest",
        "this is no setting of a line",
    ),
    (
        "v20",
        "highest_address = \"unknown\"",
        "highest_address = 248",
        "are no addresses of Modbus over a serial line",
    ),
    ("v20", "maker = \"Siemens\"", "maker = \" \"", "this is no name that a person can read"),
    ("v20", "page = \"111-115\"", "page = \"\"", "source \"oi2012\" names no document or no page"),
    (
        "v20",
        "source = \"oi2012 wb\"\n\n[register.HSW]",
        "source = \"nobody\"\n\n[register.HSW]",
        "\"nobody\" is no source",
    ),
    ("v20", "speed = \"SPEED\"", "speed = \"SPED\"", "there is no register \"SPED\""),
    ("v20", "[register.CURRENT]", "[register.\"\"]", "this is no mnemonic"),
    (
        "v20",
        "address = 40026\n",
        "address = 40026\nwords = 3\norder = \"high_first\"\n",
        "CURRENT has 3 words",
    ),
    (
        "v20",
        "address = 40026\n",
        "address = 40026\nwords = 2\n",
        "it is not said which of two words is first",
    ),
    (
        "spaces",
        "space = \"discrete_input\"\n",
        "space = \"discrete_input\"\nunit = \"V\"\nscale = [1, 1]\n",
        "DOOR is one bit",
    ),
    (
        "v20",
        "address = 40026\n",
        "address = 40026\nspace = \"input_register\"\n",
        "CURRENT is read by function 4, which the drive has not",
    ),
    ("v20", "unit = \"A\"\n", "unit = \"code\"\n", "CURRENT has a scale and no unit"),
    (
        "v20",
        "address = 40026\naccess = \"read\"",
        "address = 40026\naccess = \"read\"\nparameter = true",
        "CURRENT is a parameter that nobody can write",
    ),
    ("v20", "functions = [3, 6, 16]", "functions = [3]", "no function of the drive writes STW"),
    (
        "v20",
        "address = 40026\naccess = \"read\"",
        "address = 40226\naccess = \"read_write\"\nstorage = \"ram\"",
        "CURRENT can be written and is never written: a write cuts",
    ),
    (
        "v20",
        "address = 40026\naccess = \"read\"",
        "address = 40026\naccess = \"read_write\"\nstorage = \"ram\"\nparameter = true\nwords = 2\norder = \"low_first\"",
        "CURRENT is a parameter of two words",
    ),
    ("v20", "from = 40004, to = 40007", "from = 40007, to = 40004", "the range runs backwards"),
    (
        "v20",
        "register = \"HSW\"\nfull_scale",
        "register = \"STW\"\nfull_scale",
        "is no setpoint: that is one whole word in Hz, rpm or %",
    ),
    (
        "spaces",
        "[setpoint]\n",
        "[setpoint]\nfull_scale = \"owner\"\n",
        "only what counts in percent has a full scale",
    ),
    (
        "v20",
        "what = \"main setpoint\"\naddress = 40101\naccess = \"read_write\"\nstorage = \"ram\"\nunit = \"%\"\nscale = [100, 16384]\nsigned = true",
        "what = \"main setpoint\"\naddress = 40101\naccess = \"read\"\nunit = \"%\"\nscale = [100, 16384]\nsigned = true",
        "a setpoint that nobody can write",
    ),
    ("spaces", "sign_is_direction = false", "sign_is_direction = true", "a sign that the register has not"),
    (
        "v20",
        "what = \"main setpoint\"\naddress = 40101",
        "what = \"main setpoint\"\naddress = 40201",
        "the setpoint is never written",
    ),
    (
        "v20",
        "guards = \"none\"",
        "guards = [{ what = \"it\", register = \"ZSW\", is = [1], set_up = true, source = \"oi2012\" }]",
        "a guard is said to be made true by `setup`, and there is none",
    ),
    (
        "v20",
        "guards = \"none\"",
        "guards = [{ what = \"it\", register = \"ZSW\", source = \"oi2012\" }]",
        "it is not said what this register has to hold",
    ),
    (
        "v20",
        "guards = \"none\"",
        "guards = [{ what = \"it\", register = \"SPEED\", mask = 0x000F, is = [0x10], source = \"oi2012\" }]",
        "it never reads so",
    ),
    (
        "v20",
        "direction = { register = \"FREQ_OUTPUT\", source",
        "direction = { register = \"ZSW\", source",
        "it is not said how forward and reverse look",
    ),
    (
        "v20",
        "{ write = \"STW\", words = [0x047F] }], source = \"wb\" }\nreverse",
        "{ write = \"ZSW\", words = [0x047F] }], source = \"wb\" }\nreverse",
        "ZSW can only be read",
    ),
    (
        "v20",
        "within_ms = 1000 }, { write = \"STW\", words = [0x047F] }]",
        "within_ms = 0 }, { write = \"STW\", words = [0x047F] }]",
        "nobody waits so long",
    ),
    (
        "v20",
        "{ write = \"STW\", words = [0x04FE] }, {",
        "{ pause_ms = 5, write = \"STW\", words = [0x04FE] }, {",
        "a step is one thing",
    ),
    (
        "v20",
        "mask = 0x0004, value = 0x0004",
        "mask = 0x0004, value = 0x0008",
        "mask 0004h and value 0008h never fit",
    ),
    (
        "v20",
        "address = 40026\naccess = \"read\"",
        "address = 40026\naccess = \"write\"\nstorage = \"ram\"",
        "CURRENT can only be written",
    ),
    (
        "v20",
        "reset = { steps = [{ write = \"STW\", words = [0x04FE] }, { write = \"STW\", words = [0x047E] }]",
        "reset = { steps = []",
        "reset has no steps, or too many",
    ),
];

fn base(name: &str) -> &'static str {
    match name {
        "spaces" => SPACES,
        "directions" => DIRECTIONS,
        "signed" => SIGNED,
        name => {
            let ends = format!("/{name}");
            shipped::TEXTS.iter().find(|(known, _)| known.ends_with(&ends)).expect("it is shipped").1
        }
    }
}

#[test]
fn each_mistake_in_one_place_is_refused_in_its_line_with_what_to_write() {
    for (name, place, by, reason) in SEEN {
        let good = base(name);
        assert_eq!(good.matches(place).count(), 1, "{name}: {place}");
        let text = good.replace(place, by);
        let refusals = read(&text).map(|profile| profile.level()).expect_err(reason).0;
        let found = refusals.iter().find(|refusal| refusal.reason.contains(reason));
        let found = found.unwrap_or_else(|| panic!("{reason:?} is not among {refusals:#?}"));
        assert!(!found.write.is_empty() && (1..=text.lines().count()).contains(&found.line), "{found}");
    }
}

/// What the checker says of a mistake and what it says to write, as they stand in its source.
struct Reason {
    said: String,
    write: String,
}

impl Reason {
    /// With what is filled in left open.
    fn open(text: &str) -> String {
        let mut open = String::new();
        let mut rest = text;
        while let Some((before, behind)) = rest.split_once('{') {
            // What stands twice is a brace and no place.
            if let Some(behind) = behind.strip_prefix('{') {
                open += before;
                open.push('{');
                rest = behind;
                continue;
            }
            open += before;
            open.push('…');
            rest = behind.split_once('}').map_or("", |(_, behind)| behind);
        }
        (open + rest).replace("}}", "}")
    }

    /// Whether a text in a test names it: a part of it, or all of a part with what was filled in.
    fn is_named_by(&self, text: &str) -> bool {
        const TELLING: usize = 10;
        let mut parts = self.said.split('…').map(str::trim).filter(|part| part.len() >= 5);
        text.len() >= TELLING && parts.any(|part| part.contains(text) || text.contains(part))
            || self.said == text
    }
}

/// The texts in quotes that begin in a source, with what is quoted in them.
fn quoted(source: &str) -> Vec<String> {
    let (mut all, mut open, mut escaped) = (Vec::new(), None::<String>, false);
    for letter in source.chars() {
        match (&mut open, letter) {
            (Some(text), letter) if escaped => {
                text.push(letter);
                escaped = false;
            }
            (Some(_), '\\') => escaped = true,
            (Some(_), '"') => all.extend(open.take()),
            (Some(text), letter) => text.push(letter),
            (None, '"') => open = Some(String::new()),
            (None, _) => {}
        }
    }
    all
}

/// Every reason that the checker has.
fn reasons() -> Vec<Reason> {
    let mut all = Vec::new();
    for source in CHECKER {
        // A text that goes on in the next line is one.
        let mut joined = String::new();
        for line in source.lines() {
            match line.strip_suffix('\\') {
                Some(begun) => joined += begun.trim_start(),
                None => writeln!(joined, "{}", line.trim_start()).expect("a text"),
            }
        }
        for call in joined.split("self.refuse(").skip(1) {
            let call = call.split(");\n").next().unwrap_or_default();
            let texts = quoted(call);
            match &texts[..] {
                [said, write, ..] => {
                    all.push(Reason { said: Reason::open(said), write: Reason::open(write) });
                }
                // Several reasons for which the same is to be written.
                _ => {
                    let first = |text: &str| quoted(text).into_iter().next().expect("a text");
                    let (_, instead) = joined.split_once("const INSTEAD").expect("what to write instead");
                    let write = first(instead);
                    all.extend(joined.split("format!(").skip(1).map(|reason| Reason {
                        said: Reason::open(&first(reason)),
                        write: Reason::open(&write),
                    }));
                }
            }
        }
    }
    all.dedup_by(|one, other| one.said == other.said);
    all
}

#[test]
fn each_reason_of_the_checker_stands_in_the_list_and_was_seen_by_a_test() {
    let tests = [
        include_str!("refused.rs"),
        include_str!("slips.rs"),
        include_str!("published.rs"),
        include_str!("reasons.rs"),
    ];
    let named: Vec<String> = tests.into_iter().flat_map(quoted).collect();
    let reasons = reasons();
    assert!(reasons.len() > 80, "only {} reasons were found", reasons.len());
    let unseen: Vec<&str> = reasons
        .iter()
        .filter(|reason| !named.iter().any(|text| reason.is_named_by(text)))
        .map(|reason| &*reason.said)
        .collect();
    assert!(unseen.is_empty(), "no test has seen: {unseen:#?}");

    let cell = |text: &str| text.replace('|', "\\|");
    let mut list = String::from("| It is refused because | Write |\n|---|---|\n");
    for Reason { said, write } in &reasons {
        writeln!(list, "| {} | {} |", cell(said), cell(write)).expect("a text");
    }
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/REFUSED.md");
    let page = std::fs::read_to_string(path).expect("it is there");
    let (head, _) = page.split_once("<!-- reasons -->\n").expect("it has a place for the list");
    let whole = format!("{head}<!-- reasons -->\n{list}");
    if std::env::var_os("UPDATE_README").is_some() {
        std::fs::write(path, whole).expect("it can be written");
        return;
    }
    assert!(page == whole, "UPDATE_README=1 cargo test -p drive-profile --test reasons writes it:\n{list}");
}
