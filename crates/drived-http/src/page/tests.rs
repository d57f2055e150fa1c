//! What the page's files promise without a browser; `tests/page.rs` of the workspace looks at it with one.

use std::{collections::BTreeSet, fs, io::Read as _, path::Path};

use axum::{
    body::Body,
    http::{Request, Response},
};
use http_body_util::BodyExt as _;
use tower::ServiceExt as _;

use super::{
    files::{LATER, MODULES},
    *,
};
use drived_client as client;

fn text_of(path: &str) -> String {
    let file = files().into_iter().find(|file| file.path == path).expect("it is a file of the page");
    String::from_utf8(file.content).expect("it is text")
}

/// A module of the page.
fn module(name: &str) -> &'static str {
    modules().find(|(known, _)| *known == name).expect("it is a module of the page").1
}

/// Our own modules, without what was written elsewhere.
fn modules() -> impl Iterator<Item = (&'static str, &'static str)> {
    let french = [
        ("faults_fr.js", include_str!("web/faults_fr.js")),
        ("findings_fr.js", include_str!("web/findings_fr.js")),
        ("sentences_fr.js", include_str!("web/sentences_fr.js")),
    ];
    MODULES.iter().chain(LATER).copied().chain([("stop.js", STOP_SCRIPT)]).chain(french)
}

/// A file of the folder as it is written.
fn web(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/page/web").join(name);
    fs::read_to_string(path).expect("it is a file")
}

async fn get_with(path: &str, headers: &[(&str, &str)]) -> Response<Body> {
    let request =
        headers.iter().fold(Request::get(path), |request, (name, value)| request.header(*name, *value));
    router().oneshot(request.body(Body::empty()).expect("it is a request")).await.expect("it answers")
}

#[tokio::test]
async fn every_file_of_the_folder_is_served_with_its_type_or_stands_in_one_that_is() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/page/web");
    let listed = |folder: &Path| {
        let entries =
            fs::read_dir(folder).expect("it is a folder").map(|entry| entry.expect("it is listed").path());
        entries.filter(|path| path.is_file()).collect::<Vec<_>>()
    };
    let (document, script) = (text_of("/"), text_of("/app.js") + &text_of("/more.js"));
    for path in listed(&folder).into_iter().chain(listed(&folder.join("vendor"))) {
        let name = path.strip_prefix(&folder).expect("it is below").to_str().expect("it is text");
        let content = fs::read(&path).expect("it is read");
        match name {
            "index.html" => continue,
            "stop.js" | "stop.css" => {
                assert!(document.contains(std::str::from_utf8(&content).expect("it is text")), "{name}");
                continue;
            }
            _ if MODULES.iter().chain(LATER).any(|(module, _)| *module == name) => {
                assert!(script.contains(&format!("'{name}': (use, later) => {{")), "{name}");
                continue;
            }
            _ => {}
        }
        let answer = get_with(&format!("/{name}"), &[]).await;
        assert_eq!(answer.status(), 200, "{name}");
        let kind = answer.headers()["content-type"].to_str().expect("it is text").to_owned();
        let expected = match name.rsplit('.').next() {
            Some("js") => "text/javascript",
            Some("css") => "text/css",
            Some("svg") => "image/svg+xml",
            _ => "text/plain",
        };
        assert!(kind.starts_with(expected), "{name} is {kind}");
        let body = answer.into_body().collect().await.expect("it has a body").to_bytes();
        assert_eq!(body, content, "{name}");
    }
}

#[tokio::test]
async fn the_first_look_is_small_for_a_browser_that_reads_gzip_and_the_stop_is_in_its_first_packets() {
    let sizes = |path: &'static str| async move {
        let answer = get_with(path, &[("accept-encoding", "br, gzip;q=0.8")]).await;
        assert_eq!(answer.headers()["content-encoding"], "gzip", "{path}");
        assert_eq!(answer.headers()["vary"], "accept-encoding", "{path}");
        let body = answer.into_body().collect().await.expect("it has a body").to_bytes();
        let mut whole = Vec::new();
        flate2::read::GzDecoder::new(&body[..]).read_to_end(&mut whole).expect("it is gzip");
        let file = files().into_iter().find(|file| file.path == path).expect("it is a file");
        assert_eq!(whole, file.content, "{path}");
        body.len()
    };
    // Ten packets are sent before the first is acknowledged (RFC 6928): one round trip brings the whole stop.
    assert!(sizes("/").await < 10 * 1_400);
    assert!(sizes("/").await + sizes("/app.js").await + sizes("/page.css").await < 50_000);
    let document = text_of("/");
    let place = |part: &str| document.find(part).expect("it is there");
    assert!(place("id=\"stop\"") < place("rel=\"stylesheet\""));
    assert!(place(STOP_SCRIPT) < place("rel=\"stylesheet\""), "the script waits for no other file");
}

#[tokio::test]
async fn what_stands_in_line_is_allowed_by_its_hash_and_nothing_else_in_line_is() {
    let answer = get_with("/", &[]).await;
    let policy = answer.headers()["content-security-policy"].to_str().expect("it is text").to_owned();
    assert!(!policy.contains("unsafe"), "{policy}");
    // echo -n ... | openssl dgst -sha256 -binary | base64, of what stands between the tags as a browser reads it.
    let document = text_of("/");
    for tag in ["script", "style"] {
        let inside = document.split(&format!("<{tag}>")).nth(1).expect("it is in line");
        let inside = inside.split(&format!("</{tag}>")).next().expect("it ends");
        assert!(policy.contains(&STANDARD.encode(digest(&SHA256, inside.as_bytes()))), "{tag}");
    }
    assert!(get_with("/app.js", &[]).await.headers().get("content-security-policy").is_none());
}

#[tokio::test]
async fn a_browser_that_has_a_file_is_sent_nothing_until_the_file_changes() {
    let first = get_with("/app.js", &[]).await;
    assert_eq!(first.headers()["cache-control"], "no-cache");
    let tag = &first.headers()["etag"];
    let known = format!("\"other\", {}", tag.to_str().expect("it is text"));
    let again = get_with("/app.js", &[("if-none-match", &known)]).await;
    assert_eq!((again.status(), &again.headers()["etag"]), (StatusCode::NOT_MODIFIED, tag));
    assert_eq!(get_with("/app.js", &[("if-none-match", "\"other\"")]).await.status(), 200);
    assert_ne!(get_with("/page.css", &[]).await.headers()["etag"], tag);
}

#[test]
fn the_page_asks_nobody_else_for_anything_and_holds_nothing_in_line_but_the_stop() {
    let others = ["index.html", "page.css", "stop.css"].map(|name| (name, web(name)));
    for (path, text) in modules().map(|(path, text)| (path, text.to_owned())).chain(others) {
        for forbidden in
            ["http://", "https://", "innerHTML", "insertAdjacentHTML", "outerHTML", "eval(", "url("]
        {
            assert!(!text.contains(forbidden), "{path} has {forbidden}");
        }
    }
    let index = text_of("/");
    assert!(!index.contains("style=") && !index.contains(" onclick"));
    assert_eq!((index.matches("<style").count(), index.matches("<script").count()), (1, 2));
}

#[test]
fn every_module_and_file_that_one_names_is_there() {
    let index = text_of("/");
    let named = index.split("href=\"").skip(1).chain(index.split("src=\"").skip(1));
    let from_index = named.filter_map(|rest| rest.split('"').next()).filter(|name| name.contains('.'));
    for name in from_index {
        assert!(files().iter().any(|file| file.path == format!("/{name}")), "{name}");
    }
    for (path, text) in modules() {
        for line in text.lines().filter(|line| line.starts_with("import ")) {
            let name = line.split("'./").nth(1).and_then(|rest| rest.strip_suffix("';"));
            let name = name.unwrap_or_else(|| panic!("{path}: the bundle does not understand {line}"));
            assert!(modules().any(|(known, _)| known == name), "{path} names {name}");
        }
        let exports = text.lines().filter(|line| line.starts_with("export "));
        for line in exports {
            let kinds = ["export function ", "export async function ", "export const ", "export class "];
            assert!(
                kinds.iter().any(|kind| line.starts_with(kind)),
                "{path}: the bundle does not understand {line}"
            );
        }
    }
}

#[test]
fn every_text_has_an_english_and_a_french_form() {
    let own = modules().filter(|(path, _)| path.ends_with("texts.js")).map(|(_, text)| text);
    let table: String = own.chain([module("stop.js")]).collect();
    let rows: Vec<_> = table.lines().filter(|line| line.starts_with("  ") && line.ends_with("'],")).collect();
    assert!(rows.len() > 150, "only {} texts were found", rows.len());
    let mut names = BTreeSet::new();
    for row in rows {
        let (name, forms) = row.trim().split_once(": ['").expect("a row has a name and its forms");
        let forms: Vec<_> = forms.trim_end_matches("'],").split("', '").collect();
        assert!(forms.len() == 2 && forms.iter().all(|form| !form.is_empty()), "{name}");
        assert!(names.insert(name), "{name} is there twice");
        let filled = |form: &str| {
            form.split('{')
                .skip(1)
                .filter_map(|rest| Some(rest.split_once('}')?.0.to_owned()))
                .collect::<BTreeSet<_>>()
        };
        assert_eq!(filled(forms[0]), filled(forms[1]), "{name}");
    }
    for (path, text) in modules() {
        for before in [" t('", "(t('", "[t('", "{t('"] {
            for used in text.split(before).skip(1).filter_map(|rest| rest.split('\'').next()) {
                assert!(names.contains(used), "{path} uses the text {used}");
            }
        }
    }
    for attribute in ["data-text=\"", "data-label=\""] {
        for used in text_of("/").split(attribute).skip(1).filter_map(|rest| rest.split('"').next()) {
            assert!(names.contains(used), "index.html uses the text {used}");
        }
    }
}

#[test]
fn what_troubles_a_drive_has_the_words_of_the_fleets_table_and_its_states_the_words_of_everybody() {
    let (texts, words, french) = (module("texts.js"), module("vocabulary.js"), module("sentences_fr.js"));
    for kind in drive_fleet::ConcernKind::ALL {
        let row = format!("  concern_{}: ['{}', '", kind.word(), kind.words());
        assert!(texts.contains(&row), "{row}");
        let remedy = format!("  '{}': '", kind.remedy().replace('\'', "\\'"));
        assert!(french.contains(&remedy), "{remedy}");
    }
    // Those that are of no drive's own have their words in the table of alarms.
    for kind in drive_fleet::alarms::AlarmKind::all() {
        let own = drive_fleet::ConcernKind::ALL.iter().any(|concern| concern.word() == kind.word());
        let row = format!("  alarm_{}: ['{}', '", kind.word(), kind.words());
        assert!(own || texts.contains(&row), "{row}");
        let remedy = format!("  '{}': '", kind.remedy().replace('\'', "\\'"));
        assert!(french.contains(&remedy), "{remedy}");
    }
    for state in drive_fleet::alarms::AlarmState::ALL {
        assert!(words.contains(&format!("  {state}: ['")), "{state}");
    }
    for shows in drive_fleet::Shows::ALL {
        let word = shows.to_string();
        let (first, rest) = word.split_at(1);
        let row = format!("  {}: ['{}{rest}', '", word.replace(' ', "_"), first.to_uppercase());
        assert!(words.contains(&row), "{row}");
    }
}

#[test]
fn the_page_decides_of_no_drive_what_troubles_it_or_what_it_does() {
    for (path, text) in modules() {
        // The account of STOP ALL asks whose stop the fleet alarms.
        if !["trouble.js", "main.js", "texts.js", "alarm_words.js"].contains(&path) {
            assert!(!text.contains("concern"), "{path} reads what troubles a drive");
        }
        for decided in ["link === 'lost'", "link === 'connecting'", "stop.alarm", "stop?.alarm"] {
            assert!(!text.contains(decided), "{path} decides by {decided}");
        }
    }
}

#[test]
fn every_command_of_the_page_has_an_id_and_a_stop_is_tried_as_by_the_monitor() {
    for (path, text) in modules() {
        for given in text.split("post(`").skip(1) {
            assert!(
                given.starts_with("${where}?wait=0`, { id, ...body }, "),
                "{path} gives a command without an id"
            );
        }
    }
    let stop = include_str!("web/stop.js").replace('_', "");
    assert!(stop.contains("JSON.stringify({ id })"), "STOP ALL has one id, however often it is sent");
    // As often as the page looks after any command.
    let looks = |text: &str| {
        text.lines()
            .find(|line| line.trim_start().starts_with("const LOOK_MS"))
            .map(|line| line.trim().to_owned())
    };
    assert!(looks(module("follow.js")).is_some());
    assert_eq!(looks(include_str!("web/stop.js")), looks(module("follow.js")));
    let times =
        [("ATTEMPT", client::ANSWERED_WITHIN), ("AGAIN", client::AGAIN), ("GIVEUP", client::GIVEN_UP_AFTER)];
    // A stop of one drive, of a group or of a selection is tried so too, and nothing else.
    let orders = module("orders.js").replace('_', "");
    for (name, time) in times {
        let row = format!("const {name}MS = {};", time.as_millis());
        assert!(stop.contains(&row) && orders.contains(&row), "{row}");
    }
    assert_eq!(orders.matches("await sendAgain(").count(), 1);
    assert!(orders.contains("action === 'stop') answer = await sendAgain("), "a start is never sent again");
}
