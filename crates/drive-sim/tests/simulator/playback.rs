//! A slave that plays a recording back.

use std::{
    sync::{Arc, Mutex},
    time::Duration,
};

use drive_core::SerialSettings;
use drive_sim::{Playback, Played, Says, SimLine, Wiring};
use tokio::time::Instant;

use crate::support::{ask, frame, read};

const PATIENCE: Duration = Duration::from_millis(500);
const MS: Duration = Duration::from_millis(1);

fn says(after: u32, pdu: &[u8]) -> Played {
    Played { after: MS * after, says: Says::Message(pdu.to_vec()) }
}

#[tokio::test(start_paused = true)]
async fn a_recording_answers_the_same_request_as_it_did_in_its_order_and_its_times() {
    let (first, second) = (read(2, 1, 1), read(2, 2, 1));
    let pdu = |request: &[u8]| request[1..request.len() - 2].to_vec();
    let damaged = vec![2, 3, 2, 0, 8, 0xBA, 0xD0];
    let recorded = [
        (pdu(&first), says(20, &[3, 2, 0, 7])),
        (pdu(&second), says(5, &[0x83, 2])),
        (pdu(&first), Played { after: MS * 40, says: Says::Nothing }),
        (pdu(&first), Played { after: 6 * MS, says: Says::Characters(damaged.clone()) }),
    ];
    let unknown: Arc<Mutex<Vec<Vec<u8>>>> = Arc::default();
    let told = Arc::clone(&unknown);
    let playback = Playback::new(recorded, move |request| told.lock().unwrap().push(request.to_vec()));
    let line = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    let slave = line.add(2, playback).unwrap();
    let mut port = line.in_memory();

    let answers = [
        (&first, Some((20, frame(&[2, 3, 2, 0, 7])))),
        (&second, Some((5, frame(&[2, 0x83, 2])))),
        (&second, Some((5, frame(&[2, 0x83, 2])))),
        (&first, None),
        (&first, Some((6, damaged))),
        // Behind the last the first comes again.
        (&first, Some((20, frame(&[2, 3, 2, 0, 7])))),
    ];
    for (request, expected) in answers {
        tokio::time::sleep(5 * MS).await;
        let began = Instant::now();
        let answer = ask(&mut port, request, PATIENCE).await;
        assert_eq!(answer, expected.as_ref().map(|(_, bytes)| bytes.clone()));
        if let Some((after, bytes)) = expected {
            let characters = SerialSettings::MODBUS_DEFAULT.characters(request.len() + bytes.len());
            let exact = characters + MS * after;
            assert!(
                (exact..exact + MS).contains(&began.elapsed()),
                "{:?} and not {exact:?}",
                began.elapsed()
            );
        }
    }
    assert_eq!(*unknown.lock().unwrap(), [[0; 0]; 0], "all of it was recorded");
    assert_eq!(ask(&mut port, &read(2, 9, 1), PATIENCE).await, None);
    assert_eq!(*unknown.lock().unwrap(), [vec![3, 0, 9, 0, 1]]);
    assert_eq!(slave.requests(3), 7);
}
