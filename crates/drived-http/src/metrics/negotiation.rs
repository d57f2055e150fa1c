//! Which of the two formats is wanted: RFC 9110, as far as scrapers use it.

use axum::http::{HeaderMap, header::ACCEPT};

use super::samples::Format;

/// OpenMetrics where it is asked for by name and at least as much as the text format, which is what everybody else gets.
pub(super) fn wanted(headers: &HeaderMap) -> Format {
    let ranges = headers.get_all(ACCEPT).iter().filter_map(|value| value.to_str().ok());
    let (mut open, mut text) = (0, 0);
    for range in ranges.flat_map(|value| value.split(',')) {
        let mut parts = range.split(';').map(|part| part.trim().to_ascii_lowercase());
        let kind = parts.next().unwrap_or_default();
        let (mut weight, mut version) = (1_000, None);
        for parameter in parts {
            match parameter.split_once('=') {
                Some(("q", value)) => weight = per_mille(value),
                Some(("version", value)) => version = Some(value.trim_matches('"').to_owned()),
                _ => {}
            }
        }
        match &*kind {
            "application/openmetrics-text" if version.as_deref().is_none_or(|version| version == "1.0.0") => {
                open = weight.max(open);
            }
            "text/plain" if version.as_deref().is_none_or(|version| version == "0.0.4") => {
                text = weight.max(text);
            }
            _ => {}
        }
    }
    if open > 0 && open >= text { Format::OpenMetrics } else { Format::Text }
}

/// A weight in thousandths; one that cannot be read is none.
fn per_mille(value: &str) -> u32 {
    let weight: f64 = value.trim().parse().unwrap_or_default();
    (weight.clamp(0.0, 1.0) * 1_000.0) as u32
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    fn for_accept(values: &[&'static str]) -> Format {
        let mut headers = HeaderMap::new();
        for value in values {
            headers.append(ACCEPT, HeaderValue::from_static(value));
        }
        wanted(&headers)
    }

    #[test]
    fn what_prometheus_2_and_3_send_is_answered_with_openmetrics() {
        for accept in [
            "application/openmetrics-text;version=1.0.0,application/openmetrics-text;version=0.0.1;q=0.75,text/plain;version=0.0.4;q=0.5,*/*;q=0.1",
            "application/openmetrics-text;version=1.0.0;escaping=allow-utf-8;q=0.6,application/openmetrics-text;version=0.0.1;q=0.4,text/plain;version=1.0.0;escaping=allow-utf-8;q=0.3,text/plain;version=0.0.4;q=0.2,*/*;q=0.1",
            "application/openmetrics-text; version=\"1.0.0\"",
            "application/openmetrics-text",
        ] {
            assert_eq!(for_accept(&[accept]), Format::OpenMetrics, "{accept}");
        }
        assert_eq!(for_accept(&["text/plain;q=0.5", "application/openmetrics-text"]), Format::OpenMetrics);
    }

    #[test]
    fn everybody_else_gets_the_text_format() {
        for accept in [
            "",
            "*/*",
            "text/plain",
            "text/html,application/xhtml+xml,*/*;q=0.8",
            "application/openmetrics-text;version=0.0.1",
            "application/openmetrics-text;q=0",
            "application/openmetrics-text;q=0.2,text/plain;version=0.0.4",
            "application/openmetrics-text;q=nonsense",
        ] {
            assert_eq!(for_accept(&[accept]), Format::Text, "{accept}");
        }
        assert_eq!(for_accept(&[]), Format::Text);
    }
}
