// Many drives in one row: what follows from one cause, and what is the same at many drives of one line.

import { alarmText, isActive, ofWhat } from './alarm_words.js';
import { el, grouped, setAttribute, setText } from './dom.js';
import { clock } from './format.js';
import { plant } from './plant.js';
import { named, t } from './texts.js';
import { told } from './told.js';
import { isTrouble, trouble } from './trouble.js';

/** So many are folded; fewer are read as fast as their fold. */
const FOLDED_FROM = 4;
const NAMED = 8;

/** The drives in their order, those that belong together as `{ key, names, cause }` in the place of the first of them. */
export function folds(names) {
  const alarms = grouped([...plant.alarms.values()].filter(alarm => alarm.drive && isActive(alarm)), alarm => alarm.drive);
  const keys = new Map(names.map(name => [name, keyOf(plant.drives.get(name), alarms.get(name) ?? [])]));
  const members = grouped(names, name => keys.get(name)?.key);
  const made = new Set();
  return names.flatMap(name => {
    const key = keys.get(name);
    const those = key && members.get(key.key);
    if (!those || those.length < FOLDED_FROM) return [{ name }];
    if (made.has(key.key)) return [];
    made.add(key.key);
    return [{ ...key, names: those }];
  });
}

/** With whom a drive is folded: with all that follow from the same cause, else with those of its line that have the same trouble. */
function keyOf(drive, alarms) {
  const own = alarms.filter(alarm => !alarm.suppressed_by);
  const [first] = alarms;
  const cause = first && own.length === 0 && plant.alarms.get(first.suppressed_by);
  if (cause) return { key: `cause ${cause.id}`, cause };
  const worst = trouble(drive);
  // A motor that may turn has a row of its own.
  if (!isTrouble(worst) || own.some(alarm => alarm.of_motion)) return undefined;
  return { key: `${drive.line} ${worst.rank} ${worst.alike}` };
}

/** A row for a fold: `element`, `update(fold, isOpen, chosen)`; `select(names, isChosen)` and `toggle(key)` are called by it. */
export function makeFold(key, select, toggle) {
  const box = el('input', { type: 'checkbox', onchange: () => select(shown.names, box.checked) });
  const title = el('b');
  const what = el('div.what');
  const hint = el('small');
  const open = el('button', { type: 'button', onclick: () => toggle(key) });
  const element = el('div.fold', { role: 'row' },
    el('div.select', { role: 'cell' }, el('label', {}, box)),
    el('div.title', { role: 'rowheader' }, el('span.mark', { 'aria-hidden': 'true' }), title),
    el('div.folded', { role: 'cell' }, what, hint), el('div.act', { role: 'cell' }, open));
  let shown;
  return { element, update };

  function update(fold, isOpen, chosen) {
    shown = fold;
    const { names, cause } = fold;
    const drives = names.map(name => plant.drives.get(name));
    const count = names.length;
    setText(title, t('fold_drives', { count, line: drives[0].line }));
    const kinds = [...grouped(drives, drive => trouble(drive).alike)];
    const parts = kinds.map(([alike, those]) => t('fold_part', { count: those.length, what: alike }));
    setText(what, cause ? [named(ofWhat(cause), alarmText(cause)), ...parts].join('. ') : parts.join('. '));
    const since = cause && t('given_since', { time: clock(cause.last_unix_ms) });
    const listed = names.slice(0, NAMED).join(', ');
    setText(hint, [since, told(cause?.remedy ?? trouble(drives[0]).remedy),
      count > NAMED ? t('and_more', { names: listed, count: count - NAMED }) : listed].filter(Boolean).join(' · '));
    setText(open, t(isOpen ? 'fold_hide' : 'fold_show'));
    setAttribute(open, 'aria-expanded', String(isOpen));
    box.setAttribute('aria-label', t('select_fold', { count }));
    box.checked = names.every(name => chosen.has(name));
    box.indeterminate = !box.checked && names.some(name => chosen.has(name));
    const severe = drives.some(drive => trouble(drive).severity === 'alarm');
    setAttribute(element, 'data-trouble', severe ? 'severe' : 'minor');
    setAttribute(element, 'data-state', severe ? 'trouble' : undefined);
  }
}
