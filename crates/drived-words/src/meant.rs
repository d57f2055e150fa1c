//! What a person meant who wrote nearly that: the nearest known word, and numbers in the spellings of other keyboards and habits.
//! Nothing is taken for something else where two things can be meant.

use std::fmt;

/// The known words that are spelt most like this one, if they are near enough to have been meant.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let word = word.to_lowercase();
    // A third of the letters may be wrong, and never more than three: two letters that are swapped are one mistake.
    let most = (word.chars().count() / 3).clamp(1, 3);
    let near = known.into_iter().filter_map(|candidate| {
        let away = strsim::damerau_levenshtein(&word, &candidate.to_lowercase());
        (away <= most).then_some((away, candidate))
    });
    let near: Vec<(usize, &str)> = near.collect();
    let least = near.iter().map(|(away, _)| *away).min();
    near.into_iter().filter(|(away, _)| Some(*away) == least).map(|(_, candidate)| candidate).collect()
}

/// What is asked behind a refusal: `: did you mean X or Y?`, or nothing.
pub fn did_you_mean(meant: &[impl fmt::Display]) -> String {
    let words: Vec<String> = meant.iter().map(ToString::to_string).collect();
    match &*words {
        [] => String::new(),
        [others @ .., last] if !others.is_empty() => {
            format!(": did you mean {} or {last}?", others.join(", "))
        }
        words => format!(": did you mean {}?", words.concat()),
    }
}

/// A decimal comma as a point: `4,5 s` is `4.5 s`. One before three digits may as well part thousands: that is no number here.
pub fn with_point(text: &str) -> Option<String> {
    let (before, behind) = text.split_once(',')?;
    let decimals = behind.find(|character: char| !character.is_ascii_digit()).unwrap_or(behind.len());
    let is_number = |digits: &str| !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    let is_one = is_number(before.trim_start_matches('-')) && (1..=2).contains(&decimals);
    (is_one && !behind.contains([',', '.'])).then(|| format!("{before}.{behind}"))
}

/// A speed as people say it: `19.2k`, `19k2`, `115200 baud`. `None` where it is none that serial lines have.
pub fn speed(text: &str) -> Option<u32> {
    const SPEEDS: [u32; 12] =
        [300, 600, 1_200, 2_400, 4_800, 9_600, 19_200, 38_400, 57_600, 76_800, 115_200, 230_400];
    let text = text.trim().to_ascii_lowercase();
    let number = ["bit/s", "bps", "bauds", "baud", "bd"].iter().find_map(|unit| text.strip_suffix(unit));
    let number = number.unwrap_or(&text).trim_end();
    let hundreds = match number.split_once('k') {
        Some((whole, "")) => match whole.split_once(['.', ',']) {
            Some((whole, tenth)) => tenths(whole, tenth),
            None => tenths(whole, ""),
        },
        Some((whole, tenth)) => tenths(whole, tenth),
        None => return number.parse().ok().filter(|speed| SPEEDS.contains(speed)),
    };
    hundreds.and_then(|hundreds| hundreds.checked_mul(100)).filter(|speed| SPEEDS.contains(speed))
}

/// Tenths from a whole number and at most one decimal.
fn tenths(whole: &str, tenth: &str) -> Option<u32> {
    let digit = match tenth.as_bytes() {
        [] => 0,
        [digit] if digit.is_ascii_digit() => u32::from(digit - b'0'),
        _ => return None,
    };
    whole.parse::<u32>().ok()?.checked_mul(10)?.checked_add(digit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_word_is_found_and_what_is_far_from_all_is_nobodys() {
        let known = ["status", "start", "stop", "setpoint"];
        assert_eq!(nearest("statsu", known), ["status"]);
        assert_eq!(nearest("STAUTS", known), ["status"]);
        assert_eq!(nearest("stp", known), ["stop"]);
        assert_eq!(nearest("fly", known), [""; 0]);
        // One letter too many, or two that are swapped: nobody can know.
        let near = nearest("atv321", ["atv21", "atv28", "atv312"]);
        assert_eq!(did_you_mean(&near), ": did you mean atv21 or atv312?");
        assert_eq!(did_you_mean(&["stop"]), ": did you mean stop?");
    }

    #[test]
    fn a_comma_is_a_point_where_it_cannot_part_thousands() {
        for (text, point) in
            [("4,5", "4.5"), ("30,5Hz", "30.5Hz"), ("47,55 Hz", "47.55 Hz"), ("-4,5", "-4.5")]
        {
            assert_eq!(with_point(text).as_deref(), Some(point));
        }
        for text in ["1,500", "1,500rpm", "4.5", "4,5,6", "1,2.3", ",5", "4,", "a,5"] {
            assert_eq!(with_point(text), None, "{text}");
        }
    }

    #[test]
    fn speeds_are_understood_as_people_say_them() {
        for (text, baud) in [
            ("19.2k", 19_200),
            ("19,2K", 19_200),
            ("19k2", 19_200),
            ("9k6", 9_600),
            ("115.2k", 115_200),
            ("38400 baud", 38_400),
            ("9600bps", 9_600),
        ] {
            assert_eq!(speed(text), Some(baud), "{text}");
        }
        for text in ["19k", "19.25k", "fast", "", "k", "99999999999k", "1.2.3k"] {
            assert_eq!(speed(text), None, "{text}");
        }
    }
}
