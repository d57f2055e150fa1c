//! What a history kept of an outage, as a host is told it.

use std::collections::VecDeque;

use drive_core::{Control, State};
use drived_plant::plant::{
    past::{IsView, PastError, PointView},
    untold::{Told, Untold, UntoldPoint, UntoldView},
};

use super::*;
use crate::broker::testing::Conduct;

/// A history that keeps these parts until they are noted.
#[derive(Default)]
struct Kept(Mutex<Keeping>);

#[derive(Default)]
struct Keeping {
    parts: VecDeque<UntoldView>,
    told: Vec<Told>,
}

impl Kept {
    fn of(parts: impl IntoIterator<Item = UntoldView>) -> Arc<Self> {
        let state = Keeping { parts: parts.into_iter().collect(), told: Vec::new() };
        Arc::new(Self(Mutex::new(state)))
    }

    /// The parts that are left, by their drives.
    fn left(&self) -> Vec<String> {
        self.0.lock().unwrap().parts.iter().map(|part| part.drive.clone()).collect()
    }

    /// What it was told that somebody was told.
    fn told(&self) -> Vec<Told> {
        let state = self.0.lock().unwrap();
        state.told.iter().filter(|told| told.live.is_some()).cloned().collect()
    }
}

impl Untold for Kept {
    fn note(&self, told: &Told) -> Result<(), PastError> {
        let mut state = self.0.lock().unwrap();
        state.told.push(told.clone());
        if let Some((number, until_ms)) = told.later {
            let part = state.parts.iter_mut().find(|part| part.number == number).expect("it was given");
            part.points.retain(|point| point.at_ms > until_ms);
            state.parts.retain(|part| part.number != number || part.until_ms > until_ms);
        }
        Ok(())
    }

    fn next(&self, whom: &str, later: &BTreeSet<String>) -> Result<Option<UntoldView>, PastError> {
        assert_eq!(whom, "sparkplug plant/hall 1");
        let state = self.0.lock().unwrap();
        Ok(state.parts.iter().find(|part| !later.contains(&part.drive)).cloned())
    }
}

fn point(at_ms: i64, value: &'static str, is: Option<IsView>) -> UntoldPoint {
    UntoldPoint { at_ms, value, point: PointView { time_unix_ms: 1_000_000 + at_ms, is } }
}

fn hertz(at_ms: i64, hertz: f64) -> UntoldPoint {
    point(at_ms, "output_frequency_hz", Some(IsView::Number(hertz)))
}

fn word(word: &str) -> Option<IsView> {
    Some(IsView::Word(word.to_owned()))
}

fn part(number: i64, drive: &str, points: Vec<UntoldPoint>) -> UntoldView {
    let until_ms = points.last().map_or(0, |last| last.at_ms) + 10;
    UntoldView { number, drive: drive.to_owned(), points, until_ms }
}

impl Bench {
    async fn that_tells(kept: &Arc<Kept>, drives: u8, name: &str) -> Self {
        let (plant, broker) = (TestPlant::of(drives).await, TestBroker::default());
        plant.plant.set_untold(Some(Arc::<Kept>::clone(kept)));
        let config = SparkplugConfig { historical: true, ..config(name) };
        let prepared = Sparkplug::prepare(config, broker.options(), Duration::from_secs(1));
        let prepared = prepared.unwrap_or_else(|failure| panic!("{failure}"));
        let face = prepared.open(plant.plant.clone(), Audit::default());
        Self { plant, broker, face }
    }

    /// Everything of the past that was told of a drive: the metric, its time, and the value with its quality.
    fn past(&self, drive: &str) -> Vec<(String, u64, Option<Raw>, Option<Quality>)> {
        let mut names: HashMap<Option<u64>, String> = HashMap::new();
        let mut past = Vec::new();
        for (topic, payload) in self.said(0) {
            if topic.ends_with(&format!("BIRTH/{drive}")) {
                names.extend(payload.metrics.iter().map(|one| (one.alias, one.name.clone().unwrap())));
            }
            if topic != format!("DDATA/{drive}") {
                continue;
            }
            let historical = payload.metrics.iter().filter(|metric| metric.is_historical).count();
            assert!([0, payload.metrics.len()].contains(&historical), "the past is told by itself");
            for metric in payload.metrics.into_iter().filter(|metric| metric.is_historical) {
                assert_eq!(metric.is_null, metric.value.is_none(), "{metric:?}");
                past.push((
                    names[&metric.alias].clone(),
                    metric.timestamp.unwrap(),
                    metric.value,
                    metric.quality,
                ));
            }
        }
        past
    }

    fn counts(&self) -> [u64; 2] {
        let counts = self.face.historical.as_ref().unwrap();
        [counts.told.load(Ordering::Relaxed), counts.left_out.load(Ordering::Relaxed)]
    }
}

#[tokio::test(start_paused = true)]
async fn what_was_kept_of_an_outage_is_told_as_of_the_past_and_as_it_was() {
    let kept = Kept::of([
        part(
            7,
            "pump 1",
            vec![
                hertz(1, 12.5),
                point(1, "state", word("quick stop")),
                point(1, "motion", word("braking")),
                point(2, "warning", word("yes")),
                point(2, "inputs", word("5")),
                point(2, "input_energy_counts", Some(IsView::Number(77.0))),
                point(3, "output_frequency_hz", None),
                point(4, "setpoint_hz", Some(IsView::Number(30.0))),
            ],
        ),
        part(8, "pump 9", vec![hertz(1, 1.0), hertz(2, 2.0), point(3, "motion", None)]),
        part(9, "pump 2", vec![hertz(5, 50.0)]),
    ]);
    let bench = Bench::that_tells(&kept, 2, "past").await;
    sleep(Duration::from_secs(20)).await;
    assert_eq!(kept.left(), Vec::<String>::new());
    let told =
        |name: &str, at: u64, value: Raw| (name.to_owned(), 1_000_000 + at, Some(value), Some(Quality::Good));
    let expected = [
        told("Status/Output Frequency", 1, Raw::Double(12.5)),
        told("Status/State", 1, Raw::String("quick_stop".to_owned())),
        told("Status/Warning", 2, Raw::Boolean(true)),
        told("Measurements/Inputs", 2, Raw::Int(5)),
        told("Measurements/Input Energy", 2, Raw::Long(77)),
        ("Status/Output Frequency".to_owned(), 1_000_003, None, Some(Quality::Stale)),
        told("Control/Setpoint", 4, Raw::Double(30.0)),
    ];
    assert_eq!(bench.past("pump 1"), expected);
    assert_eq!(bench.past("pump 2"), [told("Status/Output Frequency", 5, Raw::Double(50.0))]);
    // The drive that has left is left out, and that is counted.
    assert_eq!(bench.counts(), [8, 2]);
    let topics = bench.topics(0);
    let first = |topic: &str| topics.iter().position(|said| said == topic).unwrap();
    assert!(first("DBIRTH/pump 2") < first("DDATA/pump 1"));
    // Numbers without a gap, also with the past among them.
    let numbers: Vec<_> = bench.said(0).iter().map(|(_, payload)| payload.seq.unwrap()).collect();
    assert!(numbers.windows(2).all(|pair| pair[1] == (pair[0] + 1) % 256), "{numbers:?}");
    // What is so now is what the births have told, whatever was told of the past.
    let now = bench.plant.plant.fleet().drive("pump 1").unwrap().snapshot();
    assert_ne!(now.status.as_ref().map(|status| status.value.state), Some(State::QuickStop));
}

#[tokio::test(start_paused = true)]
async fn only_what_the_broker_has_is_noted_and_the_rest_is_told_again() {
    let kept = Kept::of([part(7, "pump 1", vec![hertz(1, 12.5)])]);
    let bench = Bench::that_tells(&kept, 1, "unconfirmed").await;
    bench.broker.until(|broker| !broker.publishes().is_empty()).await;
    sleep(Duration::from_millis(50)).await;
    // It takes everything, and says nothing any more.
    bench.broker.behave(Conduct::Deaf);
    sleep(Duration::from_secs(20)).await;
    assert_eq!((kept.told(), kept.left().len()), (Vec::new(), 1), "nobody knows what it has");
    bench.broker.behave(Conduct::Usual);
    bench.broker.cut();
    sleep(Duration::from_secs(20)).await;
    assert_eq!(bench.past("pump 1").len(), 1);
    assert_eq!(kept.left(), Vec::<String>::new());
    let told = kept.told();
    // Before the births nothing was told to this session, and what was read in the last moment may not have been.
    let (since, until) = told[0].live.unwrap();
    assert!(told[0].begun < since && since <= until, "{told:?}");
    let (_, later) = told.last().unwrap().live.unwrap();
    assert!(until < later && later <= Instant::now() - Duration::from_secs(1), "{told:?}");
    assert!(told.iter().all(|one| one.live.unwrap().0 == since), "it is one session");
    bench.broker.cut();
    sleep(Duration::from_secs(20)).await;
    let (anew, _) = kept.told().last().unwrap().live.unwrap();
    assert!(anew > later, "what lies between the sessions was told to nobody");
}

#[tokio::test(start_paused = true)]
async fn that_nobody_is_told_anything_is_noted_at_once_and_for_whoever_keeps_it_from_now_on() {
    let kept = [Kept::of([]), Kept::of([])];
    let (plant, broker) = (TestPlant::of(1).await, TestBroker::default());
    broker.behave(Conduct::Away);
    plant.plant.set_untold(Some(Arc::<Kept>::clone(&kept[0])));
    let config = SparkplugConfig { historical: true, ..config("nobody") };
    let prepared = Sparkplug::prepare(config, broker.options(), Duration::from_secs(1));
    let prepared = prepared.unwrap_or_else(|failure| panic!("{failure}"));
    let _face = prepared.open(plant.plant.clone(), Audit::default());
    sleep(Duration::from_secs(1)).await;
    let noted = |kept: &Kept| kept.0.lock().unwrap().told.iter().map(|told| told.live).collect::<Vec<_>>();
    assert_eq!(noted(&kept[0]), [None]);
    // The history is opened anew.
    plant.plant.set_untold(Some(Arc::<Kept>::clone(&kept[1])));
    sleep(Duration::from_secs(120)).await;
    assert!(!noted(&kept[1]).is_empty() && noted(&kept[1]).iter().all(Option::is_none));
}

#[tokio::test(start_paused = true)]
async fn a_part_whose_message_was_lost_with_its_connection_is_told_again() {
    let kept = Kept::of([part(7, "pump 1", vec![hertz(1, 12.5)])]);
    let bench = Bench::that_tells(&kept, 1, "again").await;
    // Up to the first message of the past, at whose end the broker is lost.
    let is_past = |publish: &rumqttc::Publish| {
        Payload::decode(&publish.payload).is_ok_and(|said| said.metrics.iter().any(|one| one.is_historical))
    };
    bench.broker.until(|broker| broker.packets().len() > 2).await;
    bench.broker.until(|broker| broker.publishes().iter().any(is_past)).await;
    bench.broker.behave(Conduct::Deaf);
    bench.broker.cut();
    bench.broker.behave(Conduct::Usual);
    sleep(Duration::from_secs(20)).await;
    assert_eq!(kept.left(), Vec::<String>::new());
    let past = bench.past("pump 1");
    assert!((1..=2).contains(&past.len()), "{past:?}");
    assert!(past.iter().all(|one| *one == past[0]), "what comes twice is the same with the same time");
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_is_dead_is_told_of_when_it_is_born_again_and_holds_up_no_other() {
    let kept = Kept::of([part(7, "pump 1", vec![hertz(1, 12.5)]), part(8, "pump 2", vec![hertz(1, 13.5)])]);
    let (plant, broker) = (TestPlant::of(2).await, TestBroker::default());
    plant.machines[0].mute();
    sleep(Duration::from_secs(30)).await;
    plant.plant.set_untold(Some(Arc::<Kept>::clone(&kept)));
    let config = SparkplugConfig { historical: true, ..config("dead") };
    let prepared = Sparkplug::prepare(config, broker.options(), Duration::from_secs(1));
    let prepared = prepared.unwrap_or_else(|failure| panic!("{failure}"));
    let face = prepared.open(plant.plant.clone(), Audit::default());
    let bench = Bench { plant, broker, face };
    sleep(Duration::from_secs(30)).await;
    assert_eq!((bench.past("pump 2").len(), kept.left()), (1, vec!["pump 1".to_owned()]));
    bench.plant.machines[0].unmute();
    sleep(Duration::from_secs(60)).await;
    assert_eq!((bench.past("pump 1").len(), kept.left()), (1, Vec::new()));
}

#[tokio::test(start_paused = true)]
async fn a_long_outage_is_told_in_small_messages_and_what_is_so_now_goes_first() {
    let many = (1..=2_500).map(|at| hertz(at, at as f64 / 100.0)).collect();
    let kept = Kept::of([part(7, "pump 1", many)]);
    let bench = Bench::that_tells(&kept, 1, "long").await;
    bench.broker.until(|broker| broker.publishes().len() > 3).await;
    let (mark, began) = (bench.mark(), Instant::now());
    bench.write("pump 1", "Control/Setpoint", Raw::Double(30.0));
    let has_answer = |broker: &TestBroker| {
        let read = |publish: &rumqttc::Publish| Payload::decode(&publish.payload).unwrap();
        let is_it = |metric: &Metric| !metric.is_historical && metric.value == Some(Raw::Double(30.0));
        broker.publishes().iter().skip(mark).any(|publish| read(publish).metrics.iter().any(is_it))
    };
    bench.broker.until(has_answer).await;
    assert!(!kept.left().is_empty(), "it is told while the past is");
    sleep(Duration::from_secs(20)).await;
    let past = bench.past("pump 1");
    let times: Vec<u64> = past.iter().map(|(_, at, ..)| at - 1_000_000).collect();
    assert_eq!(times, (1..=2_500).collect::<Vec<_>>(), "each once");
    let messages = bench.said(0).into_iter().map(|(_, said)| said.metrics);
    let of_past = messages.filter(|metrics| metrics.iter().any(|one| one.is_historical));
    let sizes: Vec<usize> = of_past.map(|metrics| metrics.len()).collect();
    assert_eq!(sizes, [100; 25], "by the clock of this test no quicker than ten a second: {began:?}");
}

#[tokio::test(start_paused = true)]
async fn unless_it_is_wanted_nothing_of_the_past_is_asked_for_or_told() {
    let kept = Kept::of([part(7, "pump 1", vec![hertz(1, 12.5)])]);
    let bench = Bench::of(1, config("unwanted")).await;
    bench.plant.plant.set_untold(Some(Arc::<Kept>::clone(&kept)));
    sleep(Duration::from_secs(30)).await;
    assert_eq!((kept.told().len(), kept.left().len(), bench.past("pump 1").len()), (0, 1, 0));
    let asked = bench.broker.packets();
    let asked = asked.iter().filter(|packet| matches!(packet, rumqttc::Packet::Subscribe(_))).count();
    assert_eq!(asked, 1);
}

#[test]
fn the_words_of_the_history_are_those_of_the_metrics() {
    let state = |state: State| (state.to_string(), json!(state));
    let control = |control: Control| (control.to_string(), json!(control));
    for (value, name, (told, expected)) in [
        ("state", "Status/State", state(State::NotReady)),
        ("state", "Status/State", state(State::FaultReaction)),
        ("state", "Status/State", state(State::Running)),
        ("control", "Status/Control", control(Control::OtherBus)),
        ("control", "Status/Control", control(Control::Bus)),
    ] {
        let (metric, reading) = metrics::of_the_past(&point(1, value, word(&told))).unwrap();
        let expected = drive_sparkplug::Value::String(expected.as_str().unwrap().to_owned());
        assert_eq!((metric, reading.value, reading.quality), (name, Some(expected), Quality::Good));
    }
}

#[test]
fn every_number_of_the_measurements_has_a_value_of_the_history() {
    for Definition { name, data_type } in metrics::of_a_drive() {
        let is_number = name.starts_with("Measurements/") && !name.starts_with("Measurements/Reference");
        let is = match data_type {
            drive_sparkplug::DataType::UInt32 => word("3"),
            _ => Some(IsView::Number(3.0)),
        };
        let values = names_of_measurements();
        let has_one = values.iter().any(|value| {
            metrics::of_the_past(&point(1, value, is.clone()))
                .is_some_and(|(metric, reading)| metric == name && reading.value.is_some())
        });
        assert!(has_one || !is_number, "{name}");
    }
}

/// The names of the measurements, as `drived-history` has them.
fn names_of_measurements() -> Vec<&'static str> {
    vec![
        "speed_rpm",
        "output_voltage_v",
        "output_voltage_percent",
        "line_voltage_v",
        "dc_bus_voltage_v",
        "dc_bus_voltage_percent",
        "torque_percent",
        "power_percent",
        "input_power_kw",
        "output_power_kw",
        "drive_thermal_percent",
        "motor_thermal_percent",
        "drive_load_percent",
        "motor_load_percent",
        "input_energy_counts",
        "output_energy_counts",
        "running_time_h",
        "powered_time_h",
        "inputs",
        "outputs",
    ]
}
