// One drive as a row of the overview: made once, then only what has changed in it.

import { el, setAttribute, setClass, setText } from './dom.js';
import { MISSING, old } from './format.js';
import { age, quality } from './plant.js';
import { t } from './texts.js';
import { isTrouble, trouble } from './trouble.js';
import { word } from './vocabulary.js';
import { currentText, frequencyText, setpointOf, setpointText, stateWord } from './words.js';

const USUAL_HIGH_HZ = 50;
const ARROWS = { forward: '▶', reverse: '◀' };

/** The heads of the columns, in the order of a row's cells. */
export const COLUMNS = ['drive', 'state', 'frequency', 'current', 'note', 'control', 'age'];

const template = el('div.row', { role: 'row' },
  el('div.name', { role: 'rowheader' }, el('a'), el('small')),
  el('div.state', { role: 'cell' }, el('span.mark', { 'aria-hidden': 'true' }), el('b'), el('span.turns')),
  el('div.frequency', { role: 'cell' }, el('span.number'), ' ', el('small'), bar(true)),
  el('div.current', { role: 'cell' }, el('span.number'), bar(false)),
  el('div.note', { role: 'cell' }),
  el('div.control', { role: 'cell' }),
  el('div.age', { role: 'cell' }));

function bar(withSetpoint) {
  return el('span.meter', { 'aria-hidden': 'true' }, el('i.fill'), withSetpoint ? el('i.mark-setpoint') : null);
}

/** A row with `element`, `update(drive)` and `tick()`, which counts the age on. */
export function makeRow(drive) {
  const element = template.cloneNode(true);
  const [nameCell, stateCell, frequencyCell, currentCell, note, control, ageCell] = element.children;
  const [link, place] = nameCell.children;
  const [, state, turns] = stateCell.children;
  const [frequency, setpoint, frequencyBar] = frequencyCell.children;
  const [current, currentBar] = currentCell.children;
  let shown = drive;

  link.href = `#/drive/${encodeURIComponent(drive.name)}`;
  link.textContent = drive.name;

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
    setText(setpoint, held ? t('to_setpoint', { setpoint: setpointText(held) }) : '');
    const high = drive.limits?.high_hz ?? USUAL_HIGH_HZ;
    fill(frequencyBar, status.output_frequency_hz, high);
    placeMark(frequencyBar.lastChild, held?.frequency_hz, high);
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
  }

  update(drive);
  return { element, update, tick };
}

function fill(bar, value, high) {
  const share = typeof value === 'number' ? Math.min(Math.max(value / high, 0), 1) : 0;
  bar.firstChild.style.transform = `scaleX(${share.toFixed(3)})`;
}

function placeMark(mark, value, high) {
  mark.hidden = typeof value !== 'number';
  if (!mark.hidden) mark.style.left = `${(Math.min(Math.max(value / high, 0), 1) * 100).toFixed(1)}%`;
}
