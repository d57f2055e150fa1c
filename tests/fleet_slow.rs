//! Long readings on a line that never leaves them the time for all of their exchanges at once: they go on where they were cut.

use std::time::Duration;

use drive_families::Family;
use drive_fleet::Periods;
use support::plant::{Plant, Site, common_settings, controlled};
use tokio::time::{Instant, timeout};

const MS: Duration = Duration::from_millis(1);

/// So many turns are more than any family has exchanges in its slow set; one comes at the latest when a status is old.
const BOUND: Duration = Duration::from_secs(60);

#[tokio::test(start_paused = true)]
async fn measurements_that_are_cut_at_every_turn_are_whole_within_as_many_turns_as_they_have_exchanges() {
    // A third of the oldest age is less than the exchanges of an Altivar 21 take, alone or beside others.
    let alone =
        Periods { running: 150 * MS, rest: 200 * MS, slow: Duration::from_secs(1), max_age: 450 * MS };
    let beside = Periods { running: 300 * MS, rest: 400 * MS, max_age: 900 * MS, ..alone };
    for (periods, families) in
        [(alone, &[Family::ATV21][..]), (beside, &[Family::ATV21, Family::ATV312, Family::OMRON_3G3EV])]
    {
        let member = |(family, address): (&Family, u8)| {
            let mut settings = controlled(*family, &format!("{family} {address}"));
            (settings.periods, settings.watchdog) = (periods, None);
            (*family, address, settings)
        };
        let members: Vec<_> = families.iter().zip(1..).map(member).collect();
        let names: Vec<String> = members.iter().map(|(.., settings)| settings.name.clone()).collect();
        let site = Site::new(common_settings(), members);
        let began = Instant::now();
        let plant = Plant::open_whatever_the_plan(vec![site]).expect("it is built");
        for name in &names {
            let drive = plant.drive(name);
            let measured = drive.wait_until(|snapshot| snapshot.measurements.is_some());
            let snapshot = timeout(BOUND, measured).await.unwrap_or_else(|_| panic!("{name}: never whole"));
            let measured = snapshot.measurements.as_ref().expect("they are there");
            assert!(
                measured.at >= began,
                "{name}: as old as the first of its exchanges, which was asked for here"
            );
            assert!(!measured.value.raw.is_empty(), "{name}: {:?}", measured.value);
        }
    }
}
