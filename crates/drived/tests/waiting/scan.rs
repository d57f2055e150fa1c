//! `scan --standstill` on a pty, of simulated drives with speeds and formats of their own.

use crate::support::{path, run};
use drive_sim::{
    Dialect, Model, SimLine, SimSlave,
    models::{atv28::Atv28, atv312::Atv312, drive_3g3ev::Drive3g3ev},
};

fn add(line: &SimLine, address: u8, settings: &str, model: Box<dyn Model>) -> SimSlave {
    let slave = line.add_boxed(address, model).expect("the address is free");
    slave.set_dialect(Dialect {
        settings: settings.parse().expect("they are settings"),
        ..Dialect::default()
    });
    slave
}

#[tokio::test(flavor = "multi_thread")]
async fn drives_at_different_speeds_and_formats_are_found_and_saved_and_nothing_is_written_to_them() {
    let (line, link) = (SimLine::default(), path("scan-mixed"));
    let drives = [
        add(&line, 1, "19200 8E1", Box::new(Atv312::new())),
        add(&line, 2, "9600 8E1", Box::new(Drive3g3ev::new())),
        add(&line, 3, "19200 8N1", Box::new(Atv28::new())),
        add(&line, 4, "4800 8O1", Box::new(Atv312::new())),
    ];
    let _serving = line.serve_pty(&link).expect("there is a pty");
    let (port, to) = (link.display().to_string(), path("scan-mixed.toml").display().to_string());
    let arguments =
        ["--line", &port, "--standstill", "--protocols", "rtu", "--addresses", "1-4", "--wait", "60ms"];
    let arguments = [&["scan"], &arguments[..], &["--save", &to]].concat().into_iter().map(str::to_owned);
    let arguments: Vec<String> = arguments.collect();
    let scan =
        tokio::task::spawn_blocking(move || run(&arguments.iter().map(String::as_str).collect::<Vec<_>>()));
    let scan = scan.await.expect("it ends");
    assert_eq!(scan.code, Some(0), "{scan:?}");
    for (address, found) in
        [(1, "19200 8E1 rtu"), (2, "9600 8E1 rtu"), (3, "19200 8N1 rtu"), (4, "4800 8O1 rtu")]
    {
        assert!(scan.out.contains(&format!("    {address}  {found}")), "{scan:?}");
    }
    assert!(scan.out.contains("4 of 4 addresses answer\n"), "{scan:?}");
    for drive in &drives {
        assert_eq!([0x05, 0x06, 0x0F, 0x10].map(|write| drive.requests(write)), [0; 4], "{}", drive.name());
        assert_eq!(drive.observe().trip, None, "{}", drive.name());
    }
    let text = std::fs::read_to_string(&to).expect("it is written");
    assert_eq!(text.matches("\n[lines.").count(), 1, "a port has one speed: {text}");
    assert_eq!(text.matches("[[drives]]").count(), 4, "{text}");
    let checked = tokio::task::spawn_blocking({
        let to = to.clone();
        move || run(&["check", "--config", &to])
    });
    checked.await.expect("it ends").assert_done();
    std::fs::remove_file(&to).expect("it was ours");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drive_from_a_file_is_named_beside_others_by_its_registers_and_nothing_is_written() {
    drived_config::profiles::ship().expect("nobody has their names");
    let (line, link) = (SimLine::default(), path("scan-files"));
    let drives = [("atv312", 1), ("wj200", 3), ("goodrive", 5)].map(|(family, address)| {
        let family: drive_families::Family = family.parse().expect("it is shipped");
        let model = drive_families::simulated::model(family, drive_families::SetUp::ForTheBus);
        line.add_boxed(address, model.expect("it has a twin")).expect("the address is free")
    });
    let _serving = line.serve_pty(&link).expect("there is a pty");
    let port = format!("{},19200,8E1", link.display());
    let scan = tokio::task::spawn_blocking(move || run(&["scan", "--line", &port, "--addresses", "1-6"]));
    let scan = scan.await.expect("it ends");
    for (address, is) in [
        (1, "atv312 ("),
        (3, "no drive of a family that is known here"),
        (5, "likely goodrive, by its registers"),
    ] {
        let begin = format!("    {address}  ");
        let row = scan.out.lines().find(|row| row.starts_with(&begin)).unwrap_or_default();
        assert!(row.contains(is), "{address}: {scan:?}");
    }
    for drive in &drives {
        assert_eq!([0x05, 0x06, 0x0F, 0x10].map(|write| drive.requests(write)), [0; 4]);
    }
}
