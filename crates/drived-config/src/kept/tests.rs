//! Files in folders of tests, with links in them.

use std::{fs, os::unix::fs::symlink};

use super::*;
#[cfg(target_os = "linux")]
use crate::testing::Disk;
use crate::testing::Folder;

#[test]
fn a_file_is_replaced_whole_with_its_folder_and_nobody_else_reads_it() {
    let folder = Folder::new("kept");
    let kept = Kept::at(&folder.file("deep/er/file"));
    assert!(kept.read().unwrap().is_none());
    kept.replace(b"one", Readers::Owner).unwrap();
    let before = kept.stamp().unwrap().unwrap();
    kept.replace(b"two", Readers::Owner).unwrap();
    let (content, after) = kept.read().unwrap().unwrap();
    assert_eq!(content, b"two");
    assert!(before != after && after.is_private);
    assert_eq!(fs::read_dir(folder.file("deep/er")).unwrap().count(), 1, "nothing is left beside it");
}

#[test]
fn a_link_in_the_place_of_a_file_is_told_with_what_to_name_instead() {
    let folder = Folder::new("kept-link");
    fs::write(folder.file("elsewhere"), "precious").unwrap();
    symlink("elsewhere", folder.file("file")).unwrap();
    let kept = Kept::at(&folder.file("file"));
    for error in [kept.read().unwrap_err(), kept.open_to_append().unwrap_err()] {
        let wanted = format!(
            "it is a link, which is not followed: name {} itself",
            folder.file("elsewhere").display()
        );
        assert_eq!(error.to_string(), wanted);
    }
    kept.replace(b"new", Readers::Owner).unwrap();
    assert_eq!(fs::read_to_string(folder.file("elsewhere")).unwrap(), "precious");
    assert_eq!(fs::read_to_string(folder.file("file")).unwrap(), "new");
}

#[test]
fn a_link_of_this_user_on_the_way_to_a_folder_is_followed_and_a_circle_is_not() {
    let folder = Folder::new("kept-way");
    fs::create_dir(folder.file("private")).unwrap();
    symlink("private", folder.file("public")).unwrap();
    Kept::at(&folder.file("public/file")).replace(b"x", Readers::Owner).unwrap();
    assert_eq!(fs::read(folder.file("private/file")).unwrap(), b"x");
    symlink("circle", folder.file("circle")).unwrap();
    assert!(Kept::at(&folder.file("circle/file")).replace(b"x", Readers::Owner).is_err());
    assert!(Kept::at(&folder.file("private/file/file")).read().is_err(), "a file is no folder");
}

/// As `/var/lib/drived` of a service with a dynamic user, which systemd lays as root to `private/drived`: the folder may be behind a link,
/// but nothing in it.
#[test]
fn a_folder_behind_a_link_is_kept_in_as_it_is_and_no_link_in_it_is_followed() {
    let folder = Folder::new("kept-dynamic");
    fs::create_dir_all(folder.file("private/drived")).unwrap();
    symlink("private/drived", folder.file("drived")).unwrap();
    let kept = Kept::at(&folder.file("drived/tokens"));
    kept.replace(b"one", Readers::Owner).unwrap();
    assert_eq!(fs::read(folder.file("private/drived/tokens")).unwrap(), b"one");
    assert!(fs::symlink_metadata(folder.file("drived")).unwrap().is_symlink(), "the link stays");
    drop(kept.lock().unwrap());
    fs::write(folder.file("precious"), "precious").unwrap();
    fs::remove_file(folder.file("private/drived/tokens")).unwrap();
    symlink("../../precious", folder.file("private/drived/tokens")).unwrap();
    assert!(kept.read().is_err() && kept.open_to_append().is_err());
    // Nor is one followed to a folder that is there no more: it is made where the link leads.
    fs::remove_dir_all(folder.file("private/drived")).unwrap();
    kept.replace(b"two", Readers::Owner).unwrap();
    assert_eq!(fs::read(folder.file("private/drived/tokens")).unwrap(), b"two");
    assert_eq!(fs::read_to_string(folder.file("precious")).unwrap(), "precious");
}

/// Only root can lay another's link.
#[test]
fn root_follows_no_link_of_another_and_opens_no_file_that_is_not_the_folders_owners() {
    if !geteuid().is_root() {
        eprintln!("skipped: needs root");
        return;
    }
    let folder = Folder::new("kept-root");
    let nobody = Some(65_534);
    fs::create_dir(folder.file("service")).unwrap();
    fs::write(folder.file("precious"), "precious").unwrap();
    std::os::unix::fs::chown(folder.file("service"), nobody, nobody).unwrap();
    symlink(folder.file(""), folder.file("service/way")).unwrap();
    std::os::unix::fs::lchown(folder.file("service/way"), nobody, nobody).unwrap();
    let told = Kept::at(&folder.file("service/way/precious")).read().unwrap_err();
    assert_eq!(told.to_string(), "way is a link of user 65534");
    assert!(Kept::at(&folder.file("service/way/new")).replace(b"x", Readers::Owner).is_err());
    assert!(Kept::at(&folder.file("service/way/new")).lock().is_err());
    assert!(!folder.file("new").exists());
    fs::hard_link(folder.file("precious"), folder.file("service/file")).unwrap();
    let kept = Kept::at(&folder.file("service/file"));
    assert!(kept.read().is_err() && kept.open_to_append().is_err());
    kept.replace(b"new", Readers::Owner).unwrap();
    assert_eq!(fs::read_to_string(folder.file("precious")).unwrap(), "precious");
    let owner = std::os::unix::fs::MetadataExt::uid(&fs::metadata(folder.file("service/file")).unwrap());
    assert_eq!(owner, 65_534);
}

#[test]
fn one_after_the_other_changes_a_folder() {
    let folder = Folder::new("kept-lock");
    let kept = Kept::at(&folder.file("count"));
    let count = || {
        let _lock = kept.lock().unwrap();
        let before = kept.read().unwrap().map_or(0, |(content, _)| content.len());
        kept.replace(&vec![b'x'; before + 1], Readers::Owner).unwrap();
    };
    thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| (0..10).for_each(|_| count()));
        }
    });
    assert_eq!(kept.read().unwrap().unwrap().0.len(), 80);
}

#[cfg(target_os = "linux")]
fn ballast(disk: &Disk) -> u64 {
    fs::metadata(disk.file(BALLAST)).map_or(0, |known| known.len())
}

#[cfg(target_os = "linux")]
fn secured(kept: &Kept, content: &[u8], stale: Stale) -> Result<(), Unwritten> {
    kept.secure(Ok::<_, io::Error>(content.to_vec()), stale)
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_has_room_for_what_is_secured_as_long_as_there_is_ballast_which_is_made_anew_with_room() {
    let Some(disk) = Disk::of("ballast") else { return };
    lay_ballast(disk.path()).unwrap();
    let whole = ballast(&disk);
    assert_eq!(whole, 256 << 10);
    assert!(fs::metadata(disk.file(BALLAST)).is_ok_and(|known| {
        use std::os::unix::fs::MetadataExt as _;
        known.blocks() * 512 >= whole
    }));
    let kept = Kept::at(&disk.file("runs.json"));
    let mut last = whole;
    for round in 0..8_u8 {
        disk.fill();
        secured(&kept, &[round; 9_000], Stale::Emptied).unwrap();
        assert_eq!(kept.read_secured().unwrap().unwrap(), [round; 9_000]);
        assert!(ballast(&disk) <= last);
        last = ballast(&disk);
    }
    assert_eq!(last, 0, "others took what was free each time");
    // Its own room is left.
    disk.fill();
    secured(&kept, b"alone", Stale::Emptied).unwrap();
    assert_eq!(kept.read_secured().unwrap().unwrap(), b"alone");
    fs::remove_file(disk.file("fill")).unwrap();
    secured(&kept, b"room", Stale::Emptied).unwrap();
    assert_eq!(ballast(&disk), whole);
}

#[test]
#[cfg(target_os = "linux")]
fn what_cannot_be_written_is_known_as_old_by_whoever_reads_it_unless_the_old_is_better_than_nothing() {
    let Some(disk) = Disk::of("stale") else { return };
    let (emptied, left) = (Kept::at(&disk.file("runs.json")), Kept::at(&disk.file("names.json")));
    secured(&emptied, b"old", Stale::Emptied).unwrap();
    secured(&left, b"old", Stale::Left).unwrap();
    disk.fill();
    // More than all of the disk.
    let much = vec![0x55; 1 << 20];
    let told = secured(&emptied, &much, Stale::Emptied).unwrap_err().to_string();
    assert!(told.contains("was taken out"), "{told}");
    let read = emptied.read_secured().unwrap_err().to_string();
    assert!(read.contains("could not write it"), "{read}");
    let told = secured(&left, &much, Stale::Left).unwrap_err().to_string();
    assert!(told.contains("what stands there is old"), "{told}");
    assert_eq!(left.read_secured().unwrap().unwrap(), b"old");
    let names: Vec<_> = fs::read_dir(disk.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert!(
        !names.iter().any(|name| name.as_bytes().ends_with(b".new")),
        "half of it keeps no room: {names:?}"
    );
}
