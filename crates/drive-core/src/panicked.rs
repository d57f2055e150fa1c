//! What somebody else's code says when it panics: words for an error, never a reason to end.

use std::any::Any;

/// How much of it is kept, in characters.
const KEPT: usize = 200;

/// What a panic says of itself, as far as it is words, and no more of it than an error has room for.
///
/// ```
/// let panic = std::panic::catch_unwind(|| panic!("no such register")).unwrap_err();
/// assert_eq!(drive_core::panic_said(&*panic), "no such register");
/// ```
#[must_use]
pub fn panic_said(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied().or(panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("it does not say why").chars().take(KEPT).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_panic_says_is_cut_and_one_without_words_is_told_as_such() {
        assert_eq!(panic_said(&"ä".repeat(1_000)), "ä".repeat(KEPT));
        assert_eq!(panic_said(&7_u8), "it does not say why");
    }
}
