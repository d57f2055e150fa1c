//! What every family promises, of this one: see [`Contract`].

use drive_core::ExceptionMeaning;
use drive_fan1::{CAPABILITIES, Fan1, machine::Machine};
use drive_testing::{
    Contract,
    contract::{ControlWord, StatusWord},
    worlds::{Configuration, Event, Share, Surrounded},
};

/// The one way in which its manual lets it be commanded, with the panel and the supplies around it.
struct Around;

impl Surrounded for Around {
    fn configurations(&self) -> Vec<Configuration> {
        vec![Configuration {
            name: "by the bus".to_owned(),
            open: Box::new(|port, slave| Box::new(Fan1::new(port, slave))),
            machine: Box::new(|| Box::new(Machine::new())),
            settings: Vec::new(),
        }]
    }

    fn other_masters(&self) -> Vec<Event> {
        ["CTL 1", "CTL 3", "CTL 0", "REF 10"].map(|deed| Event::lasting(&format!("master {deed}"))).to_vec()
    }

    fn parameter(&self) -> Option<(&'static str, u16)> {
        Some(("RMP", 40))
    }
}

fn contract() -> Contract {
    use ExceptionMeaning::{NoSuchFunction, NoSuchRegister, ValueRefused};
    Contract {
        trip: Some(3),
        plausible: &[0, 0, 1, 3, 0x0011, 0x0013, 0x0019, 0x0011, 0x0013, 250],
        control: Some(ControlWord {
            register: 0x0100,
            words: &[0x0000, 0x0001, 0x0003, 0x0004],
            others: |_| 0,
            unseen: &[],
            once: &[],
        }),
        status: Some(StatusWord { register: 0x0102, others: &[], is_tripped: |word| word & 0x0008 != 0 }),
        exceptions: &[(1, NoSuchFunction), (2, NoSuchRegister), (3, ValueRefused)],
        around: Some(Box::new(Around)),
        ..Contract::new(
            &CAPABILITIES,
            |port, slave| Box::new(Fan1::new(port, slave)),
            || Box::new(Machine::new()),
        )
    }
}

#[tokio::test(start_paused = true)]
async fn it_keeps_the_contract_of_a_family() {
    contract().check().await;
}

#[tokio::test(start_paused = true)]
async fn it_says_the_truth_in_every_world_of_its_manual() {
    contract().is_true_in_worlds(Share::one_in(1)).await;
}
