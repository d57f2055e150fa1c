// A question of the page. Nothing behind it can be reached while it stands, but for the stop of all, which is above it.

import { el } from './dom.js';
import { t } from './texts.js';

/** What a question stands before. */
const BEHIND = '.bar, main, .demo, .skip';
let standing = 0;

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

/** Asks; `true` when the answer is `yes`. Escape and Cancel are a no. */
export async function confirmed(question, yes) {
  const form = el('form', { method: 'dialog' },
    el('p', {}, question),
    el('div.buttons', {},
      el('button', { value: 'no' }, t('cancel')),
      el('button.primary', { value: 'yes' }, yes)));
  return await ask(yes, form).closed === 'yes';
}

function shut(isShut) {
  for (const element of document.querySelectorAll(BEHIND)) element.inert = isShut;
}
