// What became of the last command for several drives, of each by its name: those for which it ended otherwise come first.

import { el, grouped, setClass } from './dom.js';
import { onOrder, orderText } from './orders.js';
import { named, t } from './texts.js';
import { told } from './told.js';
import { outcome } from './words.js';

/** A panel with it: `element`, `end()`. It is hidden until there is one. */
export function severalPanel() {
  const text = el('p', { role: 'status' });
  const list = el('dl.pairs');
  const close = el('button', { type: 'button', onclick: () => (element.hidden = true) }, t('close'));
  const element = el('section.panel.several', { 'aria-label': t('latest_orders'), hidden: true }, text, list, close);
  return { element, end: onOrder(write) };

  function write(order) {
    if (!order.drives) return;
    element.hidden = false;
    text.textContent = named(order.to, orderText(order));
    const kinds = grouped(order.drives, one => [one.outcome, one.outcome === 'confirmed' ? '' : one.text ?? ''].join('\n'));
    const ordered = [...kinds].sort(([one], [other]) => isDone(one) - isDone(other));
    list.replaceChildren(...ordered.flatMap(([kind, those]) => {
      const [how, why] = kind.split('\n');
      const term = el('dt', {}, t('outcome_of', { outcome: outcome(how), count: those.length }));
      setClass(term, 'bad', !isDone(kind) && how !== 'pending');
      const names = those.map(one => one.drive).join(', ');
      return [term, el('dd', {}, why ? named(names, told(why)) : names)];
    }));
  }
}

function isDone(kind) {
  return kind.startsWith('confirmed') || kind.startsWith('nothing');
}
