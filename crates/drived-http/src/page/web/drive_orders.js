// The commands of one drive, each with a question first but the stop, and what became of them.

import { path } from './api.js';
import { confirmed } from './ask.js';
import { el, setAttribute, setClass, setText } from './dom.js';
import { askToken } from './login.js';
import { command, isDone, onOrder, orderText, ordersOf } from './orders.js';
import { mayCommand, plant } from './plant.js';
import { isTripped } from './selection.js';
import { setpointControl } from './setpoint.js';
import { shown, shownToStart } from './shown.js';
import { t } from './texts.js';
import { told } from './told.js';
import { faultText } from './trouble.js';
import { word } from './vocabulary.js';
import { identityText, setpointText } from './words.js';

const STOPS = ['ramp', 'fast', 'freewheel', 'dc_injection'];
const SHOWN = 6;

/** Whether it says that it is another drive than before. */
const isAnother = drive => drive?.identity?.check === 'changed';

/** The panel of commands of the drive `name`: `element`, `update(drive)`, `end()`. */
export function ordersPanel(name) {
  const button = (text, act, more = {}) => el('button', { type: 'button', onclick: act, ...more }, t(text));
  // Whoever is called so later is not the one that this view is about.
  const own = shown([name]);
  const setpoint = setpointControl(value => order('setpoint', { setpoint: { frequency_hz: value } }));
  const forward = button('start_forward', () => start('forward'));
  const reverse = button('start_reverse', () => start('reverse'));
  const mode = el('select', { 'aria-label': t('stop_mode') }, ...STOPS.map(kind => el('option', { value: kind }, word(kind))));
  const stop = button('stop', () => order('stop', { mode: mode.value }), { 'data-order': 'stop' });
  const reset = button('reset', askReset, { 'data-order': 'reset' });
  const release = button('release', async () => await confirmed(own, t('confirm_release', { drive: name }), t('release')) && order('release'));
  const accept = button('accept', askAccept, { 'data-order': 'accept' });
  const moving = [setpoint.element, el('div.pair', {}, forward, reverse)];
  const stopping = el('div.pair', {}, stop, mode);
  const settling = el('div.pair', {}, reset, release);
  const logIn = button('log_in', askToken);
  const why = el('p.hint.why');
  const latest = el('ul.latest');
  const element = el('section.panel.orders', { 'aria-label': t('orders') },
    el('h2', {}, t('orders')), ...moving, stopping, settling, accept, why, logIn,
    el('h3', {}, t('latest_orders')), latest);
  const forget = onOrder(one => one.to === name && writeLatest());
  writeLatest();
  return { element, update, end: forget };

  function update(drive) {
    const tripped = isTripped(drive);
    const readOnly = drive.control === false;
    // What somebody may not do is not offered to him.
    const may = mayCommand(drive);
    for (const one of [...moving, settling]) one.hidden = !may;
    stopping.hidden = !plant.daemon.rights.stop;
    accept.hidden = !may || !plant.daemon.rights.engineer || !isAnother(drive);
    logIn.hidden = may || readOnly;
    setpoint.update(drive);
    for (const one of [forward, reverse]) one.disabled = readOnly || Boolean(drive.start_refused);
    reset.disabled = readOnly || !tripped;
    release.disabled = readOnly;
    setText(why, readOnly ? t('only_read_long') : [!may && t('may_not_command'), drive.start_refused && t('start_refused', { why: told(drive.start_refused) }),
      may && !tripped && t('reset_not_now')].filter(Boolean).join(' '));
    setAttribute(stop, 'disabled', readOnly);
  }

  async function start(direction) {
    const said = { drive: name, direction: t(`in_direction_${direction}`) };
    const expects = shownToStart([name]);
    const at = expects.drives[0]?.setpoint;
    const question = at ? t('confirm_start_at', { ...said, setpoint: setpointText(at) }) : t('confirm_start', said);
    // What the drive follows by somebody else's word is his to give.
    const given = plant.drives.get(name)?.setpoint;
    if (await confirmed(expects, question, t(`start_${direction}`))) order('start', { direction, expects, ...given ? { setpoint: given } : {} });
  }

  async function askReset() {
    const fault = faultText(plant.drives.get(name));
    const changed = () => {
      const drive = plant.drives.get(name);
      if (!isTripped(drive)) return t('now_no_fault', { drive: name });
      const now = faultText(drive);
      return now !== fault && t('now_fault', { drive: name, fault: now });
    };
    if (await confirmed(own, t('confirm_reset', { drive: name, fault }), t('reset'), { changed })) order('reset');
  }

  async function askAccept() {
    const { identity } = plant.drives.get(name);
    const now = identityText(identity);
    const changed = () => {
      const drive = plant.drives.get(name);
      if (!isAnother(drive)) return t('now_no_other', { drive: name });
      const is = identityText(drive.identity);
      return is !== now && t('now_identity', { drive: name, now: is });
    };
    const question = t('confirm_accept', { drive: name, now, before: identityText(identity.remembered) });
    if (await confirmed(own, question, t('accept'), { changed })) order('accept', { identity });
  }

  function order(action, body = {}) {
    return command(name, action, path('drives', name, action), { expects: own, ...body });
  }

  function writeLatest() {
    latest.replaceChildren(...ordersOf(name).slice(0, SHOWN).map(one => {
      const item = el('li', {}, orderText(one));
      setClass(item, 'bad', one.outcome !== 'pending' && !isDone(one));
      return item;
    }));
    latest.previousElementSibling.hidden = !latest.children.length;
  }
}
