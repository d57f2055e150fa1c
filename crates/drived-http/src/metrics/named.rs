//! What the alert rules and the board name: every metric and every label of it is in the table.

use std::collections::BTreeSet;

use serde_json::Value;

use super::{
    ALERTS, dashboard,
    table::{Kind, TABLE},
};

/// What a metrics store adds to every series.
const ADDED: [&str; 3] = ["instance", "job", "le"];

fn is_of_name(letter: char) -> bool {
    letter.is_ascii_alphanumeric() || matches!(letter, '_' | ':')
}

/// The labels of a metric, or of what belongs to a histogram; `None` where there is no such metric.
fn labels_of(name: &str) -> Option<&'static [&'static str]> {
    let of_histogram = |base: &&str| {
        TABLE.iter().any(|metric| metric.name == *base && matches!(metric.kind, Kind::Histogram(_)))
    };
    let base =
        ["_bucket", "_sum", "_count"].into_iter().find_map(|end| name.strip_suffix(end).filter(of_histogram));
    let metric = TABLE.iter().find(|metric| metric.name == base.unwrap_or(name))?;
    Some(metric.labels)
}

/// Checks the queries in a text, and gives the metrics that they name. Words that are recorded by rules are none.
fn check(text: &str) -> BTreeSet<String> {
    let mut named = BTreeSet::new();
    let mut rest = text;
    while let Some(at) = rest.find(is_of_name) {
        let from = &rest[at..];
        let end = from.find(|letter| !is_of_name(letter)).unwrap_or(from.len());
        let (word, after) = from.split_at(end);
        rest = after;
        let listed = after.trim_start().strip_prefix('(').and_then(|list| list.split(')').next());
        if let Some(list) =
            listed.filter(|_| ["by", "on", "without", "ignoring", "group_left"].contains(&word))
        {
            for label in list.split(',').map(str::trim).filter(|label| !label.is_empty()) {
                let is_known =
                    TABLE.iter().any(|metric| metric.labels.contains(&label)) || ADDED.contains(&label);
                assert!(is_known, "no metric has the label {label}: {text}");
            }
        }
        if !word.starts_with("drived_") && !word.starts_with("process_") {
            continue;
        }
        let labels = labels_of(word).unwrap_or_else(|| panic!("there is no metric {word}: {text}"));
        named.insert(word.to_owned());
        let matched =
            after.strip_prefix('{').and_then(|matched| matched.split('}').next()).unwrap_or_default();
        for label in matched.split(',').filter_map(|part| part.split(['=', '!']).next()) {
            let label = label.trim();
            assert!(
                label.is_empty() || labels.contains(&label) || ADDED.contains(&label),
                "{word} has no label {label}"
            );
        }
    }
    named
}

/// Every string under one of these keys.
fn strings<'a>(value: &'a Value, keys: &[&str], found: &mut Vec<&'a str>) {
    match value {
        Value::Object(members) => {
            for (key, value) in members {
                match value {
                    Value::String(text) if keys.contains(&&**key) => found.push(text),
                    other => strings(other, keys, found),
                }
            }
        }
        Value::Array(values) => values.iter().for_each(|value| strings(value, keys, found)),
        _ => {}
    }
}

#[test]
fn every_metric_and_label_of_the_alert_rules_is_in_the_table() {
    assert!(check(ALERTS).len() > 15);
}

#[test]
#[should_panic(expected = "there is no metric drived_drive_speed")]
fn a_metric_that_is_not_there_is_found() {
    check("rate(drived_drive_speed[5m])");
}

#[test]
#[should_panic(expected = "drived_drive_up has no label state")]
fn a_label_that_a_metric_does_not_have_is_found() {
    check(r#"drived_drive_up{line="north", state!="running"} == 1"#);
}

#[test]
fn every_metric_and_label_of_the_board_is_in_the_table() {
    let (board, mut queries) = (dashboard(), Vec::new());
    strings(&board, &["expr", "query", "definition"], &mut queries);
    assert!(queries.len() > 25, "{queries:?}");
    let named: BTreeSet<String> = queries.iter().flat_map(|query| check(query)).collect();
    assert!(named.len() > 20, "{named:?}");
    let mut legends = Vec::new();
    strings(&board, &["legendFormat", "titleFormat", "textFormat"], &mut legends);
    for label in legends.iter().flat_map(|text| text.split("{{").skip(1)) {
        let label = label.split("}}").next().unwrap_or_default();
        assert!(!["drive", "line"].contains(&label), "an id where a name is read: {legends:?}");
        assert!(
            TABLE.iter().any(|metric| metric.labels.contains(&label)) || ADDED.contains(&label),
            "{label}"
        );
    }
}

/// As Grafana makes the choices of `query_result`: its source of Prometheus writes each series as a text, and the first match of each of
/// both groups is taken (`metricNamesToVariableValues`).
#[test]
fn a_drive_and_a_line_are_chosen_by_what_they_are_called_and_meant_by_their_ids() {
    let board = dashboard();
    let of = |name: &str| {
        let all = board["templating"]["list"].as_array().unwrap();
        let variable = all.iter().find(|variable| variable["name"] == name).unwrap();
        let regex =
            variable["regex"].as_str().unwrap().strip_prefix('/').unwrap().strip_suffix("/g").unwrap();
        regex::Regex::new(regex).unwrap()
    };
    let drive = r#"{address="2",drive="pump 2",family="atv28",instance="a:7580",line="north",name="mixer"} 1 1790000000000"#;
    let turned = r#"{name="mixer",line="north",drive="pump 2",instance="a:7580"} 1 1790000000000"#;
    for (variable, series, value, text) in [
        ("drive", format!("drived_drive_info{drive}"), "pump 2", "mixer"),
        ("drive", format!("drived_drive_info{turned}"), "pump 2", "mixer"),
        (
            "line",
            r#"drived_line_info{line="north",name="hall 1",protocol="rtu"} 1 1790000000000"#.to_owned(),
            "north",
            "hall 1",
        ),
    ] {
        let regex = of(variable);
        let first = |group| regex.captures_iter(&series).find_map(|found| Some(found.name(group)?.as_str()));
        assert_eq!((first("value"), first("text")), (Some(value), Some(text)), "{series}");
    }
}

#[test]
fn the_panels_of_the_board_have_a_place_each_and_an_id_each() {
    let board = dashboard();
    let panels = board["panels"].as_array().unwrap();
    let place = |panel: &Value| ["x", "y", "w", "h"].map(|key| panel["gridPos"][key].as_u64().unwrap());
    let ids: BTreeSet<u64> = panels.iter().map(|panel| panel["id"].as_u64().unwrap()).collect();
    assert_eq!(ids.len(), panels.len());
    for (number, panel) in panels.iter().enumerate() {
        let [x, y, width, height] = place(panel);
        assert!(width > 0 && height > 0 && x + width <= 24, "{panel}");
        for other in &panels[..number] {
            let [other_x, other_y, other_width, other_height] = place(other);
            let apart = x >= other_x + other_width
                || other_x >= x + width
                || y >= other_y + other_height
                || other_y >= y + height;
            assert!(apart, "{} lies upon {}", panel["title"], other["title"]);
        }
        let letters: Vec<&str> = panel["targets"]
            .as_array()
            .into_iter()
            .flatten()
            .map(|target| target["refId"].as_str().unwrap())
            .collect();
        assert_eq!(letters.iter().collect::<BTreeSet<_>>().len(), letters.len(), "{panel}");
    }
    let titles: BTreeSet<&str> = panels.iter().map(|panel| panel["title"].as_str().unwrap()).collect();
    assert_eq!(titles.len(), panels.len());
}

/// The members that Grafana's import reads, as its documentation of the JSON model has them.
#[test]
fn the_board_has_the_shape_that_is_imported() {
    let source = serde_json::json!({
        "type": "object", "required": ["type", "uid"],
        "properties": { "type": { "const": "prometheus" }, "uid": { "const": "${DS_PROMETHEUS}" } },
    });
    let target = serde_json::json!({
        "type": "object", "required": ["refId", "expr", "datasource"],
        "properties": {
            "refId": { "type": "string", "pattern": "^[A-Z]$" },
            "expr": { "type": "string", "minLength": 1 },
            "datasource": source,
            "format": { "enum": ["time_series", "table", "heatmap"] },
            "instant": { "type": "boolean" }, "range": { "type": "boolean" },
        },
    });
    let panel = serde_json::json!({
        "type": "object", "required": ["id", "type", "title", "gridPos"],
        "properties": {
            "type": { "enum": ["row", "stat", "table", "timeseries", "heatmap"] },
            "title": { "type": "string", "minLength": 1 },
            "targets": { "type": "array", "minItems": 1, "items": target },
            "fieldConfig": { "type": "object", "required": ["defaults", "overrides"] },
            "transformations": { "type": "array", "items": { "type": "object", "required": ["id", "options"] } },
        },
        "if": { "properties": { "type": { "const": "row" } } },
        "then": { "required": ["collapsed", "panels"] },
        "else": { "required": ["datasource", "targets", "options", "fieldConfig"] },
    });
    let schema = serde_json::json!({
        "type": "object",
        "required": ["__inputs", "__requires", "uid", "title", "schemaVersion", "templating", "annotations", "panels", "time"],
        "properties": {
            "__inputs": { "type": "array", "minItems": 1, "maxItems": 1, "items": {
                "type": "object", "required": ["name", "label", "type", "pluginId", "pluginName"],
                "properties": { "name": { "const": "DS_PROMETHEUS" }, "type": { "const": "datasource" }, "pluginId": { "const": "prometheus" } },
            } },
            "uid": { "type": "string", "pattern": "^[A-Za-z0-9_-]{1,40}$" },
            "schemaVersion": { "type": "integer" },
            "templating": { "properties": { "list": { "type": "array", "items": {
                "type": "object", "required": ["type", "name", "datasource", "query", "multi", "includeAll"],
                "properties": { "type": { "const": "query" }, "datasource": source, "multi": { "const": true } },
            } } } },
            "annotations": { "properties": { "list": { "type": "array", "items": {
                "type": "object", "required": ["name", "datasource", "enable", "expr"],
            } } } },
            "panels": { "type": "array", "items": panel },
        },
    });
    let validator = jsonschema::validator_for(&schema).unwrap();
    let board = dashboard();
    let errors: Vec<String> =
        validator.iter_errors(&board).map(|error| format!("{}: {error}", error.instance_path())).collect();
    assert!(errors.is_empty(), "{errors:#?}");
    let names: Vec<&str> = board["templating"]["list"]
        .as_array()
        .unwrap()
        .iter()
        .map(|variable| variable["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["instance", "line", "drive"]);
}
