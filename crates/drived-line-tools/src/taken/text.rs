//! Bytes in a text: hexadecimal in any dress, dumps with offsets, and the lines of logs, with whatever stands around them.

use bytes::Bytes;
use drive_bus::{
    capture::{Captured, Direction, Dissector},
    content::Content,
    exchange::rtu,
};

use super::{
    NOTHING, Taken,
    stream::{Heard, taken},
};

/// The longest line that is looked at.
const LONGEST_LINE: usize = 16_384;

/// The longest frame of RTU.
const LONGEST: usize = 256;

/// The shortest: address, function, CRC.
const SHORTEST: usize = 4;

/// The same without the CRC, where a request or an answer says something: the refusal, address, function, code.
const SHORTEST_UNCHECKED: usize = 3;

/// The frames of a text.
pub(super) fn read(text: &str, without_check: bool) -> Taken {
    let lines = text.lines().map(|line| line.get(..LONGEST_LINE).unwrap_or(line));
    if let Some(ascii) = ascii(text) {
        return ascii;
    }
    let runs: Vec<Vec<Run>> = lines.map(runs).collect();
    let shortest = if without_check { SHORTEST_UNCHECKED } else { SHORTEST + 1 };
    let pieces: Vec<Vec<u8>> = runs.iter().flat_map(|runs| frames_of_line(runs, shortest)).collect();
    if without_check && pieces.is_empty() {
        return taken(Heard::of(&pieces, true), vec![NOTHING.to_owned()]);
    }
    if without_check {
        let framed =
            pieces.iter().filter_map(|piece| Some(rtu::frame(*piece.first()?, piece.get(1..)?).to_vec()));
        let framed: Vec<Vec<u8>> = framed.collect();
        return taken(
            Heard::of(&framed, true),
            vec!["taken as address and PDU: the check is ours".to_owned()],
        );
    }
    // A dump goes on in the next line, a log does not: what makes more of the bytes is meant.
    let alone = Heard::of(&pieces, true);
    let dump: Vec<Vec<u8>> = runs
        .iter()
        .map(|runs| runs.iter().flat_map(|run| run.bytes.clone()).collect::<Vec<u8>>())
        .filter(|run| !run.is_empty())
        .collect();
    let together = Heard::of(&dump, false);
    let heard = if together.good > alone.good { together } else { alone };
    let note = match heard.good {
        _ if heard.frames.is_empty() => NOTHING,
        0 => "no check fits: bytes that are address and PDU without their CRC are read by --no-check",
        _ => "the times were not taken down: silences cannot be judged",
    };
    taken(heard, vec![note.to_owned()])
}

/// Modbus ASCII, where a line has its frames.
fn ascii(text: &str) -> Option<Taken> {
    let mut frames = Vec::new();
    for line in text.lines() {
        let Some(at) = line.find(':') else { continue };
        for part in line[at..].split(':').skip(1) {
            let digits: String = part.chars().take_while(char::is_ascii_hexdigit).collect();
            let bytes = Bytes::from(format!(":{}\r\n", digits.to_ascii_uppercase()));
            if Content::of(Dissector::Data, &bytes).is_ok() {
                frames.push(Captured { at: std::time::Duration::ZERO, direction: Direction::Unknown, bytes });
            }
        }
    }
    // Requests and answers follow one another.
    let mut asked: Option<u8> = None;
    for frame in &mut frames {
        let slave = Content::of(Dissector::Data, &frame.bytes).ok().and_then(|content| content.slave());
        let is_answer = asked.is_some() && asked == slave;
        frame.direction = if is_answer { Direction::Received } else { Direction::Sent };
        asked = slave.filter(|slave| !is_answer && *slave != 0);
    }
    let notes = vec!["the times were not taken down: silences cannot be judged".to_owned()];
    let found = Taken { dissector: Dissector::Data, late: None, has_times: false, frames, notes };
    (!found.frames.is_empty()).then_some(found)
}

/// What of a line are frames: those whose check fits; where none does, the longest run that may be one.
fn frames_of_line(runs: &[Run], shortest: usize) -> Vec<Vec<u8>> {
    let fitting: Vec<Vec<u8>> = runs.iter().flat_map(|run| fitting(&run.bytes)).collect();
    if !fitting.is_empty() {
        return fitting;
    }
    let longest = runs.iter().filter(|run| run.is_plain).max_by_key(|run| run.bytes.len());
    longest.filter(|run| run.bytes.len() >= shortest).map(|run| run.bytes.clone()).into_iter().collect()
}

/// The frames in a run whose check fits, each as long as it can be, one behind the other.
fn fitting(run: &[u8]) -> Vec<Vec<u8>> {
    let mut found = Vec::new();
    let mut at = 0;
    while at + SHORTEST <= run.len() {
        let most = (run.len() - at).min(LONGEST);
        let fits = (SHORTEST..=most).rev().find(|length| rtu::is_frame(&run[at..at + length]));
        match fits {
            Some(length) => {
                found.push(run[at..at + length].to_vec());
                at += length;
            }
            None => at += 1,
        }
    }
    found
}

/// Bytes of words that follow one another in a line, and nothing else.
#[derive(Default)]
struct Run {
    bytes: Vec<u8>,
    /// Whether all words are as long as the others: a date is not.
    is_plain: bool,
}

/// The runs of bytes in a line.
fn runs(line: &str) -> Vec<Run> {
    // Behind the bytes of a dump stand the same as characters.
    let line = line.split('|').next().unwrap_or(line);
    let line = without_offset(line);
    let line = line.replace("\\x", " ").replace("0x", " ").replace("0X", " ");
    let is_between = |character: char| {
        character.is_whitespace()
            || matches!(
                character,
                ',' | ';'
                    | '-'
                    | ':'
                    | '['
                    | ']'
                    | '<'
                    | '>'
                    | '('
                    | ')'
                    | '{'
                    | '}'
                    | '\''
                    | '"'
                    | '_'
                    | '.'
                    | '='
            )
    };
    let mut runs = vec![Run::default()];
    let (mut is_open, mut length) = (false, 0);
    for word in line.split(is_between).filter(|word| !word.is_empty()) {
        match bytes_of(word) {
            Some(bytes) => {
                if let Some(run) = runs.last_mut() {
                    run.is_plain = if is_open { run.is_plain && length == bytes.len() } else { true };
                    length = bytes.len();
                    run.bytes.extend(bytes);
                }
                is_open = true;
            }
            None if is_open => {
                is_open = false;
                runs.push(Run::default());
            }
            None => {}
        }
    }
    runs.retain(|run| !run.bytes.is_empty());
    runs
}

/// A line of a dump without the offset before it: `00000010: 0103`, `0010  01 03`.
fn without_offset(line: &str) -> &str {
    let trimmed = line.trim_start();
    let Some(end) = trimmed.find(|character: char| !character.is_ascii_hexdigit()) else {
        // The last line of a dump says where it ends.
        return if matches!(trimmed.len(), 7 | 8) && trimmed.starts_with("0000") { "" } else { trimmed };
    };
    let (offset, rest) = trimmed.split_at(end);
    let is_offset = matches!(offset.len(), 4 | 6 | 7 | 8)
        && u64::from_str_radix(offset, 16).is_ok_and(|offset| offset % 8 == 0)
        && (rest.starts_with(": ") || rest.starts_with("  "));
    if !is_offset {
        return trimmed;
    }
    // Behind the bytes stand the same as characters: behind two spaces, or three where two part the bytes.
    let (rest, gap) = match rest.strip_prefix(": ") {
        Some(rest) => (rest, "  "),
        None => (rest.trim_start(), "   "),
    };
    rest.split(gap).next().unwrap_or(rest)
}

/// The bytes of one word: `01`, `1`, `01h`, `010300…`.
fn bytes_of(word: &str) -> Option<Vec<u8>> {
    let digits = word.strip_suffix(['h', 'H']).unwrap_or(word);
    let is_hex = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    if !is_hex || (digits.len() > 2 && digits.len() % 2 == 1) {
        return None;
    }
    let pairs = digits.as_bytes().chunks(2).map(|pair| std::str::from_utf8(pair).ok());
    pairs.map(|pair| u8::from_str_radix(pair?, 16).ok()).collect()
}
