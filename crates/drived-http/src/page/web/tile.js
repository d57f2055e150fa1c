// One drive as a tile of the wall: what is read from three metres, and no more.

import { el, setAttribute, setText } from './dom.js';
import { ofDrive } from './place.js';
import { age, quality } from './plant.js';
import { old } from './format.js';
import { isTrouble, trouble } from './trouble.js';
import { frequencyText, stateWord } from './words.js';

/** A tile with `element` and `update(drive)`. */
export function makeTile(drive) {
  const name = el('b', {}, drive.name);
  const frequency = el('span.number');
  const state = el('span.state', {}, el('span.mark', { 'aria-hidden': 'true' }), el('span'));
  const note = el('span.note');
  const element = el('a.card', { href: ofDrive(drive.name), 'data-name': drive.name }, name, frequency, state, note);
  update(drive);
  return { element, update };

  function update(drive) {
    const worst = trouble(drive);
    const severe = worst.severity === 'alarm';
    const known = quality(drive.status);
    setAttribute(element, 'data-state', severe ? 'trouble' : drive.status?.state);
    setAttribute(element, 'data-trouble', severe ? 'severe' : isTrouble(worst) && 'minor');
    setAttribute(element, 'data-quality', known);
    setText(frequency, frequencyText(drive.status));
    const shows = stateWord(drive);
    setText(state.lastChild, shows);
    const remark = drive.fault?.mnemonic || worst.alike || (known === 'stale' ? old(age(drive.status, drive)) : '');
    // What its state says already is not said again.
    setText(note, remark.toLowerCase() === shows.toLowerCase() ? '' : remark);
  }
}
