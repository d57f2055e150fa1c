// A question in a dialog of the page.

import { el } from './dom.js';
import { t } from './texts.js';

/** Asks; `true` when the answer is `yes`. Escape and Cancel are a no. */
export function confirmed(question, yes) {
  return new Promise(answer => {
    const dialog = el('dialog', { 'aria-label': yes, onclose: () => {
      dialog.remove();
      answer(dialog.returnValue === 'yes');
    } },
    el('form', { method: 'dialog' },
      el('p', {}, question),
      el('div.buttons', {},
        el('button', { value: 'no' }, t('cancel')),
        el('button.primary', { value: 'yes' }, yes))));
    document.body.append(dialog);
    dialog.showModal();
  });
}
