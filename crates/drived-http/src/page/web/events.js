// What has happened: commands with their outcome, trips, connections; to be filtered and taken away as CSV.

import { arrange, download, el, setText } from './dom.js';
import { clock, duration } from './format.js';
import { here, keepAsked } from './place.js';
import { plant } from './plant.js';
import { found } from './search.js';
import { language, named, t } from './texts.js';
import { told } from './told.js';
import { word } from './vocabulary.js';
import { command, eventText, outcome } from './words.js';

const SHOWN = 300;
const COLUMNS = ['time', 'drive', 'kind', 'what', 'who', 'outcome', 'took'];
const KINDS = {
  kind_all: () => true,
  kind_command: event => event.kind === 'command',
  kind_alarm: event => event.alarm || (event.kind === 'command' && !['confirmed', 'pending'].includes(event.outcome)),
};

/** Shows the events in `root`. */
export function events(root) {
  const asked = { kind: '', search: '', ...Object.fromEntries(here().asked) };
  if (!KINDS[asked.kind]) asked.kind = '';
  const rows = new WeakMap();
  const body = el('tbody');
  const count = el('p.hint', { role: 'status' });
  const kind = el('select', { 'aria-label': t('kind'), onchange: () => ask({ kind: kind.value === 'kind_all' ? '' : kind.value }) },
    ...Object.keys(KINDS).map(name => el('option', { value: name, selected: name === asked.kind }, t(name))));
  const search = el('input', { type: 'search', value: asked.search, placeholder: t('search'), 'aria-label': t('search'), oninput: () => ask({ search: search.value }) });
  const list = el('table.events', {}, el('thead', {}, el('tr', {}, ...COLUMNS.map(name => el('th', { scope: 'col' }, t(name))))), body);
  root.append(el('h1', { tabindex: -1 }, t('events')), el('p.hint', {}, t('events_since')),
    el('div.tools', {}, kind, search, el('button', { type: 'button', onclick: save }, t('csv'))),
    count, el('section.panel', {}, el('div.wide', {}, list)));
  update();
  return { update: names => (names.has('event') || names.has('state')) && update() };

  function ask(changes) {
    Object.assign(asked, changes);
    keepAsked(asked);
    update();
  }

  function chosen() {
    return found(plant.events.filter(KINDS[asked.kind || 'kind_all']), asked.search, event => cells(event).join(' '));
  }

  function update() {
    const those = chosen();
    setText(count, those.length ? String(those.length) : t('no_events'));
    arrange(body, those.slice(0, SHOWN).map(event => {
      if (!rows.has(event)) rows.set(event, el('tr', {}, ...COLUMNS.map(name => el('td', { 'data-column': t(name) }))));
      const row = rows.get(event);
      row.className = KINDS.kind_alarm(event) ? 'in-trouble' : '';
      cells(event).forEach((text, index) => setText(row.children[index], text));
      return row;
    }));
  }

  function save() {
    const lines = [COLUMNS.map(t), ...chosen().map(event => [new Date(event.time_unix_ms).toISOString(), ...cells(event).slice(1)])];
    // A spreadsheet would carry out a text that begins like a formula.
    const quoted = text => `"${String(text).replace(/^[=+\-@\t\r]/, "'$&").replaceAll('"', '""')}"`;
    const separator = language() === 'fr' ? ';' : ',';
    download(`drived-${new Date().toISOString().slice(0, 19).replaceAll(':', '')}.csv`, 'text/csv;charset=utf-8',
      ['\ufeff', lines.map(line => line.map(quoted).join(separator)).join('\r\n'), '\r\n']);
  }
}

/** An event as the texts of its row. */
function cells(event) {
  const time = clock(event.time_unix_ms);
  if (event.kind !== 'command') return [time, event.drive ?? '', word(event.event), eventText(event), '', '', ''];
  return [time, event.drive ?? event.group ?? event.selected?.join(', ') ?? '', word('command'), command(event), [event.caller, event.origin].filter(Boolean).join(', '),
    event.text ? named(outcome(event.outcome), told(event.text)) : outcome(event.outcome),
    event.outcome === 'pending' ? '' : duration(event.took_ms)];
}
