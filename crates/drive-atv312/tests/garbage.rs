//! A drive that answers any word to anything: nothing panics, and nothing is written that the manual does not know.

use std::time::Duration;

use drive_atv312::{Atv312, CAPABILITIES, ROWS};
use drive_core::{Direction, Drive, Frequency, Reaction, Setpoint, Speed, StopMode};
use drive_testing::{babble::Babble, bench};

/// Words that are plausible somewhere, so that the ladder is climbed and not only refused.
const PLAUSIBLE: &[u16] = &[0x0240, 0x0221, 0x0223, 0x0227, 0x0227, 0x4000, 0, 0, 0, 1, 2, 0x0008];

#[tokio::test]
async fn whatever_the_drive_says_nothing_panics_and_only_the_manuals_control_words_are_written() {
    /// BBV51701 p. 10 and 12.
    const ALLOWED: [u16; 10] =
        [0x0000, 0x0002, 0x0006, 0x0007, 0x000F, 0x080F, 0x0080, 0x100F, 0x200F, 0x400F];
    let mut written = [false; ALLOWED.len()];
    for seed in 0..3_000 {
        let mut drive = Atv312::new(Babble::new(&CAPABILITIES, PLAUSIBLE, seed), bench::address(1));
        let _ = drive.status().await;
        let _ = drive.measurements().await;
        let _ = drive.faults().await;
        let _ = drive.past_faults().await;
        let _ = drive.identify().await;
        let _ = drive.set_setpoint(Setpoint::Frequency(Frequency::from_hertz(25))).await;
        let _ = drive.set_setpoint(Setpoint::Speed(Speed::from_rpm(100))).await;
        for direction in [Direction::Forward, Direction::Reverse] {
            let _ = drive.start(direction).await;
        }
        for mode in StopMode::ALL {
            let _ = drive.stop(mode).await;
        }
        let _ = drive.reset_faults().await;
        let _ = drive.watchdog().await;
        let _ = drive.arm_watchdog(Duration::from_secs(1), Reaction::Ramp).await;
        let _ = drive.set_up_bus_control().await;
        let _ = drive.release().await;
        for row in ROWS.iter().filter(|row| row.code != "CMD").step_by(7) {
            let _ = drive.write_parameter(row, 1).await;
        }
        let _ = drive.persist().await;
        for command in drive.into_port().written(8501) {
            let index = ALLOWED.iter().position(|&word| word == command);
            written[index.unwrap_or_else(|| panic!("{command:04X}h was written"))] = true;
        }
    }
    assert_eq!(written, [true; ALLOWED.len()], "each of them is in use");
}
