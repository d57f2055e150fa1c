// The drives that were added here: how they are now, and for which of them commands are taken.

import { confirmed } from './ask.js';
import { el, setAttribute, setText } from './dom.js';
import { old, MISSING } from './format.js';
import { ofDrive } from './place.js';
import { age, plant, quality } from './plant.js';
import { shown as shownOf } from './shown.js';
import { t } from './texts.js';
import { langOf, told } from './told.js';
import { trouble } from './trouble.js';
import { frequencyText, stateWord } from './words.js';

/** The panel of the added drives; `change(drive, control)` has commands taken for one, or not. */
export function addedPanel(change) {
  const rows = new Map();
  let file = '';
  const list = el('div.added');
  const element = el('section.panel.setup', { hidden: true, 'aria-label': t('setup_here') }, el('h2', {}, t('setup_here')), list);
  return { element, show, update, tick: update };

  function show(view, may) {
    const { drives } = view;
    file = view.file ?? '';
    element.hidden = !drives.length;
    const names = drives.map(({ name }) => name);
    for (const name of [...rows.keys()]) if (!names.includes(name)) rows.delete(name);
    for (const one of drives) {
      if (!rows.has(one.name)) rows.set(one.name, makeRow(one.name));
      rows.get(one.name).show(one, may);
    }
    if (list.children.length !== rows.size || [...rows.values()].some(row => !row.element.isConnected)) list.replaceChildren(...names.map(name => rows.get(name).element));
    update();
  }

  function update() {
    for (const row of rows.values()) row.update();
  }

  function makeRow(name) {
    let isControlled = false;
    let guessed;
    const state = el('b');
    const note = el('small');
    const frequency = el('span.number');
    const fresh = el('span.age');
    const takes = el('span.takes');
    const button = el('button', { type: 'button', onclick: press });
    const element = el('div.find', { 'data-name': name },
      el('a', { href: ofDrive(name) }, name),
      el('span.state', {}, el('span.mark', { 'aria-hidden': 'true' }), state, note), frequency, fresh, takes, button);
    return { element, show, update };

    function show(one, may) {
      isControlled = one.control;
      guessed = one.guessed ? one.drive.split('@')[0] : undefined;
      const is = t(one.control ? 'setup_controlled' : 'setup_look');
      setText(takes, guessed ? `${is} · ${t('setup_guessed', { family: guessed })}` : is);
      setText(button, t(one.control ? 'setup_give' : 'setup_control'));
      setAttribute(button, 'aria-label', t(one.control ? 'setup_give_of' : 'setup_control_of', { drive: name }));
      button.hidden = !may;
    }

    function update() {
      const drive = plant.drives.get(name);
      // Nothing of what it showed last stands for what it does now.
      if (!drive) return void blank();
      const known = quality(drive.status);
      const ms = age(drive.status, drive);
      const worst = trouble(drive);
      setAttribute(element, 'data-state', worst.severity === 'alarm' ? 'trouble' : drive.status?.state);
      setAttribute(element, 'data-quality', known);
      setText(state, stateWord(drive));
      setText(note, worst.text);
      setText(frequency, frequencyText(drive.status));
      setText(fresh, known === 'good' ? t('live') : ms === undefined ? MISSING : old(ms));
    }

    function blank() {
      for (const attribute of ['data-state', 'data-quality']) setAttribute(element, attribute, undefined);
      setText(state, t('setup_gone'));
      for (const part of [note, frequency, fresh]) setText(part, '');
    }

    async function press() {
      const to = !isControlled;
      const unseen = plant.drives.get(name)?.not_known ?? [];
      const doubts = to ? [guessed && el('p.remark', {}, t('setup_confirm_guess', { family: guessed, file })),
        ...(unseen.length ? [el('p', {}, t('not_known_of')), el('ul.history', {}, ...unseen.map(one => el('li', langOf(one), told(one))))] : [])].filter(Boolean) : [];
      const shown = doubts.length ? el('div', {}, ...doubts) : undefined;
      if (!await confirmed(shownOf([name]), t(to ? 'setup_confirm_control' : 'setup_confirm_give', { drive: name }), button.textContent, { field: shown })) return;
      button.disabled = true;
      await change(name, to);
      button.disabled = false;
      button.focus();
    }
  }
}
