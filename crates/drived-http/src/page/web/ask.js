// A question of the page. Nothing behind it can be reached while it stands, but for the stop of all, which is above it.

import { el } from './dom.js';
import { daemonNow } from './plant.js';
import { named, t } from './texts.js';

/** What a question stands before. */
const BEHIND = '.bar, main, .demo, .skip';
const SHOWN_MS = 12_000;
let standing = 0;
/** The questions whose yes is a command: for which drives, since when, and how each is taken away. */
const questions = new Set();

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
 * Asks whether these drives are commanded, perhaps with a field to be filled; `true` when the answer is `yes`. Escape, Cancel and a
 * stop meanwhile are a no.
 */
export async function confirmed(drives, question, yes, field) {
  const { close, closed } = put(question, yes, field);
  const one = { drives, yes, close, since: daemonNow() };
  questions.add(one);
  const answer = await closed;
  questions.delete(one);
  return answer === 'yes';
}

/** Asks for what a form has; `true` when it was sent. No drive is commanded by it. */
export async function filled(question, yes, ...fields) {
  return await put(question, yes, ...fields).closed === 'yes';
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
    if (stop && (stop.time_unix_ms < one.since || !one.drives.some(drive => stopped.includes(drive)))) continue;
    one.close('no');
    const note = el('p.bad', {}, named(one.yes, t(stop ? 'withdrawn_by_stop' : 'withdrawn_by_stop_all')));
    document.getElementById('outcomes').prepend(note);
    setTimeout(() => note.remove(), SHOWN_MS);
  }
}

function shut(isShut) {
  for (const element of document.querySelectorAll(BEHIND)) element.inert = isShut;
}
