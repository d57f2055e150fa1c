//! What the manual of `drived` says of commands at a broker, asked of the program one by one: who may not, what is kept, late, old or
//! without a name moves no motor; a stop is taken whatever it looks like; whoever asks is answered, and nobody else is asked by that.

use std::{
    thread,
    time::{Duration, SystemTime},
};

use super::{
    broker::{Broker, Said, message, message_with},
    mqtt::{named, until},
    plant::Plant,
};

/// A command that may have been on its way for so long is late, and some calls of the daemon to itself more.
const LATE: Duration = Duration::from_millis(4_500);
/// More commands than anybody may give at once.
const FLOOD: u16 = 400;
/// A topic of the daemon's own, where an answer would be another command.
const OWN: &str = "drived/drive/pump_2/stop/desk";
const STOP: &str = "drived/drive/fan/stop/hmi";

type Promise = (&'static str, fn(&Plant) -> Result<(), String>);

/// All of them.
const PROMISES: [Promise; 13] = [
    ("what is kept moves nothing", |plant| {
        let broker = &plant.broker;
        is_refused(broker, "retained", |id| message_with(&to("desk"), start(id).as_bytes(), 1, &[]))
    }),
    ("who may stop starts nothing", |plant| {
        is_refused(&plant.broker, "", |id| message(&to("hmi"), start(id).as_bytes(), None))
    }),
    ("who says no name starts nothing", |plant| {
        is_refused(&plant.broker, "", |id| message("drived/drive/fan/command", start(id).as_bytes(), None))
    }),
    ("all together are stopped and nothing else", |plant| {
        is_refused(&plant.broker, "", |id| message("drived/all/command/desk", start(id).as_bytes(), None))
    }),
    ("what may come again has a name", |plant| {
        // What was asked before may be told meanwhile: that is a stop.
        let is_it =
            |said: &Said| said.topic.ends_with("/fan/outcome") && !said.text.contains("\"action\":\"stop\"");
        let first = in_time(|| {
            plant.broker.forget();
            plant.broker.give(&message("drived/drive/fan/set/frequency/desk", b"25", Some(7)));
            told(&plant.broker, is_it)
        })?;
        if first.text.contains("\"id_needed\"") { Ok(()) } else { Err(first.text) }
    }),
    ("what is old is not done", |plant| {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_millis();
        let old = |id: &str| setpoint(id, 20, &format!(", \"issued_unix_ms\": {}", now - 60_000));
        let first =
            in_time(|| first_answer(&plant.broker, |id| message(&to("desk"), old(id).as_bytes(), None)))?;
        if first.text.contains("\"expired\"") { Ok(()) } else { Err(first.text) }
    }),
    ("a stop that is kept is taken", |plant| {
        is_taken(&plant.broker, |id| message_with(STOP, named(id).as_bytes(), 1, &[]))
    }),
    ("whoever asks is answered, by the number of his question", |plant| {
        let id = super::mqtt::id();
        let properties = [b"\x08\x00\x0areply/fire\x09\x00".as_slice(), &[id.len() as u8], id.as_bytes()];
        plant.broker.give(&message_with(STOP, b"", 0, &properties.concat()));
        let is_it = |said: &Said| said.correlation.as_deref() == Some(id.as_bytes());
        told(&plant.broker, |said| said.topic == "reply/fire" && is_it(said))?;
        told(&plant.broker, |said| said.topic.ends_with("/fan/outcome") && is_it(said)).map(drop)
    }),
    ("no answer is a command", |plant| {
        plant.broker.forget();
        let properties = [b"\x08\x00".as_slice(), &[OWN.len() as u8], OWN.as_bytes()].concat();
        is_taken(&plant.broker, |id| message_with(STOP, named(id).as_bytes(), 0, &properties))?;
        wait(Duration::from_millis(300));
        let there = plant.broker.first(|said| said.topic == OWN);
        there.map_or(Ok(()), |said| Err(format!("{} on {}", said.text, said.topic)))
    }),
    ("the same command is done once", |plant| {
        let (one, other) = (super::mqtt::id(), super::mqtt::id());
        // Nothing is set while a stop is under way.
        until(|| is_taken(&plant.broker, by_the_desk).is_ok())
            .map_err(|()| "no setpoint is taken".to_owned())?;
        for (id, hertz) in [(&one, 20), (&other, 30), (&one, 20)] {
            plant.broker.forget();
            let asked = setpoint(id, hertz, ", \"expires_in_ms\": 9000");
            plant.broker.give(&message(&to("desk"), asked.as_bytes(), None));
            let last = told(&plant.broker, |said| is_of(said, id) && !said.text.contains("\"accepted\""))?;
            if !last.text.contains("\"confirmed\"") {
                return Err(format!("skipped: a setpoint that is not confirmed: {}", last.text));
            }
        }
        let fan = b"GET /api/v1/drives/fan HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
        let shown = plant.ask(plant.http, fan).map_err(|error| error.to_string())?;
        let shown = String::from_utf8_lossy(&shown).into_owned();
        let is_other = shown.contains("\"setpoint\":{\"frequency_hz\":30");
        if is_other { Ok(()) } else { Err(format!("another setpoint than 30 Hz: {shown}")) }
    }),
    ("a stop is taken in a flood", |plant| {
        let of_flood = message("drived/drive/pump_1/set/frequency/hmi", b"25", None);
        let flood: Vec<u8> = (0..FLOOD).flat_map(|_| of_flood.clone()).collect();
        is_taken(&plant.broker, |id| [flood, message(STOP, named(id).as_bytes(), None)].concat())
    }),
    ("what may be late moves nothing", |plant| {
        plant.broker.hold_echoes(true);
        wait(LATE);
        let asked = |id: &str| setpoint(id, 20, ", \"expires_in_ms\": 9000");
        let held = is_refused(&plant.broker, "late", |id| message(&to("desk"), asked(id).as_bytes(), None));
        plant.broker.hold_echoes(false);
        wait(Duration::from_secs(2));
        held
    }),
    ("who is there says so to a broker that was lost", |plant| {
        plant.broker.forget();
        plant.broker.lose();
        told(&plant.broker, |said| said.topic == "drived/status" && said.text == "online")?;
        until(|| plant.broker.has_daemon()).map_err(|()| "it does not come back".to_owned())
    }),
];

/// How many there are.
pub(super) const COUNT: u64 = PROMISES.len() as u64;

/// The one of this number is kept.
pub(super) fn is_kept(number: u64, plant: &Plant) -> Result<(), String> {
    let (name, holds) = PROMISES[(number % COUNT) as usize];
    until(|| plant.broker.has_daemon())
        .map_err(|()| "the daemon does not come back to its broker".to_owned())?;
    holds(plant).map_err(|why| match why.starts_with("skipped: ") {
        true => why,
        false => format!("{name}: {why}"),
    })?;
    plant.broker.wrong().map_or(Ok(()), Err)
}

#[allow(clippy::disallowed_methods, reason = "nothing asynchronous stands here")]
fn wait(time: Duration) {
    thread::sleep(time);
}

fn to(commander: &str) -> String {
    format!("drived/drive/fan/command/{commander}")
}

fn start(id: &str) -> String {
    format!(
        "{{\"id\": \"{id}\", \"action\": \"start\", \"direction\": \"forward\", \"setpoint\": {{\"frequency_hz\": 20}}}}"
    )
}

fn setpoint(id: &str, hertz: u16, more: &str) -> String {
    format!(
        "{{\"id\": \"{id}\", \"action\": \"setpoint\", \"setpoint\": {{\"frequency_hz\": {hertz}}}{more}}}"
    )
}

/// Whether it is the outcome of this command.
pub(super) fn is_of(said: &Said, id: &str) -> bool {
    said.topic.ends_with("/outcome") && said.text.contains(&format!("\"id\":\"{id}\""))
}

fn told(broker: &Broker, is_it: impl Fn(&Said) -> bool) -> Result<Said, String> {
    let mut found = None;
    let _ = until(|| {
        found = broker.first(&is_it);
        found.is_some()
    });
    found.ok_or_else(|| "nothing is told of it".to_owned())
}

/// What is told first of what is asked, which is asked again as long as that is that it is late: a machine that is starved brings what the
/// daemon says to itself back late, on a new connection nothing has come back yet, and that goes before all else that speaks
/// against a command.
fn in_time(asks: impl Fn() -> Result<Said, String>) -> Result<Said, String> {
    let mut first = None;
    let heard = until(|| {
        let said = asks();
        let is_late = said.as_ref().is_ok_and(|said| said.text.contains("\"late\""));
        first = Some(said);
        if is_late {
            // No flood: of that nothing is looked at.
            wait(Duration::from_millis(200));
        }
        !is_late
    });
    first.filter(|_| heard.is_ok()).unwrap_or_else(|| Err("skipped: whatever is asked is late".to_owned()))
}

/// What is told first of what is asked under this id.
pub(super) fn first_answer(broker: &Broker, asks: impl FnOnce(&str) -> Vec<u8>) -> Result<Said, String> {
    let id = super::mqtt::id();
    broker.give(&asks(&id));
    told(broker, |said| is_of(said, &id))
}

/// What is asked is refused, and why.
pub(super) fn is_refused(
    broker: &Broker,
    why: &str,
    asks: impl FnOnce(&str) -> Vec<u8>,
) -> Result<(), String> {
    let first = first_answer(broker, asks)?;
    if first.text.contains("\"refused\"") && first.text.contains(why) { Ok(()) } else { Err(first.text) }
}

/// What is asked is not refused.
pub(super) fn is_taken(broker: &Broker, asks: impl FnOnce(&str) -> Vec<u8>) -> Result<(), String> {
    let first = first_answer(broker, asks)?;
    let is_taken = ["\"accepted\"", "\"confirmed\""].iter().any(|word| first.text.contains(word));
    if is_taken { Ok(()) } else { Err(first.text) }
}

/// A setpoint for the fan, by whoever may give it.
pub(super) fn by_the_desk(id: &str) -> Vec<u8> {
    message(&to("desk"), setpoint(id, 25, ", \"expires_in_ms\": 9000").as_bytes(), None)
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    #[test]
    fn what_is_late_on_a_machine_that_is_starved_is_asked_again_and_anything_else_is_the_answer() {
        for reason in ["id_needed", "expired", "accepted"] {
            let asked = Cell::new(0);
            let first = in_time(|| {
                asked.set(asked.get() + 1);
                let word = if asked.get() < 3 { "late" } else { reason };
                Ok(Said {
                    topic: String::new(),
                    text: format!("{{\"reason\":\"{word}\"}}"),
                    correlation: None,
                })
            });
            assert!(first.is_ok_and(|said| said.text.contains(reason)), "{reason}");
            assert_eq!(asked.get(), 3);
        }
        let untold = in_time(|| Err("nothing is told of it".to_owned()));
        assert_eq!(untold.err().as_deref(), Some("nothing is told of it"));
    }
}
