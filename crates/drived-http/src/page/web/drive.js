// One drive: its values large, its trend, its fault, its commands, and everything that is known of it.

import { read, path } from './api.js';
import { el, setAttribute, setText } from './dom.js';
import { faultPanel } from './drive_faults.js';
import { ordersPanel } from './drive_orders.js';
import { tablesPanel } from './drive_tables.js';
import { MISSING, old, quantity } from './format.js';
import { givenBy, lastSetpoint } from './given.js';
import { age, plant, quality, takeDrive } from './plant.js';
import { named, t } from './texts.js';
import { langOf, told } from './told.js';
import { trend } from './trend.js';
import { trouble } from './trouble.js';
import { word } from './vocabulary.js';
import { currentText, frequencyText, setpointOf, setpointText, stateWord } from './words.js';

/** Measurements are read seldom: what is older than this says so, though it is the latest that there is. */
const DATED_FROM_MS = 3_000;
const SAID_MS = 12_000;

const BIG = [
  ['frequency', drive => frequencyText(drive.status), 'status'],
  ['setpoint', drive => setpointText(setpointOf(drive)), drive => drive.setpoint ? undefined : 'status'],
  ['current', drive => currentText(drive.status), 'status'],
  ['torque', drive => quantity(drive.measurements?.torque_percent, 0, '%'), 'measurements'],
  ['speed', drive => quantity(drive.measurements?.speed_rpm, 0, t('rpm')), 'measurements'],
  ['output_power', drive => typeof drive.measurements?.output_power_kw === 'number'
    ? quantity(drive.measurements.output_power_kw, 2, 'kW') : quantity(drive.measurements?.power_percent, 0, '%'), 'measurements'],
];

/** Shows the drive `name` in `root`. */
export function drive(root, name) {
  let shown = plant.drives.get(name);
  if (!shown) {
    root.append(el('h1', { tabindex: -1 }, name), el('p', {}, t('unknown_drive')), el('a', { href: '#/' }, t('overview')));
    return { update: () => plant.drives.has(name) && dispatchEvent(new HashChangeEvent('hashchange')) };
  }
  const state = el('b');
  const turns = el('span');
  const place = el('p.hint');
  const freshness = el('p.freshness');
  const head = el('header.drive-head', {},
    el('div', {}, el('h1', { tabindex: -1 }, name), place),
    el('p.state', {}, el('span.mark', { 'aria-hidden': 'true' }), state, turns), freshness);
  const remark = el('p.remark');
  const gaps = el('ul');
  let unseenBefore = '';
  const notKnown = el('details.panel', { hidden: true }, el('summary', {}, t('not_known_of')), gaps);
  const big = BIG.map(([text]) => el('div', {}, el('dt', {}, t(text)), el('dd.number'), el('dd.since')));
  const given = big[1].appendChild(el('dd.since'));
  let setpoint = setpointText(setpointOf(shown));
  let isAnother = false;
  const trendPlace = el('section.panel.trend', { 'aria-label': t('trend') });
  const fault = faultPanel(name);
  const orders = ordersPanel(name);
  const tables = tablesPanel(name);
  root.append(head, remark, fault.element, notKnown, el('dl.big', {}, ...big),
    el('div.columns', {}, trendPlace, orders.element), tables.element);
  const curve = trend(trendPlace, name);
  update(new Set(['state']));
  // The events bring a drive when it changes; here it is wanted as it is now.
  read(path('drives', name)).then(takeDrive, () => {});

  return {
    update,
    tick() {
      tick();
      curve.tick();
    },
    end() {
      curve.end();
      orders.end();
    },
  };

  /** Measurements are read seldom: after a trip they tell of the time before it. */
  function qualityOf(group) {
    return quality(shown[group], group === 'measurements' ? shown : undefined);
  }

  /** With what a value was read; nothing where nobody had to read it. */
  function groupOf(of) {
    return typeof of === 'function' ? of(shown) : of;
  }

  function update(names) {
    if (!names.has('state') && !names.has(`drive ${name}`) && !names.has('event')) return;
    const now = plant.drives.get(name);
    if (now && now.place !== shown.place) {
      if (!isAnother) say(t('now_another', { drive: name }));
      isAnother = true;
      return void dispatchEvent(new HashChangeEvent('hashchange'));
    }
    shown = now ?? shown;
    const status = shown.status ?? {};
    const { severity, text, remedy: first } = trouble(shown);
    setAttribute(head, 'data-state', severity === 'alarm' ? 'trouble' : status.state);
    setText(state, stateWord(shown));
    setText(turns, [status.direction && word(status.direction), status.control && named(t('control'), word(status.control))]
      .filter(Boolean).map(part => ` · ${part}`).join(''));
    setText(place, t('line_of', shown));
    place.title = shown.identity?.model ?? '';
    const said = shown.fault || status.state === 'fault' ? '' : [text, first].filter(Boolean).join(' – ');
    setText(remark, said);
    remark.hidden = !said;
    const unseen = shown.not_known ?? [];
    notKnown.hidden = !unseen.length;
    // As it is told: the French comes after the first values.
    const unseenNow = unseen.map(told).join('\n');
    if (unseenNow !== unseenBefore) gaps.replaceChildren(...unseen.map(one => el('li', langOf(one), told(one))));
    unseenBefore = unseenNow;
    BIG.forEach(([, value, of], index) => {
      const group = groupOf(of);
      setText(big[index].children[1], value(shown));
      setAttribute(big[index], 'data-quality', group ? qualityOf(group) : 'good');
    });
    tellSetpoint();
    fault.update(shown);
    orders.update(shown);
    tables.update(shown);
    tick();
  }

  /** Somebody else's setpoint is said when it comes, and who gave the present one stands beside it. */
  function tellSetpoint() {
    setText(given, givenBy(name));
    const now = setpointText(setpointOf(shown));
    const by = lastSetpoint(name);
    if (now === setpoint || !by || by.live === undefined) return;
    setpoint = now;
    if (by.caller === plant.daemon.caller || !by.live) return;
    say(named(name, t('given_by_now', { who: by.caller, value: now })));
  }

  function say(text) {
    const note = el('p', {}, text);
    document.getElementById('outcomes').prepend(note);
    setTimeout(() => note.remove(), SAID_MS);
  }

  function tick() {
    const ms = age(shown.status, shown);
    setText(freshness, quality(shown.status) === 'good' ? t('live') : ms === undefined ? MISSING : old(ms));
    setAttribute(freshness, 'data-quality', quality(shown.status));
    BIG.forEach(([, , of], index) => {
      const group = groupOf(of);
      const ms = group && age(shown[group], shown);
      // A status that is read again and again as it was is told anew every few seconds, and at once when it is too old: of a good one its
      // age counts as it was told.
      const counted = group === 'status' ? shown.status.age_ms : ms;
      const isDated = ms !== undefined && (qualityOf(group) === 'stale' || counted > DATED_FROM_MS);
      setText(big[index].children[2], isDated ? old(ms) : '');
    });
  }
}
