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
    ("list", "list = [[code, mnemonic, meaning, remedy], ...]"),
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
    let line = line(text, &error.span().unwrap_or(0..0));
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
        (format!("the question `{question}` is left in silence"), known.unwrap_or_else(usual))
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
