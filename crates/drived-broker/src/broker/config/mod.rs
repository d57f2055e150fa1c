//! `[mqtt]` and `[mqtt.sparkplug]`: the brokers, and what is told and taken there.

mod mqtt;
mod sparkplug;

pub use self::{
    mqtt::{Address, Discovery, MqttConfig, MqttEntry},
    sparkplug::SparkplugConfig,
};
