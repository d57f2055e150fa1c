//! Two drives that are written by hand, as files as well: over the simulators of the first, in the worlds around them. Judged by shaft,
//! twin and manual, the file says nothing that is not so; and where it sees less than what is written by hand, that is printed.

use std::{collections::BTreeMap, sync::Arc};

use drive_core::Row;
use drive_families::{Family, Options, SetUp};
use drive_profile::{Level, Profile, definition, read};
use drive_sim::SimSlave;
use drive_testing::{
    Contract,
    worlds::{Configuration, Event, Judge, Share, Surrounded, Tally, Values},
};
use support::{configurations::Around, contracts::contract};

const ATV312: &str = include_str!("profiles/atv312.toml");
const OMRON: &str = include_str!("profiles/3g3ev.toml");

fn profile(text: &str) -> Profile {
    read(text).unwrap_or_else(|refusals| panic!("{refusals}"))
}

/// The configurations of a family, each opened by a file.
struct ByFile {
    by_hand: Around,
    file: Family,
    options: Options,
}

impl Surrounded for ByFile {
    fn configurations(&self) -> Vec<Configuration> {
        let opened = |configuration: Configuration| {
            let (file, options) = (self.file, self.options.clone());
            let open = Box::new(move |port, slave| file.open_with(port, slave, &options));
            Configuration { open, ..configuration }
        };
        self.by_hand.configurations().into_iter().map(opened).collect()
    }

    fn other_masters(&self) -> Vec<Event> {
        self.by_hand.other_masters()
    }

    fn judge(&self, machine: &SimSlave) -> Option<Box<dyn Judge>> {
        self.by_hand.judge(machine)
    }

    fn parameter(&self) -> Option<(&'static str, u16)> {
        self.by_hand.parameter()
    }

    fn values_of(&self, row: &Row) -> Option<Values> {
        self.by_hand.values_of(row)
    }
}

fn share() -> Share {
    Share::one_in(std::env::var("DRIVED_ONE_IN").ok().and_then(|text| text.parse().ok()).unwrap_or(97))
}

/// What each order came to, by order and outcome.
fn outcomes(tally: &Tally) -> BTreeMap<(String, String), usize> {
    tally
        .outcomes
        .iter()
        .map(|((order, outcome), times)| ((order.clone(), outcome.to_string()), *times))
        .collect()
}

/// Whether what contradicts a twin was seen when that had tripped by its watchdog.
fn told_by_a_lost_twin(said: &str, trip: u16) -> bool {
    let twin = said.split("the twin ").nth(1);
    twin.is_some_and(|twin| twin.contains(&format!("trip: Some({trip})")))
}

/// Lives in the worlds of a family by hand and by file, and prints where the two come to something else.
async fn compare(family: Family, text: &str, options: &[(&str, &str)], watchdog: Option<u16>) {
    let profile = profile(text);
    assert_eq!(profile.level(), Level::Motion, "{:#?}", profile.gaps());
    let file = Family::new(definition(&Arc::new(profile)));
    file.exchange().expect("no other has its name");
    let mut said = Options::default();
    for (name, value) in options {
        said.set(name, value).expect("it is an option of a file");
    }
    let by_hand = contract(family).live_in_worlds(share()).await;
    let around = ByFile { by_hand: Around(family), file, options: said.clone() };
    let by_file = Contract {
        around: Some(Box::new(around)),
        trip: Some(support::drives::a_trip(family)),
        watchdog_trips: support::drives::communication_trips(family),
        ..Contract::new(
            file.capabilities(),
            move |port, slave| file.open_with(port, slave, &said),
            move || support::drives::machine(family),
        )
    };
    let by_file = by_file.live_in_worlds(share()).await;
    println!("{family}, {} worlds by hand and {} by file", by_hand.lived, by_file.lived);
    let (hand, filed) = (outcomes(&by_hand), outcomes(&by_file));
    let all: std::collections::BTreeSet<_> = hand.keys().chain(filed.keys()).collect();
    for key @ (order, outcome) in all {
        let (hand, filed) = (hand.get(key).copied().unwrap_or(0), filed.get(key).copied().unwrap_or(0));
        if hand != filed {
            println!("  {order} ends {outcome}: {hand} by hand, {filed} by file");
        }
    }
    assert!(by_hand.contradictions.is_empty(), "by hand:\n{}", by_hand.contradictions.join("\n"));
    // A twin that nobody asks while a stop is waited for may have tripped by its own watchdog, and tells nothing then.
    let (lost, said): (Vec<_>, Vec<_>) = by_file
        .contradictions
        .iter()
        .partition(|said| watchdog.is_some_and(|trip| told_by_a_lost_twin(said, trip)));
    lost.iter().for_each(|said| println!("  set aside: {said}"));
    assert!(said.is_empty(), "by file:\n{}", said.into_iter().cloned().collect::<Vec<_>>().join("\n"));
}

/// Both files, each over the simulated drive that is made of the file itself, which is what `drived sim` and a trial on it show of it. The
/// other tests here have the simulators of the drives that are written by hand.
#[tokio::test(start_paused = true)]
async fn a_file_drives_the_twin_that_is_made_of_it() {
    for text in [ATV312, OMRON] {
        let file = Family::new(definition(&Arc::new(profile(text))));
        let said = file.simulated_options();
        let own = Contract::new(
            file.capabilities(),
            move |port, slave| file.open_with(port, slave, &said),
            move || file.machine(SetUp::ForTheBus).expect("it has a twin"),
        );
        own.lives_the_story().await;
    }
}

#[tokio::test(start_paused = true)]
async fn an_altivar_312_from_a_file_says_nothing_that_is_not_so() {
    compare(Family::ATV312, ATV312, &[("commands-alone", "yes")], None).await;
}

#[tokio::test(start_paused = true)]
async fn a_3g3ev_from_a_file_says_nothing_that_is_not_so() {
    compare(Family::OMRON_3G3EV, OMRON, &[("highest", "50Hz"), ("commands-alone", "yes")], Some(14)).await;
}
