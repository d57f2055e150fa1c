//! The man pages, judged by two programs that show such pages. `.ci/run` installs them.
#![cfg(unix)]

mod support;

use std::{fs, path::PathBuf, process::Command};

use support::{is_there, path, run};

/// The pages in a folder of this test alone.
fn pages(name: &str) -> (PathBuf, Vec<PathBuf>) {
    let folder = path(name);
    let to = folder.to_str().expect("the path is text");
    let said = run(&["export", "man", "--to", to]);
    assert!(said.assert_done().contains("/drived.1 shows the first"), "{said:?}");
    let pages = fs::read_dir(&folder).expect("it was made").map(|page| page.expect("it can be read").path());
    let pages = pages.collect();
    (folder, pages)
}

#[test]
fn every_page_is_shown_without_a_warning() {
    let judges =
        [("mandoc", &["-Tlint", "-W", "warning"][..]), ("man", &["--warnings", "-l", "-Tutf8", "-Z"])];
    let (folder, pages) = pages("man-judged");
    for (judge, arguments) in judges {
        if !is_there("sh", &["-c", &format!("command -v {judge}")]) {
            continue;
        }
        for page in &pages {
            let mut command = Command::new(judge);
            let judged =
                command.args(arguments).arg(page).env("LC_ALL", "C.UTF-8").output().expect("it starts");
            // mandoc judges on stdout, man on stderr, where it shows the page on stdout.
            let told = if judge == "man" { &judged.stderr } else { &judged.stdout };
            let told = String::from_utf8_lossy(told);
            assert!(judged.status.success() && told.is_empty(), "{judge}: {}: {told}", page.display());
        }
    }
    fs::remove_dir_all(folder).expect("it is there");
}

#[test]
fn no_page_and_no_help_shows_the_marks_of_a_markup() {
    let (folder, pages) = pages("man-marks");
    for page in &pages {
        let text = fs::read_to_string(page).expect("it is text");
        assert!(!text.contains("**"), "{}", page.display());
    }
    for subcommand in ["scan", "report", "run", "explain", "replay"] {
        let help = run(&[subcommand, "--help"]);
        assert!(!help.assert_done().contains("**"), "{subcommand}: {help:?}");
    }
    fs::remove_dir_all(folder).expect("it is there");
}

#[test]
fn each_subcommand_has_a_page_that_tells_exit_codes_environment_and_its_options() {
    let (folder, pages) = pages("man-each");
    let read =
        |name: &str| fs::read_to_string(folder.join(name)).unwrap_or_else(|_| panic!("{name}: {pages:?}"));
    for line in run(&["help"]).out.lines().skip_while(|line| *line != "Commands:").skip(1) {
        let Some(name) = line.strip_prefix("  ").and_then(|line| line.split_whitespace().next()) else {
            break;
        };
        if name != "help" && !line.starts_with("   ") {
            read(&format!("drived-{name}.1"));
        }
    }
    for name in ["drived-stop.1", "drived-param-set.1", "drived.1"] {
        let page = read(name);
        for text in
            ["EXIT STATUS", "bad input or a plan that cannot work", "ENVIRONMENT", "DRIVED_LOG", "NO_COLOR"]
        {
            assert!(page.contains(text), "{name}: {text}");
        }
    }
    assert!(read("drived-stop.1").contains("freewheel") && read("drived-stop.1").contains("\\-\\-mode"));
    assert!(read("drived-param-set.1").contains("drived param set [OPTIONS] [NAME] REGISTER VALUE"));
    fs::remove_dir_all(&folder).expect("it is there");
}

#[test]
fn the_pages_need_a_folder_and_nothing_else_does() {
    run(&["export", "man"]).assert_refused(2, "--to <FOLDER>");
    run(&["export", "alerts", "--to", "/tmp"]).assert_refused(2, "--to is for the man pages");
}
