//! Texts in the room that there is: no number and no word is cut in two.

/// A count of lines as a height.
pub fn height_of(lines: usize) -> u16 {
    u16::try_from(lines).unwrap_or(u16::MAX)
}

/// A text in at most so many characters: what has no room is left out by whole words, and that is shown.
pub fn fitted(text: &str, room: usize) -> String {
    if text.chars().count() <= room {
        return text.to_owned();
    }
    let cut: String = text.chars().take(room.saturating_sub(1)).collect();
    let whole = cut.rsplit_once(' ').map_or("", |(whole, _)| whole);
    match room {
        0 => String::new(),
        _ if whole.trim().is_empty() => "…".to_owned(),
        _ => format!("{} …", whole.trim_end()),
    }
}

/// A name in at most so many characters. It keeps its end: that is where its number stands.
pub(super) fn shortened(name: &str, room: usize) -> String {
    let length = name.chars().count();
    if length <= room {
        return name.to_owned();
    }
    let Some(kept) = room.checked_sub(1) else { return String::new() };
    let number = name.chars().rev().take_while(|character| !character.is_whitespace()).count() + 1;
    let end = number.max(kept / 2).min(kept);
    let begin = name.chars().take(kept - end);
    begin.chain(['…']).chain(name.chars().skip(length - end)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_room_is_left_out_by_whole_words() {
        assert_eq!(fitted("sent 1234 times", 15), "sent 1234 times");
        assert_eq!(fitted("sent 1234 times", 14), "sent 1234 …");
        assert_eq!(fitted("sent 1234 times", 11), "sent 1234 …");
        assert_eq!(fitted("sent 1234 times", 10), "sent …");
        assert_eq!(fitted("sent 1234 times", 9), "sent …");
        assert_eq!(fitted("sent", 3), "…");
        assert_eq!(fitted("sent", 0), "");
    }

    #[test]
    fn a_name_keeps_its_number() {
        assert_eq!(shortened("conveyor belt 12", 16), "conveyor belt 12");
        assert_eq!(shortened("conveyor belt 12", 10), "conve…t 12");
        assert_eq!(shortened("conveyor belt 12", 6), "co… 12");
        assert_eq!(shortened("conveyor", 5), "…eyor");
        assert_eq!(shortened("a", 0), "");
    }
}
