// A moment: how every drive and line was, and what happened around it; forward and back. `#/at/2026-11-21T03:12`.

import { read } from './api.js';
import { el, setText, table } from './dom.js';
import { eventTable, ofRecord, saveEvents } from './event_rows.js';
import { byName, clock, duration, quantity, zoneAt } from './format.js';
import { ofMoment, ofPast, pastLinks } from './past_links.js';
import { addressOf, momentsOf, wallText } from './past_time.js';
import { valueOf } from './past_values.js';
import { daemonNow } from './plant.js';
import { t } from './texts.js';
import { told } from './told.js';
import { word } from './vocabulary.js';
import { whyPanel } from './why.js';

const MINUTE = 60_000;
const AROUND_MS = 5 * MINUTE;
/** Values are written once a minute. */
const UNWRITTEN_MS = 70_000;
const MOVES = [-60 * MINUTE, -10 * MINUTE, -MINUTE, MINUTE, 10 * MINUTE, 60 * MINUTE];
const SHOWN = ['output_frequency_hz', 'setpoint_hz', 'current_a', 'torque_percent'];

/** Shows the moment that stands in the address in `root`. */
export function at(root, text) {
  const moments = text ? momentsOf(text) : [Math.floor(daemonNow() / MINUTE) * MINUTE];
  const isWritten = !text || moments.length || /^\d{4}-\d\d-\d\dT\d\d:\d\d/.test(text);
  const [moment] = moments;
  let ended = false;
  root.append(el('h1', { tabindex: -1 }, moments.length === 1 ? t('at_title', { time: clock(moment) }) : t('at_moment')), pastLinks('at_moment'));
  const when = el('input', { type: 'datetime-local', value: wallText(moment ?? daemonNow()), onchange: () => when.value && go(when.value) });
  const moves = MOVES.map(by => el('button', { type: 'button', disabled: moments.length !== 1, 'aria-label': t(by < 0 ? 'at_back' : 'at_forward', { time: duration(Math.abs(by)) }), onclick: () => go(addressOf(moment + by)) },
    `${by < 0 ? '−' : '+'}${duration(Math.abs(by))}`));
  root.append(el('div.tools', {}, el('label.field', {}, `${t('at_when')} (${zoneAt(new Date(moment ?? daemonNow()))})`, when), el('span.chips', {}, ...moves)));
  if (moments.length === 1) show();
  else if (moments.length) root.append(el('p.remark', {}, t('at_twice')), el('p.chips', {}, ...moments.map(one => el('a.button', { href: ofMoment(one) }, clock(one)))));
  else root.append(el('p.remark', {}, t(isWritten ? 'at_never' : 'at_wrong', { text })));
  return { update() {}, end: () => (ended = true) };

  function go(address) {
    location.hash = `#/at/${address}`;
  }

  function show() {
    const said = el('p.said', { role: 'alert' });
    const drives = el('div.wide');
    const why = el('div');
    const lines = el('div.wide');
    const list = eventTable();
    const quiet = el('p.hint');
    let events = [];
    if (moment > daemonNow() - UNWRITTEN_MS) root.append(el('p.remark', {}, t('past_unwritten')));
    root.append(said, el('section.panel', {}, el('h2', {}, t('at_drives')), drives, why),
      el('section.panel', {}, el('div.headline', {}, el('h2', {}, t('at_course')), el('button', { type: 'button', onclick: () => saveEvents(events) }, t('csv'))), quiet, el('div.wide', {}, list.element)),
      el('section.panel', {}, el('h2', {}, t('at_lines')), lines));
    const failed = problem => !ended && setText(said, t('past_none', { why: problem.isUnheard ? t('not_reached') : told(problem.message) }));
    read(`history/moment?at_unix_ms=${moment}`).then(then => {
      if (ended) return;
      drives.replaceChildren(...drivesTable(then.drives, drive => why.replaceChildren(whyPanel(drive, moment))));
      lines.replaceChildren(then.lines.length ? linesTable(then.lines) : el('p.hint', {}, t('at_no_lines')));
    }, failed);
    read(`history/records?from_unix_ms=${moment - AROUND_MS}&to_unix_ms=${moment + AROUND_MS}&limit=500`).then(({ records }) => {
      if (ended) return;
      events = records.map(ofRecord);
      setText(quiet, events.length ? '' : t('at_quiet'));
      list.element.hidden = !events.length;
      list.show(events);
    }, failed);
  }

  function drivesTable(drives, ask) {
    const known = drives.filter(({ values }) => Object.keys(values).length > 0);
    const unknown = drives.filter(one => !known.includes(one)).map(({ drive }) => drive).sort(byName);
    // Why may be known also where no value is.
    const rest = unknown.length ? el('div', {}, el('p.hint', {}, t('at_unknown')), el('p.chips', {}, ...unknown.map(drive =>
      el('button', { type: 'button', 'aria-label': t('at_why_of', { drive }), onclick: () => ask(drive) }, drive)))) : '';
    if (!known.length) return [rest];
    const heads = [t('drive'), t('state'), ...SHOWN.map(name => [valueOf(name).text, 'right']), t('control'), t('at_what')];
    return [table('', heads, known.sort((one, other) => byName(one.drive, other.drive)).map(({ drive, values, exact }) => {
      const numbers = SHOWN.map(name => el('td.right', {}, quantity(values[name], valueOf(name).digits, valueOf(name).unit)));
      const state = [word(values.state), values.motion && word(values.motion)].filter(Boolean).join(', ');
      return el(values.state === 'fault' ? 'tr.in-trouble' : 'tr', {}, el('th', { scope: 'row' }, el('a', { href: ofPast([drive]) }, drive)),
        el('td', {}, state, !exact ? el('small', {}, ` ${t('at_mean')}`) : null), ...numbers, el('td', {}, word(values.control)),
        el('td', {}, el('button', { type: 'button', 'aria-label': t('at_why_of', { drive }), onclick: () => ask(drive) }, t('at_why'))));
    })), rest];
  }

  function linesTable(lines) {
    const heads = [t('line_name'), ...['at_sent', 'answered', 'at_damaged', 'at_missing', 'at_foreign', 'at_busy'].map(name => [t(name), 'right'])];
    return table('', heads, lines.map(line => el(line.is_open ? 'tr' : 'tr.in-trouble', {},
      el('th', { scope: 'row' }, line.line, line.is_open ? null : el('small', {}, ` ${t('at_closed')}`)),
      ...[line.sent, line.answered, line.damaged, line.missing, line.foreign].map(count => el('td.right', {}, quantity(count, 0))),
      el('td.right', {}, quantity(line.busy_permille / 10, 0, '%')))));
  }
}
