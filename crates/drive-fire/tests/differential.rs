//! Our line and somebody else's, asked for the same.

use drive_fire::differential::Peer;
use drive_testing::peers;

#[test]
fn what_our_line_takes_for_an_answer_pymodbus_takes_too() {
    let Some(python) = peers::python_with("pymodbus") else { return };
    let told = drive_fire::differential::run(&python, Peer::Pymodbus, 1, 20_000).expect("it can be asked");
    println!("{told}");
    assert!(told.finds.is_empty(), "{told}");
    assert_eq!(told.plants_found(), told.plants.len(), "{told}");
}

#[test]
fn what_our_line_takes_for_an_answer_libmodbus_takes_too() {
    let load = "import ctypes; ctypes.CDLL('libmodbus.so.5')";
    if !peers::is_there(peers::runs("python3", &["-c", load]), "libmodbus") {
        return;
    }
    let told = drive_fire::differential::run("python3".as_ref(), Peer::Libmodbus, 1, 4_000)
        .expect("it can be asked");
    println!("{told}");
    assert!(told.finds.is_empty(), "{told}");
    // Of the ten two are of ASCII, which libmodbus does not speak.
    assert!(told.plants_found() >= 9, "{told}");
}
