// How a scan stands.

import { el, setAttribute, setText } from './dom.js';
import { duration } from './format.js';
import { t } from './texts.js';
import { told } from './told.js';

/** The panel of the scan; `cancel` gives it up. */
export function scanPanel(cancel) {
  const said = el('p', { role: 'status' });
  const bar = el('progress', { 'aria-label': t('setup_found') });
  const takes = el('span.hint');
  const give = el('button', { type: 'button', onclick: cancel }, t('setup_cancel'));
  const doubts = el('ul.history');
  const running = el('div.progress', {}, bar, takes, give);
  const element = el('section.panel.setup', { hidden: true, 'aria-label': t('setup_found') }, el('h2', {}, t('setup_found')), said, running, doubts);
  return { element, update };

  function update(scan) {
    element.hidden = !scan;
    if (!scan) return;
    const { state, line, address, setting, why, found, done, steps } = scan;
    const isRunning = ['listening', 'asking'].includes(state);
    const count = found.length;
    const isNobody = state === 'done' && !count;
    setText(said, [t(`setup_${state}`, { line, address: address ?? '', setting: setting ?? '', why: told(why), count }), isNobody && t('setup_nobody')].filter(Boolean).join(' '));
    running.hidden = !isRunning;
    setAttribute(bar, 'max', steps || 1);
    setAttribute(bar, 'value', state === 'asking' ? done : undefined);
    setText(takes, scan.takes_ms ? t('setup_takes', { time: duration(scan.takes_ms) }) : '');
    doubts.replaceChildren(...scan.doubts.map(doubt => el('li', {}, told(doubt))));
  }
}
