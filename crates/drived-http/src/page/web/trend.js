// The trend of one drive: the daemon's own record of ten minutes, and nothing else; what was not recorded is a gap.

import { path, read } from './api.js';
import { el, setText, table } from './dom.js';
import { clock, plainTime, quantity, zoneAt } from './format.js';
import { ofPast } from './past_links.js';
import { daemonNow } from './plant.js';
import { axis, colour, loadPlotter, timeAxis, upTo } from './plot.js';
import { t } from './texts.js';
import { told } from './told.js';

const KEPT_S = 600;
const WINDOWS = { trend_minute: 60, trend_ten: KEPT_S };
const READ_EVERY_MS = 1_000;
const TABLE_STEP_S = 5;
const TABLE_ROWS = 24;
/** Where so many samples are missing nothing was recorded. */
const GAP_STEPS = 3;
const HEIGHTS = [190, 150];

/** Where the API keeps each column, with unit and digits. */
const COLUMNS = [
  { key: 'frequency_hz', text: 'frequency', unit: 'Hz', digits: 1, colour: '--series-1' },
  { key: 'setpoint_hz', text: 'setpoint', unit: 'Hz', digits: 1, colour: '--series-2', dash: [5, 4] },
  { key: 'current_a', text: 'current', unit: 'A', digits: 1, colour: '--series-3' },
  { key: 'torque_percent', text: 'torque', unit: '%', digits: 0, colour: '--series-4' },
];

/** Shows the trend of the drive `name` in `root`; gives `tick()`, `end()`. */
export function trend(root, name) {
  const values = [[], ...COLUMNS.map(() => [])];
  let plots = [];
  let seconds = KEPT_S;
  let held;
  let ended = false;
  let stepMs = 500;
  let reading = false;

  const pause = el('button', { type: 'button', 'aria-pressed': 'false', onclick: () => hold(held ? undefined : range()) }, t('trend_pause'));
  const windows = Object.entries(WINDOWS).map(([text, length]) =>
    el('button', { type: 'button', 'aria-pressed': String(length === seconds), onclick: event => choose(length, event.target) }, t(text)));
  const canvas = el('div.plots');
  const said = el('p.hint', {}, t('trend_hint', { zone: zoneAt() }));
  const rows = el('div.wide');
  const asTable = el('details', { ontoggle: writeTable }, el('summary', {}, t('trend_table')), rows);
  root.append(el('div.headline', {}, el('h2', {}, t('trend')), el('span.chips', {}, ...windows, pause)), canvas, said,
    el('p', {}, el('a', { href: ofPast([name]) }, t('past'))), asTable);
  const dark = matchMedia('(prefers-color-scheme: dark)');
  dark.addEventListener('change', draw);
  const resized = new ResizeObserver(() => plots.forEach((plot, index) =>
    plot.setSize({ width: canvas.clientWidth, height: HEIGHTS[index] })));
  resized.observe(canvas);
  begin();
  const reads = setInterval(readOn, READ_EVERY_MS);

  return {
    end() {
      ended = true;
      clearInterval(reads);
      resized.disconnect();
      dark.removeEventListener('change', draw);
      plots.forEach(plot => plot.destroy());
    },
    tick: () => asTable.open && !held && writeTable(),
  };

  async function begin() {
    try {
      const [history] = await Promise.all([read(path('drives', name, 'history')), loadPlotter()]);
      if (ended) return;
      take(history);
      draw();
    } catch (problem) {
      setText(said, t('trend_missing', { why: told(problem.message) }));
    }
  }

  /** Reads what was recorded since. What was not read for a while is read now: the record has it. */
  async function readOn() {
    if (!plots.length || reading || document.hidden) return;
    reading = true;
    try {
      const last = values[0].at(-1);
      take(await read(`${path('drives', name, 'history')}${last ? `?since_unix_ms=${Math.round(last * 1000)}` : ''}`));
    } catch {
      // What is missing now is asked for the next time.
    }
    reading = false;
    if (ended) return;
    plots.forEach((plot, index) => plot.setData(columnsOf(index), false));
    follow();
  }

  function take(history) {
    stepMs = history.step_ms ?? stepMs;
    const times = history.time_unix_ms.map(ms => ms / 1000);
    const isEarlier = times.length && times[0] <= values[0].at(-1);
    // The daemon's clock was put back: all that was drawn stands at other times now.
    if (isEarlier) for (const column of values) column.length = 0;
    times.forEach((time, at) => {
      const before = values[0].at(-1);
      const isGap = before !== undefined && time - before > GAP_STEPS * stepMs / 1000;
      if (isGap) put(before + stepMs / 1000, () => null);
      put(time, ({ key }) => history[key]?.[at] ?? null);
    });
    while (values[0][0] < values[0].at(-1) - KEPT_S) for (const column of values) column.shift();
  }

  function put(time, of) {
    values[0].push(time);
    COLUMNS.forEach((column, index) => values[index + 1].push(of(column)));
  }

  function columnsOf(index) {
    return index === 0 ? [values[0], values[1], values[2]] : [values[0], values[3], values[4]];
  }

  function follow() {
    const { min, max } = held ?? range();
    for (const plot of plots) plot.setScale('x', { min, max });
  }

  function range() {
    const max = daemonNow() / 1000;
    return { min: max - seconds, max };
  }

  function hold(what) {
    held = what;
    pause.setAttribute('aria-pressed', String(Boolean(held)));
    setText(pause, t(held ? 'trend_live' : 'trend_pause'));
    follow();
  }

  function choose(length, button) {
    seconds = length;
    for (const one of windows) one.setAttribute('aria-pressed', String(one === button));
    hold(undefined);
  }

  function draw() {
    plots.forEach(plot => plot.destroy());
    const width = canvas.clientWidth;
    const together = { cursor: { sync: { key: `trend ${name}` }, drag: { x: true, y: false } },
      hooks: { setSelect: [plot => plot.select.width > 0 && hold({ min: plot.posToVal(plot.select.left, 'x'), max: plot.posToVal(plot.select.left + plot.select.width, 'x') })] } };
    plots = [
      new window.uPlot({ width, height: HEIGHTS[0], padding: [null, 52, null, null], ...together, series: [timeSeries(), series(0), series(1)], axes: [timeAxis(plainTime), axis('Hz')],
        scales: { Hz: { range: upTo(10) } } }, columnsOf(0), canvas),
      new window.uPlot({ width, height: HEIGHTS[1], ...together, series: [timeSeries(), series(2), series(3)], axes: [timeAxis(plainTime), axis('A'), axis('%', 1)],
        scales: { A: { range: upTo(1) }, '%': { range: upTo(100) } } }, columnsOf(1), canvas),
    ];
    follow();
  }

  function writeTable() {
    if (!asTable.open) return;
    const picked = [];
    for (let at = values[0].length - 1; at >= 0 && picked.length < TABLE_ROWS; at -= Math.round(TABLE_STEP_S * 1000 / stepMs)) picked.push(at);
    rows.replaceChildren(table('', [t('time'), ...COLUMNS.map(({ text }) => [t(text), 'right'])], picked.map(at =>
      el('tr', {}, el('td', {}, clock(values[0][at] * 1000)), ...COLUMNS.map(({ unit, digits }, index) =>
        el('td.right', {}, quantity(values[index + 1][at], digits, unit)))))));
  }
}

function timeSeries() {
  return { label: t('time'), value: (_, seconds) => (seconds ? clock(seconds * 1000) : '—') };
}

function series(index) {
  const { text, unit, digits, colour: name, dash } = COLUMNS[index];
  return { label: t(text), scale: unit, stroke: colour(name), width: 1.6, dash, spanGaps: false, points: { show: false },
    value: (_, value) => quantity(value, digits, unit) };
}
