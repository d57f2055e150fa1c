//! `init`: a configuration from a scan, over a pty; and what the packaged service has for it.
#![cfg(unix)]

mod support;

use support::{File, Sim, path, run};

#[test]
fn a_scan_becomes_a_configuration_that_passes_check_and_is_never_written_over() {
    let sim =
        Sim::serve_with("init", &["atv312@1", "atv58@2", "atv21@5"], &["--baud", "19200", "--format", "8N1"]);
    let to = path("init-written.toml");
    let to = to.to_str().expect("the path is text");
    let line = format!("{},19200,8N1", sim.link());
    let arguments = ["init", "--line", &line, "--addresses", "1-6", "--to", to];
    let written = run(&arguments);
    assert_eq!((written.code, written.err.as_str()), (Some(0), ""), "{written:?}");
    let text = std::fs::read_to_string(to).expect("it is written");
    // What the drive says itself, and what is only guessed.
    assert!(text.contains("# By its own words. It says it is TELEMECANIQUE ATV312HU15N4"), "{text}");
    assert!(text.contains("drive = \"atv312@1\"") && text.contains("drive = \"atv58@2\""), "{text}");
    // The comment of the second stands behind the first.
    let guessed = text.split("[[drives]]").nth(1).unwrap_or_default();
    assert!(guessed.contains("# A GUESS by its registers"), "{text}");
    // Nothing is commanded until somebody takes the mark away.
    assert_eq!(text.matches("\n# control = true\n").count(), 3, "{text}");
    assert!(!text.lines().any(|line| line.starts_with("control")), "{text}");
    let checked = run(&["check", "--config", to]);
    assert_eq!(checked.assert_done().matches("none: it is only read").count(), 3, "{}", checked.out);
    // What is there is not touched, not even by the same.
    run(&arguments).assert_refused(2, "is there already, and not touched: name another by --to");
    assert_eq!(std::fs::read_to_string(to).expect("it is there"), text);
    std::fs::remove_file(to).expect("it was ours");
}

#[test]
fn nobody_on_the_line_is_no_configuration() {
    let sim = Sim::serve("init-none", &["atv312@1"]);
    let to = path("init-none.toml");
    let line = format!("{},19200,8E1", sim.link());
    let ended =
        run(&["init", "--line", &line, "--addresses", "7-8", "--to", to.to_str().expect("it is text")]);
    ended.assert_refused(1, "nobody answers at 2 addresses");
    assert!(!to.exists());
}

#[test]
fn the_packaged_service_waits_as_long_as_the_exit_may_take_and_check_says_where_it_does_not() {
    let unit = include_str!("../packaging/drived.service");
    let of = |shutdown: &str| {
        format!(
            "shutdown = \"{shutdown}\"\n[lines.north]\nport = \"/dev/nowhere\"\n[[drives]]\nline = \"north\"\n\
             drive = \"atv312@1\"\n"
        )
    };
    let usual = File::new("usual-exit", &of("60s"));
    let checked = run(&["check", "--config", usual.path()]);
    assert!(checked.assert_done().contains("as a service it needs TimeoutStopSec=70s"), "{checked:?}");
    assert!(!checked.out.contains("PACKAGED") && unit.contains("\nTimeoutStopSec=90s\n"), "{checked:?}");
    let long = File::new("long-exit", &of("120s"));
    let checked = run(&["check", "--config", long.path()]);
    assert!(checked.assert_done().contains("TimeoutStopSec=130s"), "{checked:?}");
    assert!(checked.out.contains("THE PACKAGED UNIT HAS LESS"), "{checked:?}");
}
