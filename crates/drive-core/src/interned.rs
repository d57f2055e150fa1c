//! What is known only at run time, for as long as the program lives: the tables of a family that was read from a file.
//!
//! The tables of a family are `'static`, because those that are built in are constants and everything copies them freely. One from a
//! file gets the same by these: each content is kept **once**, however often the file is read again, so that what they hold is bounded
//! by what was ever different. Nothing is freed before the program ends.

use std::{
    any::{Any, TypeId},
    collections::{HashMap, HashSet},
    hash::Hash,
    sync::{LazyLock, Mutex, PoisonError},
};

/// The contents of each type.
static KEPT: LazyLock<Mutex<HashMap<TypeId, Box<dyn Any + Send>>>> = LazyLock::new(Mutex::default);

/// The same text for the life of the program, kept once.
///
/// ```
/// use drive_core::interned;
///
/// let read = String::from("Somebody's fan drive");
/// let kept: &'static str = interned::text(&read);
/// assert!(std::ptr::eq(kept, interned::text("Somebody's fan drive")));
/// ```
#[must_use]
pub fn text(text: &str) -> &'static str {
    keep(text, |text| Box::leak(text.into()))
}

/// The same list for the life of the program, kept once: [`Row`](crate::Row)s, [`Choice`](crate::registers::Choice)s,
/// [`FaultEntry`](crate::FaultEntry)s, numbers.
///
/// ```
/// use drive_core::{interned, registers::Choice};
///
/// let read = vec![Choice::new(0, interned::text("no"), interned::text("not assigned"))];
/// let kept: &'static [Choice] = interned::list(&read);
/// assert!(std::ptr::eq(kept, interned::list(&read)));
/// ```
#[must_use]
pub fn list<T: Copy + Eq + Hash + Send + Sync + 'static>(list: &[T]) -> &'static [T] {
    keep(list, |list| Box::leak(list.into()))
}

/// The same value for the life of the program, kept once: a family's [`Capabilities`](crate::Capabilities).
///
/// ```
/// use drive_core::{Capabilities, interned};
///
/// let read = String::from("fan1");
/// let kept: &'static Capabilities =
///     interned::one(Capabilities::least(interned::text(&read), "Somebody's fan drive"));
/// assert_eq!(kept.key, "fan1");
/// ```
#[must_use]
pub fn one<T: Copy + Eq + Hash + Send + Sync + 'static>(value: T) -> &'static T {
    keep(&value, |value| Box::leak(Box::new(*value)))
}

/// A panic elsewhere leaves a set whole: it is changed by one insertion.
fn keep<T: ?Sized + Eq + Hash + Sync + 'static>(content: &T, leak: fn(&T) -> &'static T) -> &'static T {
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let of_type = TypeId::of::<&'static T>();
    let all = kept.entry(of_type).or_insert_with(|| Box::new(HashSet::<&'static T>::new()));
    // What stands at a type is of this type.
    let Some(all) = all.downcast_mut::<HashSet<&'static T>>() else { return leak(content) };
    match all.get(content) {
        Some(content) => content,
        None => {
            let content = leak(content);
            all.insert(content);
            content
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Capabilities, Row,
        access::Access,
        registers::{Choice, Confidence, Factory, Range, Space, Storage, Unit},
    };

    /// A family's tables as somebody's file says them.
    fn read(meaning: &str) -> &'static Capabilities {
        let choices = list(&[Choice::new(1, text("on"), text(meaning))]);
        let row = Row {
            space: Space::HoldingRegister,
            address: 9,
            code: text(&format!("{}FR", "C")),
            name: text("fan command"),
            access: Access::ReadWrite,
            storage: Storage::Volatile,
            unit: Unit::CODE,
            range: Range::OneOf(choices),
            factory: Factory::None,
            confidence: Confidence::Manual,
            source: text("its manual, p. 3"),
        };
        one(Capabilities { rows: list(&[row]), ..Capabilities::least(text("fan9"), text("A fan")) })
    }

    #[test]
    fn a_file_that_is_read_again_costs_nothing_and_a_change_is_another_content() {
        let first = read("the fan turns");
        assert!(std::ptr::eq(first, read("the fan turns")));
        let other = read("the fan runs");
        assert!(!std::ptr::eq(first, other));
        let [row] = other.rows else { panic!("there is one") };
        assert_eq!(row.range.choices()[0].meaning, "the fan runs");
        assert_eq!(first.rows[0].range.choices()[0].meaning, "the fan turns");
    }

    #[test]
    fn contents_of_different_types_never_meet() {
        assert_eq!(list(&[1_u16, 2]), [1, 2]);
        assert_eq!(list(&[1_u8, 2]), [1, 2]);
        assert_eq!((*one(7_u16), *one(7_u32)), (7, 7));
        assert!(list::<Row>(&[]).is_empty() && text("").is_empty());
    }

    #[test]
    fn all_threads_get_the_same() {
        let kept: Vec<_> = (0..8).map(|_| std::thread::spawn(|| read("at once"))).collect();
        let kept: Vec<_> = kept.into_iter().map(|thread| thread.join().unwrap()).collect();
        assert!(kept.iter().all(|one| std::ptr::eq(*one, kept[0])));
    }
}
