// The values of the history, by their names of the API: in words, with unit and digits.

import { t } from './texts.js';

const VALUES = {
  output_frequency_hz: ['frequency', 'Hz', 1],
  setpoint_hz: ['setpoint', 'Hz', 1],
  current_a: ['current', 'A', 1],
  torque_percent: ['torque', '%', 0],
  speed_rpm: ['speed', 'rpm', 0],
  output_power_kw: ['output_power', 'kW', 2],
  input_power_kw: ['input_power', 'kW', 2],
  power_percent: ['power', '%', 0],
  line_voltage_v: ['line_voltage', 'V', 0],
  output_voltage_v: ['output_voltage', 'V', 0],
  dc_bus_voltage_v: ['dc_bus_voltage', 'V', 0],
  drive_thermal_percent: ['drive_thermal', '%', 0],
  motor_thermal_percent: ['motor_thermal', '%', 0],
  drive_load_percent: ['drive_load', '%', 0],
  motor_load_percent: ['motor_load', '%', 0],
  running_time_h: ['running_time', 'h', 0],
};

/** The names of the values that are drawn. */
export const VALUE_NAMES = Object.keys(VALUES);

/** What a value is called, its unit and its digits. */
export function valueOf(name) {
  const [text, unit, digits] = VALUES[name] ?? [name, '', 2];
  return { text: t(text), unit: unit === 'rpm' ? t('rpm') : unit, digits };
}
