//! Wrong values accepted as right, over every fault of the simulator, in virtual time and from a seed.

use std::time::Duration;

use drive_bus::{Echo, Line, LineConfig, Slave};
use drive_core::serial::SerialSettings;
use drive_sim::{ALWAYS, Delivery, Fault, Faults, PerMillion, SimLine, Wiring};
use fastrand::Rng;
use tokio::time::{sleep, timeout};
use tokio_modbus::{Request, Response, client, client::Client, prelude::*};

use crate::{
    Error,
    ledger::Ledger,
    report::{Goal, Report, Unit},
    rig::virtual_runtime,
};

const SECTION: &str = "faults";

const SETTINGS: SerialSettings = SerialSettings::MODBUS_DEFAULT;

const DRIVES: u8 = 8;

/// Of each kind of fault but the echo, which an adapter has always or never.
const RATE: PerMillion = 20_000;

/// How the transactions ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Tally {
    /// With what the drive has answered to this very request, or was written by it.
    right: u64,
    /// Said to be right, and is not.
    wrong: u64,
    /// With an error.
    failed: u64,
}

impl Tally {
    const fn sum(self, other: Self) -> Self {
        Self {
            right: self.right + other.right,
            wrong: self.wrong + other.wrong,
            failed: self.failed + other.failed,
        }
    }

    const fn count(&mut self, accepted: Option<bool>) {
        match accepted {
            Some(true) => self.right += 1,
            Some(false) => self.wrong += 1,
            None => self.failed += 1,
        }
    }
}

/// One line and its troubles.
#[derive(Debug, Clone, Copy)]
struct Trouble {
    name: &'static str,
    delivery: Delivery,
    /// What the line is told of the adapter; when anything, the adapter does echo.
    echo: Echo,
    lateness: Duration,
}

const TROUBLES: [Trouble; 4] = [
    Trouble {
        name: "answers whole, late ones by 200 ms",
        delivery: Delivery::Whole,
        echo: Echo::Off,
        lateness: Duration::from_millis(200),
    },
    Trouble {
        name: "answers whole, late ones by 600 ms",
        delivery: Delivery::Whole,
        echo: Echo::Off,
        lateness: Duration::from_millis(600),
    },
    Trouble {
        name: "answers character by character",
        delivery: Delivery::Pieces(1),
        echo: Echo::Off,
        lateness: Duration::from_millis(200),
    },
    Trouble {
        name: "an adapter that echoes",
        delivery: Delivery::Whole,
        echo: Echo::Auto,
        lateness: Duration::from_millis(200),
    },
];

impl Trouble {
    fn line(self, seed: u64) -> Result<(SimLine, Vec<Ledger>), Error> {
        let line = SimLine::new(Wiring { delivery: self.delivery, ..Wiring::rtu(SETTINGS) });
        let mut faults = Faults::seeded(seed);
        for fault in Fault::ALL {
            let echoes = if self.echo == Echo::Off { 0 } else { ALWAYS };
            faults.set(fault, if fault == Fault::Echo { echoes } else { RATE });
        }
        faults.set_lateness(self.lateness);
        line.set_faults(faults);
        let mut ledgers = Vec::new();
        for address in 1..=DRIVES {
            let ledger = Ledger::new(address);
            line.add(address, ledger.clone())?;
            ledgers.push(ledger);
        }
        Ok((line, ledgers))
    }
}

/// How often a fault other than the echo has struck.
fn struck(line: &SimLine) -> u64 {
    Fault::ALL.into_iter().filter(|fault| *fault != Fault::Echo).map(|fault| line.injected(fault)).sum()
}

pub(crate) fn measure(report: &mut Report, seed: u64, transactions: u64) -> Result<(), Error> {
    let each = transactions / TROUBLES.len() as u64;
    let (mut all, mut faults) = (Tally::default(), 0);
    for trouble in TROUBLES {
        let (tally, struck) = ours(trouble, seed, each)?;
        let what = format!("{}: wrong values in {each} transactions, {struck} faults", trouble.name);
        report.row(SECTION, what, Unit::Count, tally.wrong as f64, Goal::AtMost(0.0));
        all = all.sum(tally);
        faults += struck;
    }
    let what = format!("wrong values accepted as right, over {faults} faults, seed {seed}");
    report.row(SECTION, what, Unit::Count, all.wrong as f64, Goal::AtMost(0.0));
    report.note(SECTION, "… answered right, retries included", Unit::Count, all.right as f64);
    report.note(SECTION, "… ended with an error", Unit::Count, all.failed as f64);

    let trouble = TROUBLES[1];
    let (tally, struck) = stock(trouble, seed, each)?;
    let what = format!("stock tokio-modbus, {}: wrong values in {each} reads, {struck} faults", trouble.name);
    report.note(SECTION, what, Unit::Count, tally.wrong as f64);
    Ok(())
}

/// Our line. What it made of so many transactions, and how many faults struck.
fn ours(trouble: Trouble, seed: u64, transactions: u64) -> Result<(Tally, u64), Error> {
    virtual_runtime()?.block_on(async {
        let (simulated, ledgers) = trouble.line(seed)?;
        let config = LineConfig { echo: trouble.echo, ..LineConfig::stream(SETTINGS) };
        let line = Line::over(simulated.in_memory(), config);
        let each = transactions / u64::from(DRIVES);
        let callers: Vec<_> = (1..)
            .zip(ledgers)
            .map(|(address, ledger)| {
                let random = Rng::with_seed(seed ^ u64::from(address));
                tokio::spawn(call(line.slave(address), ledger, random, each))
            })
            .collect();
        let mut tally = Tally::default();
        for caller in callers {
            tally = tally.sum(caller.await?);
        }
        line.close().await;
        Ok((tally, struck(&simulated)))
    })
}

/// Reads and writes of one drive.
async fn call(mut slave: Slave, ledger: Ledger, mut random: Rng, transactions: u64) -> Tally {
    let mut tally = Tally::default();
    // Each write has its own value, so that a confirmation cannot be another's.
    let mut value = 0_u16;
    for _ in 0..transactions {
        let register = random.u16(0..1_000);
        value = value.wrapping_add(1);
        let accepted = match random.u8(0..10) {
            0..6 => {
                let (since, quantity) = (ledger.reads(), random.u16(2..12));
                match slave.call(Request::ReadHoldingRegisters(register, quantity)).await {
                    Ok(Ok(Response::ReadHoldingRegisters(words))) => {
                        Some(words.len() == usize::from(quantity) && ledger.answered(since, register, &words))
                    }
                    Ok(_) => Some(false),
                    Err(_) => None,
                }
            }
            6..8 => match slave.call(Request::WriteSingleRegister(register, value)).await {
                Ok(Ok(_)) => Some(ledger.written(register) == Some(value)),
                Ok(Err(_)) => Some(false),
                Err(_) => None,
            },
            _ => {
                let values = vec![value, !value];
                match slave.call(Request::WriteMultipleRegisters(register, values.into())).await {
                    Ok(Ok(_)) => Some(
                        ledger.written(register) == Some(value)
                            && ledger.written(register + 1) == Some(!value),
                    ),
                    Ok(Err(_)) => Some(false),
                    Err(_) => None,
                }
            }
        };
        tally.count(accepted);
        // A drive that is off-line is refused at once.
        sleep(Duration::from_millis(random.u64(0..40))).await;
    }
    tally
}

/// The stock tokio-modbus client with `sleep(t3.5)` and a timeout of 500 ms, attached anew after ten failures in a row.
async fn read_with_stock(simulated: &SimLine, ledgers: &[Ledger], seed: u64, reads: u64) -> Tally {
    let mut random = Rng::with_seed(seed);
    let mut context = client::rtu::attach(simulated.in_memory());
    let (mut tally, mut failures) = (Tally::default(), 0);
    for (address, ledger) in (1..=DRIVES).zip(ledgers).cycle().take(reads as usize) {
        context.set_slave(tokio_modbus::Slave(address));
        sleep(SETTINGS.t3_5()).await;
        let (since, register, quantity) = (ledger.reads(), random.u16(0..1_000), random.u16(2..12));
        let answer = context.read_holding_registers(register, quantity);
        let accepted = match timeout(Duration::from_millis(500), answer).await {
            Ok(Ok(Ok(words))) => Some(ledger.answered(since, register, &words)),
            Ok(Ok(Err(_))) => Some(false),
            Ok(Err(_)) | Err(_) => None,
        };
        tally.count(accepted);
        failures = if accepted.is_some() { 0 } else { failures + 1 };
        if failures == 10 {
            context = client::rtu::attach(simulated.in_memory());
            failures = 0;
        }
    }
    tally
}

fn stock(trouble: Trouble, seed: u64, reads: u64) -> Result<(Tally, u64), Error> {
    virtual_runtime()?.block_on(async {
        let (simulated, ledgers) = trouble.line(seed)?;
        let tally = read_with_stock(&simulated, &ledgers, seed, reads).await;
        Ok((tally, struck(&simulated)))
    })
}
