// The lines: how much of them is used, what each drive's exchanges take, what went wrong, and a capture of them.

import { address, path } from './api.js';
import { el, setText, table } from './dom.js';
import { duration, load, MISSING, quantity } from './format.js';
import { lastExchanges } from './line_last.js';
import { plant } from './plant.js';
import { named, t } from './texts.js';
import { foundWords, told } from './told.js';
import { word } from './vocabulary.js';

/** Kinds that a slave's exchanges have, and those that only the line can tell. */
const ERRORS = ['no_answer', 'damaged', 'late', 'mismatched', 'exception'];
const LINE_ERRORS = [...ERRORS, 'foreign', 'echo'];

/** Shows all lines in `root`. */
export function lines(root) {
  const body = el('tbody');
  const list = table('', [t('line_name'), t('port'), [t('utilisation'), 'right'], [t('cycle'), 'right'], [t('worst_stop'), 'right'], [t('exchanges'), 'right'], [t('errors'), 'right']], []);
  list.tBodies[0].replaceWith(body);
  root.append(el('h1', { tabindex: -1 }, t('lines')), el('section.panel', {}, el('div.wide', {}, list)),
    el('p', { hidden: plant.daemon.demo }, el('a.button', { href: '#/setup' }, t('setup'))));
  const update = () => {
    const focused = document.activeElement?.textContent;
    const had = body.contains(document.activeElement);
    body.replaceChildren(...[...plant.lines.values()].map(line => el(line.link === 'away' ? 'tr.in-trouble' : 'tr', {},
      el('th', { scope: 'row' }, el('a', { href: `#/line/${encodeURIComponent(line.name)}` }, line.name)),
      el('td', {}, [line.port, line.protocol, line.link === 'away' && (told(line.error) || t('line_away'))].filter(Boolean).join(' · ')),
      el('td.right', {}, load(line)),
      el('td.right', {}, duration(line.cycle_ms)),
      el('td.right', {}, duration(line.worst_case_stop_ms)),
      el('td.right', {}, quantity(line.exchanges, 0)),
      el('td.right', {}, quantity(sum(line.errors), 0)))));
    if (had) [...body.querySelectorAll('a')].find(link => link.textContent === focused)?.focus({ preventScroll: true });
  };
  update();
  return { update: names => [...names].some(name => name === 'state' || name.startsWith('line ')) && update() };
}

/** Shows the line `name` in `root`. */
export function line(root, name) {
  if (!plant.lines.has(name)) {
    root.append(el('h1', { tabindex: -1 }, name), el('p', {}, t('unknown_line')), el('a', { href: '#/lines' }, t('lines')));
    return { update() {} };
  }
  const place = el('p.hint');
  const big = ['utilisation', 'worst_stop', 'cycle', 'exchanges', 'errors'].map(text => el('div', {}, el('dt', {}, t(text)), el('dd.number')));
  const found = el('section.panel');
  const kinds = el('p.hint');
  const slaves = el('div.wide');
  const last = lastExchanges(name);
  root.append(
    el('header.drive-head', {}, el('div', {}, el('h1', { tabindex: -1 }, name), place)),
    el('dl.big', {}, ...big),
    found,
    el('section.panel', {}, el('div.headline', {}, el('h2', {}, t('exchange_times')),
      el('a.button', { href: address(`${path('lines', name)}/capture`), download: `${name}.pcapng` }, t('capture'))), slaves, kinds),
    last.panel);
  update();
  return { update: names => (names.has('state') || names.has(`line ${name}`)) && update() };

  function update() {
    const now = plant.lines.get(name);
    if (!now) return;
    setText(place, [now.port, now.protocol, now.link === 'away' && (told(now.error) || t('line_away'))].filter(Boolean).join(' · '));
    place.classList.toggle('bad', now.link === 'away');
    const values = [load(now), duration(now.worst_case_stop_ms), duration(now.cycle_ms),
      quantity(now.exchanges, 0), quantity(sum(now.errors), 0)];
    values.forEach((value, index) => setText(big[index].lastChild, value));
    big[0].title = named(t('since_opening'), quantity(now.utilisation_since_opening_percent, 0, '%'));
    last.update();
    const findings = now.findings ?? [];
    found.hidden = findings.length === 0;
    found.replaceChildren(el('h2', {}, t('line_findings')), el('ul', {}, ...findings.map(foundItem)));
    setText(kinds, LINE_ERRORS.filter(kind => now.errors?.[kind] !== undefined).map(kind => named(word(kind), quantity(now.errors[kind], 0))).join(' · '));
    const rows = now.slaves ?? [];
    const longest = Math.max(1, ...rows.map(row => row.answer_ms?.max ?? 0));
    slaves.replaceChildren(table('', [[t('slave'), 'right'], t('drive'), t('state'), t('answer_times'), [t('usual'), 'right'], [t('of_hundred'), 'right'],
      [t('longest'), 'right'], [t('exchanges'), 'right'], ...ERRORS.map(kind => [word(kind), 'right'])], rows.map(row => slaveRow(row, longest))));
  }
}

/** What was found, of whom, and what to do next. */
function foundItem(finding) {
  const { text, alike, next, lang } = foundWords(finding);
  const whose = finding.drive ?? (finding.slave && `${t('slave')} ${finding.slave}`);
  return el('li', { lang }, el('b', {}, whose ? named(whose, word(finding.defect)) : word(finding.defect)),
    el('p', {}, [text, alike].filter(Boolean).join(lang === 'fr' ? ' ; ' : '; ')),
    el('ul.hint', {}, ...next.map(step => el('li', {}, step))));
}

function slaveRow(row, longest) {
  const errors = row.errors ?? {};
  const times = row.answer_ms;
  const spread = el('span.meter.spread', { 'aria-hidden': 'true' });
  for (const [kind, ms] of [['max', times?.max], ['p99', times?.p99], ['p50', times?.p50]]) {
    if (typeof ms !== 'number') continue;
    const part = el(`i.fill.${kind}`);
    part.style.transform = `scaleX(${(ms / longest).toFixed(3)})`;
    spread.append(part);
  }
  const answers = row.off_line ? t('only_probed', { count: row.probes ?? 0, next: duration(row.next_probe_ms) }) : row.exchanges ? t('answers') : t('no_answer_yet');
  return el(row.off_line ? 'tr.in-trouble' : 'tr', {},
    el('td.right', {}, row.slave),
    el('th', { scope: 'row' }, el('a', { href: `#/drive/${encodeURIComponent(row.drive)}` }, row.drive ?? MISSING)),
    el('td', {}, answers), el('td.spread', {}, spread),
    ...['p50', 'p99', 'max'].map(key => el('td.right', {}, quantity(times?.[key], 1, 'ms'))),
    el('td.right', {}, quantity(row.exchanges, 0)),
    ...ERRORS.map(kind => el(errors[kind] ? 'td.right.some' : 'td.right', {}, quantity(errors[kind], 0))));
}

function sum(errors) {
  return errors && ERRORS.reduce((total, kind) => total + (errors[kind] ?? 0), 0);
}
