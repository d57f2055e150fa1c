//! Every metric there is, in one table: what is written at `/metrics`, the table of the manual, and what alert rules and the
//! board may name are all made of it, or checked against it.

use std::time::Duration;

use crate::plant::tally::STOP_BOUNDS;

/// What kind of number a metric is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Gauge,
    /// Never goes backwards while the program runs and what it counts for is there.
    Counter,
    /// Always 1: its labels are what it tells.
    Info,
    /// Durations in seconds, counted by these bounds.
    Histogram(&'static [Duration]),
}

/// One metric.
#[derive(Debug, Clone, Copy)]
pub struct Metric {
    /// As it is scraped: a counter ends in `_total`, an info in `_info`.
    pub name: &'static str,
    pub kind: Kind,
    /// The names of its labels, in the order in which samples give their values.
    pub labels: &'static [&'static str],
    pub help: &'static str,
}

macro_rules! metrics {
    ($($id:ident: $kind:expr, $name:literal, [$($label:literal),*], $help:literal;)*) => {
        /// A metric of the table.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Id {
            $($id,)*
        }

        /// All metrics, in the order in which they are written.
        pub const TABLE: &[Metric] = {
            use Kind::*;
            &[$(Metric { name: $name, kind: $kind, labels: &[$($label),*], help: $help },)*]
        };
    };
}

metrics! {
    BuildInfo: Info, "drived_build_info", ["version"], "The program that answers.";
    ClockDrift: Gauge, "drived_clock_drift_seconds", [],
        "How far the wall clock has moved against the steady one since the start: a step of it is a step here.";
    ReloadSuccessful: Gauge, "drived_config_last_reload_successful", [],
        "Whether the configuration holds that was last read, at the start or later: 1, or 0 when the old one holds on.";
    ReloadTime: Gauge, "drived_config_last_reload_success_timestamp_seconds", [],
        "When the configuration that holds was read.";

    DriveInfo: Info, "drived_drive_info", ["line", "drive", "name", "address", "family", "model", "firmware"],
        "What a drive is. drive is its id, which it keeps, and name what it is called now; model and firmware are empty until it has said them, or where its family cannot.";
    DriveUp: Gauge, "drived_drive_up", ["line", "drive"], "Whether the drive answers.";
    DriveLastAnswer: Gauge, "drived_drive_last_answer_timestamp_seconds", ["line", "drive"],
        "When the last status of the drive was read; absent before the first.";
    DriveState: Gauge, "drived_drive_state", ["line", "drive", "state"],
        "1 for the state that the drive is in, 0 for the others.";
    DriveFrequency: Gauge, "drived_drive_output_frequency_hertz", ["line", "drive"], "The output frequency.";
    DriveSetpoint: Gauge, "drived_drive_setpoint_hertz", ["line", "drive"],
        "The setpoint that this program gave the drive last and that it confirmed.";
    DriveSetpointSpeed: Gauge, "drived_drive_setpoint_rpm", ["line", "drive"],
        "The same for a drive that takes speeds.";
    DriveSpeed: Gauge, "drived_drive_motor_speed_rpm", ["line", "drive"], "The motor speed.";
    DriveCurrent: Gauge, "drived_drive_motor_current_amperes", ["line", "drive"], "The motor current.";
    DriveCurrentShare: Gauge, "drived_drive_motor_current_ratio", ["line", "drive"],
        "The motor current by the rated current, where the family tells it so.";
    DriveCurrentLimit: Gauge, "drived_drive_motor_current_limit_amperes", ["line", "drive"],
        "The current above which the configuration has an alarm; absent without one.";
    DriveMotorVoltage: Gauge, "drived_drive_motor_voltage_volts", ["line", "drive"], "The output voltage.";
    DriveMotorVoltageShare: Gauge, "drived_drive_motor_voltage_ratio", ["line", "drive"],
        "The output voltage by the base of the drive, where the family tells it so.";
    DriveBusVoltage: Gauge, "drived_drive_bus_voltage_volts", ["line", "drive"], "The DC bus voltage.";
    DriveBusVoltageShare: Gauge, "drived_drive_bus_voltage_ratio", ["line", "drive"],
        "The DC bus voltage by the base of the drive, where the family tells it so.";
    DriveLineVoltage: Gauge, "drived_drive_line_voltage_volts", ["line", "drive"], "The line voltage.";
    DriveTorque: Gauge, "drived_drive_torque_ratio", ["line", "drive"],
        "The torque by the nominal torque; negative where the motor brakes.";
    DrivePowerShare: Gauge, "drived_drive_power_ratio", ["line", "drive"],
        "The power by the nominal power, where the family tells it so.";
    DrivePower: Gauge, "drived_drive_power_watts", ["line", "drive"], "The power given to the motor.";
    DriveInputPower: Gauge, "drived_drive_input_power_watts", ["line", "drive"], "The power taken from the line.";
    DriveThermal: Gauge, "drived_drive_thermal_ratio", ["line", "drive", "of"],
        "The thermal state of the motor or of the drive; 1 is nominal.";
    DriveLoad: Gauge, "drived_drive_load_ratio", ["line", "drive", "of"], "The load of the motor or of the drive.";
    DriveRunning: Counter, "drived_drive_running_seconds_total", ["line", "drive"],
        "The time with the motor running, as the drive counts it.";
    DrivePowered: Counter, "drived_drive_powered_seconds_total", ["line", "drive"],
        "The time under power, as the drive counts it.";
    DriveWarning: Gauge, "drived_drive_warning", ["line", "drive"], "Whether the drive shows an alarm that does not trip it.";
    DriveFault: Gauge, "drived_drive_fault", ["line", "drive", "code", "mnemonic"],
        "1 while the drive is tripped, with the manual's mnemonic; absent otherwise.";
    DriveTrips: Counter, "drived_drive_trips_total", ["line", "drive"], "Trips; not one that stood at the start.";
    DriveInControl: Gauge, "drived_drive_in_control", ["line", "drive", "by"],
        "1 for who has control of the drive: bus, terminals, panel, local or other bus.";
    DriveStopPending: Gauge, "drived_drive_stop_pending_seconds", ["line", "drive"],
        "For how long a stop has not been confirmed; absent when there is none.";
    DriveStopUnconfirmed: Gauge, "drived_drive_stop_unconfirmed", ["line", "drive"],
        "1 when a stop has not been confirmed for longer than the configuration allows, else 0.";
    DriveConcern: Gauge, "drived_drive_concern", ["line", "drive", "concern"],
        "1 for each thing that troubles the drive, by its word; absent otherwise.";
    Alarms: Gauge, "drived_alarms", ["line", "drive", "name", "alarm", "state"],
        "How many alarms of a kind are in a state, by their words; name is what the drive or the line is called now; drive is empty for those of a line, line too for those of the program.";
    AlarmsDropped: Counter, "drived_alarms_dropped_total", [],
        "Alarms that had returned and were dropped before somebody acknowledged them, because there were too many.";
    DriveWatchdogArmed: Gauge, "drived_drive_watchdog_armed", ["line", "drive"],
        "Whether the drive's communication watchdog is known to be armed: as the configuration says, or as it was found.";
    DriveWatchdogTimeout: Gauge, "drived_drive_watchdog_timeout_seconds", ["line", "drive"],
        "After how long without a message the armed watchdog acts.";
    DriveWatchdogMargin: Gauge, "drived_drive_watchdog_margin_seconds", ["line", "drive"],
        "What is left of that time when the drive hears its next message at the latest, by the plan of the line.";
    DrivePolls: Counter, "drived_drive_polls_total", ["line", "drive"], "Statuses that were due.";
    DriveMissed: Counter, "drived_drive_polls_missed_total", ["line", "drive"],
        "Statuses that did not come before the next was due.";
    DriveLost: Counter, "drived_drive_lost_total", ["line", "drive"], "How often the drive was lost.";
    DriveSaves: Counter, "drived_drive_eeprom_saves_total", ["line", "drive"],
        "Saves to EEPROM that were asked for here.";

    LineInfo: Info, "drived_line_info", ["line", "name", "protocol"],
        "What a line is. line is its id, which it keeps, and name what it is called now.";
    LineUp: Gauge, "drived_line_up", ["line"], "Whether the port is there.";
    LineBusy: Counter, "drived_line_busy_seconds_total", ["line"],
        "The time in which the line was needed: its rate is the utilisation.";
    LineWorstStop: Gauge, "drived_line_worst_case_stop_seconds", ["line"],
        "The longest time from a stop to its first bit on the line, whatever happens.";
    LineSweep: Gauge, "drived_line_sweep_seconds", ["line"], "One status of every living drive, by the plan.";
    LineWaiting: Gauge, "drived_line_waiting_requests", ["line"], "Requests that wait now.";
    LineExchanges: Counter, "drived_line_exchanges_total", ["line", "drive", "result"],
        "Exchanges on the line by their end: answered, exception, no_answer, damaged, mismatch or busy.";
    LineExchangeDuration: Histogram(&drive_bus::stats::BOUNDS), "drived_line_exchange_duration_seconds", ["line", "drive"],
        "From the first character of a request to the end of its answer, or of the wait for one.";
    LineRequests: Counter, "drived_line_requests_total", ["line", "class"],
        "Requests that were sent, by class: stop, command, keep-alive, status or background.";
    LineQueueWait: Histogram(&drive_bus::stats::BOUNDS), "drived_line_queue_wait_seconds", ["line", "class"],
        "From the call to the first bit on the line.";
    LineUnsent: Counter, "drived_line_unsent_requests_total", ["line", "reason"],
        "Requests that never went out: expired, superseded, withdrawn or refused.";
    LineFrameErrors: Counter, "drived_line_frame_errors_total", ["line", "kind"],
        "Frames that answered nothing: late, early, wrong_function, wrong_count or foreign.";
    LineNoise: Counter, "drived_line_noise_bytes_total", ["line"], "Bytes that made no frame.";
    LineReopens: Counter, "drived_line_reopens_total", ["line"], "How often the port was opened again.";

    Commands: Counter, "drived_commands_total", ["line", "drive", "action", "outcome", "origin"],
        "Commands by what became of them at first; origin is the face they came by.";
    StopConfirm: Histogram(&STOP_BOUNDS), "drived_stop_confirm_seconds", [],
        "From the arrival of a stop until the drive showed standstill.";

    HttpRequests: Counter, "drived_http_requests_total", ["route", "method", "code"],
        "Answers of the HTTP server and the control socket; route is the template of the path.";

    MqttConnected: Gauge, "drived_mqtt_connected", [], "Whether the MQTT broker is connected; absent without one.";
    MqttWaiting: Gauge, "drived_mqtt_queue_messages", [], "Messages that wait to be sent to the MQTT broker.";
    MqttSent: Counter, "drived_mqtt_sent_messages_total", [], "Messages that the MQTT broker has taken.";
    MqttArrived: Counter, "drived_mqtt_arrived_messages_total", [], "Messages of the MQTT broker that were looked at.";
    MqttLost: Counter, "drived_mqtt_dropped_messages_total", ["reason"],
        "Messages that were lost: no_room, expired, not_taken by the broker, or a flood of arriving ones.";

    GatewayClients: Gauge, "drived_gateway_clients", ["gateway"], "Modbus TCP clients that are connected.";
    GatewayRequests: Counter, "drived_gateway_requests_total", ["gateway", "function", "result"],
        "Requests of Modbus TCP clients: answered, exception_ and its code, or silence.";
    GatewayDuration: Histogram(&drive_bus::stats::BOUNDS), "drived_gateway_request_duration_seconds", ["gateway"],
        "From the arrival of a request to its answer.";
    GatewayRefused: Counter, "drived_gateway_refused_writes_total", ["gateway", "reason"],
        "Writes that were refused, by the exception.";
    GatewaySaved: Counter, "drived_gateway_saved_exchanges_total", ["gateway", "by"],
        "Reads that were answered without an exchange of their own: joined to an equal one, or kept from a block read before.";
    GatewayEnded: Counter, "drived_gateway_ended_connections_total", ["gateway", "reason"],
        "Clients that were turned away or put out: full, not_allowed, idle, half_open, malformed or slow_reader.";
    SparkplugConnected: Gauge, "drived_sparkplug_connected", [],
        "Whether the edge node of Sparkplug is connected to its broker; absent without one.";
    SparkplugSent: Counter, "drived_sparkplug_sent_messages_total", [], "Messages of the edge node that the broker has taken.";
    SparkplugArrived: Counter, "drived_sparkplug_arrived_messages_total", [], "Messages for the edge node that were looked at.";
    SparkplugLost: Counter, "drived_sparkplug_dropped_messages_total", ["reason"],
        "Messages of the edge node, or for it, that were lost; reasons as for MQTT.";
    SparkplugHistorical: Counter, "drived_sparkplug_historical_values_total", ["result"],
        "Values of outages by what became of them: told, or left_out, for their drive or its metric is not there any more.";
    WebhookWaiting: Gauge, "drived_webhook_queue_messages", ["receiver"], "Messages that wait for a receiver of alarms.";
    WebhookTaken: Counter, "drived_webhook_sent_messages_total", ["receiver"], "Messages that the receiver has taken.";
    WebhookFailed: Counter, "drived_webhook_failed_attempts_total", ["receiver", "reason"],
        "Attempts in vain, by the reason: unreachable, timeout, status or refused.";
    WebhookLost: Counter, "drived_webhook_dropped_messages_total", ["receiver", "reason"],
        "Messages that were lost: refused by the receiver, or no_room.";

    ProcessCpu: Counter, "process_cpu_seconds_total", [], "User and system processor time.";
    ProcessFds: Gauge, "process_open_fds", [], "Open file descriptors.";
    ProcessMaxFds: Gauge, "process_max_fds", [], "How many file descriptors may be open.";
    ProcessResident: Gauge, "process_resident_memory_bytes", [], "Resident memory.";
    ProcessVirtual: Gauge, "process_virtual_memory_bytes", [], "Virtual memory.";
    ProcessThreads: Gauge, "process_threads", [], "Threads.";
    ProcessStart: Gauge, "process_start_time_seconds", [], "When the program was started.";
}

impl Id {
    /// Its row.
    pub fn metric(self) -> &'static Metric {
        // The variants and the rows are made of the same list.
        &TABLE[self as usize]
    }
}
