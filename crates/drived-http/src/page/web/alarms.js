// The alarms of the plant from their one source: what waits for somebody first, with who has done what about each.

import { alarmText, isActive, mayAct, ofWhat, waits } from './alarm_words.js';
import { path, post } from './api.js';
import { filled } from './ask.js';
import { isLoud, switchSound } from './attention.js';
import { arrange, el, setAttribute, setClass, setText } from './dom.js';
import { clock, duration } from './format.js';
import { here, keepAsked, ofDrive } from './place.js';
import { daemonNow, plant, takeAlarm } from './plant.js';
import { found } from './search.js';
import { named, t } from './texts.js';
import { told } from './told.js';
import { word } from './vocabulary.js';

const FILTERS = {
  all: alarm => alarm.state !== 'suppressed',
  alarms_waiting: waits,
  alarms_known: alarm => alarm.state === 'acknowledged',
  alarms_shelved: alarm => alarm.state === 'shelved',
};
const SHELVES_MIN = [15, 60, 240, 480, 1_440];
const USUAL_SHELF_MIN = 480;
const LONGEST_NOTE = 500;
const NAMED = 12;
const SAID_MS = 12_000;
const SEVERITIES = ['alarm', 'warning', 'note'];

/** Shows the alarms in `root`. */
export function alarms(root) {
  const asked = { filter: '', search: '', ...Object.fromEntries(here().asked) };
  if (!FILTERS[asked.filter]) asked.filter = '';
  const items = new Map();
  const filters = Object.keys(FILTERS).map(name => el('button.chip', { type: 'button', 'data-filter': name, onclick: () => ask({ filter: name === 'all' ? '' : name }) }));
  const search = el('input', { type: 'search', value: asked.search, placeholder: t('search'), 'aria-label': t('search'), oninput: () => ask({ search: search.value }) });
  const all = el('button', { type: 'button', onclick: () => acknowledge(mine()) });
  const sound = el('button', { type: 'button', 'aria-pressed': String(isLoud()), onclick: () => setAttribute(sound, 'aria-pressed', String(switchSound())) }, t('sound'));
  const dropped = el('p.hint');
  const none = el('p', {}, t('alarms_none'));
  const list = el('ul.alarms');
  let shown = [];
  root.append(el('h1', { tabindex: -1 }, t('alarms')), el('p.hint', {}, t('alarms_about')),
    el('div.tools', {}, el('div.chips', { role: 'group', 'aria-label': t('state') }, ...filters), search, all, sound), none, list, dropped);
  update();
  return { update: names => (names.has('alarm') || names.has('state')) && update(), tick };

  function ask(changes) {
    Object.assign(asked, changes);
    keepAsked(asked);
    update();
  }

  function update() {
    const known = [...plant.alarms.values()];
    for (const chip of filters) {
      const { filter } = chip.dataset;
      setText(chip, `${t(filter === 'all' ? 'alarms_all' : filter)} ${known.filter(FILTERS[filter]).length}`);
      setAttribute(chip, 'aria-pressed', String(filter === (asked.filter || 'all')));
      setClass(chip, 'some', filter === 'alarms_waiting' && known.some(waits));
    }
    shown = found(known.filter(FILTERS[asked.filter || 'all']), asked.search, alarm => `${ofWhat(alarm)} ${alarm.line ?? ''} ${alarmText(alarm)}`)
      .sort((one, other) => waits(other) - waits(one) || SEVERITIES.indexOf(one.severity) - SEVERITIES.indexOf(other.severity) || other.last_unix_ms - one.last_unix_ms);
    for (const id of items.keys()) if (!plant.alarms.has(id)) items.delete(id);
    arrange(list, shown.map(alarm => {
      if (!items.has(alarm.id)) items.set(alarm.id, makeItem());
      items.get(alarm.id).update(alarm);
      return items.get(alarm.id).element;
    }));
    none.hidden = shown.length > 0;
    all.hidden = mine().length < 2;
    setText(all, t('acknowledge_all', { count: mine().length }));
  }

  function tick() {
    items.forEach(item => item.tick());
  }

  /** Those that are shown, wait, and that the asker may take note of. */
  function mine() {
    return shown.filter(alarm => waits(alarm) && mayAct(alarm));
  }
}

function makeItem() {
  const state = el('b.life');
  const title = el('h2');
  const when = el('p');
  const remedy = el('p.hint');
  const who = el('p');
  const followers = el('details', { ontoggle: () => followers.open && writeFollowers() }, el('summary'), el('p.hint'));
  const buttons = el('div.buttons');
  const element = el('li', {}, el('div.about', {}, title, state, when, remedy, who, followers), buttons);
  let shown;
  let offered = '';
  return { element, update, tick };

  function update(alarm) {
    shown = alarm;
    const active = isActive(alarm);
    setAttribute(element, 'data-alarm', alarm.id);
    setAttribute(element, 'data-life', alarm.state);
    setAttribute(element, 'data-trouble', waits(alarm) || active ? (alarm.severity === 'alarm' ? 'severe' : 'minor') : undefined);
    writeTitle(alarm);
    setText(state, word(alarm.state));
    setText(remedy, active ? [named(t('what_to_do'), told(alarm.remedy)), alarm.of_motion && t('alarm_of_motion')].filter(Boolean).join('. ') : '');
    setText(who, [alarm.acknowledged && done('alarm_acknowledged', alarm.acknowledged, alarm.acknowledged.unix_ms, alarm.acknowledged.note),
      alarm.shelved && done('alarm_shelved', alarm.shelved, alarm.shelved.until_unix_ms, alarm.shelved.why)].filter(Boolean).join('. '));
    followers.hidden = !alarm.members;
    setText(followers.firstChild, t('alarm_followers', { count: namesOf(alarm).length }));
    if (followers.open) writeFollowers();
    offer(alarm);
    tick();
  }

  function writeTitle(alarm) {
    const text = named(ofWhat(alarm), alarmText(alarm));
    if (title.textContent === text) return;
    const link = alarm.drive && plant.drives.has(alarm.drive) ? ofDrive(alarm.drive) : alarm.line && plant.lines.has(alarm.line) && `#/line/${encodeURIComponent(alarm.line)}`;
    title.replaceChildren(link ? el('a', { href: link }, text) : text);
  }

  function tick() {
    const { first_unix_ms: first, last_unix_ms: last, returned_unix_ms: end, count } = shown;
    const time = end ? t('alarm_was', { time: clock(last), end: clock(end) }) : t('alarm_since', { time: clock(last), age: duration(daemonNow() - last) });
    setText(when, [time, count > 1 && t('alarm_times', { count, time: clock(first) })].filter(Boolean).join(' · '));
  }

  function writeFollowers() {
    setText(followers.lastChild, namesOf(shown).join(', '));
  }

  /** What would be refused is not offered. */
  function offer(alarm) {
    const acts = mayAct(alarm) ? [waits(alarm) && 'acknowledge', isActive(alarm) && !alarm.shelved && !alarm.of_motion && !alarm.suppressed_by && 'shelve', alarm.shelved && 'unshelve',
      alarm.kind === 'maintenance' && isActive(alarm) && 'maintained'].filter(Boolean) : [];
    const now = `${acts.join()} ${title.textContent}`;
    if (now === offered) return;
    offered = now;
    const act = { acknowledge: () => acknowledge([shown]), shelve: () => shelve(shown), unshelve: () => send(shown, 'unshelve', {}), maintained: () => maintained(shown) };
    buttons.replaceChildren(...acts.map(name => el('button', { type: 'button', 'data-act': name, onclick: act[name], 'aria-label': t(`${name}_of`, { what: title.textContent }) }, t(name))));
  }
}

/** The drives of which something follows from an alarm. */
function namesOf({ id }) {
  return [...new Set([...plant.alarms.values()].filter(alarm => alarm.drive && alarm.suppressed_by === id).map(ofWhat))];
}

function done(text, { by }, ms, note) {
  const said = t(text, { who: by, time: clock(ms) });
  return note ? named(said, note) : said;
}

/** What of an alarm is not as a question has shown it: it is over, has come again, or is of a drive of another name. */
function changedOf(alarm) {
  const now = plant.alarms.get(alarm.id);
  const isSame = now && now.count === alarm.count && ofWhat(now) === ofWhat(alarm);
  return !isSame && t('now_alarm', { what: named(ofWhat(alarm), alarmText(alarm)) });
}

async function acknowledge(alarms) {
  const note = el('textarea', { maxlength: LONGEST_NOTE, rows: 3 });
  const listed = alarms.slice(0, NAMED).map(alarm => named(ofWhat(alarm), alarmText(alarm))).join(' · ');
  const question = alarms.length > NAMED ? t('and_more', { names: listed, count: alarms.length - NAMED }) : listed;
  const yes = alarms.length > 1 ? t('acknowledge_all', { count: alarms.length }) : t('acknowledge');
  if (!await filled(() => alarms.map(changedOf).find(Boolean), question, yes, el('label.field', {}, t('alarm_note'), note))) return;
  // One after another: however many they are, the connections are left to a stop. What has come again meanwhile is not meant.
  for (const alarm of alarms) await send(alarm, 'acknowledge', { count: alarm.count, ...note.value.trim() ? { note: note.value.trim() } : {} });
}

async function shelve(alarm) {
  const time = el('select', {}, ...SHELVES_MIN.map(minutes => el('option', { value: minutes, selected: minutes === USUAL_SHELF_MIN }, duration(minutes * 60_000))));
  const why = el('textarea', { maxlength: LONGEST_NOTE, rows: 3, required: true });
  if (!await filled(() => changedOf(alarm), named(ofWhat(alarm), alarmText(alarm)), t('shelve'), el('label.field', {}, t('alarm_why'), why), el('label.field', {}, t('alarm_for'), time))) return;
  await send(alarm, 'shelve', { minutes: Number(time.value), why: why.value.trim() });
}

/** What an alarm of maintenance asks for was done: it is counted from now on. */
async function maintained(alarm) {
  const note = el('textarea', { maxlength: LONGEST_NOTE, rows: 3 });
  if (!await filled(() => changedOf(alarm), named(ofWhat(alarm), alarmText(alarm)), t('maintained_yes'), el('p', {}, t('maintained_about')), el('label.field', {}, t('alarm_note'), note))) return;
  await send(alarm, 'done', note.value.trim() ? { note: note.value.trim() } : {});
}

async function send(alarm, act, body) {
  const what = named(ofWhat(alarm), alarmText(alarm));
  try {
    const now = await post(path('alarms', alarm.id, act), body);
    takeAlarm(now);
    say(act === 'done' ? t('maintained_done', { what }) : t('alarm_done', { what, state: word(now.state === 'over' || act === 'acknowledge' ? 'acknowledged' : now.state) }));
  } catch (problem) {
    say(t('alarm_not_done', { what, why: problem.isUnheard ? t('not_reached') : told(problem.message) }), true);
  }
}

function say(text, isBad = false) {
  const note = el(isBad ? 'p.bad' : 'p', {}, text);
  document.getElementById('outcomes').prepend(note);
  setTimeout(() => note.remove(), SAID_MS);
}
