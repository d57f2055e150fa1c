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
  // Neither Back nor the list of what was visited has it.
  history.replaceState(null, '', '#/enter');
  begin();
  return { update() {} };

  async function begin() {
    if (!code) return void setText(said, t('enter_none'));
    try {
      await post('login', { code });
      await start();
      location.replace(plant.drives.size ? '#/' : '#/setup');
    } catch (problem) {
      setText(said, problem.isUnheard ? t('not_reached') : problem.lacksRight ? t('enter_wrong') : told(problem.message));
    }
  }
}
