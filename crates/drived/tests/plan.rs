//! `plan`: its figures follow from the line's arithmetic, and it says no to what cannot work.

mod support;

use drive_families::Family;
use support::{File, run};

/// Whole nanoseconds.
type Nanos = u128;

const MS: Nanos = 1_000_000;
const S: Nanos = 1_000 * MS;
/// An Altivar 312 answers within this, as the plan has it.
const RESPONSE: Nanos = 10 * MS;

/// So many characters of 11 bits (8E1).
fn characters(baud: Nanos, count: Nanos) -> Nanos {
    count * 11 * S / baud
}

/// 3.5 characters, and 1.75 ms above 19200 bit/s (MODBUS over Serial Line V1.02 p. 13).
fn t3_5(baud: Nanos) -> Nanos {
    if baud > 19_200 { 1_750_000 } else { 7 * 11 * S / (2 * baud) }
}

/// The frame of a read (8 characters) or that of its answer with eight words (21), and what is between them.
fn read(baud: Nanos) -> Nanos {
    characters(baud, 8 + 21) + RESPONSE + t3_5(baud)
}

/// One status of an Altivar 312: one read of its six words (17 characters), and such a read behind every twentieth that proves its
/// run command.
fn status(baud: Nanos) -> Nanos {
    let read = characters(baud, 8 + 17) + RESPONSE + t3_5(baud);
    read + read / 20
}

/// A read without an answer.
fn lost(baud: Nanos, timeout: Nanos) -> Nanos {
    characters(baud, 8) + t3_5(baud) + timeout
}

/// A time as it is shown: never shorter than it is.
fn shown(time: Nanos) -> String {
    let millis = time.div_ceil(MS);
    if millis < 1_000 {
        return format!("{millis} ms");
    }
    format!("{}.{:02} s", millis.div_ceil(10) / 100, millis.div_ceil(10) % 100)
}

/// The cells of the row with this label.
fn row(out: &str, label: &str) -> Vec<String> {
    let line = out
        .lines()
        .find(|line| line.trim_start().starts_with(label))
        .unwrap_or_else(|| panic!("{label}: {out}"));
    let cells = line.trim_start().split("  ").map(str::trim).filter(|cell| !cell.is_empty());
    cells.skip(1).map(str::to_owned).collect()
}

/// Whether a figure in percent is this share, to its last decimal.
fn assert_share(figure: &str, part: Nanos, of: Nanos) {
    let ppm: f64 = part as f64 / of as f64 * 100.0;
    let told: f64 = figure.trim_end_matches(" %").parse().expect("a number");
    assert!((told - ppm).abs() <= 0.011, "{figure}, expected {ppm}");
}

fn fans(port: &str, number: usize, running: &str, more: &str) -> String {
    format!(
        "[lines.north]\nport = \"{port}\"\nresponse_timeout = \"200ms\"\n\
         [[drives]]\nline = \"north\"\ndrive = \"atv312@1-{number}\"\nname = \"fan {{}}\"\n\
         running = \"{running}\"\nrest = \"2s\"\nslow = \"60s\"\n{more}"
    )
}

const WATCHED: &str =
    "control = true\nmax_age = \"6s\"\nwatchdog = { time = \"10s\", reaction = \"ramp\" }\n";

#[test]
fn the_figures_of_a_file_follow_from_the_arithmetic_of_its_line() {
    let file = File::new("works", &fans("/dev/nowhere,19200,8E1", 31, "1500ms", WATCHED));
    let ended = run(&["plan", "--config", file.path()]);
    let out = ended.assert_done();
    assert!(out.starts_with("line north: 31 drives on /dev/nowhere, 19200 8E1 rtu"), "{out}");
    let family = Family::ATV312.capabilities();
    let counted =
        (family.status_exchanges, family.status_words, family.statuses_per_turn, family.stop_exchanges);
    assert_eq!(counted, (1, 6, 20, 4), "the figures below count so");
    let slow_reads = Nanos::from(family.measurement_exchanges);

    // What the probes of the dead take, a twentieth, the living do without.
    let cases = [(19_200, 31, 0, 20), (38_400, 31, 0, 20), (19_200, 28, 3, 19)];
    for (column, (baud, living, dead, of_twenty)) in cases.into_iter().enumerate() {
        let cell = |label: &str| row(out, label).get(column).expect("each case has a column").clone();
        let sweep = living * status(baud) * 20 / of_twenty;
        assert_eq!(cell("works"), "yes");
        assert_eq!(cell("cycle"), shown(sweep));

        let each_minute = living * (40 * status(baud) + slow_reads * read(baud)) + (20 - of_twenty) * 3 * S;
        assert_share(&cell("used by polls"), each_minute, 60 * S);
        assert_share(&cell("left for commands"), 60 * S - each_minute, 60 * S);

        // Every twentieth turn is the measurements', while they are due.
        let wait = sweep * 20 / 19;
        assert_eq!(cell("running: status"), shown(1_500 * MS + wait));
        assert_eq!(cell("at rest: status"), shown(2 * S + wait));
        let statuses = living * 40 * status(baud) + (20 - of_twenty) * 3 * S;
        let measured = 60 * S + living * slow_reads * read(baud) * 60 * S / (60 * S - statuses);
        let told: f64 = cell("measurements").trim_end_matches(" s").parse().expect("a number");
        assert!((told - measured as f64 / S as f64).abs() < 0.02, "{told} and {measured}");

        let (answer, timeout) = (lost(baud, 200 * MS), 200 * MS);
        let fed = 5 * S + answer * Nanos::max(dead, 1) + living * read(baud);
        assert_eq!(cell("watchdog of 10s"), shown(fed));

        // A write of the most words that the family takes is under way and is never answered.
        let longest = characters(baud, 9 + 2 * Nanos::from(family.write_words));
        let answered = characters(baud, 5 + 2 * Nanos::from(family.read_words));
        // It is given up after a frame's longest babble and an adapter's longest pause, and then somebody else's may
        // come.
        let babble = characters(baud, 256) + 20 * MS;
        let pause = family.turnaround.as_nanos();
        let wire = longest + timeout + answered + 2 * babble + t3_5(baud) + pause;
        assert_eq!(cell("a stop is on the wire"), shown(wire));

        // When it is on the wire, a broadcast goes out, then three writes and a status of each, and each mute
        // drive costs three answers until the line takes it for off-line.
        let stop = wire + 100 * MS + 4 * living * read(baud) + 3 * dead * answer;
        assert_eq!(cell("all have confirmed"), shown(stop));
    }
}

#[test]
fn lines_stop_beside_each_other_so_all_stop_with_the_slowest() {
    let text = format!(
        "{}[lines.south]\nport = \"/dev/nowhere2,9600,8N1\"\nresponse_timeout = \"300ms\"\n\
         [[drives]]\nline = \"south\"\ndrive = \"atv28@1-2\"\nrunning = \"1s\"\nmax_age = \"6s\"\n",
        fans("/dev/nowhere,19200,8E1", 5, "1500ms", WATCHED)
    );
    let file = File::new("two-lines", &text);
    let ended = run(&["plan", "--config", file.path()]);
    let out = ended.assert_done();
    let (first, rest) = out.split_once("line south").expect("two lines");
    let (second, together) = rest.split_once("all 2 lines: 7 drives").expect("and both together");
    for label in ["a stop is on the wire within", "all have confirmed a stop within"] {
        let planned = |part: &str| row(part, label)[0].clone();
        let millis = |figure: String| -> f64 {
            match figure.strip_suffix(" ms") {
                Some(millis) => millis.parse().expect("a number"),
                None => figure.trim_end_matches(" s").parse::<f64>().expect("a number") * 1_000.0,
            }
        };
        let (first, second, together) =
            (millis(planned(first)), millis(planned(second)), millis(planned(together)));
        assert!((together - first.max(second)).abs() < 0.5, "{label}: {first} {second} {together}");
    }
}

#[test]
fn a_line_that_is_too_slow_for_its_periods_is_refused_with_the_arithmetic() {
    let file = File::new("too-slow", &fans("/dev/nowhere,9600,8E1", 31, "500ms", "max_age = \"6s\"\n"));
    let ended = run(&["plan", "--config", file.path()]);
    let sweep = 31 * status(9_600);
    // Each drive has a status in each half second, and its measurements each minute.
    let slow = Nanos::from(Family::ATV312.capabilities().measurement_exchanges) * 31 * read(9_600);
    let percent = (sweep * 120 + slow) * 1_000 / (60 * S);
    ended.assert_refused(2, &format!(
        "too-slow.toml:1: lines.north: one status of 31 drives takes {}.{:03}s and the polls want {}.{} % of the line",
        sweep.div_ceil(MS) / 1_000, sweep.div_ceil(MS) % 1_000, percent / 10, percent % 10
    ));
    assert_eq!(row(&ended.out, "works"), ["NO", "NO", "NO"], "and the figures are shown all the same");
    assert_eq!(row(&ended.out, "cycle")[0], shown(sweep));
    assert_eq!(row(&ended.out, "running: status"), ["no limit"; 3]);
}

#[test]
fn a_watchdog_that_cannot_be_fed_is_refused_with_the_arithmetic_and_the_time_that_it_would_need() {
    let watchdog = |time: &str| {
        let more = format!(
            "control = true\nmax_age = \"6s\"\nwatchdog = {{ time = \"{time}\", reaction = \"ramp\" }}\n"
        );
        let file = File::new("watchdog", &fans("/dev/nowhere,19200,8E1", 31, "3s", &more));
        run(&["plan", "--config", file.path()])
    };
    let refused = watchdog("2s");
    let gap = S + lost(19_200, 200 * MS) + 31 * read(19_200);
    let hears = gap.div_ceil(MS);
    refused.assert_refused(2, &format!(
        "lines.north: the watchdog of fan 1 is 2s, and it might hear nothing for {}.{:03}s: 1s until it gets a frame",
        hears / 1_000, hears % 1_000
    ));
    assert!(row(&refused.out, "watchdog of 2s")[0].ends_with(": NO"), "{}", refused.out);
    let needed = 2 * (gap - S);
    refused
        .assert_refused(2, &format!("set it to {}.{:03}s or more", needed / S, needed.div_ceil(MS) % 1_000));
    watchdog("2300ms").assert_done();
}

#[test]
fn a_watchdog_that_nobody_set_but_the_family_always_has_is_fed_too() {
    let out = run(&["plan", "--line", "/dev/nowhere,19200,8E1", "--drive", "3g3ev@1-5", "--watchdog", "10s"]);
    assert_eq!(row(out.assert_done(), "watchdog of 2s").len(), 3, "{out:?}");
    let refused = run(&["plan", "--line", "/dev/nowhere,19200,8E1", "--drive", "3g3ev@1-31"]);
    refused.assert_refused(2, "the watchdog of 3g3ev@1 is 2s");
}

#[test]
fn a_status_that_grows_older_than_it_may_is_refused_with_the_arithmetic() {
    let file = File::new("stale", &fans("/dev/nowhere,19200,8E1", 31, "1500ms", "max_age = \"2500ms\"\n"));
    let ended = run(&["plan", "--config", file.path()]);
    let wait = (31 * status(19_200) * 20 / 19).div_ceil(MS);
    let told = format!("2s of the period and {wait}ms of waiting for the other drives, and from 2.5s on");
    ended.assert_refused(2, &told);
}

#[test]
fn what_is_wrong_in_a_file_is_told_with_its_line_and_field() {
    let good = fans("/dev/nowhere,19200,8E1", 31, "1500ms", WATCHED);
    for (instead_of, with, told) in [
        ("\"1500ms\"", "\"soon\"", ".toml:8: running: \"soon\": expected a whole number and a unit"),
        (
            "drive = \"atv312@1-31\"",
            "drive = \"atv999@1\"",
            ".toml:6: drive: \"atv999@1\": \"atv999\" is not a family",
        ),
        ("19200,8E1", "31250,8E1", ".toml:2: port: atv312@1: 31250 bit/s"),
        ("line = \"north\"", "line = \"south\"", ".toml:5: line: there is no line \"south\""),
        ("rest = \"2s\"", "rests = \"2s\"", ".toml:9: rests: unknown field"),
    ] {
        let text = good.replacen(instead_of, with, 1);
        assert_ne!(text, good, "{instead_of}");
        let ended = run(&["plan", "--config", File::new("wrong-plan", &text).path()]);
        ended.assert_refused(2, told);
        assert_eq!(ended.out, "", "nothing is calculated");
    }
    run(&["plan", "--config", "nowhere.toml"]).assert_refused(2, "nowhere.toml: cannot be read");
}

#[test]
fn a_file_and_a_line_are_two_ways_of_which_one_is_taken() {
    let line = ["--line", "/dev/nowhere", "--drive", "atv312@1"];
    run(&["plan"]).assert_refused(2, "--config <FILE>|--line <LINE>");
    run(&[&["plan", "--config", "drives.toml"], &line[..]].concat()).assert_refused(2, "cannot be used with");
    run(&["plan", "--config", "drives.toml", "--period", "2s"]).assert_refused(2, "cannot be used with");
    run(&["plan", "--line", "/dev/nowhere"]).assert_refused(2, "--drive <FAMILY@ADDRESSES>");
    run(&[&["plan", "--period", "0"], &line[..]].concat()).assert_refused(2, "the time between two polls");
}

#[test]
fn a_line_of_the_command_line_has_the_figures_of_the_same_line_in_a_file() {
    let described = run(&[
        "plan",
        "--line",
        "/dev/nowhere,19200,8E1",
        "--drive",
        "atv312@1-10",
        "--period",
        "2s",
        "--watchdog",
        "10s",
    ]);
    let text = "[lines.a]\nport = \"/dev/nowhere,19200,8E1\"\nresponse_timeout = \"500ms\"\n[[drives]]\nline = \"a\"\n\
                drive = \"atv312@1-10\"\nrunning = \"2s\"\nrest = \"2s\"\nslow = \"0\"\nmax_age = \"9s\"\n\
                control = true\nwatchdog = { time = \"10s\", reaction = \"ramp\" }\n";
    let file = File::new("same", text);
    let written = run(&["plan", "--config", file.path()]);
    // Only a file has a history to reckon with.
    let figures = |out: &str| -> Vec<String> {
        out.split("\n\nhistory:")
            .next()
            .into_iter()
            .flat_map(str::lines)
            .filter(|line| !line.starts_with("line") && !line.contains("a 1 … a 10"))
            .map(str::to_owned)
            .collect()
    };
    let without_names = |line: &String| !line.starts_with("atv312@1-10");
    let (described, written) = (figures(described.assert_done()), figures(written.assert_done()));
    let (described, written): (Vec<_>, Vec<_>) = (
        described.iter().filter(|line| without_names(line)).collect(),
        written.iter().filter(|line| without_names(line)).collect(),
    );
    assert_eq!(described, written);
}

#[test]
fn modbus_tcp_has_no_speed_to_plan_with() {
    let out = run(&["plan", "--line", "tcp://gateway:502", "--drive", "atv312@1-4"]);
    let out = out.assert_done();
    assert!(!out.contains("38400"), "{out}");
    assert_eq!(row(out, "cycle")[0], shown(4 * (RESPONSE + RESPONSE / 20)));
}

#[test]
fn the_example_of_the_repository_can_work_and_the_manual_shows_what_is_printed_of_it() {
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/drives.toml");
    let manual = [
        include_str!("../docs/plan.md"),
        include_str!("../docs/daemon.md"),
        include_str!("../docs/families.md"),
    ];
    let is_shown = |printed: &str| manual.iter().any(|chapter| chapter.contains(printed));
    let planned = run(&["plan", "--config", example]);
    let out = planned.assert_done();
    assert!(out.contains("line north: 31 drives") && out.contains("all 2 lines: 34 drives"), "{out}");
    assert!(!out.contains("NO"), "{out}");
    // Where the history is kept depends on the machine.
    let (lines, history) = out.split_once("\n\nhistory: in ").expect("it has one");
    assert!(is_shown(lines), "{lines}");
    assert!(history.contains("MiB at the most") && history.contains("a day"), "{history}");
    let checked = run(&["check", "--config", example]);
    let (first_line, _) = checked.assert_done().split_once("line south").expect("two lines");
    assert!(is_shown(first_line), "{first_line}");
    let families = run(&["families"]);
    assert!(is_shown(families.assert_done()), "{families:?}");
}

#[test]
fn an_altivar_58_on_ascii_has_the_watchdog_of_its_card_there_in_plan_check_and_families() {
    let line = "/dev/nowhere,9600,7E1,ascii";
    let plan = run(&["plan", "--line", line, "--drive", "atv58@1-3"]);
    plan.assert_refused(2, "the watchdog of atv58@1 is 1s");
    assert_eq!(row(&plan.out, "watchdog of 1s").len(), 2, "{plan:?}");
    let rtu = run(&["plan", "--line", "/dev/nowhere,9600,8E1", "--drive", "atv58@1-3"]);
    assert_eq!(row(rtu.assert_done(), "watchdog of 10s").len(), 2, "{rtu:?}");
    let file = |time: &str| {
        let text = format!(
            "[lines.cell]\nport = \"{line}\"\n[[drives]]\nline = \"cell\"\ndrive = \"atv58@1-3\"\ncontrol = true\n\
             watchdog = {{ time = \"{time}\", reaction = \"trip\" }}\n"
        );
        let file = File::new("ascii", &text);
        run(&["check", "--config", file.path()])
    };
    assert_eq!(
        row(file("1s").assert_done(), "watchdog"),
        ["1s, then trip (how the motor stops is not in the manual)"]
    );
    file("10s").assert_refused(2, "a watchdog of 10s: Schneider Altivar 58");
    let families = run(&["families", "atv58"]);
    assert!(families.assert_done().contains("10s, not settable over the bus; in ASCII 1s"), "{families:?}");
}

#[test]
fn more_stations_than_a_family_allows_on_a_segment_are_refused() {
    let plan = |more: &[&str]| {
        let line = ["plan", "--line", "/dev/nowhere,19200,8N1", "--drive", "atv28@1-19", "--period", "5s"];
        run(&[&line[..], more].concat())
    };
    plan(&[]).assert_refused(
        2,
        "19 drives on 1 segment: atv28@1 is of the family Schneider Altivar 28, which allows 18 stations",
    );
    plan(&["--segments", "2"]).assert_done();
    // VVDED397054 p. 8: not more than 28 stations on a bus.
    let cards = |drives: &str| {
        run(&["plan", "--line", "/dev/nowhere,19200,8O1", "--drive", drives, "--period", "5s"])
    };
    cards("atv58@1-28").assert_done();
    cards("atv58@1-29").assert_refused(2, "which allows 28 stations");
    let wide = run(&["plan", "--line", "/dev/nowhere,19200,8E1", "--drive", "atv312@1-32", "--period", "5s"]);
    wide.assert_refused(2, "which allows 31 stations");
}

#[test]
fn of_a_stop_over_modbus_tcp_the_plan_says_what_is_a_gateways_and_asks_for_it() {
    let planned = |line: &str| {
        let ended = run(&["plan", "--line", line, "--drive", "atv312@1"]);
        let out = ended.assert_done().to_owned();
        (row(&out, "a stop is on the wire")[0].clone(), out)
    };
    let (alone, out) = planned("tcp://drive:502,gateway=none");
    assert!(!out.contains("gateway's"), "{out}");
    // The longest answer that is waited for, and nothing of a line that is not there.
    assert!(alone.ends_with(" ms"), "{alone}");
    let (assumed, out) = planned("tcp://drive:502");
    assert!(
        out.contains(&format!("Say gateway=none where each drive answers for itself: then it is {alone}")),
        "{out}"
    );
    let (three, out) = planned("tcp://drive:502,gateway=3x1s");
    assert!(out.contains("3.00 s of a stop's wait are the gateway's, which waits 3s"), "{out}");
    let seconds = |text: &str| text.trim_end_matches(" s").parse::<f64>().expect("seconds");
    assert!((seconds(&assumed) - seconds(&three) - 3.0).abs() < 0.011, "{assumed} and {three}");
}
