//! A Prometheus with the rules that the program gives out.

use std::{
    fs,
    path::PathBuf,
    process::{Child, Command, Stdio},
    thread,
    time::Duration,
};

use super::support::{ask, free_port, path, run};

/// A Prometheus of this test alone; killed when dropped.
pub(crate) struct Prometheus {
    child: Child,
    port: u16,
    folder: PathBuf,
}

impl Prometheus {
    /// It scrapes the daemons of these configurations each second, found by the files in which `drived export file-sd` says where they are,
    /// and judges the rules that the program gives out.
    pub(crate) fn start(name: &str, configurations: &[&str]) -> Self {
        let (folder, port) = (path(name), free_port());
        fs::create_dir_all(&folder).expect("it can be made");
        for (number, file) in configurations.iter().enumerate() {
            let found = run(&["export", "file-sd", "--config", file, "--host", "localhost"]);
            let to = folder.join(format!("host-{number}.json"));
            fs::write(to, found.assert_done()).expect("it can be written");
        }
        let rules = run(&["export", "alerts"]);
        fs::write(folder.join("rules.yml"), rules.assert_done()).expect("it can be written");
        let config = "global: { scrape_interval: 1s, evaluation_interval: 1s }\nrule_files: [rules.yml]\nscrape_configs:\n\
             \x20 - { job_name: drived, file_sd_configs: [{ files: [\"host-*.json\"] }] }\n";
        fs::write(folder.join("prometheus.yml"), config).expect("it can be written");
        let child = Command::new("prometheus")
            .arg(format!("--config.file={}", folder.join("prometheus.yml").display()))
            .arg(format!("--storage.tsdb.path={}", folder.join("data").display()))
            .arg(format!("--web.listen-address=127.0.0.1:{port}"))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("it was there a moment ago");
        let mut prometheus = Self { child, port, folder };
        prometheus.wait(|prometheus| {
            let ready = std::net::TcpStream::connect(("127.0.0.1", prometheus.port));
            ready.is_ok().then_some(())
        });
        prometheus
    }

    /// Asks again and again until something is so.
    #[expect(
        clippy::disallowed_methods,
        reason = "no runtime is here, and Prometheus tells nobody when it has scraped"
    )]
    pub(crate) fn wait<T>(&mut self, mut is_so: impl FnMut(&Self) -> Option<T>) -> T {
        loop {
            assert!(self.child.try_wait().expect("it is a child").is_none(), "Prometheus has ended");
            if let Some(so) = is_so(self) {
                return so;
            }
            thread::sleep(Duration::from_millis(200));
        }
    }

    /// The answer to a query; `None` while it is still starting.
    pub(crate) fn query(&self, query: &str) -> Option<String> {
        let encoded: String = query.bytes().map(|byte| format!("%{byte:02X}")).collect();
        let answer =
            ask(self.port, &format!("GET /api/v1/query?query={encoded} HTTP/1.0\r\nHost: localhost\r\n\r\n"));
        answer.contains("200 OK").then_some(answer)
    }

    /// The alerts that fire.
    pub(crate) fn firing(&self) -> Option<String> {
        self.query(r#"ALERTS{alertstate="firing"}"#)
    }
}

impl Drop for Prometheus {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = fs::remove_dir_all(&self.folder);
    }
}
