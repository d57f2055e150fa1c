//! What something between the line and its slaves does to each answer, and what ends a diagnosis before its time.

use drive_bus::{Gateway, Protocol};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, DuplexStream},
    time::sleep,
};

use super::*;
use crate::{
    doctor::verdict::Certainty,
    testing::{Change, Through},
};

const SECOND: Duration = Duration::from_secs(1);

impl Ways for Through {
    async fn open(&self, config: LineConfig) -> Result<Line, Failure> {
        Ok(Line::over(self.stream(config.serial), config))
    }

    async fn listen(&self, config: &LineConfig) -> Result<Listener, Failure> {
        Listener::over(self.stream(config.serial), config).map_err(|error| Failure::Input(error.to_string()))
    }

    fn adapter(&self) -> Adapter {
        Adapter::default()
    }
}

/// What the doctor notices of two drives through something.
async fn seen(change: Change, time: Duration) -> Observations {
    let bench = Bench::of(&[Family::ATV312, Family::ATV21]);
    let task = bench.task(LineConfig::stream(bench.serial), time);
    observe::observe(&task, &Through(bench.line.clone(), change), |_| {}, std::future::pending())
        .await
        .unwrap()
}

fn kinds(seen: &Observations) -> Vec<Defect> {
    judge(seen).into_iter().map(|verdict| verdict.defect).collect()
}

#[tokio::test(start_paused = true)]
async fn one_byte_that_is_missing_is_no_wrong_speed() {
    let first = seen(
        |_, said| {
            said.remove(0);
        },
        10 * SECOND,
    )
    .await;
    assert_eq!(kinds(&first), [Defect::FirstByteCut], "{}", told(&first));
    assert_eq!(judge(&first)[0].certainty, Certainty::Certain);
    let last = seen(
        |_, said| {
            said.pop();
        },
        10 * SECOND,
    )
    .await;
    assert_eq!(kinds(&last), [Defect::LastByteCut], "{}", told(&last));
}

#[tokio::test(start_paused = true)]
async fn bytes_behind_each_answer_are_not_healthy() {
    let behind = seen(|_, said| said.extend([0xFF, 0x00]), 10 * SECOND).await;
    assert_eq!(kinds(&behind), [Defect::BytesBehind], "{}", told(&behind));
}

#[tokio::test(start_paused = true)]
async fn a_line_that_is_silent_from_the_eighth_second_is_no_noise() {
    let silent = seen(
        |at, said| {
            if at > 8 * SECOND {
                said.clear();
            }
        },
        20 * SECOND,
    )
    .await;
    assert_eq!(kinds(&silent), [Defect::FellSilent], "{}", told(&silent));
}

fn judged(seen: &Observations) -> Vec<(Defect, Vec<u8>)> {
    defects(&judge(seen))
}

#[tokio::test(start_paused = true)]
async fn a_line_that_is_cut_once_for_some_seconds_is_no_noise() {
    for from in (8_000..9_000).step_by(100).map(Duration::from_millis) {
        let bench = Bench::of(&[Family::ATV312; 3]);
        let line = bench.line.clone();
        tokio::spawn(async move {
            sleep(from).await;
            line.cut();
            sleep(4 * SECOND).await;
            line.join();
        });
        let cut = bench.seen(20 * SECOND).await;
        assert_eq!(judged(&cut), [(Defect::Interrupted, vec![])], "{from:?}: {}", told(&cut));
        let verdict = &judge(&cut)[0];
        let steps = verdict.next.concat();
        assert!(verdict.finding.contains("once, for 4"), "{}", verdict.finding);
        assert!(!steps.contains("120") && steps.contains("plug"), "{steps}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_without_contact_a_quarter_of_the_time_is_not_healthy() {
    let loose = seen(
        |at, said| {
            if said.first() == Some(&2) && at.as_millis() % 6_000 < 1_500 {
                said.clear();
            }
        },
        20 * SECOND,
    )
    .await;
    assert_eq!(judged(&loose), [(Defect::Interrupted, vec![2])], "{}", told(&loose));
}

#[tokio::test(start_paused = true)]
async fn bursts_that_destroy_everything_for_a_seventh_of_the_time_are_not_healthy() {
    let bursts = seen(
        |at, said| {
            if at.as_millis() % 5_000 < 700 {
                said.fill(0x55);
            }
        },
        20 * SECOND,
    )
    .await;
    assert_eq!(judged(&bursts), [(Defect::Noise, vec![])], "{}", told(&bursts));
    assert!(judge(&bursts)[0].finding.contains("bursts"), "{}", judge(&bursts)[0].finding);
}

/// One that refuses everything, for another reason each.
async fn refused(code: u8) -> Observations {
    let bench = Bench::of(&[Family::ATV312]);
    let task = bench.task(LineConfig::stream(bench.serial), 10 * SECOND);
    let line = move |mut far: DuplexStream| async move {
        let mut bytes = [0; 512];
        while let Ok(8..) = far.read(&mut bytes).await {
            sleep(20 * SECOND / 1_000).await;
            let answer = drive_bus::exchange::rtu::frame(bytes[0], &[bytes[1] | 0x80, code]);
            if far.write_all(&answer).await.is_err() {
                return;
            }
        }
    };
    struct Ways1<F>(F);
    impl<F: Fn(DuplexStream) -> R, R: Future<Output = ()> + Send + 'static> Ways for Ways1<F> {
        async fn open(&self, config: LineConfig) -> Result<Line, Failure> {
            let (ours, far) = tokio::io::duplex(512);
            tokio::spawn((self.0)(far));
            Ok(Line::over(ours, config))
        }

        async fn listen(&self, config: &LineConfig) -> Result<Listener, Failure> {
            let (ours, far) = tokio::io::duplex(512);
            tokio::spawn((self.0)(far));
            Listener::over(ours, config).map_err(|error| Failure::Input(error.to_string()))
        }

        fn adapter(&self) -> Adapter {
            Adapter::default()
        }
    }
    observe::observe(&task, &Ways1(line), |_| {}, std::future::pending()).await.unwrap()
}

#[tokio::test(start_paused = true)]
async fn exceptions_to_everything_are_not_healthy_and_name_who_gives_them() {
    for (code, who) in
        [(0x0B, "the gateway"), (0x06, "it is busy"), (0x02, "no such register"), (0x01, "no such function")]
    {
        let seen = refused(code).await;
        assert_eq!(kinds(&seen), [Defect::RefusesAll], "{}", told(&seen));
        assert!(judge(&seen)[0].finding.contains(who), "{}", told(&seen));
    }
}

#[tokio::test(start_paused = true)]
async fn a_diagnosis_that_is_asked_to_end_judges_from_what_there_is() {
    let bench = Bench::of(&[Family::ATV312]);
    let task = bench.task(LineConfig::stream(bench.serial), 60 * SECOND);
    let ways = Through(bench.line.clone(), |_, said| {
        said.remove(0);
    });
    let seen = observe::observe(&task, &ways, |_| {}, sleep(12 * SECOND)).await.unwrap();
    assert_eq!(kinds(&seen), [Defect::FirstByteCut], "{}", told(&seen));
    assert!(seen.cut_short.is_some() && seen.took < 14 * SECOND, "{:?}", seen.took);
    // Before anything was asked there is nothing to judge.
    assert!(observe::observe(&task, &ways, |_| {}, sleep(SECOND)).await.is_err());
}

#[tokio::test(start_paused = true)]
async fn a_gateway_that_answers_for_a_dead_drive_is_not_taken_for_the_drive() {
    let bench = Bench::of(&[Family::ATV312]);
    bench.machine(1).mute();
    let gateway = bench.line.behind(drive_sim::Gateway {
        attempts: 1,
        wait: SECOND / 5,
        ..drive_sim::Gateway::default()
    });
    struct Behind(drive_sim::GatewayInMemory);
    impl Ways for Behind {
        async fn open(&self, config: LineConfig) -> Result<Line, Failure> {
            Ok(Line::over(self.0.connect(), config))
        }

        async fn listen(&self, config: &LineConfig) -> Result<Listener, Failure> {
            Listener::over(self.0.connect(), config).map_err(|error| Failure::Input(error.to_string()))
        }

        fn adapter(&self) -> Adapter {
            Adapter::default()
        }
    }
    let config = LineConfig {
        protocol: Protocol::Tcp,
        gateway: Some(Gateway { at_once: Some(1), wait: Some(SECOND / 5) }),
        ..LineConfig::stream(bench.serial)
    };
    let task = bench.task(config, 10 * SECOND);
    let seen = observe::observe(&task, &Behind(gateway), |_| {}, std::future::pending()).await.unwrap();
    assert_eq!(kinds(&seen), [Defect::RefusesAll], "{}", told(&seen));
    assert!(judge(&seen)[0].finding.contains("0Bh"), "{}", told(&seen));
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_acknowledges_later_than_the_link_waits_is_named_with_the_setting() {
    let serial: SerialSettings = "19200 8O1".parse().unwrap();
    let line = SimLine::new(Wiring { protocol: drive_sim::Protocol::UniTelway, ..Wiring::rtu(serial) });
    let mut bench = Bench { line, names: Vec::new(), machines: Vec::new(), serial };
    for number in [1, 2] {
        let model = simulated::model(Family::ATV58, SetUp::Factory).unwrap();
        bench.machines.push(bench.line.add_boxed(number, model).unwrap());
        bench.names.push(DriveName { family: Family::ATV58, slave: SlaveAddress::try_from(number).unwrap() });
    }
    let late = drive_sim::LinkHabits { acknowledges_after: Some(3 * SECOND / 20), ..Default::default() };
    bench.machine(2).set_link_habits(late);
    let config = LineConfig { protocol: "unitelway".parse().unwrap(), ..LineConfig::stream(serial) };
    let task = bench.task(config, 20 * SECOND);
    let seen =
        observe::observe(&task, &InMemory(bench.line.clone()), |_| {}, std::future::pending()).await.unwrap();
    let verdicts = judge(&seen);
    assert_eq!(defects(&verdicts), [(Defect::LinkTimeout, vec![2])], "{}", told(&seen));
    assert!(verdicts[0].next[0].contains("link-timeout=200ms"), "{}", told(&seen));
}
