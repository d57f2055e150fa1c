// What has happened, as rows of a table and of a file: the same from the stream and from the history.

import { alarmText } from './alarm_words.js';
import { arrange, download, el, setText } from './dom.js';
import { clock, duration } from './format.js';
import { language, named, t } from './texts.js';
import { told } from './told.js';
import { word } from './vocabulary.js';
import { command, eventText, outcome } from './words.js';

const COLUMNS = ['time', 'drive', 'kind', 'what', 'who', 'outcome', 'took'];

/** The kinds that can be asked for. */
export const KINDS = {
  kind_all: () => true,
  kind_command: event => event.kind === 'command',
  kind_alarm: event => event.alarm || (event.kind === 'command' && !['confirmed', 'pending'].includes(event.outcome)),
};

/** A table of events: `show(events)` writes them. */
export function eventTable() {
  const rows = new WeakMap();
  const body = el('tbody');
  const element = el('table.events', {}, el('thead', {}, el('tr', {}, ...COLUMNS.map(name => el('th', { scope: 'col' }, t(name))))), body);
  return { element, show };

  function show(events) {
    arrange(body, events.map(event => {
      if (!rows.has(event)) rows.set(event, el('tr', {}, ...COLUMNS.map(name => el('td', { 'data-column': t(name) }))));
      const row = rows.get(event);
      row.className = KINDS.kind_alarm(event) ? 'in-trouble' : '';
      cells(event).forEach((text, index) => setText(row.children[index], text));
      return row;
    }));
  }
}

/** Offers events as a file for a spreadsheet. */
export function saveEvents(events) {
  const lines = [COLUMNS.map(t), ...events.map(event => [new Date(event.time_unix_ms).toISOString(), ...cells(event).slice(1)])];
  // A spreadsheet would carry out a text that begins like a formula.
  const quoted = text => `"${String(text).replace(/^[=+\-@\t\r]/, "'$&").replaceAll('"', '""')}"`;
  const separator = language() === 'fr' ? ';' : ',';
  download(`drived-${new Date().toISOString().slice(0, 19).replaceAll(':', '')}.csv`, 'text/csv;charset=utf-8',
    ['\ufeff', lines.map(line => line.map(quoted).join(separator)).join('\r\n'), '\r\n']);
}

/** An event as the texts of its row. */
export function cells(event) {
  const time = clock(event.time_unix_ms);
  const whose = event.drive ?? event.group ?? event.selected?.join(', ') ?? event.line ?? '';
  if (event.kind !== 'command') return [time, whose, word(event.event), eventText(event), '', '', ''];
  return [time, whose, word('command'), command(event), [event.caller, event.origin].filter(Boolean).join(', '),
    event.text ? named(outcome(event.outcome), told(event.text)) : outcome(event.outcome),
    event.outcome === 'pending' ? '' : duration(event.took_ms)];
}

/** A record of the history as the event or command that it was told as. */
export function ofRecord({ kind, what, drive, line, text, alarm, body, number, time_unix_ms: time }) {
  const was = kind === 'command' || kind === 'event' ? body : undefined;
  // An alarm is told by what it is, in the language of the page.
  const said = kind === 'alarm' && body?.kind ? alarmText(body) : text;
  return { drive, line, text: said, event: what, ...was, alarm: was?.alarm ?? alarm, number, kind: kind === 'command' && was ? kind : 'event', time_unix_ms: time };
}
