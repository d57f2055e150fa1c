//! The page tells every fault of the manuals in French, too.

use drive_core::FaultEntry;

#[test]
fn every_fault_and_alarm_of_every_family_has_its_french_text_on_the_page() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/drived/src/page/web/faults_fr.js");
    let french = std::fs::read_to_string(path).expect("it is read").replace("\\'", "'");
    let tables: [&[FaultEntry]; 8] = [
        drive_atv21::FAULTS,
        drive_atv21::ALARMS,
        drive_atv28::FAULTS,
        drive_atv28::WARNINGS,
        drive_atv312::FAULTS,
        drive_atv312::WARNINGS,
        drive_3g3ev::FAULTS,
        drive_3g3ev::WARNINGS,
    ];
    for entry in tables.concat() {
        for text in [entry.meaning, entry.remedy] {
            assert!(french.contains(&format!("  '{text}': '")), "{}: {text}", entry.mnemonic);
        }
    }
}
