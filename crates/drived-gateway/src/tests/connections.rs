//! What several connections of one SCADA carry, over sockets and in real time: what a cable held back comes when its kernel sends it again.

use std::{sync::Arc, time::Duration};

use tokio::{
    io::AsyncWriteExt as _,
    net::{TcpListener, TcpStream},
    sync::watch,
    time::sleep,
};

use super::{
    Peer,
    writing::{CMD, LFR, climb, operated, write, write_two},
};
use crate::{accept_all, clients::Course, config::GatewayConfig, desk::Desk};
use drived_doors::{Role, audit::Audit};

/// An open door.
struct Door {
    at: std::net::SocketAddr,
    _end: watch::Sender<bool>,
}

impl Door {
    async fn of(desk: &Arc<Desk>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let at = listener.local_addr().unwrap();
        let (_end, ended) = watch::channel(false);
        let desk = Arc::clone(desk);
        tokio::spawn(async move { accept_all(&listener, &desk, ended).await });
        Self { at, _end }
    }

    /// One who has been let in: the answer to a first question shows that.
    async fn connect(&self) -> Peer<TcpStream> {
        let mut peer = Peer::over(TcpStream::connect(self.at).await.unwrap());
        assert_eq!(peer.ask(1, &write(400, 0)).await, [0x86, 0x04], "a register that is none of a 312");
        peer
    }
}

const RUN: u16 = 0x000F;

/// The kernel of a SCADA sends again what was written on a connection, up to minutes later and behind what came on a newer one.
#[tokio::test]
async fn a_run_command_of_a_connection_that_is_older_than_a_stop_on_another_one_starts_nothing() {
    let (plant, desk) = operated(1, |_| {}).await;
    let door = Door::of(&desk).await;
    let runs = || plant.machines[0].observe().running;
    let mut old = door.connect().await;
    climb(&mut old, 1).await;
    assert_eq!(old.ask(1, &write(LFR, 300)).await, write(LFR, 300));
    let mut new = door.connect().await;
    assert_eq!(new.ask(1, &write(CMD, 0)).await, write(CMD, 0));
    assert_eq!(old.ask(1, &write(CMD, RUN)).await, [0x86, 0x04]);
    assert_eq!(old.ask(1, &write_two(CMD, [RUN, 300])).await, [0x90, 0x04]);
    assert!(!runs(), "it was written before the stop, for all that anybody knows");
    climb(&mut new, 1).await;
    assert_eq!(
        old.ask(1, &write(CMD, RUN)).await,
        [0x86, 0x04],
        "the ladder of the newer one is none of its own"
    );
    assert_eq!(new.ask(1, &write(CMD, RUN)).await, write(CMD, RUN), "and what is old does not unsay it");
    assert!(runs());
    // It would turn the motor round, which somebody has started since.
    assert_eq!(old.ask(1, &write(CMD, 0x080F)).await, [0x86, 0x04]);
    assert!(plant.machines[0].observe().output_frequency >= 0);
    assert_eq!(new.ask(1, &write(CMD, 0)).await, write(CMD, 0));
    climb(&mut old, 1).await;
    assert_eq!(
        old.ask(1, &write(CMD, RUN)).await,
        write(CMD, RUN),
        "its own word without run makes it a new one"
    );
    assert!(runs());
}

/// It goes on by the connection that it had before, and stops there.
#[tokio::test]
async fn a_run_command_of_a_newer_connection_that_was_there_before_the_stop_starts_nothing_either() {
    let (plant, desk) = operated(1, |_| {}).await;
    let door = Door::of(&desk).await;
    let (mut first, mut second) = (door.connect().await, door.connect().await);
    climb(&mut second, 1).await;
    assert_eq!(first.ask(1, &write(CMD, 0)).await, write(CMD, 0));
    assert_eq!(second.ask(1, &write(CMD, RUN)).await, [0x86, 0x04]);
    assert!(!plant.machines[0].observe().running);
}

#[tokio::test]
async fn a_scada_that_opens_a_connection_for_each_write_starts_and_stops_its_motor() {
    let (plant, desk) = operated(1, |_| {}).await;
    let door = Door::of(&desk).await;
    for _ in 0..2 {
        for (register, word) in [(CMD, 0), (CMD, 0x0006), (CMD, 0x0007), (LFR, 300), (CMD, RUN)] {
            let answer = door.connect().await.ask(1, &write(register, word)).await;
            assert_eq!(answer, write(register, word));
        }
        assert!(plant.machines[0].observe().running);
        assert_eq!(door.connect().await.ask(1, &write(CMD, 0)).await, write(CMD, 0));
        assert!(!plant.machines[0].observe().running);
    }
}

/// Nobody is there who could hear that the motor runs.
#[tokio::test]
async fn of_a_client_that_has_closed_its_side_a_stop_is_carried_out_and_nothing_else() {
    let (plant, desk) = operated(1, |_| {}).await;
    let door = Door::of(&desk).await;
    let mut scada = door.connect().await;
    climb(&mut scada, 1).await;
    for pdu in [write(CMD, RUN), write(LFR, 300), write_two(CMD, [RUN, 300])] {
        let mut gone = door.connect().await;
        gone.send(1, &pdu).await;
        gone.stream.shutdown().await.unwrap();
        assert_eq!(gone.answer().await.1, [pdu[0] | 0x80, 0x04], "{pdu:02X?}");
        assert!(gone.is_ended().await);
    }
    assert_eq!(plant.machines[0].peek(LFR), Some(0));
    assert!(!plant.machines[0].observe().running);
    assert_eq!(scada.ask(1, &write_two(CMD, [RUN, 300])).await[0], 0x10);
    assert!(plant.machines[0].observe().running);
    let mut gone = door.connect().await;
    gone.send(1, &write(CMD, 0)).await;
    gone.stream.shutdown().await.unwrap();
    assert_eq!(gone.answer().await.1, write(CMD, 0));
    assert!(!plant.machines[0].observe().running);
}

/// It was sent behind the run command, was held back as that was, and comes once that is confirmed.
#[tokio::test(start_paused = true)]
async fn a_run_command_behind_which_the_end_of_its_connection_comes_in_a_moment_starts_nothing() {
    let (plant, desk) = operated(1, |_| {}).await;
    let mut scada = Peer::of(&desk);
    climb(&mut scada, 1).await;
    scada.send(1, &write(CMD, RUN)).await;
    sleep(Duration::from_millis(45)).await;
    scada.stream.shutdown().await.unwrap();
    assert_eq!(scada.answer().await.1, [0x86, 0x04]);
    assert!(!plant.machines[0].observe().running);
}

/// A stop is a stop for all: whoever has written before it, on whatever gateway, has to say again that he means it.
#[tokio::test(start_paused = true)]
async fn a_word_without_run_of_any_client_of_any_gateway_goes_before_what_an_older_connection_carries() {
    let (plant, _) = operated(1, |_| {}).await;
    let course = Course::default();
    let desk = |name: &str| {
        let config =
            GatewayConfig { name: name.to_owned(), rights: Role::Operate.rights(), ..super::config() };
        Desk::new(&course, config, plant.plant.clone(), Audit::default(), super::names(&plant))
    };
    let (one, other) = (desk("one"), desk("other"));
    let stranger = "10.0.0.9".parse().unwrap();
    for mut stopping in [Peer::of(&other), Peer::at(&one, stranger), Peer::at(&other, stranger)] {
        let mut scada = Peer::of(&one);
        climb(&mut scada, 1).await;
        for word in [0x0006, 0] {
            assert_eq!(stopping.ask(1, &write(CMD, word)).await, write(CMD, word));
            assert_eq!(scada.ask(1, &write(CMD, RUN)).await, [0x86, 0x04], "behind {word:04X}h");
        }
        assert!(!plant.machines[0].observe().running);
        climb(&mut scada, 1).await;
        assert_eq!(scada.ask(1, &write(CMD, RUN)).await, write(CMD, RUN));
        assert_eq!(stopping.ask(1, &write(CMD, 0)).await, write(CMD, 0));
    }
}
