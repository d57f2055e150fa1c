//! Files of tests.

use std::{fs, path::PathBuf};

/// A folder of one test; removed when dropped.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("drived-doors-{}-{name}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A small disk of one test, where whoever runs the tests may mount one; gone when dropped.
#[cfg(target_os = "linux")]
pub struct Disk(PathBuf);

#[cfg(target_os = "linux")]
impl Disk {
    /// `None`: this machine gives none.
    pub fn of(name: &str) -> Option<Self> {
        let at = std::env::temp_dir().join(format!("drived-disk-{name}-{}", std::process::id()));
        fs::create_dir_all(&at).unwrap();
        let disk = Self(at);
        if disk.mounted("size=768k") {
            return Some(disk);
        }
        println!("skipped: this machine gives no disk to mount");
        None
    }

    pub fn path(&self) -> &std::path::Path {
        &self.0
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Takes whatever is free.
    pub fn fill(&self) {
        use std::io::Write as _;
        let mut fill = fs::OpenOptions::new().create(true).append(true).open(self.file("fill")).unwrap();
        while fill.write_all(&[0x55; 512]).is_ok() {}
    }

    /// Whether it can only be read from now on.
    pub fn is_only_read(&self, only_read: bool) {
        assert!(self.mounted(if only_read { "remount,ro" } else { "remount,rw" }));
    }

    fn mounted(&self, options: &str) -> bool {
        let mut mount = std::process::Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", options, "tmpfs"]).arg(&self.0);
        mount.stderr(std::process::Stdio::null()).status().is_ok_and(|code| code.success())
    }
}

#[cfg(target_os = "linux")]
impl Drop for Disk {
    fn drop(&mut self) {
        let mut umount = std::process::Command::new("umount");
        let _ = umount.arg("-l").arg(&self.0).stderr(std::process::Stdio::null()).status();
        let _ = fs::remove_dir_all(&self.0);
    }
}
