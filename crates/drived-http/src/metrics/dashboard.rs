//! The Grafana board: made here, so that its panels stand in rows without gaps and name what the [table](super::table) has.

use serde_json::{Value, json};

/// The width of the board.
const COLUMNS: u64 = 24;
/// The data source that is asked for when the board is imported.
const SOURCE: &str = "${DS_PROMETHEUS}";
/// What every query of drives, and of lines, is narrowed to.
const DRIVES: &str = r#"instance=~"$instance",line=~"$line",drive=~"$drive""#;
const LINES: &str = r#"instance=~"$instance",line=~"$line""#;
const HOSTS: &str = r#"instance=~"$instance""#;

/// The board as Grafana imports it.
pub fn dashboard() -> Value {
    let mut board = Board::default();
    fleet(&mut board);
    drives(&mut board);
    lines(&mut board);
    commands(&mut board);
    json!({
        "__inputs": [{
            "name": "DS_PROMETHEUS",
            "label": "Prometheus",
            "description": "where drived is scraped to",
            "type": "datasource",
            "pluginId": "prometheus",
            "pluginName": "Prometheus",
        }],
        "__requires": [
            { "type": "grafana", "id": "grafana", "name": "Grafana", "version": "9.4.0" },
            { "type": "datasource", "id": "prometheus", "name": "Prometheus", "version": "1.0.0" },
        ],
        "uid": "drived",
        "title": "Drives",
        "description": "Variable-speed drives as drived sees them. A gap is a value that was not known.",
        "tags": ["drived", "modbus"],
        "editable": true,
        "graphTooltip": 1,
        "schemaVersion": 38,
        "version": 1,
        "refresh": "10s",
        "time": { "from": "now-1h", "to": "now" },
        "timezone": "browser",
        "templating": { "list": [
            variable("instance", "Host", "label_values(drived_build_info, instance)"),
            named("line", "Line", r#"query_result(drived_line_info{instance=~"$instance"})"#),
            named("drive", "Drive", &format!("query_result(drived_drive_info{{{LINES}}})")),
        ] },
        "annotations": { "list": [{
            "name": "Trips",
            "datasource": source(),
            "enable": true,
            "iconColor": "red",
            "expr": of_drive(&format!("drived_drive_fault{{{DRIVES}}} == 1")),
            "titleFormat": "{{name}} {{mnemonic}}",
            "textFormat": "fault {{code}}",
            "tagKeys": "line,name",
            "step": "15s",
        }] },
        "panels": board.panels,
    })
}

fn fleet(board: &mut Board) {
    board.row("Fleet");
    for (title, query, colour) in [
        ("Drives that answer", format!("sum(drived_drive_up{{{DRIVES}}})"), "green"),
        ("Running", format!(r#"sum(drived_drive_state{{{DRIVES},state="running"}})"#), "green"),
        ("Lost", format!("sum(drived_drive_up{{{DRIVES}}} == bool 0)"), "orange"),
        ("Tripped", format!("sum(drived_drive_fault{{{DRIVES}}}) or vector(0)"), "red"),
        ("Stops not confirmed", format!("sum(drived_drive_stop_unconfirmed{{{DRIVES}}})"), "red"),
        ("Lines that are away", format!("sum(drived_line_up{{{LINES}}} == bool 0)"), "red"),
    ] {
        board.put(4, 4, stat(title, &query, colour));
    }
    board.put(24, 12, table());
}

fn drives(board: &mut Board) {
    board.row("Drives");
    board.put(
        24,
        9,
        series(
            "Output frequency and setpoint",
            "hertz",
            &[
                (of_drive(&format!("drived_drive_output_frequency_hertz{{{DRIVES}}}")), "{{name}}"),
                (of_drive(&format!("drived_drive_setpoint_hertz{{{DRIVES}}}")), "{{name}} setpoint"),
            ],
        ),
    );
    for (title, unit, metric, legend) in [
        ("Motor current", "amp", "drived_drive_motor_current_amperes", "{{name}}"),
        ("Motor current by the rated one", "percentunit", "drived_drive_motor_current_ratio", "{{name}}"),
        ("Torque by the nominal one", "percentunit", "drived_drive_torque_ratio", "{{name}}"),
        ("Motor speed", "rotrpm", "drived_drive_motor_speed_rpm", "{{name}}"),
        ("Thermal state", "percentunit", "drived_drive_thermal_ratio", "{{name}} {{of}}"),
        ("DC bus voltage", "volt", "drived_drive_bus_voltage_volts", "{{name}}"),
    ] {
        board.put(12, 8, series(title, unit, &[(of_drive(&format!("{metric}{{{DRIVES}}}")), legend)]));
    }
}

fn lines(board: &mut Board) {
    board.row("Lines");
    let buckets = format!(
        "sum by (le) (increase(drived_line_exchange_duration_seconds_bucket{{{DRIVES}}}[$__rate_interval]))"
    );
    board.put(12, 9, heatmap("Duration of exchanges", &buckets));
    let waits = format!(
        "histogram_quantile(0.99, sum by (le, class) (rate(drived_line_queue_wait_seconds_bucket{{{LINES}}}[$__rate_interval])))"
    );
    board.put(12, 9, series("Wait for the line, p99 by class", "s", &[(waits, "{{class}}")]));
    for (title, unit, query, legend) in [
        (
            "Utilisation",
            "percentunit",
            of_line(&format!("rate(drived_line_busy_seconds_total{{{LINES}}}[$__rate_interval])")),
            "{{name}}",
        ),
        (
            "Exchanges that failed",
            "cps",
            of_drive(&format!(
                r#"sum by (instance, line, drive, result) (rate(drived_line_exchanges_total{{{DRIVES},result!~"answered|exception"}}[$__rate_interval])) > 0"#
            )),
            "{{name}} {{result}}",
        ),
        (
            "Frames that answered nothing",
            "cps",
            of_line(&format!("rate(drived_line_frame_errors_total{{{LINES}}}[$__rate_interval]) > 0")),
            "{{name}} {{kind}}",
        ),
        (
            "The longest way of a stop to the wire",
            "s",
            of_line(&format!("drived_line_worst_case_stop_seconds{{{LINES}}}")),
            "{{name}}",
        ),
    ] {
        board.put(12, 8, series(title, unit, &[(query, legend)]));
    }
}

fn commands(board: &mut Board) {
    board.row("Commands and the program");
    for (title, unit, query, legend) in [
        (
            "Commands by outcome",
            "short",
            format!(
                "sum by (action, outcome, origin) (increase(drived_commands_total{{{DRIVES}}}[$__rate_interval])) > 0"
            ),
            "{{action}} {{outcome}} by {{origin}}",
        ),
        (
            "Time until a stop was confirmed, p99",
            "s",
            format!(
                "histogram_quantile(0.99, sum by (le) (rate(drived_stop_confirm_seconds_bucket{{{HOSTS}}}[$__rate_interval])))"
            ),
            "p99",
        ),
        (
            "Requests of the HTTP server",
            "reqps",
            format!("sum by (route, code) (rate(drived_http_requests_total{{{HOSTS}}}[$__rate_interval]))"),
            "{{route}} {{code}}",
        ),
        (
            "MQTT messages",
            "cps",
            format!("rate(drived_mqtt_sent_messages_total{{{HOSTS}}}[$__rate_interval])"),
            "{{instance}}",
        ),
        (
            "MQTT messages that were lost",
            "short",
            format!("increase(drived_mqtt_dropped_messages_total{{{HOSTS}}}[$__rate_interval]) > 0"),
            "{{instance}} {{reason}}",
        ),
        (
            "Resident memory",
            "bytes",
            format!(r#"process_resident_memory_bytes{{{HOSTS}}} * on (instance) drived_build_info"#),
            "{{instance}}",
        ),
    ] {
        board.put(12, 8, series(title, unit, &[(query, legend)]));
    }
}

/// What drives are called now: their series have their ids, which they keep.
fn of_drive(query: &str) -> String {
    format!("({query}) * on (instance, line, drive) group_left (name) drived_drive_info")
}

/// The same of lines.
fn of_line(query: &str) -> String {
    format!("({query}) * on (instance, line) group_left (name) drived_line_info")
}

/// Panels from left to right and downwards.
#[derive(Default)]
struct Board {
    panels: Vec<Value>,
    left: u64,
    top: u64,
    /// The height of what stands beside the next panel.
    height: u64,
}

impl Board {
    fn row(&mut self, title: &str) {
        self.put(COLUMNS, 1, json!({ "type": "row", "title": title, "collapsed": false, "panels": [] }));
    }

    fn put(&mut self, width: u64, height: u64, mut panel: Value) {
        if self.left + width > COLUMNS {
            (self.left, self.top, self.height) = (0, self.top + self.height, 0);
        }
        panel["id"] = json!(self.panels.len() + 1);
        panel["gridPos"] = json!({ "x": self.left, "y": self.top, "w": width, "h": height });
        self.left += width;
        self.height = self.height.max(height);
        self.panels.push(panel);
    }
}

fn source() -> Value {
    json!({ "type": "prometheus", "uid": SOURCE })
}

fn variable(name: &str, label: &str, query: &str) -> Value {
    json!({
        "type": "query",
        "name": name,
        "label": label,
        "datasource": source(),
        "query": { "query": query, "refId": name },
        "definition": query,
        "refresh": 2,
        "sort": 1,
        "multi": true,
        "includeAll": true,
        "allValue": ".*",
        "current": { "text": ["All"], "value": ["$__all"] },
    })
}

/// One whose choices are shown by what they are called now, and chosen by their ids, which the series have. Grafana takes both from the
/// text of each series, where its labels stand in any order.
fn named(label: &str, shown: &str, query: &str) -> Value {
    let mut variable = variable(label, shown, query);
    variable["regex"] = format!(r#"/[{{,]{label}="(?<value>[^"]+)|[{{,]name="(?<text>[^"]+)/g"#).into();
    variable
}

fn target(letter: char, query: &str, legend: &str) -> Value {
    json!({ "refId": letter.to_string(), "datasource": source(), "expr": query, "legendFormat": legend, "range": true })
}

/// The same, only for now.
fn now(letter: char, query: &str) -> Value {
    let mut target = target(letter, query, "");
    target["range"] = json!(false);
    target["instant"] = json!(true);
    target["format"] = json!("table");
    target
}

fn stat(title: &str, query: &str, colour: &str) -> Value {
    json!({
        "type": "stat",
        "title": title,
        "datasource": source(),
        "targets": [now('A', query)],
        "options": {
            "reduceOptions": { "calcs": ["lastNotNull"], "fields": "", "values": false },
            "colorMode": "background",
            "graphMode": "none",
        },
        "fieldConfig": { "overrides": [], "defaults": {
            "noValue": "0",
            "thresholds": { "mode": "absolute", "steps": [
                { "color": "text", "value": null },
                { "color": colour, "value": 1 },
            ] },
        } },
    })
}

fn series(title: &str, unit: &str, queries: &[(String, &str)]) -> Value {
    let targets = ('A'..).zip(queries).map(|(letter, (query, legend))| target(letter, query, legend));
    json!({
        "type": "timeseries",
        "title": title,
        "datasource": source(),
        "targets": targets.collect::<Vec<_>>(),
        "options": {
            "legend": { "showLegend": true, "displayMode": "list", "placement": "bottom" },
            "tooltip": { "mode": "multi", "sort": "desc" },
        },
        "fieldConfig": { "overrides": [], "defaults": {
            "unit": unit,
            // A gap stays a gap.
            "custom": { "lineWidth": 1, "fillOpacity": 0, "spanNulls": false },
        } },
    })
}

fn heatmap(title: &str, query: &str) -> Value {
    let mut target = target('A', query, "{{le}}");
    target["format"] = json!("heatmap");
    json!({
        "type": "heatmap",
        "title": title,
        "datasource": source(),
        "targets": [target],
        "options": {
            "calculate": false,
            "yAxis": { "unit": "s" },
            "color": { "mode": "scheme", "scheme": "Oranges", "steps": 64 },
            "cellGap": 1,
        },
        "fieldConfig": { "overrides": [], "defaults": {} },
    })
}

/// One line a drive: what it is doing, in colours that are not the only carrier.
fn table() -> Value {
    let by = "max by (instance, line, drive";
    let queries = [
        format!("{by}, state) (drived_drive_state{{{DRIVES}}} == 1)"),
        format!("{by}, code, mnemonic) (drived_drive_fault{{{DRIVES}}})"),
        format!("{by}) (drived_drive_output_frequency_hertz{{{DRIVES}}})"),
        format!("{by}) (drived_drive_setpoint_hertz{{{DRIVES}}})"),
        format!("{by}) (drived_drive_motor_current_amperes{{{DRIVES}}})"),
        format!("{by}) (time() - drived_drive_last_answer_timestamp_seconds{{{DRIVES}}})"),
        format!("{by}, name) (drived_drive_info{{{DRIVES}}})"),
    ];
    let targets = ('A'..).zip(&queries).map(|(letter, query)| now(letter, query));
    let units = [
        ("Value #C", "hertz", "Output"),
        ("Value #D", "hertz", "Setpoint"),
        ("Value #E", "amp", "Current"),
        ("Value #F", "s", "Age"),
    ];
    let of_unit = |(name, unit, title): (&str, &str, &str)| {
        json!({
            "matcher": { "id": "byName", "options": name },
            "properties": [{ "id": "unit", "value": unit }, { "id": "displayName", "value": title }],
        })
    };
    let colours = [
        ("running", "green"),
        ("ready", "blue"),
        ("disabled", "text"),
        ("not_ready", "text"),
        ("stopping", "yellow"),
        ("quick_stop", "orange"),
        ("fault_reaction", "red"),
        ("fault", "red"),
        ("unknown", "purple"),
    ];
    let colours: serde_json::Map<String, Value> = (0..)
        .zip(colours)
        .map(|(index, (state, colour)): (u32, _)| {
            (state.to_owned(), json!({ "text": state.replace('_', " "), "color": colour, "index": index }))
        })
        .collect();
    let of_states = json!({
        "matcher": { "id": "byName", "options": "state" },
        "properties": [
            { "id": "mappings", "value": [{ "type": "value", "options": colours }] },
            { "id": "custom.cellOptions", "value": { "type": "color-text" } },
        ],
    });
    let overrides: Vec<Value> = units.into_iter().map(of_unit).chain([of_states]).collect();
    json!({
        "type": "table",
        "title": "Every drive; without a state: it cannot be seen",
        "datasource": source(),
        "targets": targets.collect::<Vec<_>>(),
        "transformations": [
            { "id": "merge", "options": {} },
            { "id": "organize", "options": {
                "excludeByName": { "Time": true, "Value #A": true, "Value #B": true, "Value #G": true },
                "indexByName": { "instance": 0, "line": 1, "name": 2, "drive": 3 },
                "renameByName": { "mnemonic": "fault", "drive": "id" },
            } },
        ],
        "options": { "showHeader": true, "sortBy": [{ "displayName": "fault", "desc": true }] },
        "fieldConfig": { "overrides": overrides, "defaults": {} },
    })
}
