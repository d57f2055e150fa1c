//! A port with nothing behind it: for what a drive knows of itself without asking.

use std::io;

use async_trait::async_trait;
use drive_core::{Port, PortError};
use tokio_modbus::{Request, Response, Slave, client::Client, slave::SlaveContext};

/// Where nobody answers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nowhere {
    /// Whether its line speaks Modbus ASCII.
    pub(crate) ascii: bool,
}

#[async_trait]
impl Client for Nowhere {
    async fn call(&mut self, _: Request<'_>) -> tokio_modbus::Result<Response> {
        Err(tokio_modbus::Error::Transport(PortError::Closed.into_io()))
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl SlaveContext for Nowhere {
    fn set_slave(&mut self, _: Slave) {}
}

impl Port for Nowhere {
    fn is_ascii(&self) -> bool {
        self.ascii
    }
}
