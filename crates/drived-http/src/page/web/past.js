// Trends from seconds to years: one value of several drives, drawn from the history in steps; what is not known is a gap.

import { read } from './api.js';
import { el, setText, table } from './dom.js';
import { byName, clock, duration, plainTime, quantity, zoneAt } from './format.js';
import { ofMoment, pastLinks } from './past_links.js';
import { addressOf, clockChange, momentsOf, wallText } from './past_time.js';
import { VALUE_NAMES, valueOf } from './past_values.js';
import { here, keepAsked } from './place.js';
import { daemonNow, plant } from './plant.js';
import { axis, colour, loadPlotter, timeAxis, upTo } from './plot.js';
import { t } from './texts.js';
import { told } from './told.js';

const DAY = 86_400_000;
const SPANS = { past_hour: DAY / 24, past_day: DAY, past_week: 7 * DAY, past_month: 30 * DAY, past_year: 365 * DAY, past_decade: 3652 * DAY };
/** Steps of this many seconds: the smallest of which no more than `STEPS` are drawn. */
const STEP_S = [1, 2, 5, 10, 30, 60, 120, 300, 600, 1800, 3600, 7200, 21_600, 43_200, 86_400, 259_200, 604_800];
const STEPS = 720;
const MOST = 6;
/** Values are written once a minute. */
const UNWRITTEN_MS = 70_000;
const LEAST_MS = 10_000;
const TABLE_ROWS = 60;
const LOOKS = [['--series-1'], ['--series-3', [7, 3]], ['--series-4', [2, 3]], ['--ink', [10, 4, 2, 4]], ['--series-2', [4, 4]], ['--focus', [1, 2]]];

/** A name as an address has it; one that a person has typed is what it is. */
function nameOf(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

/** Shows the long trends in `root`. */
export function past(root) {
  const asked = { drives: '', value: '', from: '', to: '', ...Object.fromEntries(here().asked) };
  let names = asked.drives.split(',').filter(Boolean).map(nameOf);
  let to = momentsOf(asked.to)[0] ?? daemonNow();
  let from = momentsOf(asked.from)[0] ?? to - DAY;
  let answered;
  let plot;
  let asks = 0;
  let ended = false;

  const value = el('select', { onchange: show }, ...VALUE_NAMES.map(name => el('option', { value: name, selected: name === asked.value }, valueOf(name).text)));
  const spans = Object.entries(SPANS).map(([text, length]) => el('button', { type: 'button', onclick: () => go(to - length, to) }, t(text)));
  const fromField = field(() => from, moment => go(moment, Math.max(to, moment + LEAST_MS)));
  const toField = field(() => to, moment => go(Math.min(from, moment - LEAST_MS), moment));
  const boxes = el('div.boxes');
  const canvas = el('div.plots');
  const said = el('p.hint', { role: 'status' });
  const known = el('ul.history');
  const then = el('p', { role: 'status' });
  const rows = el('div.wide');
  const asTable = el('details', { ontoggle: writeTable }, el('summary', {}, t('past_table')), rows);
  root.append(el('h1', { tabindex: -1 }, t('past')), pastLinks('past'), el('p.hint', {}, t('past_about')),
    el('div.tools', {}, el('label.field', {}, t('past_value'), value),
      el('label.field', {}, t('past_from'), fromField), el('label.field', {}, t('past_to'), toField)),
    el('div.tools', {}, el('span.chips', {}, ...spans),
      el('span.chips', {}, button('past_earlier', () => move(-1)), button('past_later', () => move(1)), button('past_out', () => go(from - (to - from) / 2, to + (to - from) / 2)), button('past_now', () => go(daemonNow() - (to - from), daemonNow())))),
    el('section.panel', {}, canvas, then, said, known, asTable),
    el('details.panel', { open: true }, el('summary', {}, t('past_drives', { count: MOST })), boxes));
  const dark = matchMedia('(prefers-color-scheme: dark)');
  dark.addEventListener('change', draw);
  const resized = new ResizeObserver(() => plot?.setSize({ width: canvas.clientWidth, height: height() }));
  resized.observe(canvas);
  writeBoxes();
  show();
  return {
    update: names => names.has('state') && writeBoxes(),
    end() {
      ended = true;
      resized.disconnect();
      dark.removeEventListener('change', draw);
      plot?.destroy();
    },
  };

  function go(first, last) {
    const longest = SPANS.past_decade * 2;
    [from, to] = [Math.max(first, last - longest), last];
    if (to - from < LEAST_MS) [from, to] = [(from + to - LEAST_MS) / 2, (from + to + LEAST_MS) / 2];
    show();
  }

  function move(direction) {
    const by = direction * (to - from) / 2;
    go(from + by, to + by);
  }

  function field(now, take) {
    return el('input', { type: 'datetime-local', onchange: event => {
      const [moment] = momentsOf(event.target.value);
      if (moment === undefined) event.target.value = wallText(now());
      else take(moment);
    } });
  }

  function button(text, act) {
    return el('button', { type: 'button', onclick: act }, t(text));
  }

  function writeBoxes() {
    const all = [...new Set([...plant.drives.keys(), ...names])].sort(byName);
    if (!names.length && all.length) names = [all[0]];
    boxes.replaceChildren(...all.map(name => {
      const box = el('input', { type: 'checkbox', checked: names.includes(name), disabled: !names.includes(name) && names.length >= MOST, onchange: () => {
        names = box.checked ? [...names, name] : names.filter(one => one !== name);
        writeBoxes();
        show();
      } });
      return el('label.check', {}, box, name);
    }));
  }

  async function show() {
    const mine = ++asks;
    keepAsked({ drives: names.map(encodeURIComponent).join(','), value: value.value === VALUE_NAMES[0] ? '' : value.value, from: addressOf(from), to: addressOf(to) });
    fromField.value = wallText(from);
    toField.value = wallText(to);
    Object.values(SPANS).forEach((length, index) => spans[index].setAttribute('aria-pressed', String(Math.abs(to - from - length) < 1000)));
    setText(then, '');
    const every = 1000 * (STEP_S.find(step => (to - from) / 1000 / step <= STEPS) ?? STEP_S.at(-1));
    const wanted = new URLSearchParams([...names.map(name => ['drive', name]), ['value', value.value], ['from_unix_ms', Math.floor(from)], ['to_unix_ms', Math.floor(to)], ['every_ms', every]]);
    const [askedValue, askedNames, askedFrom, askedTo] = [value.value, names, from, to];
    try {
      const [answer] = await Promise.all([names.length ? read(`history/curves?${wanted}`) : { curves: [], steps: 0, from_unix_ms: from, every_ms: every }, loadPlotter()]);
      if (ended || mine !== asks) return;
      // It is drawn by what was asked for, whatever is chosen meanwhile.
      answered = { ...answer, value: askedValue, names: askedNames, from: askedFrom, to: askedTo };
      tell();
      draw();
      writeTable();
    } catch (problem) {
      if (ended || mine !== asks) return;
      // What stands there answers another question.
      answered = undefined;
      plot?.destroy();
      plot = undefined;
      for (const part of [known, rows]) part.replaceChildren();
      setText(said, t('past_none', { why: problem.isUnheard ? t('not_reached') : told(problem.message) }));
    }
  }

  function tell() {
    const { from, to, names } = answered;
    const change = clockChange(from, to);
    const isBack = change !== undefined && zoneAt(new Date(from)) !== zoneAt(new Date(to)) && wallText(change) < wallText(change - 60_000);
    const zones = [...new Set([zoneAt(new Date(from)), zoneAt(new Date(to))])].join(', ');
    setText(said, [t('past_zoom', { step: duration(answered.every_ms), zone: zones }),
      to > daemonNow() - UNWRITTEN_MS && t('past_unwritten'),
      change !== undefined && t(isBack ? 'past_clock_back' : 'past_clock_forward', { time: clock(change) })].filter(Boolean).join(' '));
    known.replaceChildren(...names.map(drive => {
      const steps = answered.curves.find(curve => curve.drive === drive)?.known ?? [];
      const share = steps.length ? steps.reduce((sum, one) => sum + one, 0) / steps.length : 0;
      return el('li', {}, share ? t('past_known', { drive, share: quantity(share * 100, share > 0.999 ? 0 : 1, '%') }) : t('past_nothing', { drive }));
    }));
  }

  function draw() {
    if (!answered || ended) return;
    plot?.destroy();
    const { from, to, names } = answered;
    const { unit, digits } = valueOf(answered.value);
    const times = Array.from({ length: answered.steps }, (_, index) => (answered.from_unix_ms + index * answered.every_ms) / 1000);
    const curves = names.map(name => answered.curves.find(curve => curve.drive === name)).filter(Boolean);
    const lines = curves.map(({ drive }, index) => {
      const [name, dash] = LOOKS[index];
      return { label: drive, scale: 'y', stroke: colour(name), dash, width: 1.6, spanGaps: false, points: { show: true, size: 4, filter: alone }, value: (_, one) => quantity(one, digits, unit) };
    });
    const data = [times];
    const bands = [];
    // The band is drawn first, and the line over it.
    if (curves.length === 1) {
      const edge = text => ({ label: t(text), scale: 'y', stroke: 'transparent', spanGaps: false, points: { show: false }, value: (_, one) => quantity(one, digits, unit) });
      lines.unshift(edge('past_greatest'), edge('past_least'));
      data.push(curves[0].greatest, curves[0].least);
      bands.push({ series: [1, 2], fill: colour('--fill-ground') });
    }
    data.push(...curves.map(curve => curve.mean));
    plot = new window.uPlot({ width: canvas.clientWidth, height: height(), padding: [12, 16, null, null],
      series: [{ label: t('time'), value: (_, seconds) => (seconds ? clock(seconds * 1000) : '—') }, ...lines], bands,
      axes: [timeAxis(tickText, 110), { ...axis('y'), size: 64, values: (_, ticks) => ticks.map(one => quantity(one, Number.isInteger(one) ? 0 : 1, unit)) }],
      scales: { x: { range: () => [from / 1000, to / 1000] }, y: { range: upTo(1) } },
      cursor: { drag: { x: true, y: false, setScale: false } },
      hooks: { setSelect: [zoom], ready: [({ over }) => over.addEventListener('click', pick)] } }, data, canvas);
  }

  /** A step whose neighbours are gaps would not be seen as a line. */
  function alone(self, index) {
    const values = self.data[index];
    return values.flatMap((one, at) => (one !== null && (values[at - 1] ?? null) === null && (values[at + 1] ?? null) === null ? [at] : []));
  }

  function zoom(self) {
    if (self.select.width < 5) return;
    go(self.posToVal(self.select.left, 'x') * 1000, self.posToVal(self.select.left + self.select.width, 'x') * 1000);
  }

  function pick() {
    if (plot.cursor.left < 0 || plot.select.width >= 5) return;
    const at = plot.posToVal(plot.cursor.left, 'x') * 1000;
    then.replaceChildren(el('a.button', { href: ofMoment(at) }, t('past_here', { time: clock(at) })));
  }

  function tickText(unixMs) {
    const [day, time] = wallText(unixMs).split('T');
    const [, month, date] = day.split('-');
    const { from, to } = answered;
    if (to - from > 20 * DAY) return to - from > 400 * DAY ? day.slice(0, 7) : `${date}.${month}.`;
    if (to - from > 1.5 * DAY) return `${date}.${month}. ${time}`;
    return to - from < DAY / 24 ? plainTime(unixMs) : time;
  }

  function height() {
    return canvas.clientWidth < 600 ? 240 : 340;
  }

  /** The latest steps of which something is known. */
  function writeTable() {
    if (!asTable.open || !answered) return;
    const { unit, digits } = valueOf(answered.value);
    const lines = [];
    for (let at = answered.steps - 1; at >= 0 && lines.length < TABLE_ROWS; at--) {
      for (const { drive, least, mean, greatest, known: share } of answered.curves) {
        if (!share[at]) continue;
        const cells = [least[at], mean[at], greatest[at]].map(one => el('td.right', {}, quantity(one, digits, unit)));
        lines.push(el('tr', {}, el('td', {}, clock(answered.from_unix_ms + at * answered.every_ms)), el('td', {}, drive), ...cells, el('td.right', {}, quantity(share[at] * 100, 0, '%'))));
      }
    }
    rows.replaceChildren(table('', [t('time'), t('drive'), ...['past_least', 'past_mean', 'past_greatest', 'past_share'].map(name => [t(name), 'right'])], lines));
  }
}
