//! One target of `drive_fire::fuzz`, by bytes that libFuzzer chooses as its coverage guides. `DRIVE_FIRE_TARGET` names the target: the
//! arguments are libFuzzer's.

#![no_main]

use std::{env, process, sync::LazyLock};

use drive_fire::fuzz::Target;
use libfuzzer_sys::fuzz_target;

static TARGET: LazyLock<Target> = LazyLock::new(|| {
    let named = env::var("DRIVE_FIRE_TARGET").ok().and_then(|name| Target::named(&name));
    named.unwrap_or_else(|| {
        eprintln!("DRIVE_FIRE_TARGET is to name one of {:?}", Target::ALL);
        process::exit(2)
    })
});

/// With the defect that `DRIVE_FIRE_PLANT` names, which is found by what is sound without it.
#[cfg(feature = "plants")]
fn execute(bytes: &[u8]) -> Result<(), String> {
    static PLANT: LazyLock<Option<&'static str>> =
        LazyLock::new(|| env::var("DRIVE_FIRE_PLANT").ok().map(|name| &*name.leak()));
    let planted = PLANT.map(|name| {
        let _chosen = drive_bus::mutants::choose(name);
        TARGET.execute_on(bytes)
    });
    let held = TARGET.execute_on(bytes);
    match (planted, held) {
        (Some(found), Ok(())) => found,
        (Some(_), Err(_)) => Ok(()),
        (None, held) => held,
    }
}

#[cfg(not(feature = "plants"))]
fn execute(bytes: &[u8]) -> Result<(), String> {
    TARGET.execute_on(bytes)
}

fuzz_target!(init: LazyLock::force(&TARGET), |bytes: &[u8]| {
    if let Err(why) = execute(bytes) {
        eprintln!("FOUND {why}");
        process::abort();
    }
});
