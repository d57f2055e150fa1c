// A link of `drived token link`: what stands behind it begins a session, once, and is taken out of the address at once.

import { post } from './api.js';
import { el, setText } from './dom.js';
import { plant, start } from './plant.js';
import { SETUP_TEXTS } from './setup_texts.js';
import { addTexts, t } from './texts.js';
import { told } from './told.js';

addTexts(SETUP_TEXTS);

/** Begins a session by the code in the address, and goes on to the drives, or to where they are added. */
export function enter(root, code) {
  const said = el('p', { role: 'status' }, t('enter_now'));
  root.append(el('h1', { tabindex: -1 }, t('enter')), said);
  // Neither Back nor the list of what was visited has it; a try that nobody heard is made again from here.
  history.replaceState(null, '', '#/enter');
  const again = el('button', { type: 'button', hidden: true, onclick: begin }, t('enter_again'));
  root.append(el('p.buttons', {}, again));
  begin();
  return { update() {} };

  async function begin() {
    again.hidden = true;
    if (!code) return void setText(said, t('enter_none'));
    setText(said, t('enter_now'));
    try {
      await post('login', { code });
      await start();
      location.replace(plant.drives.size ? '#/' : '#/setup');
    } catch (problem) {
      again.hidden = problem.lacksRight;
      setText(said, problem.isUnheard ? t('not_reached') : problem.lacksRight ? t('enter_wrong') : told(problem.message));
    }
  }
}
