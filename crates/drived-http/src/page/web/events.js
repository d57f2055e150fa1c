// What has happened: commands with their outcome, trips, connections; what was earlier from the history; to be filtered and taken away as CSV.

import { read } from './api.js';
import { el, setText } from './dom.js';
import { KINDS, cells, eventTable, ofRecord, saveEvents } from './event_rows.js';
import { pastLinks } from './past_links.js';
import { here, keepAsked } from './place.js';
import { daemonNow, plant } from './plant.js';
import { found } from './search.js';
import { named, t } from './texts.js';
import { told } from './told.js';

const SHOWN = 300;
const OLDER = 300;
const READS = 10;

/** Shows the events in `root`. */
export function events(root) {
  const asked = { kind: '', search: '', ...Object.fromEntries(here().asked) };
  if (!KINDS[asked.kind]) asked.kind = '';
  let older = [];
  let room = SHOWN;
  let before;
  /** What was asked of the history before another kind was chosen is not heard any more. */
  let asks = 0;
  const count = el('p.hint', { role: 'status' });
  const kind = el('select', { 'aria-label': t('kind'), onchange: () => ask({ kind: kind.value === 'kind_all' ? '' : kind.value }, true) },
    ...Object.keys(KINDS).map(name => el('option', { value: name, selected: name === asked.kind }, t(name))));
  const search = el('input', { type: 'search', value: asked.search, placeholder: t('search'), 'aria-label': t('search'), oninput: () => ask({ search: search.value }) });
  const list = eventTable();
  const more = el('button', { type: 'button', onclick: readOlder }, t('journal_older'));
  const said = el('p.hint', { role: 'status' });
  root.append(el('h1', { tabindex: -1 }, t('events')), pastLinks('events'), el('p.hint', {}, t('events_since')),
    el('div.tools', {}, kind, search, el('button', { type: 'button', onclick: () => saveEvents(chosen()) }, t('csv'))),
    count, el('section.panel', {}, el('div.wide', {}, list.element), el('p.buttons', {}, said, more)));
  update();
  return { update: names => (names.has('event') || names.has('state')) && update() };

  /** Another kind is asked anew of the history, which has more than was read. */
  function ask(changes, isAnew) {
    Object.assign(asked, changes);
    if (isAnew) {
      asks++;
      [older, before, room] = [[], undefined, SHOWN];
      more.disabled = false;
      more.hidden = false;
      setText(said, '');
    }
    keepAsked(asked);
    update();
  }

  function chosen() {
    const all = [...plant.events, ...older].filter(KINDS[asked.kind || 'kind_all']);
    return found(all, asked.search, event => cells(event).join(' '));
  }

  function update() {
    const those = chosen();
    const all = those.length ? String(those.length) : t('no_events');
    setText(count, older.length ? named(all, t('journal_of', { count: older.length })) : all);
    list.show(those.slice(0, room));
  }

  /** Reads until there is something of the kind that is asked for, or nothing older. */
  async function readOlder() {
    const mine = asks;
    more.disabled = true;
    const oldest = plant.events.at(-1)?.time_unix_ms ?? daemonNow();
    const isWanted = KINDS[asked.kind || 'kind_all'];
    try {
      let fresh = [];
      for (let times = 0; times < READS && !fresh.some(isWanted) && !more.hidden; times++) {
        const wanted = new URLSearchParams({ from_unix_ms: 0, to_unix_ms: Math.floor(oldest) - 1, limit: OLDER, before: before ?? Number.MAX_SAFE_INTEGER });
        if (asked.kind === 'kind_command') wanted.set('kind', 'command');
        const { records, next_before: next } = await read(`history/records?${wanted}`);
        if (mine !== asks) return;
        before = next;
        fresh = records.map(ofRecord);
        const numbers = new Set(older.map(({ number }) => number));
        older = [...older, ...fresh.filter(({ number }) => !numbers.has(number))];
        more.hidden = next === undefined;
      }
      room += OLDER;
      setText(said, more.hidden ? t('journal_end') : '');
      update();
    } catch (problem) {
      if (mine !== asks) return;
      setText(said, t('past_none', { why: problem.isUnheard ? t('not_reached') : told(problem.message) }));
    }
    more.disabled = false;
  }
}
