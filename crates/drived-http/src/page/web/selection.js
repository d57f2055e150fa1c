// The drives that somebody has chosen, and what he may do with all of them at once: each command says first for how many it is.

import { confirmed } from './ask.js';
import { decimalField, read } from './decimal.js';
import { el, setText } from './dom.js';
import { quantity } from './format.js';
import { command } from './orders.js';
import { mayCommand, plant } from './plant.js';
import { shown as shownOf, shownToStart, shownToStop, withSetpoints } from './shown.js';
import { t } from './texts.js';

const NAMED = 12;

/** For which drives each command is one that is not refused. */
const FITS = {
  start: drive => mayCommand(drive) && drive.control && !drive.start_refused,
  stop: drive => plant.daemon.rights.stop && drive.control,
  setpoint: drive => mayCommand(drive) && drive.control,
  reset: drive => mayCommand(drive) && drive.control && isTripped(drive),
};

/** Whether a drive has a fault that can be reset. */
export function isTripped(drive) {
  return drive.status?.state === 'fault' || Boolean(drive.fault);
}

/** Whether anything can be done with drives that are chosen. */
export function mayChoose() {
  return Boolean(plant.daemon.rights.stop || plant.daemon.rights.operate);
}

/** The bar for the chosen names, a set; `changed()` is called when it is emptied. Gives `element`, `update(shown)`: the names that are shown. */
export function selectionBar(chosen, changed) {
  const count = el('b', { role: 'status' });
  const button = (action, act) => el('button', { type: 'button', 'data-order': action, onclick: act });
  const buttons = {
    start: button('start', askStart), stop: button('stop', askNothing),
    setpoint: button('setpoint', askSetpoint), reset: button('reset', askReset),
  };
  const none = el('button.quiet', { type: 'button', onclick: clear }, t('select_none'));
  const element = el('div.selection', { role: 'group', 'aria-label': t('orders'), hidden: true }, count, ...Object.values(buttons), none);
  return { element, update };

  function update(shown) {
    for (const name of chosen) if (!plant.drives.has(name)) chosen.delete(name);
    element.hidden = chosen.size === 0;
    const selected = chosen.size === 1 ? t('selected_one') : t('selected', { count: chosen.size });
    // Whom a search or a filter hides is commanded all the same.
    const hidden = [...chosen].filter(name => !shown.has(name)).length;
    setText(count, hidden ? t('selected_unseen', { selected, count: hidden }) : selected);
    for (const [action, one] of Object.entries(buttons)) {
      const fit = fitting(action);
      one.hidden = fit.length === 0;
      setText(one, t(`${action}_these`, { count: fit.length }));
    }
  }

  function clear() {
    chosen.clear();
    changed();
  }

  /** One that has left the plant since keeps no command from the others. */
  function fitting(action) {
    return [...chosen].filter(name => plant.drives.has(name) && FITS[action](plant.drives.get(name)));
  }

  function give(action, names, body) {
    command(t('selected', { count: names.length }), action, `selected/${action}`, { drives: names, ...body });
  }

  function askNothing() {
    const names = fitting('stop');
    give('stop', names, shownToStop(names));
  }

  async function askStart() {
    const names = fitting('start');
    const expects = shownToStart(names);
    const asked = question('confirm_start_these', names, withSetpoints(expects));
    if (await confirmed(expects, asked, t('start_these', { count: names.length }))) give('start', names, { direction: 'forward', expects });
  }

  async function askReset() {
    const names = fitting('reset');
    const expects = shownOf(names);
    if (await confirmed(expects, question('confirm_reset_these', names), t('reset_these', { count: names.length }))) give('reset', names, { expects });
  }

  async function askSetpoint() {
    const all = fitting('setpoint');
    const expects = shownOf(all);
    const [low, high] = limitsOf(all);
    const said = t('limits_are', { low: quantity(low, 1), high: quantity(high, 1, 'Hz') });
    const field = decimalField({ required: true }, hertz => hertz < low || hertz > high ? said : '');
    const label = el('label.field', {}, `${t('setpoint')} (Hz). ${said}`, field);
    if (!await confirmed(expects, question('confirm_setpoint_these', all), t('set'), { field: label })) return;
    give('setpoint', all, { setpoint: { frequency_hz: read(field) }, expects });
  }

  /** Who is commanded, and who of the chosen is not. */
  function question(text, names, told = names) {
    const out = [...chosen].filter(name => !names.includes(name));
    return [t(text, { count: names.length }), t('these_are', { names: listed(told) }), out.length && t('left_out', { names: listed(out) })]
      .filter(Boolean).join(' ');
  }
}

/** The first of many. */
export function listed(names) {
  const first = names.slice(0, NAMED).join(', ');
  return names.length > NAMED ? t('and_more', { names: first, count: names.length - NAMED }) : first;
}

/** What every one of these may be given, in hertz. */
function limitsOf(names) {
  const limits = names.map(name => plant.drives.get(name).limits ?? {});
  return [Math.max(0, ...limits.map(one => one.low_hz ?? 0)), Math.min(...limits.map(one => one.high_hz ?? 50))];
}
