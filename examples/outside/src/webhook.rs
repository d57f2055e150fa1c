//! A webhook: what alarms a plant becomes a POST of JSON to a receiver over HTTP. `webhook HOST:PORT/PATH [DEVICE]` reads the
//! FAN1 at address 1 of a serial line at 19200 8E1, or a simulated one that trips.
//!
//! The queue is the fleet's own: 4 096 events wait for a receiver that is down, and how many were lost beyond that is posted
//! too. An alarm is posted until it is taken, so one whose answer was lost comes twice: its `order` tells it.

#![forbid(unsafe_code)]

use std::{error::Error, io, time::Duration};

use drive_bus::{Line, LineConfig};
use drive_core::SerialSettings;
use drive_families::Family;
use drive_fan1::{FAN1, machine::Machine};
use drive_fleet::{DriveSettings, Events, Fleet, Received};
use drive_sim::{SimLine, SimSlave, Wiring};
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::TcpStream,
    time::{sleep, timeout},
};

/// How long a receiver may take, and how long one is left alone that did not.
const PATIENCE: Duration = Duration::from_secs(5);
const PAUSE: Duration = Duration::from_secs(1);

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let receiver = arguments.next().ok_or("webhook HOST:PORT/PATH [DEVICE]")?;
    let (line, machine) = match arguments.next() {
        Some(path) => (Line::open(LineConfig::serial(path, SerialSettings::MODBUS_DEFAULT)).await?, None),
        None => simulated().map(|(line, machine)| (line, Some(machine)))?,
    };
    let fleet = watched(&line)?;
    let posting = tokio::spawn(post_alarms(fleet.events(), receiver));
    if let Some(machine) = machine {
        sleep(PAUSE).await;
        machine.trip(3);
    }
    tokio::signal::ctrl_c().await?;
    let _left_as_they_are = fleet.shutdown(PATIENCE).await;
    // The fleet's last words, if somebody takes them.
    timeout(PATIENCE, posting).await.ok();
    Ok(())
}

/// The drive of a line; nothing is ever written to it.
fn watched(line: &Line) -> Result<Fleet, drive_fleet::FleetError> {
    let open = |port, slave| Family::new(&FAN1).open(port, slave);
    Fleet::builder().line("line", line.clone()).drive("line", 1, DriveSettings::watched("fan"), open).start()
}

fn simulated() -> Result<(Line, SimSlave), drive_sim::AddressError> {
    let plant = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    let machine = plant.add(1, Machine::new())?;
    Ok((Line::over(plant.in_memory(), LineConfig::stream(SerialSettings::MODBUS_DEFAULT)), machine))
}

/// Until the fleet ends. An event is taken from the fleet when the one before has arrived.
async fn post_alarms(mut events: Events, receiver: String) {
    loop {
        let told = match events.recv().await {
            Received::Event(event) if event.kind.is_alarm() => serde_json::json!(event),
            Received::Event(_) => continue,
            Received::Missed(events) => serde_json::json!({ "missed": events }),
            Received::End => return,
        };
        while let Err(error) = post(&receiver, &told.to_string()).await {
            eprintln!("{receiver}: {error}: alarms wait for it");
            sleep(PAUSE).await;
        }
    }
}

/// One POST; done is what was answered by a 2xx.
async fn post(receiver: &str, body: &str) -> io::Result<()> {
    let (host, path) = receiver.split_once('/').unwrap_or((receiver, ""));
    let request = format!(
        "POST /{path} HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\
         Connection: close\r\n\r\n{body}",
        body.len()
    );
    let exchange = async {
        let mut stream = TcpStream::connect(host).await?;
        stream.write_all(request.as_bytes()).await?;
        let mut begin = [0; "HTTP/1.1 2".len()];
        stream.read_exact(&mut begin).await?;
        let taken = begin.starts_with(b"HTTP/1.") && begin.ends_with(b" 2");
        if taken { Ok(()) } else { Err(io::Error::other("it did not take it")) }
    };
    timeout(PATIENCE, exchange).await?
}

#[cfg(test)]
mod tests {
    use super::*;
    use drive_sim::Panel;
    use tokio::net::TcpListener;

    /// The next thing that is posted, answered by this status.
    async fn receive(listener: &TcpListener, status: u16) -> serde_json::Value {
        let (mut stream, _) = timeout(PATIENCE * 4, listener.accept()).await.expect("it is posted").unwrap();
        let mut request = Vec::new();
        loop {
            assert_ne!(stream.read_buf(&mut request).await.unwrap(), 0, "it was cut");
            let text = String::from_utf8_lossy(&request);
            if let Some(told) = text.split_once("\r\n\r\n").and_then(|(_, body)| body.parse().ok()) {
                stream.write_all(format!("HTTP/1.1 {status} \r\n\r\n").as_bytes()).await.unwrap();
                return told;
            }
        }
    }

    /// Until the fleet tells an event of this name.
    async fn told(events: &mut Events, name: &str) {
        let is_it = |told| matches!(told, Received::Event(event) if event.kind.name() == name);
        while !is_it(events.recv().await) {}
    }

    #[tokio::test]
    async fn each_alarm_arrives_once_and_none_is_lost_while_the_receiver_is_down() {
        let (line, machine) = simulated().unwrap();
        let fleet = watched(&line).unwrap();
        let mut listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let receiver = listener.local_addr().unwrap();
        tokio::spawn(post_alarms(fleet.events(), receiver.to_string()));
        let mut seen = fleet.events();
        told(&mut seen, "connected").await;
        let mut arrived = Vec::new();
        for code in [3, 1, 2] {
            machine.trip(code);
            told(&mut seen, "tripped").await;
            machine.panel(Panel::Reset);
            told(&mut seen, "fault cleared").await;
            if code == 3 {
                arrived.push(receive(&listener, 200).await);
                listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
            }
        }
        let listener = TcpListener::bind(receiver).await.unwrap();
        for status in [503, 200, 204] {
            arrived.push(receive(&listener, status).await);
        }
        let texts: Vec<_> = arrived.iter().map(|told| told["text"].as_str().unwrap()).collect();
        assert_eq!(texts, ["tripped: fault 3", "tripped: fault 1", "tripped: fault 1", "tripped: fault 2"]);
        assert_eq!(arrived[1], arrived[2], "what was refused came again");
    }
}
