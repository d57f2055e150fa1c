//! What the manual wants to hold among registers, for one that is written alone: the rule of a restore.

use drive_core::{Capabilities, Row, registers::Change};

use super::restore::Way;
use drived_words::failure::Failure;

/// Refuses a word that would leave the drive with what its manual forbids, by what the related registers hold. What cannot be read
/// forbids nothing.
pub(super) async fn held(
    capabilities: &'static Capabilities,
    row: &'static Row,
    word: u16,
    mut read: impl AsyncFnMut(&'static Row) -> Option<u16>,
) -> Result<(), Failure> {
    let mut way = Way::of(capabilities, std::iter::empty());
    let related = way.related(&[row.address]);
    if related.is_empty() {
        return Ok(());
    }
    for row in related.into_iter().chain([row]) {
        if let Some(word) = read(row).await {
            way.hold(row.place(), word);
        }
    }
    let held = way.word(row.place()).unwrap_or(word);
    match way.would_break(&Change { row, held, wanted: word }) {
        Some(why) => Err(Failure::Input(format!(
            "{} {}: the drive would be left with {why}; nothing was written",
            row.code,
            way.text(row, word)
        ))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use drive_families::{Family, SetUp};

    use super::*;
    use crate::commands::param::{source::Source, testing::Bench};

    /// bEn ≤ LSP ≤ HSP ≤ tFr (BBV51701 p. 27, 47): HSP of 50 Hz and tFr of 60 Hz as the drive leaves the factory.
    #[tokio::test(start_paused = true)]
    async fn a_limit_that_passes_another_is_refused_as_a_restore_refuses_it() {
        let mut bench = Bench::of(Family::ATV312, SetUp::ForTheBus);
        let Source::OnLine(one) = &mut bench.source else { panic!("it is on a line") };
        let capabilities = one.drive.capabilities();
        for (code, word, allowed) in [
            ("HSP", 700, false),
            ("HSP", 600, true),
            ("LSP", 510, false),
            ("LSP", 450, true),
            ("ACC", 700, true),
        ] {
            let row = Row::find(capabilities.rows, code).unwrap();
            let held =
                held(capabilities, row, word, async |row| one.drive.read_parameter(row).await.ok()).await;
            assert_eq!(held.is_ok(), allowed, "{code} {word}: {held:?}");
            if let Err(failure) = held {
                let told = failure.to_string();
                assert!(told.contains("LSP ≤ HSP ≤ tFr") && told.contains("nothing was written"), "{told}");
            }
        }
    }
}
