//! What only this family has, on a drive that answers any word to anything: nothing panics, and nothing is written that
//! the manual does not know. What all families have is asked so in the workspace's own tests.

use drive_atv312::{Atv312, CAPABILITIES};
use drive_core::{Direction, Drive, Percent, StopMode};
use drive_testing::{babble::Babble, bench};

/// Words that are plausible somewhere, so that the ladder is climbed and not only refused.
const PLAUSIBLE: &[u16] = &[0x0240, 0x0221, 0x0223, 0x0227, 0x0227, 0x4000, 0, 0, 0, 1, 2, 0x0008];

#[tokio::test(start_paused = true)]
async fn whatever_the_drive_says_setting_it_up_writes_no_other_control_words_than_the_manuals() {
    /// BBV51701 p. 10 and 12. The bits above are the drive's own, where it has given them a function.
    const ALLOWED: [u16; 6] = [0x0000, 0x0002, 0x0006, 0x0007, 0x000F, 0x0080];
    for seed in 0..3_000 {
        let mut drive = Atv312::new(Babble::new(&CAPABILITIES, PLAUSIBLE, seed), bench::address(1));
        let _ = drive.past_faults().await;
        let _ = drive.error_code().await;
        let _ = drive.set_up_bus_control().await;
        let _ = drive.start(Direction::Reverse).await;
        for mode in StopMode::ALL {
            let _ = drive.stop(mode).await;
        }
        let _ = drive.release().await;
        for command in drive.into_port().written(8501) {
            assert!(ALLOWED.contains(&(command & 0x07FF)), "{command:04X}h was written");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_torque_of_which_the_sign_is_not_printed_is_left_raw() {
    let mut kinds = [false; 2];
    for seed in 0..100 {
        let mut drive = Atv312::new(Babble::new(&CAPABILITIES, &[], seed), bench::address(1));
        let measured = drive.measurements().await.unwrap();
        let word = measured.raw.iter().find(|word| word.address == 3205).unwrap().value;
        let shown = i16::try_from(word).ok().map(Percent::from_percent);
        assert_eq!(measured.torque, shown, "{word:04X}h");
        kinds[usize::from(shown.is_some())] = true;
    }
    assert_eq!(kinds, [true; 2]);
}
