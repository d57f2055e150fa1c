//! Masters in Python that others wrote. Optional: where one is not installed it is left out, and that is said.

use std::{
    env,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::Duration,
};

use crate::{
    Error,
    rig::{FIRST, QUANTITY},
};

/// A script under `peers/` that reads every drive in turn, named after the module that it needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Python(pub(crate) &'static str);

impl Python {
    /// Whether its module is there. `DRIVED_PYTHON` names the interpreter, as in the tests.
    pub(crate) fn is_installed(self) -> bool {
        let mut import = Command::new(interpreter());
        import.args(["-c", &format!("import {}", self.0)]).stdout(Stdio::null()).stderr(Stdio::null());
        import.status().is_ok_and(|status| status.success())
    }

    pub(crate) fn run(self, port: &Path, drives: u8, time: Duration) -> Result<(), Error> {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("peers/{}_loop.py", self.0));
        let numbers = [u16::from(drives), FIRST, QUANTITY].map(|number| number.to_string());
        let mut command = Command::new(interpreter());
        command.arg(script).arg(port).args(numbers).arg(time.as_secs_f64().to_string());
        if command.status()?.success() { Ok(()) } else { Err(format!("{} has failed", self.0).into()) }
    }
}

/// The Python of whatever others wrote.
pub(crate) fn interpreter() -> PathBuf {
    env::var_os("DRIVED_PYTHON").map_or_else(|| "python3".into(), PathBuf::from)
}
