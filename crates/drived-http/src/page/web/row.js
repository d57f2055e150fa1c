// One drive as a row of the overview: made once, then only what has changed in it.

import { curveOf, drawCurve } from './curves.js';
import { el, setAttribute, setClass, setText } from './dom.js';
import { MISSING, old } from './format.js';
import { givenBy } from './given.js';
import { ofDrive } from './place.js';
import { age, quality } from './plant.js';
import { t } from './texts.js';
import { isTrouble, trouble } from './trouble.js';
import { word } from './vocabulary.js';
import { currentText, deviationText, frequencyText, setpointOf, setpointText, stateWord } from './words.js';

const USUAL_HIGH_HZ = 50;
const ARROWS = { forward: '▶', reverse: '◀' };

/** The heads of the columns, in the order of a row's cells behind its box. */
export const COLUMNS = ['drive', 'state', 'frequency', 'deviation', 'current', 'curve', 'note', 'control', 'age'];

const template = el('div.row', { role: 'row' },
  el('div.select', { role: 'cell' }, el('label', {}, el('input', { type: 'checkbox' }))),
  el('div.name', { role: 'rowheader' }, el('a'), el('small')),
  el('div.state', { role: 'cell' }, el('span.mark', { 'aria-hidden': 'true' }), el('b'), el('span.turns')),
  el('div.frequency', { role: 'cell' }, el('span.number'), ' ', el('small'), bar(true)),
  el('div.deviation', { role: 'cell' }, el('span.number')),
  el('div.current', { role: 'cell' }, el('span.number'), bar(false)),
  el('div.curve', { role: 'cell' }),
  el('div.note', { role: 'cell' }),
  el('div.control', { role: 'cell' }),
  el('div.age', { role: 'cell' }));

function bar(withSetpoint) {
  return el('span.meter', { 'aria-hidden': 'true' }, el('i.fill'), withSetpoint ? el('i.mark-setpoint') : null);
}

/** A row with `element`, `update(drive)`, `choose(isChosen)` and `tick()`, which counts the age on; its box calls `chosen(name, isChosen)`. */
export function makeRow(drive, chosen) {
  const element = template.cloneNode(true);
  const [selectCell, nameCell, stateCell, frequencyCell, deviationCell, currentCell, curveCell, note, control, ageCell] = element.children;
  const box = selectCell.querySelector('input');
  const [link, place] = nameCell.children;
  const [, state, turns] = stateCell.children;
  const [frequency, setpoint, frequencyBar] = frequencyCell.children;
  const [current, currentBar] = currentCell.children;
  const curve = curveOf(curveCell);
  let shown = drive;

  element.dataset.name = drive.name;
  link.href = ofDrive(drive.name);
  link.textContent = drive.name;
  box.setAttribute('aria-label', t('select_one', { drive: drive.name }));
  box.addEventListener('change', () => chosen(drive.name, box.checked));

  function update(drive) {
    shown = drive;
    const status = drive.status ?? {};
    const known = quality(status);
    const worst = trouble(drive);
    const severe = worst.severity === 'alarm';
    setAttribute(element, 'data-state', severe ? 'trouble' : status.state);
    setAttribute(element, 'data-trouble', severe ? 'severe' : isTrouble(worst) && 'minor');
    setAttribute(element, 'data-quality', known);
    setText(place, `${drive.line} · ${drive.slave} · ${drive.family}`);
    setText(state, stateWord(drive));
    setText(turns, status.direction && status.output_frequency_hz !== 0 ? `${ARROWS[status.direction] ?? ''} ${word(status.direction)}` : '');
    setText(frequency, frequencyText(status));
    const held = setpointOf(drive);
    const by = givenBy(drive.name, true);
    setText(setpoint, held ? [t('to_setpoint', { setpoint: setpointText(held) }), by].filter(Boolean).join(' · ') : '');
    const high = drive.limits?.high_hz ?? USUAL_HIGH_HZ;
    fill(frequencyBar, status.output_frequency_hz, high);
    placeMark(frequencyBar.lastChild, held?.frequency_hz, high);
    setText(deviationCell.firstChild, deviationText(drive));
    setText(current, currentText(status));
    setClass(currentBar, 'unknown', typeof status.current_percent !== 'number');
    fill(currentBar, status.current_percent, 100);
    setText(note, worst.text);
    note.title = worst.remedy;
    setText(control, status.control ? word(status.control) : MISSING);
    tick();
  }

  function tick() {
    const known = quality(shown.status);
    const ms = age(shown.status, shown);
    setText(ageCell, known === 'good' ? t('live') : ms === undefined ? MISSING : old(ms));
    drawCurve(curve, shown);
  }

  update(drive);
  return { element, update, tick, choose: isChosen => (box.checked = isChosen) };
}

function fill(bar, value, high) {
  const share = typeof value === 'number' ? Math.min(Math.max(value / high, 0), 1) : 0;
  bar.firstChild.style.transform = `scaleX(${share.toFixed(3)})`;
}

function placeMark(mark, value, high) {
  mark.hidden = typeof value !== 'number';
  if (!mark.hidden) mark.style.left = `${(Math.min(Math.max(value / high, 0), 1) * 100).toFixed(1)}%`;
}
