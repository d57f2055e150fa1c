// The last exchanges of a line, as bytes, read anew while they are looked at.

import { path, read } from './api.js';
import { el, setText } from './dom.js';
import { clock, MISSING, quantity } from './format.js';
import { t } from './texts.js';
import { word } from './vocabulary.js';

const COLUMNS = ['time', 'slave', 'request', 'answer', 'outcome', 'took'];

/** A panel with the last exchanges of the line `name`; `update()` reads them, unless they are held. */
export function lastExchanges(name) {
  const body = el('tbody');
  let held = false;
  const hold = el('button', { type: 'button', 'aria-pressed': 'false', onclick: () => {
    held = !held;
    hold.setAttribute('aria-pressed', held);
    setText(hold, t(held ? 'go_on' : 'hold'));
    if (!held) update();
  } }, t('hold'));
  const panel = el('section.panel.last', {},
    el('div.headline', {}, el('h2', {}, t('last_exchanges')), hold),
    el('div.wide', { tabindex: 0, role: 'group', 'aria-label': t('last_exchanges') },
      el('table', {}, el('thead', {}, el('tr', {}, ...COLUMNS.map(column => el(column === 'took' ? 'th.right' : 'th', { scope: 'col' }, t(column))))), body)));
  let reading = false;
  return { panel, update };

  async function update() {
    if (reading || document.hidden || held) return;
    reading = true;
    try {
      const { last, slaves } = await read(path('lines', name));
      // Asked before they were held: what somebody looks at does not move any more.
      if (held) return;
      const drives = new Map(slaves.map(slave => [slave.slave, slave.drive]));
      body.replaceChildren(...last.reverse().map(exchange => row(exchange, drives)));
    } catch {
      // The frame of the page says that the daemon is away; what was read stands.
    } finally {
      reading = false;
    }
  }
}

function row({ time_unix_ms: time, slave, request, answer, result, took_ms: took }, drives) {
  const bad = !['ok', 'broadcast', 'put_aside', 'given_up'].includes(result);
  const name = slave === 0 ? '' : drives.get(slave) ?? '';
  return el(bad ? 'tr.in-trouble' : 'tr', {},
    el('td', {}, clock(time, { thousandths: true })),
    el('td', {}, [slave, name].filter(part => part !== '').join(' · ')),
    el('td', {}, el('code', {}, request)),
    el('td', {}, el('code', {}, answer || MISSING)),
    el('td', {}, word(result)),
    el('td.right', {}, quantity(took, 1, 'ms')));
}
