//! Modbus TCP: which answer belongs to which request, and what becomes of calls when the connection ends.

#![cfg(feature = "tcp")]

mod support;

use drive_bus::{LineConfig, SlaveSettings};
use drive_core::{Class, PortError, Terms};
use support::{
    MS,
    server::{PATIENCE, Server, call, outcome},
};
use tokio_modbus::{Request, Response};

/// A line to this address whose answers may be as late as a busy machine makes them.
fn to(address: impl Into<String>) -> LineConfig {
    LineConfig { response_timeout: PATIENCE, timeout_floor: PATIENCE, ..LineConfig::modbus_tcp(address) }
}

fn read(address: u16) -> Request<'static> {
    Request::ReadHoldingRegisters(address, 1)
}

fn word(word: u16) -> Result<Response, PortError> {
    Ok(Response::ReadHoldingRegisters(vec![word]))
}

#[tokio::test]
async fn a_late_answer_is_known_by_its_number_and_a_foreign_unit_by_its_address() {
    let server = Server::bind().await;
    let hasty = SlaveSettings { response_timeout: Some(50 * MS), ..SlaveSettings::default() };
    let config = LineConfig { retries: 0, ..to(server.address()) }.slave(1, hasty);
    let (line, mut far) = server.serve(config).await;
    let first = call(&line, 1, Terms::default(), read(7));
    let asked: [u8; 12] = far.request().await;
    // The numbers begin anywhere.
    let begun = u16::from_be_bytes([asked[0], asked[1]]);
    let number = |n: u16| begun.wrapping_add(n).to_be_bytes();
    assert_eq!(asked[2..], [0, 0, 0, 6, 1, 3, 0, 7, 0, 1]);
    assert_eq!(outcome(first).await, Err(PortError::Timeout { after: 50 * MS }));

    line.configure_slave(1, SlaveSettings::default());
    let second = call(&line, 1, Terms::default(), read(8));
    let asked: [u8; 12] = far.request().await;
    assert_eq!((&asked[..2], &asked[2..]), (&number(1)[..], &[0, 0, 0, 6, 1, 3, 0, 8, 0, 1][..]));
    let numbered = |n: u16, rest: [u8; 9]| [&number(n)[..], &rest].concat();
    let late = numbered(0, [0, 0, 0, 5, 1, 3, 2, 0xAA, 0xAA]);
    let other_unit = numbered(1, [0, 0, 0, 5, 9, 3, 2, 0xBB, 0xBB]);
    let right = numbered(1, [0, 0, 0, 5, 1, 3, 2, 0, 8]);
    far.send_one_by_one(&[&late[..], &other_unit, &right].concat()).await;
    assert_eq!(outcome(second).await, word(8));

    let third = call(&line, 1, Terms::default(), read(9));
    assert_eq!(far.request::<12>().await[..2], number(2));
    let right = numbered(2, [0, 0, 0, 5, 1, 3, 2, 0, 9]);
    far.send(&[late, other_unit, right].concat()).await;
    assert_eq!(outcome(third).await, word(9));
}

#[tokio::test]
async fn a_connection_that_ends_in_the_middle_of_an_answer_is_made_anew_for_reads_and_never_repeats_a_write()
{
    let server = Server::bind().await;
    let (line, mut far) = server.serve(to(server.address())).await;
    let write = call(&line, 1, Terms::of(Class::Command).edge(), Request::WriteSingleRegister(8501, 15));
    let request: [u8; 12] = far.request().await;
    far.send(&request[..9]).await;
    drop(far);
    assert_eq!(outcome(write).await, Err(PortError::OutcomeUnknown("the line was lost")));

    let mut far = server.accept().await;
    let asked = call(&line, 1, Terms::default(), read(7));
    let again: [u8; 12] = far.request().await;
    assert_eq!(again[2..], [0, 0, 0, 6, 1, 3, 0, 7, 0, 1]);
    far.send(&[again[0], again[1], 0, 0, 0, 5, 1, 3]).await;
    drop(far);
    let mut far = server.accept().await;
    let last: [u8; 12] = far.request().await;
    assert_eq!(last[2..], again[2..]);
    assert_ne!(last[..2], again[..2]);
    far.send(&[last[0], last[1], 0, 0, 0, 5, 1, 3, 2, 0, 7]).await;
    assert_eq!(outcome(asked).await, word(7));
    assert_eq!((line.stats().opened, line.stats().lost), (3, 2));
}
