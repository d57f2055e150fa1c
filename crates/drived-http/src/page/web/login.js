// The question for a token, when a right is lacking.

import { post } from './api.js';
import { ask } from './ask.js';
import { el } from './dom.js';
import { start } from './plant.js';
import { t } from './texts.js';
import { told } from './told.js';

let open = false;

/** Gives the session up. */
export async function logOut() {
  await post('logout').catch(() => {});
  start();
}

/** Asks for a token. Whatever lacked the right is not sent again: a motor that starts late by a login is nobody's wish. */
export async function askToken() {
  if (open) return;
  open = true;
  const token = el('input', { type: 'password', autocomplete: 'current-password', required: true });
  const said = el('p.said', { role: 'alert' });
  const form = el('form', { method: 'dialog', onsubmit: send },
    el('p', {}, t('login_why')),
    el('label.field', {}, t('token'), token),
    said,
    el('div.buttons', {},
      el('button', { type: 'button', onclick: () => question.close() }, t('cancel')),
      el('button.primary', {}, t('log_in'))));
  const question = ask(t('log_in'), form);
  token.focus();
  await question.closed;
  open = false;

  async function send(event) {
    event.preventDefault();
    try {
      await post('login', { token: token.value });
      said.textContent = t('login_done');
      start();
      setTimeout(() => question.close(), 1_500);
    } catch (problem) {
      said.textContent = problem.lacksRight ? t('login_wrong') : told(problem.message);
    }
  }
}
