//! What the page's files promise without a browser; `tests/page.rs` of the workspace looks at it with one.

use std::{collections::BTreeSet, fs, path::Path};

use axum::{
    body::Body,
    http::{Request, Response},
};
use http_body_util::BodyExt as _;
use tower::ServiceExt as _;

use super::*;

fn text_of(path: &str) -> &'static str {
    let file = FILES.iter().find(|file| file.path == path).expect("it is a file of the page");
    std::str::from_utf8(file.content).expect("it is text")
}

/// Our own modules, without what was written elsewhere.
fn modules() -> impl Iterator<Item = (&'static str, &'static str)> {
    let own = FILES.iter().filter(|file| file.path.ends_with(".js") && !file.path.starts_with("/vendor/"));
    own.map(|file| (file.path, text_of(file.path)))
}

async fn get_with(path: &str, headers: &[(&str, &str)]) -> Response<Body> {
    let request =
        headers.iter().fold(Request::get(path), |request, (name, value)| request.header(*name, *value));
    router().oneshot(request.body(Body::empty()).expect("it is a request")).await.expect("it answers")
}

#[tokio::test]
async fn every_file_of_the_folder_is_served_with_its_type_and_content() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/page/web");
    let listed = |folder: &Path| {
        let entries =
            fs::read_dir(folder).expect("it is a folder").map(|entry| entry.expect("it is listed").path());
        entries.filter(|path| path.is_file()).collect::<Vec<_>>()
    };
    let mut served = 0;
    for path in listed(&folder).into_iter().chain(listed(&folder.join("vendor"))) {
        let name = path.strip_prefix(&folder).expect("it is below").to_str().expect("it is text");
        let answer = get_with(&format!("/{name}").replace("/index.html", "/"), &[]).await;
        assert_eq!(answer.status(), 200, "{name}");
        let kind = answer.headers()["content-type"].to_str().expect("it is text").to_owned();
        let expected = match name.rsplit('.').next() {
            Some("js") => "text/javascript",
            Some("css") => "text/css",
            Some("html") => "text/html",
            Some("svg") => "image/svg+xml",
            _ => "text/plain",
        };
        assert!(kind.starts_with(expected), "{name} is {kind}");
        let body = answer.into_body().collect().await.expect("it has a body").to_bytes();
        assert_eq!(body, fs::read(&path).expect("it is read"), "{name}");
        served += 1;
    }
    assert_eq!(served, FILES.len());
}

#[tokio::test]
async fn a_browser_that_has_a_file_is_sent_nothing_until_the_file_changes() {
    let first = get_with("/main.js", &[]).await;
    assert_eq!(first.headers()["cache-control"], "no-cache");
    let tag = &first.headers()["etag"];
    let known = format!("\"other\", W/{}", tag.to_str().expect("it is text"));
    let again = get_with("/main.js", &[("if-none-match", &known)]).await;
    assert_eq!((again.status(), &again.headers()["etag"]), (StatusCode::NOT_MODIFIED, tag));
    assert_eq!(get_with("/main.js", &[("if-none-match", "\"other\"")]).await.status(), 200);
    assert_ne!(get_with("/stop.js", &[]).await.headers()["etag"], tag);
}

#[test]
fn the_page_asks_nobody_else_for_anything_and_holds_no_script_or_style_in_line() {
    for (path, text) in modules().chain([("/", text_of("/")), ("/page.css", text_of("/page.css"))]) {
        for forbidden in
            ["http://", "https://", "innerHTML", "insertAdjacentHTML", "outerHTML", "eval(", "url("]
        {
            assert!(!text.contains(forbidden), "{path} has {forbidden}");
        }
    }
    let index = text_of("/");
    assert!(!index.contains("style=") && !index.contains("<style") && !index.contains(" onclick"));
    assert_eq!(index.matches("<script").count(), index.matches("<script type=\"module\" src=").count());
}

#[test]
fn every_module_that_one_names_is_a_file_of_the_page() {
    let index = text_of("/");
    let named = index.split("href=\"").skip(1).chain(index.split("src=\"").skip(1));
    let from_index = named.filter_map(|rest| rest.split('"').next()).filter(|name| name.contains('.'));
    let mut all: BTreeSet<String> = from_index.map(|name| format!("/{name}")).collect();
    for (_, text) in modules() {
        all.extend(
            text.split("'./")
                .skip(1)
                .filter_map(|rest| rest.split('\'').next())
                .map(|name| format!("/{name}")),
        );
    }
    for name in all {
        assert!(FILES.iter().any(|file| file.path == name), "{name}");
    }
}

#[test]
fn every_text_has_an_english_and_a_french_form() {
    let table = text_of("/texts.js");
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
    let (texts, words, french) = (text_of("/texts.js"), text_of("/words.js"), text_of("/sentences_fr.js"));
    for kind in drive_fleet::ConcernKind::ALL {
        let row = format!("  concern_{}: ['{}', '", kind.word(), kind.words());
        assert!(texts.contains(&row), "{row}");
        let remedy = format!("  '{}': '", kind.remedy().replace('\'', "\\'"));
        assert!(french.contains(&remedy), "{remedy}");
    }
    use drive_core::State;
    for state in [
        State::NotReady,
        State::Disabled,
        State::Ready,
        State::Running,
        State::Stopping,
        State::QuickStop,
        State::FaultReaction,
        State::Fault,
        State::Unknown,
    ] {
        let word = state.to_string();
        let (first, rest) = word.split_at(1);
        let row = format!("  {}: ['{}{rest}', '", word.replace(' ', "_"), first.to_uppercase());
        assert!(words.contains(&row), "{row}");
    }
}
