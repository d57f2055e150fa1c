//! Clients of a gateway before a simulated plant, in virtual time.

mod by_file;
mod connections;
mod reading;
mod writing;

use std::{collections::BTreeMap, net::IpAddr, sync::Arc, time::Duration};

use drive_bus::exchange::mbap;
use drive_core::Class;
use tokio::{
    io::{AsyncRead, AsyncReadExt as _, AsyncWrite, AsyncWriteExt as _, DuplexStream},
    time::Instant,
};

use super::{client, clients::Course, desk::Desk};
use crate::config::{GatewayConfig, Units};
use drived_config::names::{Configured, Named, Names};
use drived_doors::{
    Role,
    audit::Audit,
    crowd::{Crowd, Limits, Place},
};
use drived_plant::plant::testing::TestPlant;

/// ETA, ETI and what stands behind them: BBV51701 p. 21.
const ETA: u16 = 3_201;

fn config() -> GatewayConfig {
    GatewayConfig {
        name: "scada".to_owned(),
        listen: "127.0.0.1:0".parse().unwrap(),
        allow: Vec::new(),
        clients: 16,
        idle: Duration::from_secs(60),
        units: Units::OfLine("north".to_owned()),
        patience: Duration::from_millis(900),
        reads: Class::Status,
        share: 30,
        silent: false,
        mapped_only: false,
        rights: Role::View.rights(),
        virtual_unit: None,
        max_age: Duration::ZERO,
        raw_writes: false,
        eeprom_writes: false,
        broadcast: false,
        client_timeout: None,
        stops_when_silent: false,
    }
}

/// The numbers of a plant's drives, in the order of its configuration.
fn names(plant: &TestPlant) -> Names {
    let names = Names::default();
    names.take_up(&named(plant)).unwrap();
    names
}

/// Gives numbers to those who are there now.
fn take_up(desk: &Desk, plant: &TestPlant) {
    desk.names.take_up(&named(plant)).unwrap();
}

fn named(plant: &TestPlant) -> Configured {
    let drives = plant.plant.fleet().drives();
    let named = drives.iter().map(|drive| Named {
        name: drive.name().to_string(),
        place: drive.slave().to_string(),
        slot: None,
    });
    Configured { drives: named.collect(), ..Configured::default() }
}

/// A client that checks what every answer has to have.
struct Peer<S = DuplexStream> {
    stream: S,
    sent: BTreeMap<u16, (u8, u8)>,
    next: u16,
}

impl Peer {
    fn of(desk: &Arc<Desk>) -> Self {
        Self::at(desk, "127.0.0.1".parse().unwrap())
    }

    fn at(desk: &Arc<Desk>, address: IpAddr) -> Self {
        Self::in_place(desk, address, place(address))
    }

    fn in_place(desk: &Arc<Desk>, address: IpAddr, place: Place) -> Self {
        let (stream, theirs) = tokio::io::duplex(4_096);
        let desk = Arc::clone(desk);
        let by = desk.clients.open(address);
        tokio::spawn(async move { client::serve(theirs, by, desk, &place).await });
        Self::over(stream)
    }
}

impl<S: AsyncRead + AsyncWrite + Unpin> Peer<S> {
    const fn over(stream: S) -> Self {
        Self { stream, sent: BTreeMap::new(), next: 0x1501 }
    }

    async fn send(&mut self, unit: u8, pdu: &[u8]) -> u16 {
        let transaction = self.next;
        self.next += 1;
        self.sent.insert(transaction, (unit, pdu[0]));
        self.stream.write_all(&mbap::frame(transaction, unit, pdu)).await.unwrap();
        transaction
    }

    /// The next answer, with the transaction that it answers: one that was sent and not answered yet, by its unit and its
    /// function.
    async fn answer(&mut self) -> (u16, Vec<u8>) {
        let mut header = [0; mbap::HEADER];
        self.stream.read_exact(&mut header).await.unwrap();
        let head = mbap::Head::of(header).unwrap();
        let mut pdu = vec![0; head.pdu];
        self.stream.read_exact(&mut pdu).await.unwrap();
        let asked = self.sent.remove(&head.transaction).expect("one answer for each request");
        assert_eq!((head.unit, pdu[0] & 0x7F), asked, "transaction {:04X}h", head.transaction);
        (head.transaction, pdu)
    }

    async fn ask(&mut self, unit: u8, pdu: &[u8]) -> Vec<u8> {
        let transaction = self.send(unit, pdu).await;
        let (answered, pdu) = self.answer().await;
        assert_eq!(answered, transaction);
        pdu
    }

    async fn is_ended(&mut self) -> bool {
        matches!(self.stream.read(&mut [0; 1]).await, Ok(0) | Err(_))
    }
}

/// A place of a client, where there is room.
fn place(address: IpAddr) -> Place {
    Crowd::new(Limits::of_gateway(1)).enter(Some(address), Instant::now()).unwrap()
}

fn read(address: u16, count: u16) -> Vec<u8> {
    [&[0x03][..], &address.to_be_bytes(), &count.to_be_bytes()].concat()
}

async fn plant(drives: u8, change: impl FnOnce(&mut GatewayConfig)) -> (TestPlant, Arc<Desk>) {
    let plant = TestPlant::of(drives).await;
    let mut config = config();
    change(&mut config);
    let desk = Desk::new(&Course::default(), config, plant.plant.clone(), Audit::default(), names(&plant));
    (plant, desk)
}
