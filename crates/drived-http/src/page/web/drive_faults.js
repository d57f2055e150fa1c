// The present fault of a drive with what to do, the freeze-frame of the trip, and the history that the drive keeps.

import { path, read } from './api.js';
import { el, table } from './dom.js';
import { clock, MISSING, quantity } from './format.js';
import { named, t } from './texts.js';
import { faultMeaning, faultRemedy, told } from './told.js';
import { word } from './vocabulary.js';

const FRAME = [
  ['state', status => word(status.state)],
  ['frequency', status => quantity(status.output_frequency_hz, 1, 'Hz')],
  ['current', status => typeof status.current_a === 'number' ? quantity(status.current_a, 1, 'A') : quantity(status.current_percent, 0, '%')],
  ['control', status => (status.control ? word(status.control) : MISSING)],
  ['words', status => (status.raw ?? []).map(({ code, address, value }) => `${code ?? address} ${hex(value)}`).join(' ') || MISSING],
];

/** The panel of the fault of the drive `name`: `element`, `update(drive)`. */
export function faultPanel(name) {
  const element = el('section.panel.fault', { 'aria-label': t('fault'), hidden: true });
  let shown = '';
  return { element, update };

  function update(drive) {
    const { fault, status } = drive;
    const tripped = Boolean(fault) || status?.state === 'fault' || status?.state === 'fault_reaction';
    element.hidden = !tripped;
    const now = JSON.stringify([tripped, fault, status?.fault_code]);
    if (now === shown) return;
    shown = now;
    element.replaceChildren(...(tripped ? content(drive, fault ?? { code: status.fault_code ?? '' }) : []));
  }

  function content(drive, fault) {
    const remedy = faultRemedy(fault);
    const said = el('div', {},
      el('h2', {}, t('fault_of', { code: fault.code ?? '', mnemonic: fault.mnemonic ?? '' })),
      el('p.meaning', {}, faultMeaning(fault)),
      ...(remedy ? [el('p', {}, el('b', {}, named(t('what_to_do'), '')), remedy)] : []),
      ...(fault.by_watchdog ? [el('p', {}, t('by_watchdog'))] : []),
      history(drive));
    return fault.before || fault.at_trip ? [said, frame(fault)] : [said];
  }

  function frame(fault) {
    const columns = [['before_trip', fault.before], ['at_trip', fault.at_trip]].filter(([, status]) => status);
    return el('div.wide', {}, table(`${t('freeze_frame')}, ${clock(fault.time_unix_ms)}`, [t('what'), ...columns.map(([text]) => t(text))],
      FRAME.map(([text, value]) => el('tr', {}, el('th', { scope: 'row' }, t(text)), ...columns.map(([, status]) => el('td', {}, value(status)))))));
  }

  function history(drive) {
    const place = el('div');
    return el('details', { ontoggle: ({ target }) => target.open && readHistory(place, drive) }, el('summary', {}, t('fault_history')), place);
  }
}

/** The history that the drive itself keeps, read when somebody asks for it. */
export async function readHistory(place, drive) {
  try {
    const { history = [] } = await read(path('drives', drive.name, 'faults'));
    place.replaceChildren(history.length ? el('ol.history', {}, ...history.map(({ entry, ...past }) => {
      const fault = { ...past, ...entry };
      const remedy = faultRemedy(fault);
      return el('li', {}, el('b', {}, `${fault.code ?? ''} ${fault.mnemonic ?? ''} `), faultMeaning(fault),
        remedy ? el('small', {}, ` – ${remedy}`) : null);
    })) : el('p', {}, t('history_empty')));
  } catch (problem) {
    place.replaceChildren(el('p.bad', {}, told(problem.message)));
  }
}

function hex(value) {
  return `${value.toString(16).toUpperCase().padStart(4, '0')}h`;
}
