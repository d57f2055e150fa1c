//! The page that follows one drive from its manual to motion, played as it is printed.

use drive_profile::{Level, Profile, read, shipped};

use crate::{check::reached, new::template};

const PAGE: &str = include_str!("../../drive-profile/IN-AN-HOUR.md");

/// The blocks of the page in a language.
fn blocks(language: &str) -> Vec<&'static str> {
    let begins = format!("```{language}\n");
    PAGE.split(&*begins).skip(1).filter_map(|rest| rest.split("\n```").next()).collect()
}

/// A block by its parts: lines that answer a question of the beginning, which go on while they are indented or close a list, and tables.
fn parts(block: &str) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    let mut in_table = false;
    for line in block.lines() {
        in_table |= line.starts_with('[');
        let goes_on = line.starts_with([' ', ']']) || in_table && !line.starts_with('[');
        match parts.last_mut().filter(|_| goes_on) {
            Some(part) => *part += &format!("\n{line}"),
            None if line.is_empty() => {}
            None => parts.push(line.to_owned()),
        }
    }
    parts
}

/// The file with a part in the place of what it had there, as whoever follows the page puts it.
fn with(text: &str, part: &str) -> String {
    let part = part.trim_end();
    if part.starts_with('[') {
        let header = part.lines().next().unwrap_or_default();
        let key = header.trim_matches(['[', ']']);
        // The table of that name ends where the next part of the template begins.
        let from = text.find(&format!("\n{header}\n")).map(|at| at + 1);
        if let Some(from) = from {
            let rest = &text[from + header.len()..];
            let ends = ["\n[", "\n# ---"].into_iter().filter_map(|end| rest.find(end)).min();
            let to = ends.map_or(text.len(), |end| from + header.len() + end);
            return format!("{}{part}\n{}", &text[..from], &text[to..]);
        }
        // A question of the beginning that becomes a table; a register more stands before the states.
        let question = text.split_inclusive('\n').find(|line| line.starts_with(&format!("{key} = ")));
        let without = question.map_or_else(|| text.to_owned(), |question| text.replacen(question, "", 1));
        let at = without.find("# --- 5.").filter(|_| key.starts_with("register.")).unwrap_or(without.len());
        return format!("{}{part}\n\n{}", &without[..at], &without[at..]);
    }
    let key = part.split(" = ").next().unwrap_or_default();
    let old = text.lines().find(|line| line.starts_with(&format!("{key} = ")));
    text.replacen(old.unwrap_or_else(|| panic!("the template asks {key}")), part, 1)
}

/// Where the numbers of lines stand: they are those of whoever edits.
fn without_line(text: &str) -> String {
    let mut words: Vec<&str> = text.split(' ').collect();
    if let Some(at) = words.iter().position(|word| *word == "line") {
        words.remove(at + 1);
    }
    words.join(" ")
}

#[test]
fn the_page_leads_from_the_template_to_motion_and_says_at_each_step_what_check_says() {
    let (edits, said) = (blocks("toml"), blocks("console"));
    assert!(edits.len() == said.len() && edits.len() > 5, "{} {}", edits.len(), said.len());
    let mut text = template("my-v20");
    let mut last: Option<Profile> = None;
    for (edit, said) in edits.into_iter().zip(said) {
        if edit.contains("[register.") {
            let example = text.split("[register.STATUS]").nth(1).and_then(|rest| rest.split("\n\n").next());
            let example = format!("[register.STATUS]{}\n\n", example.expect("the template has an example"));
            text = text.replacen(&example, "", 1);
        }
        for part in parts(edit) {
            text = with(&text, &part);
        }
        let profile = read(&text).unwrap_or_else(|refusals| panic!("{refusals}\n{text}"));
        let printed: Vec<String> = said.lines().skip(1).map(without_line).collect();
        assert_eq!(printed, reached(&profile).map(|line| without_line(&line)), "{edit}");
        last = Some(profile);
    }
    let profile = last.expect("there are steps");
    let shipped = shipped::find("v20").expect("it is shipped");
    assert_eq!(profile.level(), Level::Motion);
    // What it writes is what the shipped one writes.
    let sent = |profile: &Profile| format!("{:?}", profile.requests());
    assert_eq!(sent(&profile), sent(shipped));
}
