//! What waits for most of its time: in one program, so that one waits beside another.

#![cfg(unix)]

mod alarm_life;
mod doctor;
#[path = "../mqtt/home.rs"]
mod home;
mod home_assistant;
mod kept_trip;
mod metrics;
mod mistakes;
#[path = "../support/page.rs"]
mod page;
#[path = "../support/prometheus.rs"]
mod prometheus;
mod report;
#[path = "../mqtt/rig.rs"]
mod rig;
mod scan;
#[path = "../support/mod.rs"]
mod support;
mod values;
