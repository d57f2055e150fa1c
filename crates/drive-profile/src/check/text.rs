//! The text as such: its length, its form, its keys, and that no question is left out.

use super::{LONGEST, Refusal};
use crate::{format::File, source::line};

/// How deep tables may stand in each other.
const DEEPEST: usize = 16;

pub(super) fn parse(text: &str) -> Result<File, Refusal> {
    if text.len() > LONGEST {
        return Err(Refusal {
            line: 1,
            reason: format!("the file is longer than {LONGEST} bytes"),
            write: "one drive in a file".to_owned(),
        });
    }
    if let Some(deep) = too_deep(text) {
        return Err(Refusal {
            line: deep,
            reason: "tables or lists stand too deep in each other".to_owned(),
            write: "what the format has, which is nowhere so deep".to_owned(),
        });
    }
    toml::from_str(text).map_err(|error| refusal(text, &error))
}

/// The line in which brackets stand too deep in each other, in whatever they stand: a parser may follow each by a call.
fn too_deep(text: &str) -> Option<usize> {
    text.lines()
        .zip(1..)
        .scan(0_usize, |open, (content, number)| {
            for byte in content.bytes() {
                match byte {
                    b'[' | b'{' => *open += 1,
                    b']' | b'}' => *open = open.saturating_sub(1),
                    _ => {}
                }
                if *open > DEEPEST {
                    return Some(Some(number));
                }
            }
            Some(None)
        })
        .flatten()
        .next()
}

/// What is to be written under a key that has no answer "none" or "unknown".
const KEYS: &[(&str, &str)] = &[
    (
        "access",
        "access = \"read\", \"read_write\", \"write_stopped\" (only while the motor stands) or \"write\" (nobody reads it)",
    ),
    (
        "acts",
        "acts = \"level\" where a run command that stands starts the motor when the power comes back, \"edge\" where it has to be written anew, or \"unknown\"",
    ),
    ("address", "address = the number as the manual prints it"),
    ("bits", "bits = { register = \"...\", mask = 0x0001, value = 0x0001, source = \"...\" }"),
    ("do", "do = \"write\" with register and word, \"wait\" or \"run\""),
    ("document", "document = the manual's title and number, or the repository"),
    ("functions", "functions = those of 1 to 6, 15, 16 and 23 that the drive answers, such as [3, 6]"),
    (
        "limits",
        "limits = { low = 0, high = ... } in counts, with high_in = a register or \"owner\" where the drive allows less",
    ),
    (
        "fed_by",
        "fed_by = \"any_request\", \"command_write\" (only a write of the command or the setpoint), \"none\" or \"unknown\"",
    ),
    (
        "format",
        "format = 1, or begin by `drived profile new KEY --to FILE`: that writes a file with every question in it",
    ),
    (
        "from_factory",
        "from_factory = true where it acts as it leaves the factory, false where it is off, or \"unknown\"",
    ),
    ("list", "list = [[code, \"short name\", \"what it means\", \"what to do first, or nothing\"], ...]"),
    (
        "mark",
        "mark = \"P\" (the maker's manual), \"R\" (a public repository), \"D\" (arithmetic from these), or \"X\", \"M\", \"W\", which move no motor",
    ),
    ("mask", "mask = the bits that count, such as 0x0008"),
    ("numbering", "numbering = \"wire\" (from 0), \"from_one\" or \"from_40001\", as the manual counts"),
    ("page", "page = the pages, sections or files"),
    (
        "proves",
        "proves = \"bus\" where the bits say that the bus commands it, \"nothing\" where they say only that it may",
    ),
    ("register", "register = the name of a table [register.NAME]"),
    (
        "runs",
        "runs = every form of a word that runs the motor: [{ register = \"...\", mask = 0x0001, value = 0x0001, source = \"...\" }]",
    ),
    (
        "sign_is_direction",
        "sign_is_direction = true where a negative setpoint turns it the other way, else false",
    ),
    ("source", "source = one name of [sources], or several with spaces between"),
    ("space", "space = \"holding_register\", \"input_register\", \"coil\" or \"discrete_input\""),
    (
        "state",
        "state = \"fault\", \"fault_reaction\", \"running\", \"stopping\", \"quick_stop\", \"ready\", \"disabled\" or \"not_ready\"",
    ),
    ("steps", "steps = [{ write = \"...\", words = [...] }]"),
    (
        "unread",
        "unread = \"ramp\", \"fast\", \"freewheel\" or \"dc_injection\": the one that is a stop whatever the guards say",
    ),
    ("value", "value = how the bits of the mask are then"),
    ("what", "what = what it is, in a few words"),
    ("why", "why = why it is never written"),
    ("zero_is", "zero_is = \"off\" where a time of 0 switches it off, or what 0 means, or \"unknown\""),
];

/// Questions that stand above the first table, for a question under a table is that table's.
const ON_TOP: &[&str] = &[
    "format",
    "key",
    "maker",
    "name",
    "models",
    "tried",
    "command",
    "setpoint",
    "reset",
    "setup",
    "watchdog",
    "never_written",
    "texts",
];

/// Whether a message is about what a value is, and not about how it is written.
fn of_a_value(message: &str) -> bool {
    ["invalid type: ", "invalid value: ", "invalid length "].iter().any(|begin| message.starts_with(begin))
}

/// The parser's words for kinds of values, and what they are called.
const KINDS: &[(&str, &str)] = &[
    ("u16", "one number of 0 to 65535"),
    ("u32", "one number from 0"),
    ("u8", "one number of 0 to 255"),
    ("i32", "one number"),
    ("i64", "one number"),
    ("a sequence", "a list [...]"),
    ("sequence", "a list [...]"),
    ("an array of length 2", "a list of two numbers, such as [1, 100]"),
    (
        "a tuple of size 4",
        "[code, \"short name\", \"what it means\", \"what to do first, or nothing\"], four of them",
    ),
    ("a tuple of size 2", "[number, \"what it does\"], two of them"),
    ("a map", "a table { ... }"),
    ("map", "a table { ... }"),
    ("a string", "a text in quotes"),
    ("a boolean", "true or false"),
];

/// A value or what is wanted instead, by what it is called in a file.
fn in_words(said: &str) -> String {
    if let Some((_, known)) = KINDS.iter().find(|(kind, _)| *kind == said) {
        return (*known).to_owned();
    }
    if said.starts_with("struct ") {
        return "a table { ... }".to_owned();
    }
    let of = [
        ("integer `", "the number `"),
        ("string \"", "the text \""),
        ("boolean `", "`"),
        ("floating point `", "the number `"),
    ];
    let found = of.iter().find_map(|(begin, by)| said.strip_prefix(begin).map(|rest| format!("{by}{rest}")));
    found.unwrap_or_else(|| said.to_owned())
}

/// What the parser says, in the words of whoever writes a profile.
fn refusal(text: &str, error: &toml::de::Error) -> Refusal {
    let message = error.message();
    let mut line = line(text, &error.span().unwrap_or(0..0));
    let content = text.lines().nth(line.saturating_sub(1)).unwrap_or_default();
    let quoted = |begin: &str| message.strip_prefix(begin)?.split('`').nth(1);
    let expected =
        message.split_once("expected ").map(|(_, expected)| expected.lines().collect::<Vec<_>>().join(" "));
    let (reason, write) = if let Some(question) = quoted("missing field ") {
        let known = KEYS.iter().find(|(key, _)| *key == question).map(|(_, write)| (*write).to_owned());
        let usual = || {
            format!(
                "{question} = what the manual says, \"none\" where there is none, \"unknown\" where nobody knows"
            )
        };
        let mut write = known.unwrap_or_else(usual);
        // The whole file has no line of its own.
        let is_of_all = error.span().is_none_or(|span| span.start == 0);
        if is_of_all && ON_TOP.contains(&question) {
            let first = text.lines().position(|of| of.trim_start().starts_with('['));
            line = first.map_or(1, |at| at + 1);
            write = format!("above the first [table]: {write}");
        }
        (format!("the question `{question}` is left in silence"), write)
    } else if let Some(told) = tired(text, content, message) {
        told
    } else if let Some(key) = quoted("unknown field ") {
        let instead = expected.as_deref().unwrap_or("a key of the format");
        (format!("`{key}` is no key of the format"), format!("{instead}, or nothing"))
    } else if let Some(word) = quoted("unknown variant ") {
        let instead = expected.unwrap_or_else(|| "one of the words of the format".to_owned());
        (format!("`{word}` is none of the words that may stand there"), instead)
    } else if let Some((found, wanted)) =
        message.split_once(", expected ").filter(|_| message.starts_with("invalid ") && of_a_value(message))
    {
        let found = found.split_once(": ").map_or(found, |(_, found)| found);
        (
            format!("{} does not belong there", in_words(found)),
            in_words(wanted.lines().next().unwrap_or_default()),
        )
    } else {
        let said = message.lines().collect::<Vec<_>>().join(" ");
        let write = "key = value or [table], as the lines around it; what only explains begins with #";
        (format!("this is no line of TOML: {said}"), write.to_owned())
    };
    Refusal { line, reason, write }
}

/// What a tired engineer has written where the parser sees no more than that it is none of its own, and what he meant.
fn tired(text: &str, content: &str, message: &str) -> Option<(String, String)> {
    let content = content.split('#').next().unwrap_or_default().trim();
    let is_form = !["invalid ", "unknown "].iter().any(|begin| message.starts_with(begin));
    if content.contains(['\u{201C}', '\u{201D}', '\u{201E}', '\u{2018}', '\u{2019}']) && is_form {
        let write =
            "straight quotes, as a text editor writes them and a word processor does not: key = \"mmax\"";
        return Some(("these quotes are none of TOML's".to_owned(), write.to_owned()));
    }
    if let Some(name) = content.strip_prefix("[register.") {
        let name = name.trim_end_matches(']');
        if name.contains(|of: char| !(of.is_ascii_alphanumeric() || matches!(of, '_' | '-' | '"'))) {
            let plain: String =
                name.chars().map(|of| if of.is_ascii_alphanumeric() { of } else { '_' }).collect();
            let reason = format!("{name} is no name of a register: it has letters, digits, _ and -");
            return Some((reason, format!("[register.{plain}], and the same name wherever it is used")));
        }
    }
    if message.starts_with("duplicate key") {
        let first =
            text.lines().position(|line| line.split('#').next().unwrap_or_default().trim() == content);
        let first = first.map_or_else(String::new, |at| format!(", first in line {}", at + 1));
        let write = "one of them alone, with all that it says".to_owned();
        return Some((format!("{content} stands twice{first}"), write));
    }
    // What stands in quotes is a text.
    let plain: String = content.split('"').step_by(2).collect::<Vec<_>>().join(" ");
    let words = plain.split(|of: char| !of.is_ascii_alphanumeric());
    let is_hex = |word: &&str| {
        word.strip_suffix(['h', 'H']).is_some_and(|of| {
            of.starts_with(|of: char| of.is_ascii_digit()) && of.chars().all(|of| of.is_ascii_hexdigit())
        })
    };
    if let Some(word) = words.into_iter().find(is_hex).filter(|_| is_form) {
        let digits = word.trim_end_matches(['h', 'H']);
        return Some((
            format!("{word} is no number of TOML"),
            format!("0x{digits}: a number in hexadecimal digits begins with 0x"),
        ));
    }
    let said = content.split_once('=').map_or("", |(_, said)| said.trim());
    let is_comma = said.split_once(',').is_some_and(|(whole, part)| {
        let is_number = |of: &str| !of.is_empty() && of.bytes().all(|byte| byte.is_ascii_digit());
        is_number(whole.trim()) && is_number(part.trim())
    });
    (is_comma && is_form).then(|| {
        (
            format!("{said} is no number of TOML, which has no comma in it"),
            "a fraction, such as scale = [1, 10] for 0.1".to_owned(),
        )
    })
}
