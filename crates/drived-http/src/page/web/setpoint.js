// The control of a setpoint, with the drive's limits and forbidden bands drawn into it.

import { decimalField, read, write } from './decimal.js';
import { el, setAttribute, setText } from './dom.js';
import { quantity } from './format.js';
import { t } from './texts.js';
import { setpointOf } from './words.js';

const USUAL_HIGH_HZ = 50;
const STEP_HZ = 0.1;

/** A control that calls `send(hertz)`: `element`, `update(drive)`. */
export function setpointControl(send) {
  const slider = el('input', { type: 'range', step: STEP_HZ, 'aria-label': t('setpoint') });
  const field = decimalField({ 'aria-label': `${t('setpoint')} (Hz)` });
  const bands = el('div.bands', { 'aria-hidden': 'true' });
  const said = el('p.hint', { 'aria-live': 'polite' });
  const give = el('button', {}, t('set'));
  const element = el('form.setpoint', { onsubmit: submit }, el('label.field', {}, `${t('set_setpoint')} (Hz)`),
    el('div.track', {}, bands, slider), el('div.pair', {}, field, give), said);
  let limits = {};
  let readOnly = false;
  let touched = false;
  let drawn = '';

  slider.addEventListener('input', () => choose(() => write(field, slider.value)));
  // What is written is left as it is: whoever writes it has not come to its end.
  field.addEventListener('input', () => choose(() => { slider.value = read(field) ?? slider.value; }));
  return { element, update };

  function update(drive) {
    limits = { low: drive.limits?.low_hz ?? 0, high: drive.limits?.high_hz ?? USUAL_HIGH_HZ, forbidden: drive.limits?.forbidden_hz ?? [] };
    readOnly = drive.control === false;
    setAttribute(slider, 'min', limits.low);
    setAttribute(slider, 'max', limits.high);
    slider.disabled = field.disabled = readOnly;
    // Nobody's choice is pulled from under his finger by what the drive reports.
    if (!touched) {
      const held = setpointOf(drive)?.frequency_hz;
      // Nor what is selected to be written over.
      if (document.activeElement !== field) write(field, held);
      slider.value = held ?? limits.low;
    }
    draw(drive);
    judge();
  }

  function draw(drive) {
    const output = drive.status?.output_frequency_hz;
    const now = JSON.stringify([limits, output]);
    if (now === drawn) return;
    drawn = now;
    bands.replaceChildren(
      ...limits.forbidden.map(([from, to]) => part('i.forbidden', from, to)),
      ...(typeof output === 'number' ? [part('i.output', limits.low, output)] : []));
  }

  function part(name, from, to) {
    const share = value => (Math.min(Math.max(value, limits.low), limits.high) - limits.low) / (limits.high - limits.low || 1) * 100;
    const mark = el(name);
    mark.style.left = `${share(from)}%`;
    mark.style.width = `${share(to) - share(from)}%`;
    return mark;
  }

  function choose(follow) {
    touched = true;
    follow();
    judge();
  }

  function judge() {
    const value = read(field);
    const isNone = value === undefined && field.value.trim() !== '';
    const band = limits.forbidden.find(([from, to]) => value > from && value < to);
    const range = ([from, to]) => `${quantity(from, 1)}–${quantity(to, 1, 'Hz')}`;
    give.disabled = readOnly || value === undefined || Boolean(band) || value < limits.low || value > limits.high;
    setText(said, [isNone ? t('no_number') : band ? t('forbidden_now', { value: quantity(value, 1, 'Hz') }) : t('limits_are', { low: quantity(limits.low, 1), high: quantity(limits.high, 1, 'Hz') }),
      limits.forbidden.length ? t('forbidden_are', { bands: limits.forbidden.map(range).join(', ') }) : ''].filter(Boolean).join('. '));
    said.classList.toggle('bad', isNone || Boolean(band));
  }

  function submit(event) {
    event.preventDefault();
    if (give.disabled) return;
    touched = false;
    send(read(field));
  }
}
