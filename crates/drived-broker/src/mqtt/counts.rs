//! What the connection counts, as metrics.

use crate::broker::Broker;
use drived_plant::counts::{Id, Samples, Source};

impl Source for Broker {
    fn collect(&self, samples: &mut Samples) {
        let counts = self.counts();
        samples.add(Id::MqttConnected, &[], f64::from(counts.connected));
        samples.count(Id::MqttWaiting, &[], counts.waiting as u64);
        samples.count(Id::MqttSent, &[], counts.sent);
        samples.count(Id::MqttArrived, &[], counts.arrived);
        for (reason, lost) in counts.lost.by_reason() {
            samples.count(Id::MqttLost, &[reason], lost);
        }
    }
}
