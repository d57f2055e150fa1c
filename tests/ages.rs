//! A value is as old as the request that brought it: it may be younger, and never older than is said.

use drive_families::Family;
use support::contracts::contract;
use tokio::time::Instant;

#[tokio::test(start_paused = true)]
async fn a_status_of_several_exchanges_is_as_old_as_the_first_of_them() {
    let mut of_several = 0;
    for family in Family::BUILT_IN {
        let mut rig = contract(family).rig();
        // What is read once, such as the unit of its frequencies, is no part of the picture.
        let _ = rig.drive.status().await;
        let called = Instant::now();
        let status = rig.drive.status().await.unwrap_or_else(|error| panic!("{family}: {error}"));
        let asked: Vec<Instant> =
            rig.machine.received().iter().map(|request| request.at).filter(|at| *at >= called).collect();
        let at = status.at.unwrap_or_else(|| panic!("{family}: the line keeps the time"));
        assert!(at >= called, "{family}: older than its own call");
        assert!(
            at <= asked[0],
            "{family}: told younger than what the drive had when it heard the first request"
        );
        of_several += usize::from(asked.len() > 1);
    }
    assert!(of_several >= 2, "{of_several} families take several exchanges");
}
