// A question of the page. Nothing behind it can be reached while it stands, but for the stop of all, which is above it.

import { el } from './dom.js';
import { daemonNow, onChange, plant } from './plant.js';
import { otherwise } from './shown.js';
import { named, t } from './texts.js';

/** What a question stands before. */
const BEHIND = '.bar, main, .demo, .skip';
const SHOWN_MS = 12_000;
let standing = 0;
/** The questions that stand: what each has shown, since when, of which daemon, and how it is taken away. */
const questions = new Set();

onChange(() => {
  for (const one of [...questions]) {
    const isAnew = plant.daemon.started_unix_ms !== one.started;
    const why = isAnew ? t('now_daemon') : one.expects && otherwise(one.expects) || one.changed?.();
    if (why) takeBack(one, t('withdrawn_by_change', { why }));
  }
});

/** Puts a dialog with this form up: `close(value)` takes it away, Escape too; `closed` ends then, with the value. */
export function ask(name, form) {
  const cameFrom = document.activeElement;
  const dialog = el('dialog', { 'aria-label': name, 'aria-modal': 'true' }, form);
  const veil = el('div.veil');
  const escape = event => event.key === 'Escape' && dialog.close('');
  const closed = new Promise(over => dialog.addEventListener('close', () => {
    removeEventListener('keydown', escape);
    dialog.remove();
    veil.remove();
    if (!--standing) shut(false);
    cameFrom?.focus?.({ preventScroll: true });
    over(dialog.returnValue);
  }));
  addEventListener('keydown', escape);
  document.body.append(veil, dialog);
  standing++;
  shut(true);
  dialog.show();
  return { close: value => dialog.close(value), closed };
}

/**
 * Asks whether the drives that are commanded are, perhaps with a field to be filled; `true` when the answer is `yes`. Escape, Cancel,
 * a stop meanwhile, and that something is not as it was shown are a no: `expects` goes with the command; `changed()` says what else is.
 */
export function confirmed(expects, question, yes, { field, changed } = {}) {
  return answered(expects, changed, question, yes, field);
}

/** Asks for what a form has; `true` when it was sent. No drive is commanded by it. */
export function filled(changed, question, yes, ...fields) {
  return answered(undefined, changed, question, yes, ...fields);
}

async function answered(expects, changed, question, yes, ...fields) {
  const { close, closed } = put(question, yes, ...fields);
  const one = { expects, changed, yes, close, since: daemonNow(), started: plant.daemon.started_unix_ms };
  questions.add(one);
  const answer = await closed;
  questions.delete(one);
  return answer === 'yes';
}

function put(question, yes, ...fields) {
  const form = el('form', { method: 'dialog' },
    el('p', {}, question), ...fields,
    el('div.buttons', {},
      el('button', { value: 'no', formnovalidate: true }, t('cancel')),
      el('button.primary', { value: 'yes' }, yes)));
  const asked = ask(yes, form);
  form.querySelector('input, textarea, select')?.focus();
  return asked;
}

/** A stop of all was pressed here, or the daemon tells of this one: what was asked of its drives before is asked no more. */
export function withdraw(stop) {
  for (const one of [...questions]) {
    const stopped = [stop?.drive, ...(stop?.drives ?? []).map(each => each.drive)];
    if (!one.expects || stop && (stop.time_unix_ms < one.since || !one.expects.drives.some(({ name }) => stopped.includes(name)))) continue;
    takeBack(one, t(stop ? 'withdrawn_by_stop' : 'withdrawn_by_stop_all'));
  }
}

function takeBack(one, why) {
  questions.delete(one);
  one.close('no');
  const note = el('p.bad', {}, named(one.yes, why));
  document.getElementById('outcomes').prepend(note);
  setTimeout(() => note.remove(), SHOWN_MS);
}

function shut(isShut) {
  for (const element of document.querySelectorAll(BEHIND)) element.inert = isShut;
}
