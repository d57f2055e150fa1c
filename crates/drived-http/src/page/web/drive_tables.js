// Everything else that is known of a drive: measurements, words bit by bit, identity, watchdog, counters, parameters.

import { path, post, read } from './api.js';
import { confirmed } from './ask.js';
import { el, setText, table } from './dom.js';
import { readHistory } from './drive_faults.js';
import { duration, MISSING, old, quantity } from './format.js';
import { carryOut } from './orders.js';
import { age, mayCommand, plant, quality } from './plant.js';
import { shown } from './shown.js';
import { bitName } from './status_bits.js';
import { named, t } from './texts.js';
import { told } from './told.js';
import { word } from './vocabulary.js';

const MEASUREMENTS = [
  ['line_voltage', 'line_voltage_v', 0, 'V'], ['output_voltage', 'output_voltage_v', 0, 'V'], ['dc_bus_voltage', 'dc_bus_voltage_v', 0, 'V'],
  ['output_voltage', 'output_voltage_percent', 0, '%'], ['dc_bus_voltage', 'dc_bus_voltage_percent', 0, '%'],
  ['power', 'power_percent', 0, '%'], ['input_power', 'input_power_kw', 2, 'kW'], ['drive_load', 'drive_load_percent', 0, '%'], ['motor_load', 'motor_load_percent', 0, '%'], ['drive_thermal', 'drive_thermal_percent', 0, '%'], ['motor_thermal', 'motor_thermal_percent', 0, '%'],
  ['running_time', 'running_time_h', 0, 'h'], ['powered_time', 'powered_time_h', 0, 'h'], ['energy', 'output_energy_kwh', 0, 'kWh'],
  ['energy_counts', 'output_energy_counts', 0, ''],
];
/** A parameter that was read longer ago says so. */
const DATED_FROM_MS = 60_000;
const COUNTERS = [['polls', 'polls'], ['answered', 'answered'], ['missed', 'missed'], ['failures', 'failures'], ['times_lost', 'lost'], ['trips', 'trips'], ['saves', 'saves']];

/** The tables of the drive `name`: `element`, `update(drive)`. */
export function tablesPanel(name) {
  const measured = el('section.panel', { 'aria-label': t('measurements') });
  const known = el('section.panel', { 'aria-label': t('identity') });
  const counted = el('section.panel', { 'aria-label': t('counters') });
  const words = el('section.panel.wide-panel', { 'aria-label': t('words') });
  const history = el('div');
  const rows = el('div.wide');
  const more = el('section.panel.wide-panel', {},
    el('details', { ontoggle: ({ target }) => target.open && readHistory(history, plant.drives.get(name)) }, el('summary', {}, t('fault_history')), history),
    el('details', { ontoggle: ({ target }) => target.open && !rows.children.length && readParameters(name, rows) }, el('summary', {}, t('parameters')), rows));
  const shown = new Map();
  return { element: el('div.tables', {}, measured, known, counted, words, more), update };

  function update(drive) {
    write(measured, 'measurements', measurements(drive));
    write(known, 'identity', identity(drive));
    write(counted, 'counters', COUNTERS.map(([text, key]) => [t(text), quantity(drive.counters?.[key], 0)]));
    writeWords(drive.status?.raw ?? []);
    measured.dataset.quality = quality(drive.measurements);
  }

  function write(panel, title, pairs) {
    const now = JSON.stringify(pairs);
    if (shown.get(title) === now) return;
    shown.set(title, now);
    panel.replaceChildren(el('h2', {}, t(title)), el('dl.pairs', {}, ...pairs.flatMap(([text, value]) =>
      [el('dt', {}, text), el('dd.number', {}, value)])));
  }

  function writeWords(raw) {
    const now = JSON.stringify(raw);
    if (shown.get('words') === now) return;
    const open = words.querySelector('details')?.open;
    shown.set('words', now);
    words.replaceChildren(el('details', { open }, el('summary', {}, t('words')), el('div.wide', {}, table('',
      [t('register'), [t('value'), 'right'], t('bits')], raw.map(wordRow)))));
  }
}

function measurements(drive) {
  const values = drive.measurements ?? {};
  const pairs = MEASUREMENTS.filter(([, key]) => values[key] !== undefined).map(([text, key, digits, unit]) => [t(text), quantity(values[key], digits, unit)]);
  for (const key of ['inputs', 'outputs']) if (values[key] !== undefined) pairs.push([t(key), `${values[key].toString(2).padStart(8, '0')}b`]);
  if (values.before_trip) pairs.unshift([t('before_trip_values'), t('yes')]);
  if (quality(values) === 'stale') pairs.unshift([t('age'), old(age(values, drive))]);
  return pairs.length ? pairs : [[t('measurements'), MISSING]];
}

function identity(drive) {
  const { identity: is = {}, watchdog = {} } = drive;
  return [
    [t('model'), [is.vendor, is.model, is.power].filter(Boolean).join(' ') || MISSING],
    [t('firmware'), is.firmware ?? MISSING],
    ...(is.codes?.length ? [[t('identity_codes'), is.codes.map(({ code, value }) => `${code} ${value}`).join(', ')]] : []),
    [t('checked'), word(is.check) || MISSING],
    [t('watchdog'), watchdog.why ? named(word(watchdog.check), told(watchdog.why)) : word(watchdog.check) || MISSING],
    ...(watchdog.time_ms !== undefined ? [[t('watchdog_time'), [duration(watchdog.time_ms), word(watchdog.reaction)].filter(Boolean).join(', ')]] : []),
    [t('starts_by_itself'), drive.starts_by_itself?.join(', ') || t('no')],
    [t('commanders'), drive.commanders?.join(', ') || t('anyone')],
  ];
}

function wordRow({ address, code, value }) {
  const bits = Array.from({ length: 16 }, (_, index) => 15 - index);
  const set = bits.filter(bit => value >> bit & 1);
  const names = set.map(bit => bitName(code, bit)).filter(Boolean);
  return el('tr', {},
    el('th', { scope: 'row' }, `${code ?? ''} ${address}`),
    el('td.right', {}, `${value} = ${value.toString(16).toUpperCase().padStart(4, '0')}h`),
    el('td', {}, el('span.bits', { role: 'img', 'aria-label': set.join(', ') }, ...bits.map(bit =>
      el(value >> bit & 1 ? 'i.set' : 'i', { title: `${bit} ${bitName(code, bit) ?? ''}` }))), names.length ? el('small', {}, ` ${names.join(', ')}`) : null));
}

async function readParameters(name, place) {
  const said = el('p.hint', {}, t('reading_parameters'));
  place.replaceChildren(said);
  try {
    // One answer holds what could be read in its time; the next goes on from there.
    for (let left = Infinity, rows; left > 0;) {
      rows = await read(`${path('drives', name, 'parameters')}?wait=5s`);
      const open = rows.filter(row => row.access !== 'write' && row.value === undefined && !row.error).length;
      place.replaceChildren(open ? said : '', table('', [t('register'), t('name'), [t('value'), 'right'], t('factory'), t('access')], rows.map(row => parameterRow(name, row))));
      if (open >= left || !place.isConnected) break;
      left = open;
    }
  } catch (problem) {
    setText(said, told(problem.message));
    said.classList.add('bad');
  }
}

function parameterRow(name, row) {
  const value = el('td.right', {}, valueText(row));
  const differs = row.factory && row.text !== undefined && row.text !== row.factory && String(row.value) !== row.factory;
  const line = el('tr', {}, el('th', { scope: 'row' }, `${row.mnemonic} ${row.space ? `${word(row.space)} ` : ''}${row.address}`), el('td', {}, row.name, row.range ? el('small', {}, ` ${row.range}`) : null),
    value, el('td', {}, row.factory, differs ? el('b', {}, ` · ${t('differs')}`) : null), el('td', {}, word(row.access)));
  if (!plant.daemon.rights.engineer || !mayCommand(plant.drives.get(name) ?? { name }) || row.access === 'read') return line;
  const field = el('input.small', { value: row.value ?? '', 'aria-label': row.mnemonic });
  const write = async event => {
    event.preventDefault();
    const expects = shown([name]);
    if (!await confirmed(expects, t('confirm_parameter', { drive: name, name: row.mnemonic, value: field.value }), t('set'))) return;
    const number = Number(field.value.replace(',', '.'));
    const given = field.value.trim() === '' || Number.isNaN(number) ? field.value : number;
    carryOut(name, 'parameter', () => post(path('drives', name, 'parameters', row.mnemonic), { value: given, expects }, 'PUT'));
  };
  value.replaceChildren(el('form.inline', { onsubmit: write }, field, row.unit ?? '', el('button', {}, t('set'))));
  return line;
}

function valueText({ text, error, age_ms: ms }) {
  if (error) return error;
  return ms > DATED_FROM_MS ? `${text} (${old(ms)})` : text ?? MISSING;
}
