#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod bank;
mod control;
mod defects;
mod fault;
mod framing;
mod habits;
mod line;
mod model;
pub mod models;
mod motor;
mod pdu;
mod playback;
mod record;
mod serve;
mod slave;
mod speech;
mod state;
mod unite;
mod watchdog;
mod wire;
mod world;

pub use bank::{Bank, Refusal};
pub use control::ControlError;
pub use defects::{Defects, Interference, Noise, Rest, SecondMaster, Unheard};
pub use fault::{ALWAYS, Fault, Faults, PerMillion};
pub use habits::{HeaderForm, LinkHabits, Unacknowledged};
pub use line::{AddressError, SimLine, SimSlave, Wiring};
pub use model::{
    Block, Cast, Damage, Dialect, Exception, Model, Observation, Played, Protocol, Rules, Says, UniTe,
};
pub use motor::{Motor, Nameplate, Ramp, Ramps};
pub use pdu::identification;
pub use playback::Playback;
pub use record::{Breach, LineStats, Violation};
pub use serve::{Gateway, GatewayInMemory, SecondConnection, Serving};
pub use slave::Received;
pub use watchdog::Watchdog;
pub use wire::Delivery;
pub use world::{Act, Intervened, Intervention, Panel, Surroundings, Switch, UnknownName};
