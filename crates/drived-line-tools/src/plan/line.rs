//! A line in the cases for which it is planned.

use std::time::Duration;

use drive_bus::{Echo, Gateway, LineConfig};
use drive_core::Capabilities;
use drive_fleet::{Demand, Forecast, LineBudget, forecast};

use drived_words::{drive_spec::DriveName, line_spec, output};

/// Bytes of a PDU around its words: function, address, quantity and count of a write; function and count of an answer.
const AROUND_WRITE: usize = 6;
const AROUND_ANSWER: usize = 2;

/// How many dead drives a plan allows for.
const DEAD: usize = 3;

/// The speed for which a line is planned besides its own.
const OTHER_SPEED: u32 = 38_400;

/// A line to be planned, from the command line or from a file.
#[derive(Debug)]
pub(super) struct PlannedLine {
    /// Its name, where the file gives it one.
    pub(super) name: Option<String>,
    pub(super) config: LineConfig,
    pub(super) budget: LineBudget,
    pub(super) drives: Vec<(DriveName, Demand)>,
}

/// What the line is like in one case.
#[derive(Debug)]
pub(super) struct Case {
    pub(super) label: String,
    pub(super) forecast: Forecast,
    /// How long a stop waits until it is on the wire, at the most.
    pub(super) stop_to_the_wire: Duration,
    /// How long it takes at the most until all living drives have confirmed a stop.
    pub(super) all_stopped: Duration,
    /// Why the case cannot be, though it can be calculated.
    pub(super) hypothetical: Option<String>,
}

impl PlannedLine {
    /// The line as it is planned, then at another speed, then with dead drives; each as far as there is such a case.
    pub(super) fn cases(&self) -> Vec<Case> {
        let mut cases = vec![self.case("as planned".to_owned(), &self.config, 0)];
        if self.config.serial.baud() != OTHER_SPEED {
            let names: Vec<DriveName> = self.drives.iter().map(|(name, _)| *name).collect();
            cases.extend(line_spec::at(&self.config, &names, OTHER_SPEED).map(|(config, forbidden)| Case {
                hypothetical: forbidden.map(|error| error.to_string()),
                ..self.case(format!("at {OTHER_SPEED}"), &config, 0)
            }));
        }
        if self.drives.len() > DEAD {
            cases.push(self.case(format!("with {DEAD} dead"), &self.config, DEAD));
        }
        cases
    }

    fn case(&self, label: String, config: &LineConfig, dead: usize) -> Case {
        let budget = LineBudget {
            response: self.budget.response,
            segments: self.budget.segments,
            ..LineBudget::of(config)
        };
        let demands: Vec<Demand> = self.drives.iter().map(|(_, demand)| demand.clone()).collect();
        let forecast = forecast(budget, &demands, dead);
        let stop_to_the_wire = self.stop_to_the_wire(config);
        let stop_all = forecast.plan.stop_all(u32::try_from(dead).unwrap_or(u32::MAX));
        // It begins with an exchange of the usual length that is under way, and here the longest is counted.
        // A gateway waits for each dead drive as it waits for one.
        let waits = config.far_end().map_or(Duration::ZERO, |gateway| {
            gateway.wait.unwrap_or(Gateway::ASSUMED_WAIT) * u32::try_from(dead).unwrap_or(u32::MAX)
        });
        let all_stopped = stop_all.saturating_sub(budget.lost_slot()) + stop_to_the_wire + waits;
        Case { label, forecast, stop_to_the_wire, all_stopped, hypothetical: None }
    }

    /// How long a stop may wait behind a port that was just opened, where the line has to find out first whether its adapter echoes. It is what
    /// the daemon tells as its bound until then.
    pub(super) fn until_echo_is_known(&self) -> Option<String> {
        let asking = self.stop_bound(&self.config);
        (asking > self.stop_to_the_wire(&self.config)).then(|| {
            format!(
                "a stop that comes while the line still finds out whether its adapter echoes, behind a port that was just opened, is on the wire within {}",
                output::bound(asking)
            )
        })
    }

    /// What of the stop's wait is a gateway's, and where that is from; `None` where there is none.
    pub(super) fn behind_gateway(&self) -> Option<String> {
        let gateway = self.config.far_end()?;
        let waits = output::bound(gateway.stop_waits());
        let without = LineConfig { gateway: Some(Gateway::NONE), ..self.config.clone() };
        let alone = output::bound(self.stop_to_the_wire(&without));
        let said = match (self.config.gateway, gateway.wait) {
            (None, _) => format!(
                "{waits} of a stop's wait are a gateway's, of which nothing is said: assumed are {:?} for a drive that does not answer, \
                 and perhaps one request at a time. Say gateway=none where each drive answers for itself: then it is {alone}; or what \
                 the gateway is set to, such as gateway=3x1s",
                Gateway::ASSUMED_WAIT
            ),
            (Some(_), None) => format!(
                "{waits} of a stop's wait are assumed, for a gateway that is unknown: {:?} for a drive that does not answer",
                Gateway::ASSUMED_WAIT
            ),
            (Some(_), Some(wait)) => format!(
                "{waits} of a stop's wait are the gateway's, which waits {wait:?} for a drive that does not answer{}",
                if gateway.at_once.is_some() {
                    ""
                } else {
                    "; how many requests it serves at once is not said, so twice"
                }
            ),
        };
        Some(said)
    }

    /// The longest wait of a stop, once the line knows whether its adapter echoes.
    fn stop_to_the_wire(&self, config: &LineConfig) -> Duration {
        self.stop_bound(&LineConfig { echo: Echo::Off, ..config.clone() })
    }

    fn stop_bound(&self, config: &LineConfig) -> Duration {
        let bytes = |of: fn(&Capabilities) -> u16| {
            let most = self.drives.iter().map(|(_, demand)| of(demand.capabilities)).max();
            2 * usize::from(most.unwrap_or_default())
        };
        config.worst_case_stop(
            AROUND_WRITE + bytes(|family| family.write_words),
            AROUND_ANSWER + bytes(|family| family.read_words),
        )
    }
}
