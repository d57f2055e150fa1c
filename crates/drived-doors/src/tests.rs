//! The doors before a router that only says who came.

use std::fs;

use axum::http::{StatusCode, header};
use futures_util::future::{Either, select};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _, DuplexStream};

use super::{gate::Peer, *};
use crate::testing::{Asked, Rig, START, STATE, STOP};

/// Whoever may only stop passes with each route that stops, and with none that looks like one.
#[tokio::test]
async fn a_stop_of_those_that_are_selected_passes_like_every_other() {
    let rig = Rig::new("gate-selected");
    for name in ["stop", "selected/stop", "drives/pump 1/stop", "groups/pumps/stop"] {
        let path = format!("/api/v1/{}", name.replace(' ', "%20"));
        let status = rig.ask(&Asked { path: &path, ..STOP }).await.status;
        assert!([StatusCode::OK, StatusCode::NOT_FOUND].contains(&status), "{name}: {status}");
    }
    for name in ["selected/start", "selected/reset", "drives/stop/start", "stopped", "alarms/stop"] {
        rig.ask(&Asked { path: &format!("/api/v1/{name}"), ..STOP }).await.assert_refused(401);
    }
}

#[tokio::test]
async fn on_loopback_to_see_and_to_stop_need_no_login_and_a_proxy_is_no_loopback() {
    let rig = Rig::new("freely");
    assert_eq!(rig.ask(&STATE).await.body, "anonymous http 127.0.0.1 vs");
    assert_eq!(rig.ask(&STOP).await.body, "anonymous http 127.0.0.1 vs");
    let forwarded = [("x-forwarded-for", "10.0.0.7")];
    assert_eq!(rig.ask(&Asked { headers: &forwarded, ..STATE }).await.body, "anonymous http 127.0.0.1 ");
    rig.ask(&Asked { headers: &forwarded, ..STOP }).await.assert_refused(401);
}

#[tokio::test]
async fn a_token_has_the_rights_of_its_role_until_it_is_removed() {
    let rig = Rig::new("roles");
    for (name, role, rights) in [
        // What nobody needs a login for is not lost by one.
        ("a", Role::View, "vs"),
        ("b", Role::Stop, "vs"),
        ("c", Role::Operate, "vso"),
        ("d", Role::Engineer, "vsoe"),
    ] {
        let bearer = format!("Bearer {}", rig.token(name, role));
        let asked = Asked { headers: &[("authorization", &bearer)], ..STATE };
        assert_eq!(rig.ask(&asked).await.body, format!("{name} http 127.0.0.1 {rights}"));
        rig.gate.tokens.as_ref().unwrap().remove(name).unwrap();
        rig.ask(&asked).await.assert_refused(401);
    }
}

#[tokio::test]
async fn whoever_has_asked_for_something_that_waits_is_heard_until_his_token_is_removed() {
    let rig = Rig::new("heard");
    let token = |name| format!("Bearer {}", rig.token(name, Role::Operate));
    let (stays, goes) = (token("stays"), token("goes"));
    let ask = async |bearer: &String| {
        let headers = [("authorization", bearer.as_str())];
        rig.ask(&Asked { path: "/api/v1/drives/pump/reset", headers: &headers, ..START }).await.body
    };
    let (waits, still_waits) = (std::pin::pin!(ask(&goes)), std::pin::pin!(ask(&stays)));
    let both = select(waits, still_waits);
    let both = match select(both, std::pin::pin!(sleep(Duration::from_millis(100)))).await {
        Either::Left(_) => panic!("nobody has taken anything away"),
        Either::Right(((), both)) => both,
    };
    rig.gate.tokens.as_ref().unwrap().remove("goes").unwrap();
    match both.await {
        Either::Left((said, _)) => assert_eq!(said, "not heard any more"),
        Either::Right(_) => panic!("nobody has taken it away"),
    }
}

#[cfg(unix)]
#[tokio::test]
async fn tokens_that_cannot_be_read_keep_nobody_from_a_stop_that_needs_none() {
    use std::os::unix::fs::PermissionsExt as _;
    let rig = Rig::new("unreadable");
    let bearer = format!("Bearer {}", rig.token("panel", Role::Operate));
    let headers = [("authorization", bearer.as_str())];
    fs::set_permissions(rig.folder.file("tokens"), fs::Permissions::from_mode(0o644)).unwrap();
    rig.ask(&Asked { headers: &headers, ..START }).await.assert_refused(503);
    let stop = rig.ask(&Asked { headers: &headers, ..STOP }).await;
    assert_eq!(stop.body, "anonymous http 127.0.0.1 vs");
    let forwarded = [headers[0], ("x-forwarded-for", "10.0.0.7")];
    rig.ask(&Asked { headers: &forwarded, ..STOP }).await.assert_refused(503);
}

/// As when the program has no descriptor left: nothing can be opened, and nobody has changed the file.
#[cfg(unix)]
#[tokio::test]
async fn tokens_that_cannot_be_looked_at_keep_nobody_from_a_stop_whose_token_was_right() {
    let rig = Rig::new("unopened");
    let bearer = format!("Bearer {}", rig.token("panel", Role::Operate));
    let headers = [("authorization", bearer.as_str()), ("x-forwarded-for", "10.0.0.7")];
    let stop = Asked { headers: &headers, ..STOP };
    let stopped = rig.ask(&stop).await.body;
    let (file, aside) = (rig.folder.file("tokens"), rig.folder.file("aside"));
    fs::rename(&file, &aside).unwrap();
    std::os::unix::fs::symlink(&aside, &file).unwrap();
    rig.ask(&Asked { headers: &headers, ..START }).await.assert_refused(503);
    let wrong = [("authorization", "Bearer drv_0"), headers[1]];
    rig.ask(&Asked { headers: &wrong, ..STOP }).await.assert_refused(401);
    assert_eq!(rig.ask(&stop).await.body, stopped);
}

#[tokio::test]
async fn a_wrong_token_is_never_taken_for_none_and_ten_a_minute_are_looked_at() {
    let rig = Rig::new("wrong-token");
    let right = format!("Bearer {}", rig.token("panel", Role::Operate));
    for wrong in ["Bearer drv_0", "Bearer ", "Bearer", "Basic YWRtaW46MDAwMA==", "drv_0"] {
        let asked = Asked { headers: &[("authorization", wrong)], ..STATE };
        let answer = rig.ask(&asked).await;
        answer.assert_refused(401);
        assert_eq!(answer.headers[header::WWW_AUTHENTICATE], "Bearer");
        rig.ask(&Asked { headers: &[("authorization", wrong)], ..STOP }).await.assert_refused(401);
    }
    let asked = Asked { headers: &[("authorization", &right)], ..STATE };
    let waits = rig.ask(&asked).await;
    waits.assert_refused(429);
    assert!(waits.headers.contains_key(header::RETRY_AFTER));
    // Nobody is kept from a stop by what others do.
    let stop = rig.ask(&Asked { headers: &[("authorization", &right)], ..STOP }).await;
    assert_eq!(stop.body, "panel http 127.0.0.1 vso");
    assert_eq!(rig.ask_from([10, 0, 0, 7], &asked).await.body, "panel http 10.0.0.7 vso");
    let failures = rig.audited().await;
    assert_eq!(
        failures.iter().filter(|line| *line == "login_failed anonymous -").count(),
        10,
        "{failures:?}"
    );
}

#[tokio::test]
async fn a_link_lets_a_browser_in_once_by_the_rights_of_its_token_and_is_made_over_the_socket_alone() {
    let rig = Rig::new("link");
    let wanted = Asked { path: "/api/v1/links", body: "{\"name\":\"anna\",\"role\":\"engineer\"}", ..START };
    rig.ask(&wanted).await.assert_refused(403);
    let chief = format!("Bearer {}", rig.token("chief", Role::Engineer));
    rig.ask(&Asked { headers: &[("authorization", &chief)], ..wanted }).await.assert_refused(403);
    rig.ask_on_socket(&Asked { body: "{\"name\":\"nobody\"}", ..wanted }).await.assert_refused(422);
    let made = rig.ask_on_socket(&wanted).await;
    let made: serde_json::Value = serde_json::from_str(&made.body).unwrap();
    let code =
        made["link"].as_str().unwrap().strip_prefix("http://127.0.0.1:7580/#/enter/").unwrap().to_owned();
    // Nobody has a token by a link that was never used.
    assert_eq!(rig.gate.tokens.as_ref().unwrap().all().unwrap().len(), 1);
    let enter = |code: &str| format!("{{\"code\":\"{code}\"}}");
    let login = Asked { path: "/api/v1/login", ..START };
    rig.ask(&Asked { body: &enter(&code[1..]), ..login }).await.assert_refused(401);
    for neither in ["{}", &format!("{{\"code\":\"{code}\",\"token\":\"drv_0\"}}")] {
        rig.ask(&Asked { body: neither, ..login }).await.assert_refused(400);
    }
    let entered = rig.ask(&Asked { body: &enter(&code), ..login }).await;
    assert_eq!(entered.status, StatusCode::OK, "{entered:?}");
    let set = entered.headers[header::SET_COOKIE].to_str().unwrap();
    assert!(!set.contains(&code), "{set}");
    let headers = [("cookie", set.split(';').next().unwrap())];
    assert_eq!(rig.ask(&Asked { headers: &headers, ..STATE }).await.body, "anna page 127.0.0.1 vsoe");
    // It was good once.
    rig.ask(&Asked { body: &enter(&code), ..login }).await.assert_refused(401);
    // The token of whom the session is, is one as every other.
    rig.gate.tokens.as_ref().unwrap().remove("anna").unwrap();
    assert_eq!(rig.ask(&Asked { headers: &headers, ..STATE }).await.body, "anonymous page 127.0.0.1 vs");
    let audited = rig.audited().await;
    for one in ["token local -", "token anonymous -", "login anna -", "login_failed anonymous -"] {
        assert!(audited.iter().any(|line| line == one), "{one}: {audited:?}");
    }
    let text = fs::read_to_string(rig.folder.file("audit")).unwrap();
    assert!(!text.contains(&code), "{text}");
}

/// A link that could never let anybody in is not made, and one that is not used takes nothing away.
#[tokio::test]
async fn a_link_is_no_way_round_what_was_taken_away_and_none_is_made_that_cannot_work() {
    let rig = Rig::new("link-ends");
    let tokens = rig.gate.tokens.clone().unwrap();
    let links = Asked { path: "/api/v1/links", ..START };
    let make = async |body: &str| {
        let made = rig.ask_on_socket(&Asked { body, ..links }).await;
        let made: serde_json::Value = serde_json::from_str(&made.body).unwrap();
        let link = made["link"].as_str().unwrap_or_else(|| panic!("{made}"));
        format!("{{\"code\":\"{}\"}}", link.rsplit('/').next().unwrap())
    };
    let login = Asked { path: "/api/v1/login", ..START };
    rig.token("panel-1", Role::Operate);
    for wrong in [
        r#"{"name":"a b","role":"view"}"#,
        r#"{"name":"local","role":"view"}"#,
        r#"{"name":"panel-l","role":"view"}"#,
        r#"{"name":"bob"}"#,
        r#"{"name":"bob","role":"view","days":0}"#,
    ] {
        rig.ask_on_socket(&Asked { body: wrong, ..links }).await.assert_refused(422);
    }
    // Of a token that is removed or replaced no link is left, and none makes it anew.
    let of_panel = Asked { path: "/api/v1/tokens/panel-1", ..START };
    for (method, body) in [("PUT", r#"{"hours":1}"#), ("DELETE", "")] {
        let [bare, with_role] = [r#"{"name":"panel-1"}"#, r#"{"name":"panel-1","role":"engineer"}"#];
        let codes = [make(bare).await, make(with_role).await];
        assert_eq!(rig.ask_on_socket(&Asked { method, body, ..of_panel }).await.status, StatusCode::OK);
        for code in codes {
            rig.ask(&Asked { body: &code, ..login }).await.assert_refused(401);
        }
    }
    assert!(tokens.all().unwrap().is_empty(), "none was made");
    // Nor where another program has put another in its place.
    rig.token("panel-1", Role::View);
    let code = make(r#"{"name":"panel-1"}"#).await;
    tokens.remove("panel-1").unwrap();
    rig.token("panel-1", Role::Engineer);
    rig.ask(&Asked { body: &code, ..login }).await.assert_refused(401);
    // Whose name came to look like another's meanwhile is told so, and a token whose time was over is still there.
    let over = Some(Duration::ZERO);
    tokens.remove("panel-1").unwrap();
    tokens.add("carol", (Role::View, None), over).unwrap();
    rig.ask_on_socket(&Asked { body: r#"{"name":"carol"}"#, ..links }).await.assert_refused(422);
    let code = make(r#"{"name":"dora","role":"view"}"#).await;
    rig.token("Dora", Role::View);
    rig.ask(&Asked { body: &code, ..login }).await.assert_refused(422);
    let code = make(r#"{"name":"carol","role":"engineer"}"#).await;
    assert_eq!(tokens.all().unwrap().len(), 2, "making a link changes no token");
    assert_eq!(rig.ask(&Asked { body: &code, ..login }).await.status, StatusCode::OK);
    assert_eq!(tokens.all().unwrap().iter().filter(|token| token.name == "carol").count(), 1);
}

#[tokio::test]
async fn no_token_is_made_by_a_link_that_nobody_could_keep_in_the_log() {
    let rig = Rig::new("link-log");
    let links = Asked { path: "/api/v1/links", body: r#"{"name":"anna","role":"engineer"}"#, ..START };
    let made = rig.ask_on_socket(&links).await;
    let made: serde_json::Value = serde_json::from_str(&made.body).unwrap();
    let code = format!("{{\"code\":\"{}\"}}", made["link"].as_str().unwrap().rsplit('/').next().unwrap());
    fs::remove_file(rig.folder.file("audit")).unwrap();
    fs::create_dir(rig.folder.file("audit")).unwrap();
    rig.ask_on_socket(&links).await.assert_refused(503);
    rig.ask(&Asked { path: "/api/v1/login", body: &code, ..START }).await.assert_refused(503);
    assert!(rig.gate.tokens.as_ref().unwrap().all().unwrap().is_empty());
}

#[tokio::test]
async fn a_login_gives_a_cookie_that_no_script_reads_and_a_logout_takes_it_back() {
    let rig = Rig::new("login");
    let secret = rig.token("panel", Role::Operate);
    let login = Asked { path: "/api/v1/login", body: &format!("{{\"token\":\"{secret}\"}}"), ..START };
    let answer = rig.ask(&login).await;
    assert_eq!(answer.status, StatusCode::OK, "{answer:?}");
    let set = answer.headers[header::SET_COOKIE].to_str().unwrap();
    assert!(set.contains("HttpOnly") && set.contains("SameSite=Strict") && !set.contains(&secret), "{set}");
    let cookie = set.split(';').next().unwrap();
    let headers = [("cookie", cookie)];
    let with = |asked| Asked { headers: &headers, ..asked };
    assert_eq!(rig.ask(&with(STATE)).await.body, "panel page 127.0.0.1 vso");
    let away = rig.ask(&with(Asked { path: "/api/v1/logout", body: "", ..START })).await;
    assert!(away.headers[header::SET_COOKIE].to_str().unwrap().contains("Max-Age=0"), "{away:?}");
    assert_eq!(rig.ask(&with(STATE)).await.body, "anonymous page 127.0.0.1 vs");
    rig.ask(&Asked { body: "{\"token\":\"drv_0\"}", ..login }).await.assert_refused(401);
    rig.ask(&Asked { body: "{\"token\"", ..login }).await.assert_refused(400);
    let log = fs::read_to_string(rig.folder.file("audit")).unwrap();
    assert!(!log.contains(&secret[4..]), "no secret in a log");
    assert_eq!(rig.audited().await, ["login panel -", "logout panel -", "login_failed anonymous -"]);
}

#[tokio::test]
async fn a_wrong_host_or_another_sites_origin_is_refused_before_anything_is_looked_at() {
    let rig = Rig::new("hosts");
    for path in ["/", "/api/v1/state", "/api/v1/events", "/metrics", "/nowhere"] {
        rig.ask(&Asked { headers: &[("host", "evil.example")], path, ..STATE }).await.assert_refused(421);
    }
    for foreign in [
        ("origin", "http://evil.example"),
        ("origin", "null"),
        ("origin", "http://localhost:8080"),
        ("sec-fetch-site", "cross-site"),
        ("sec-fetch-site", "same-site"),
    ] {
        rig.ask(&Asked { headers: &[foreign], ..STOP }).await.assert_refused(403);
    }
    for kind in ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data"] {
        rig.ask(&Asked { headers: &[("content-type", kind)], ..STOP }).await.assert_refused(415);
    }
    let own = [("origin", "http://localhost:7580"), ("sec-fetch-site", "same-origin")];
    assert_eq!(rig.ask(&Asked { headers: &own, ..STOP }).await.status, StatusCode::OK);
    assert_eq!(rig.audited().await.len(), 2, "one command and its answer");
}

#[tokio::test]
async fn every_answer_tells_the_browser_to_keep_to_itself_and_no_other_site_is_allowed() {
    let rig = Rig::new("headers");
    for asked in
        [STATE, STOP, Asked { path: "/nowhere", ..STATE }, Asked { headers: &[("host", "x")], ..STATE }]
    {
        let answer = rig.ask(&asked).await;
        for name in [
            "content-security-policy",
            "x-content-type-options",
            "referrer-policy",
            "cross-origin-resource-policy",
        ] {
            assert!(answer.headers.contains_key(name), "{name}: {answer:?}");
        }
        assert!(
            answer.headers.keys().all(|name| !name.as_str().starts_with("access-control-")),
            "{answer:?}"
        );
        assert_eq!(answer.headers.contains_key(header::CACHE_CONTROL), asked.path.starts_with("/api/"));
    }
}

#[tokio::test]
async fn a_browser_comes_by_tls_from_then_on_where_it_has_come_by_it_once_and_nowhere_else() {
    let rig = Rig::new("hsts");
    let encrypted = Door { encrypted: true, ..rig.door.clone() };
    for asked in [STATE, STOP, Asked { path: "/nowhere", ..STATE }] {
        let peer = Peer::Address([127, 0, 0, 1].into());
        let answer = rig.ask_as(&encrypted, peer, &asked).await;
        assert_eq!(answer.headers["strict-transport-security"], "max-age=31536000", "{answer:?}");
        // RFC 6797, 7.2: not over a transport that is not secure.
        assert!(!rig.ask(&asked).await.headers.contains_key("strict-transport-security"));
    }
}

#[tokio::test]
async fn each_command_is_audited_with_what_became_of_it() {
    let rig = Rig::new("audited");
    rig.ask_on_socket(&START).await;
    assert_eq!(rig.audited().await, ["command local -", "answer local refused"]);
    let log = fs::read_to_string(rig.folder.file("audit")).unwrap();
    assert!(log.contains("POST /api/v1/drives/pump%201/start") && log.contains(r#""id":"c-1""#), "{log}");
}

#[tokio::test]
async fn what_cannot_be_audited_is_not_done_but_a_stop() {
    let rig = Rig::new("no-audit");
    rig.ask_on_socket(&START).await;
    assert_eq!(rig.audited().await.len(), 2);
    // A folder in its place: nothing can be written there.
    fs::remove_file(rig.folder.file("audit")).unwrap();
    fs::create_dir(rig.folder.file("audit")).unwrap();
    rig.ask_on_socket(&START).await.assert_refused(503);
    assert_eq!(rig.ask(&STOP).await.status, StatusCode::OK);
    assert_eq!(rig.ask(&STATE).await.status, StatusCode::OK);
    fs::remove_dir(rig.folder.file("audit")).unwrap();
    assert_eq!(rig.ask_on_socket(&START).await.status, StatusCode::CONFLICT, "the disk is there again");
}

/// A connection that the system puts off comes again a second later, and a stop with it. Measured from outside, for a queue that is
/// full is told to nobody.
#[tokio::test]
async fn three_hundred_who_come_while_nobody_is_let_in_find_room_to_wait() {
    let listener = listen("127.0.0.1:0".parse().unwrap()).await;
    let address = listener.local_addr().unwrap();
    let patience = Duration::from_secs(20);
    let come = move |_| std::net::TcpStream::connect_timeout(&address, patience);
    let waiting = tokio::task::spawn_blocking(move || (0..300).map(come).collect::<Result<Vec<_>, _>>());
    assert_eq!(waiting.await.unwrap().unwrap().len(), 300);
}

#[tokio::test]
async fn a_request_says_64_kib_at_the_most() {
    let rig = Rig::new("body");
    let most = " ".repeat(64 * 1024);
    assert_eq!(rig.ask_on_socket(&Asked { body: &most, ..START }).await.status, StatusCode::CONFLICT);
    rig.ask_on_socket(&Asked { body: &(most.clone() + " "), ..START }).await.assert_refused(413);
}

#[tokio::test(start_paused = true)]
async fn a_request_came_when_its_head_did_and_not_when_it_was_written_down() {
    let rig = Rig::new("came");
    let token = rig.token("panel", Role::Operate);
    let mut stream = rig.connect();
    let head = format!(
        "POST /api/v1/drives/pump/setpoint HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {token}\r\n\
         Content-Type: application/json\r\nContent-Length: 2\r\nConnection: close\r\n\r\n{{"
    );
    stream.write_all(head.as_bytes()).await.unwrap();
    sleep(Duration::from_millis(700)).await;
    stream.write_all(b"}").await.unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await.unwrap();
    let ago = answer.lines().last().and_then(|last| last.strip_suffix(" ms ago")?.parse::<u64>().ok());
    assert!(ago.is_some_and(|ago| ago >= 700), "{answer}");
}

const HEAD: &[u8] = b"GET /api/v1/state HTTP/1.1\r\nHost: localhost\r\n";

#[tokio::test(start_paused = true)]
async fn a_head_that_comes_too_slowly_ends_its_connection() {
    let rig = Rig::new("slow-head");
    let mut slow = rig.connect();
    for byte in HEAD.iter().cycle() {
        if slow.write_all(&[*byte]).await.is_err() {
            break;
        }
        sleep(Duration::from_secs(1)).await;
    }
    let mut rest = Vec::new();
    slow.read_to_end(&mut rest).await.unwrap();
    assert!(!rest.starts_with(b"HTTP/1.1 200"), "{rest:?}");
}

#[tokio::test(start_paused = true)]
async fn a_body_that_comes_too_slowly_is_given_up() {
    let rig = Rig::new("slow-body");
    let mut slow = rig.connect();
    // Whom it stops stands in it.
    let head = "POST /api/v1/selected/stop HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 9\r\n\r\n";
    slow.write_all(head.as_bytes()).await.unwrap();
    let mut answer = Vec::new();
    slow.read_to_end(&mut answer).await.unwrap();
    assert!(answer.starts_with(b"HTTP/1.1 408"), "{}", String::from_utf8_lossy(&answer));
}

/// A radio link that goes between two segments: the head of a browser's request and its body come in two.
#[tokio::test(start_paused = true)]
async fn a_stop_whose_body_does_not_come_to_its_end_is_a_stop() {
    for (length, said, is_cut) in
        [(9, "", false), (90, "{\"mode\":\"fre", false), (90, "{\"mode\":\"fre", true), (200_000, "{", false)]
    {
        let rig = Rig::new("cut-stop");
        let mut stream = rig.connect();
        let begun = Instant::now();
        let request = format!(
            "POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: {length}\r\n\r\n{said}"
        );
        stream.write_all(request.as_bytes()).await.unwrap();
        if is_cut {
            stream.shutdown().await.unwrap();
        }
        let mut status = [0; 12];
        stream.read_exact(&mut status).await.unwrap();
        assert_eq!(&status, b"HTTP/1.1 200", "{length}, {said}");
        assert!(begun.elapsed() < Duration::from_millis(300), "{:?}", begun.elapsed());
    }
}

#[tokio::test(start_paused = true)]
async fn an_idle_connection_ends_and_event_streams_end_with_the_server() {
    let rig = Rig::new("idle");
    let mut idle = rig.connect();
    idle.write_all(HEAD).await.unwrap();
    idle.write_all(b"\r\n").await.unwrap();
    let mut answer = Vec::new();
    idle.read_to_end(&mut answer).await.unwrap();
    assert!(answer.starts_with(b"HTTP/1.1 200"), "{}", String::from_utf8_lossy(&answer));

    let mut stream = rig.connect();
    stream.write_all(b"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n").await.unwrap();
    let mut heard = Vec::new();
    while !heard.windows(4).any(|four| four == b"tick") {
        stream.read_buf(&mut heard).await.unwrap();
    }
    rig.end.send_replace(true);
    stream.read_to_end(&mut heard).await.unwrap();
    assert!(heard.ends_with(b"0\r\n\r\n"), "{}", String::from_utf8_lossy(&heard));
}

#[tokio::test(start_paused = true)]
async fn one_address_has_eight_event_streams() {
    let rig = Rig::new("streams");
    let mut open = Vec::new();
    for number in 1..=10 {
        let mut stream = rig.connect();
        stream.write_all(b"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n").await.unwrap();
        let mut head = Vec::new();
        while !head.windows(4).any(|four| four == b"\r\n\r\n") {
            stream.read_buf(&mut head).await.unwrap();
        }
        let status = if number <= 8 { &b"HTTP/1.1 200"[..] } else { b"HTTP/1.1 429" };
        assert!(head.starts_with(status), "{number}: {}", String::from_utf8_lossy(&head));
        open.push(stream);
    }
    open.clear();
    // They are gone when the next tick finds nobody.
    sleep(Duration::from_secs(10)).await;
    let mut stream = rig.connect();
    stream.write_all(b"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n").await.unwrap();
    let mut status = [0; 12];
    stream.read_exact(&mut status).await.unwrap();
    assert_eq!(&status, b"HTTP/1.1 200");
}

/// How much is still heard of a stream in so many of its ticks; `None`: it has ended.
async fn heard(stream: &mut DuplexStream, ticks: u32) -> Option<usize> {
    let (mut all, mut ended) = (Vec::new(), false);
    let _ = timeout(ticks * Duration::from_secs(5), async {
        ended = stream.read_to_end(&mut all).await.is_ok();
    })
    .await;
    (!ended).then_some(all.len())
}

/// After how long whoever reads a stream sees that its connection has ended.
async fn closed_after(mut stream: DuplexStream) -> Duration {
    let since = Instant::now();
    let ended = timeout(Duration::from_secs(60), stream.read_to_end(&mut Vec::new())).await;
    ended.expect("it ends").unwrap();
    since.elapsed()
}

#[tokio::test(start_paused = true)]
async fn what_an_event_stream_was_let_in_by_ends_and_its_connection_with_it_within_a_second() {
    let rig = Rig::new("closed-at-once");
    let secrets = ["here", "elsewhere", "panel"].map(|name| rig.token(name, Role::View));
    let here = rig.stream(&format!("Authorization: Bearer {}", secrets[0])).await;
    let remove = Asked { method: "DELETE", path: "/api/v1/tokens/here", body: "", headers: &[] };
    assert_eq!(rig.ask_on_socket(&remove).await.status, StatusCode::OK);
    assert!(closed_after(here).await < Duration::from_millis(50), "this program has removed it");

    let login = format!("{{\"token\":\"{}\"}}", secrets[2]);
    let begun = rig.ask(&Asked { path: "/api/v1/login", body: &login, ..START }).await;
    let cookie = begun.headers[header::SET_COOKIE].to_str().unwrap().split(';').next().unwrap().to_owned();
    let left = rig.stream(&format!("Cookie: {cookie}")).await;
    rig.ask(&Asked { path: "/api/v1/logout", headers: &[("cookie", &cookie)], ..START }).await;
    assert!(closed_after(left).await < Duration::from_millis(50), "this program has ended the session");

    let elsewhere = rig.stream(&format!("Authorization: Bearer {}", secrets[1])).await;
    Tokens::open(&rig.folder.file("tokens")).unwrap().remove("elsewhere").unwrap();
    assert!(closed_after(elsewhere).await < Duration::from_secs(1), "another program has removed it");
}

#[tokio::test(start_paused = true)]
async fn an_event_stream_ends_when_its_token_is_removed_and_others_go_on() {
    let rig = Rig::new("live");
    let bearers =
        ["removed", "other"].map(|name| format!("Authorization: Bearer {}", rig.token(name, Role::View)));
    let mut removed = rig.stream(&bearers[0]).await;
    let mut other = rig.stream(&bearers[1]).await;
    let mut free = rig.stream("X: y").await;
    rig.gate.tokens.as_ref().unwrap().remove("removed").unwrap();
    assert_eq!(heard(&mut removed, 2).await, None);
    assert!(heard(&mut other, 10).await.is_some());
    assert!(heard(&mut free, 10).await.is_some());
}

/// Whoever comes by the old secret, himself or by a session, goes with it, also where the new one has been there all along.
#[tokio::test(start_paused = true)]
async fn streams_and_sessions_of_a_replaced_token_end_with_the_secret_that_they_came_by() {
    let rig = Rig::new("rotated");
    let tokens = Arc::clone(rig.gate.tokens.as_ref().unwrap());
    let first = rig.token("scada", Role::Operate);
    let (_, second) = tokens.rotate("scada", Duration::from_secs(3_600)).unwrap();
    let mut sessions = Vec::new();
    let mut streams = Vec::new();
    for secret in [&first, &second] {
        let login = format!("{{\"token\":\"{secret}\"}}");
        let answer = rig.ask(&Asked { path: "/api/v1/login", body: &login, ..START }).await;
        let set = answer.headers[header::SET_COOKIE].to_str().unwrap().to_owned();
        sessions.push(set.split(';').next().unwrap().to_owned());
        streams.push(rig.stream(&format!("Authorization: Bearer {secret}")).await);
        streams.push(rig.stream(&format!("Cookie: {}", sessions.last().unwrap())).await);
    }
    // A third makes the first good for nothing, and the second good for an hour yet.
    tokens.rotate("scada", Duration::from_secs(3_600)).unwrap();
    let [of_first, in_first, of_second, in_second] = &mut streams[..] else { panic!("four") };
    assert_eq!((heard(of_first, 2).await, heard(in_first, 2).await), (None, None));
    assert!(heard(of_second, 10).await.is_some() && heard(in_second, 10).await.is_some());
    for (session, caller) in [(&sessions[0], "anonymous"), (&sessions[1], "scada")] {
        let who = rig.ask(&Asked { headers: &[("cookie", session)], ..STATE }).await.body;
        assert!(who.starts_with(caller), "{who}");
    }
    // And one that is replaced at once is no more.
    tokens.rotate("scada", Duration::ZERO).unwrap();
    assert_eq!((heard(of_second, 2).await, heard(in_second, 2).await), (None, None));
}

#[tokio::test(start_paused = true)]
async fn an_event_stream_ends_with_its_session_by_logout_and_by_time() {
    let rig = Rig::new("live-session");
    let login = format!("{{\"token\":\"{}\"}}", rig.token("panel", Role::Operate));
    let login = Asked { path: "/api/v1/login", body: &login, ..START };
    let mut cookies = Vec::new();
    for _ in 0..2 {
        let answer = rig.ask(&login).await;
        cookies
            .push(answer.headers[header::SET_COOKIE].to_str().unwrap().split(';').next().unwrap().to_owned());
    }
    let mut left = rig.stream(&format!("Cookie: {}", cookies[0])).await;
    let mut kept = rig.stream(&format!("Cookie: {}", cookies[1])).await;
    rig.ask(&Asked { path: "/api/v1/logout", headers: &[("cookie", &cookies[0])], ..START }).await;
    assert_eq!(heard(&mut left, 2).await, None);
    assert!(heard(&mut kept, 10).await.is_some());
    // Its cookie lasts for twelve hours.
    assert_eq!(heard(&mut kept, 12 * 60 * 12 + 2).await, None);
}

#[tokio::test(start_paused = true)]
async fn whoever_is_refused_again_and_again_is_answered_slower_and_no_stop_and_nobody_else_waits_for_it() {
    let rig = Rig::new("paced");
    let right = format!("Bearer {}", rig.token("panel", Role::Stop));
    let since = Instant::now();
    let wrong = Asked { headers: &[("authorization", "Bearer drv_wrong")], ..STOP };
    for _ in 0..20 {
        rig.ask(&wrong).await.assert_refused(401);
    }
    assert!(since.elapsed() < Duration::from_millis(50), "a page that does not know it yet");
    for _ in 0..20 {
        rig.ask(&wrong).await.assert_refused(401);
    }
    assert!(since.elapsed() >= Duration::from_millis(950), "twenty a second");
    let since = Instant::now();
    let flood: Vec<_> = (0..20).map(|_| rig.ask(&wrong)).collect();
    let stop = async {
        sleep(Duration::from_millis(1)).await;
        let stopped = rig.ask(&Asked { headers: &[("authorization", &right)], ..STOP }).await;
        rig.ask_from([10, 0, 0, 9], &wrong).await.assert_refused(401);
        (stopped.status, since.elapsed())
    };
    let ((status, waited), _) = tokio::join!(stop, futures_util::future::join_all(flood));
    assert_eq!(status, StatusCode::OK);
    assert!(waited < Duration::from_millis(50), "{waited:?}");
    assert!(since.elapsed() >= Duration::from_millis(950));
}

#[tokio::test(start_paused = true)]
async fn a_refusal_that_is_held_back_makes_room_for_whoever_comes() {
    let rig = Rig::new("paced-room");
    let wrong = "POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer drv_wrong\r\nContent-Type: application/json\r\nContent-Length: 2\r\n\r\n{}";
    let mut held = Vec::new();
    for _ in 0..200 {
        let mut stream = rig.connect();
        stream.write_all(wrong.as_bytes()).await.unwrap();
        sleep(Duration::from_millis(1)).await;
        held.push(stream);
    }
    let since = Instant::now();
    assert!(stops(&mut rig.connect(), "").await);
    assert!(since.elapsed() < Duration::from_millis(50));
}

/// A whole stop, and whether it was answered.
async fn stops(stream: &mut DuplexStream, bearer: &str) -> bool {
    let request = format!(
        "POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 2\r\n{bearer}\r\n{{}}"
    );
    stream.write_all(request.as_bytes()).await.unwrap();
    let mut status = [0; 12];
    stream.read_exact(&mut status).await.is_ok() && &status == b"HTTP/1.1 200"
}

/// RFC 9112, 9.6: who has asked may close his half, and is answered by the other. `nc -N` does.
#[tokio::test(start_paused = true)]
async fn whoever_says_no_more_behind_his_stop_is_answered() {
    let rig = Rig::new("half-closed");
    let mut stream = rig.connect();
    let request = "POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 2\r\n\r\n{}";
    stream.write_all(request.as_bytes()).await.unwrap();
    stream.shutdown().await.unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).await.unwrap();
    assert!(answer.starts_with(b"HTTP/1.1 200"), "{}", String::from_utf8_lossy(&answer));
}

#[tokio::test(start_paused = true)]
async fn whoever_says_his_login_slowly_keeps_nobody_from_a_stop() {
    let rig = Rig::new("slow-logins");
    let bearer = format!("Authorization: Bearer {}\r\n", rig.token("panel", Role::Stop));
    let login = "POST /api/v1/login HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 80\r\n\r\n{";
    let mut slow = Vec::new();
    for number in 0..64 {
        let mut stream = rig.connect_from([10, 0, number / 16, number % 16]).unwrap();
        stream.write_all(login.as_bytes()).await.unwrap();
        slow.push(stream);
    }
    sleep(Duration::from_millis(10)).await;
    for address in [[10, 0, 0, 1], [10, 0, 9, 9]] {
        let mut stream = rig.connect_from(address).expect("the slow make room");
        assert!(stops(&mut stream, &bearer).await);
    }
}

#[tokio::test(start_paused = true)]
async fn nothing_is_read_for_longer_than_a_second_before_it_is_known_who_asks() {
    let rig = Rig::new("login-in-time");
    let mut slow = rig.connect();
    let login = "POST /api/v1/login HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 80\r\n\r\n{";
    slow.write_all(login.as_bytes()).await.unwrap();
    let begun = Instant::now();
    let mut answer = Vec::new();
    slow.read_to_end(&mut answer).await.unwrap();
    assert!(answer.starts_with(b"HTTP/1.1 408"), "{}", String::from_utf8_lossy(&answer));
    assert!(begun.elapsed() <= Duration::from_millis(1_100), "{:?}", begun.elapsed());
}

#[tokio::test]
async fn a_proxy_that_hides_whom_it_speaks_for_makes_nobody_local() {
    let rig = Rig::new("hidden-proxy");
    for (name, value) in
        [("via", "1.1 front"), ("x-forwarded-host", "drives.example"), ("x-forwarded-proto", "https")]
    {
        rig.ask(&Asked { headers: &[(name, value)], ..STOP }).await.assert_refused(401);
    }
}

#[tokio::test]
async fn what_a_viewer_may_not_do_takes_no_room_in_the_log_of_what_was_done() {
    let rig = Rig::new("refused");
    let bearer = format!("Bearer {}", rig.token("viewer", Role::View));
    let body = format!("{{\"a\":\"{}\"}}", "x".repeat(60_000));
    for _ in 0..50 {
        let asked = Asked { headers: &[("authorization", &bearer)], body: &body, ..START };
        rig.ask(&asked).await.assert_refused(403);
    }
    // Of fifty ten are told, in a file of their own.
    assert_eq!(rig.audited().await, vec!["refused viewer -"; 10]);
    let log = fs::read_to_string(rig.folder.file("audit")).unwrap();
    assert!(!log.contains("viewer"), "{log}");
    let size: u64 =
        fs::read_dir(rig.folder.file("")).unwrap().map(|file| file.unwrap().metadata().unwrap().len()).sum();
    assert!(size < 20_000, "{size} bytes");
}

#[tokio::test]
async fn a_token_that_was_sent_to_a_wrong_path_stands_nowhere() {
    let rig = Rig::new("masked");
    let bearer = format!("Bearer {}", rig.token("boss", Role::Engineer));
    let body = format!("{{\"token\":\"{}\",\"password\":\"secret\"}}", &bearer[7..]);
    let path = format!("/api/v1/logins?token={}", &bearer[7..]);
    rig.ask(&Asked { path: &path, headers: &[("authorization", &bearer)], body: &body, ..START }).await;
    rig.audited().await;
    let log = fs::read_to_string(rig.folder.file("audit")).unwrap();
    assert!(log.contains("POST /api/v1/logins"), "{log}");
    assert!(!log.contains(&bearer[11..]) && !log.contains("secret"), "{log}");
}

#[tokio::test]
async fn a_stop_that_could_not_be_written_stands_in_the_log_as_soon_as_it_can() {
    let rig = Rig::new("gap");
    rig.ask_on_socket(&START).await;
    rig.audited().await;
    let held = fs::read(rig.folder.file("audit")).unwrap();
    fs::remove_file(rig.folder.file("audit")).unwrap();
    fs::create_dir(rig.folder.file("audit")).unwrap();
    assert_eq!(rig.ask(&STOP).await.status, StatusCode::OK);
    rig.ask_on_socket(&START).await.assert_refused(503);
    assert!(*rig.gate.audit.failing().borrow());
    fs::remove_dir(rig.folder.file("audit")).unwrap();
    fs::write(rig.folder.file("audit"), held).unwrap();
    rig.audited().await;
    let log = fs::read_to_string(rig.folder.file("audit")).unwrap();
    let gap = log.lines().find(|line| line.contains("\"kind\":\"gap\"")).expect("a gap");
    assert!(gap.contains("POST /api/v1/stop"), "{gap}");
    assert!(!*rig.gate.audit.failing().borrow());
    let verdict = audit::verify(&rig.folder.file("audit")).unwrap();
    assert!(matches!(verdict, audit::Verdict::Unbroken { .. }), "{verdict:?}");
}

#[tokio::test]
async fn wrong_tokens_on_the_path_of_a_stop_fill_no_log() {
    let rig = Rig::new("flood");
    for number in 0..500 {
        let wrong = format!("Bearer drv_{number}");
        rig.ask(&Asked { headers: &[("authorization", &wrong)], ..STOP }).await.assert_refused(401);
    }
    rig.audited().await;
    let mut lines = 0;
    for file in fs::read_dir(rig.folder.file("")).unwrap() {
        let text = fs::read_to_string(file.unwrap().path()).unwrap_or_default();
        lines += text.lines().filter(|line| line.contains("login_failed")).count();
    }
    assert!((1..=30).contains(&lines), "{lines}");
}

#[tokio::test]
async fn tokens_are_made_and_removed_over_the_socket_and_by_no_door_that_others_reach() {
    let rig = Rig::new("token-desk");
    let bearer = format!("Bearer {}", rig.token("boss", Role::Engineer));
    let new = Asked { path: TOKENS, body: r#"{"name":"panel","role":"operate"}"#, ..START };
    rig.ask(&Asked { headers: &[("authorization", &bearer)], ..new }).await.assert_refused(403);
    let made = rig.ask_on_socket(&new).await;
    let told: serde_json::Value = serde_json::from_str(&made.body).unwrap();
    let secret = &told["token"];
    let bearer = format!("Bearer {}", secret.as_str().unwrap());
    let asked = Asked { headers: &[("authorization", &bearer)], ..STATE };
    assert_eq!(rig.ask(&asked).await.body, "panel http 127.0.0.1 vso");
    rig.ask_on_socket(&new).await.assert_refused(422);
    let listed = rig.ask_on_socket(&Asked { path: TOKENS, ..STATE }).await.body;
    assert!(
        listed.contains(r#""name":"panel","role":"operate""#) && !listed.contains(&bearer[11..]),
        "{listed}"
    );
    let remove = Asked { method: "DELETE", path: "/api/v1/tokens/panel", body: "", headers: &[] };
    assert_eq!(rig.ask_on_socket(&remove).await.status, StatusCode::OK);
    rig.ask(&asked).await.assert_refused(401);
    rig.ask_on_socket(&remove).await.assert_refused(404);
    let audited = rig.audited().await;
    assert_eq!(audited.iter().filter(|line| *line == "token local -").count(), 2, "{audited:?}");
}

#[tokio::test]
async fn a_null_in_what_is_asked_of_tokens_is_refused_with_the_name_of_its_key() {
    let rig = Rig::new("token-null");
    for (method, path, body, key) in [
        ("POST", TOKENS, r#"{"name":"panel","role":"view","days":null}"#, "days: null is no value"),
        ("POST", TOKENS, r#"{"name":"panel","role":"view","scope":null}"#, "scope: null is no value"),
        ("POST", TOKENS, r#"{"name":"panel","role":"view","role":"engineer"}"#, "role stands there twice"),
        ("PUT", "/api/v1/tokens/panel", r#"{"hours":null}"#, "hours: null is no value"),
        ("POST", LOGIN, r#"{"token":null}"#, "token: null is no value"),
    ] {
        let answer = rig.ask_on_socket(&Asked { method, path, body, headers: &[] }).await;
        answer.assert_refused(400);
        assert!(answer.body.contains(key), "{}", answer.body);
    }
    let listed = rig.ask_on_socket(&Asked { path: TOKENS, ..STATE }).await.body;
    assert!(!listed.contains("panel"), "{listed}");
}

#[tokio::test]
async fn a_stop_is_carried_out_while_every_thread_that_answers_readings_is_busy() {
    let mut rig = Rig::new("busy");
    let (threads, _own) = threads::Own::start();
    let (release, held) = std::sync::mpsc::channel::<()>();
    let (held, begun) = (Arc::new(std::sync::Mutex::new(held)), Arc::new(tokio::sync::Notify::new()));
    let begins = Arc::clone(&begun);
    let busy = move || {
        let (held, begins) = (Arc::clone(&held), Arc::clone(&begins));
        async move {
            begins.notify_one();
            // As whoever makes a large answer: its thread does nothing else.
            let _ = held.lock().map(|held| held.recv_timeout(Duration::from_secs(2)));
        }
    };
    let gate = Arc::get_mut(&mut rig.gate).unwrap();
    gate.router = gate.router.clone().route("/api/v1/busy", axum::routing::get(busy));
    gate.threads = threads;
    let rig = Arc::new(rig);
    let reads: Vec<_> = (0..2 * std::thread::available_parallelism().unwrap().get())
        .map(|_| {
            let rig = Arc::clone(&rig);
            tokio::spawn(async move { rig.ask(&Asked { path: "/api/v1/busy", ..STATE }).await.status })
        })
        .collect();
    begun.notified().await;
    assert_eq!(rig.ask(&STOP).await.status, StatusCode::OK);
    assert!(reads.iter().all(|read| !read.is_finished()), "it waited for who reads");
    drop(release);
    for read in reads {
        assert_eq!(read.await.unwrap(), StatusCode::OK);
    }
}
