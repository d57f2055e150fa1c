// Which port is scanned, at which speed and format, and which addresses.

import { confirmed } from './ask.js';
import { el, setText } from './dom.js';
import { named, t } from './texts.js';

const SPEEDS = [1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200];
const FORMATS = ['8E1', '8N1', '8O1', '8N2', '7E1', '7O1'];
const ADDRESSES = ['1-31', '1-247'];
/** What most drives have from the factory. */
const USUAL = { speed: 19200, format: '8E1' };

/** The panel: `scan(wanted)` is called with what is chosen, `look()` looks for ports again. */
export function portPanel(scan, look) {
  let shown = '';
  const ports = el('div.ports', { role: 'radiogroup', 'aria-label': t('port') });
  const other = el('input', { type: 'text', autocomplete: 'off', spellcheck: 'false', 'aria-label': t('setup_other_hint'), placeholder: 'tcp://…', oninput: () => (radio(other).checked = true) });
  const none = el('p.hint', { hidden: true }, t('setup_port_none'));
  const speed = select(SPEEDS, USUAL.speed);
  const format = select(FORMATS, USUAL.format);
  const addresses = select(ADDRESSES, ADDRESSES[0]);
  const all = el('input', { type: 'checkbox', onchange: () => (speed.disabled = format.disabled = all.checked) });
  const go = el('button.primary', {}, t('setup_scan'));
  const form = el('form', { onsubmit: submit }, ports, none,
    el('div.fields', {},
      el('label.field', {}, t('setup_speed'), speed), el('label.field', {}, t('setup_format'), format),
      el('label.field', {}, t('setup_addresses'), addresses)),
    el('label.check', {}, all, t('setup_all_speeds')), el('p.hint', {}, t('setup_watchdogs')),
    el('div.buttons', {}, el('button', { type: 'button', onclick: look }, t('setup_again')), go));
  const element = el('section.panel.setup', { 'aria-label': t('port') }, el('h2', {}, t('setup_port')), form);
  return { element, update };

  function update({ ports: present, scan: under }) {
    go.disabled = ['listening', 'asking'].includes(under?.state);
    const now = JSON.stringify(present);
    if (now === shown) return;
    shown = now;
    const chosen = ports.querySelector('input:checked')?.value;
    none.hidden = present.length > 0;
    ports.replaceChildren(...present.map(({ path, device, line }) => choice(path, el('span', {}, el('b', {}, device ?? path),
      device || line ? el('small', {}, [device && path, line && t('setup_port_taken', { line })].filter(Boolean).join(' · ')) : null), Boolean(line))),
    choice('', el('span.other', {}, t('setup_other'), other), false));
    const first = [...ports.querySelectorAll('input[type=radio]')];
    (first.find(one => one.value === chosen) ?? first.find(one => !one.disabled)).checked = true;
  }

  function choice(value, label, disabled) {
    return el('label.check', {}, el('input', { type: 'radio', name: 'port', value, disabled }), label);
  }

  function radio(field) {
    return field.closest('label').querySelector('input[type=radio]');
  }

  async function submit(event) {
    event.preventDefault();
    const where = ports.querySelector('input[type=radio]:checked')?.value || other.value.trim();
    if (!where) return void other.focus();
    if (all.checked && !await confirmed({ drives: [] }, named(where, `${t('setup_confirm_standstill')} ${t('setup_standstill')}`), t('setup_they_stand'))) return;
    const isOnlyPort = !/^[a-z+]+:|,/.test(where);
    const line = isOnlyPort && !all.checked ? `${where},${speed.value},${format.value}` : where;
    scan({ line, addresses: addresses.value, standstill: all.checked });
  }
}

function select(values, usual) {
  return el('select', {}, ...values.map(value => el('option', { value, selected: value === usual }, String(value))));
}
