// Who answers, by what it is known what he is, and what he is to be called.

import { el, setText } from './dom.js';
import { duration, quantity } from './format.js';
import { plant } from './plant.js';
import { t } from './texts.js';
import { told } from './told.js';

/** The panel of those who were found; `take(wanted)` has them watched. */
export function foundPanel(take) {
  let shown = '';
  let rows = [];
  const list = el('div.finds');
  const lineName = el('input', { type: 'text', required: true, autocomplete: 'off' });
  const nameField = el('label.field', {}, t('setup_line_name'), lineName);
  const two = el('p.hint', { hidden: true });
  const watch = el('button.primary', {}, t('setup_watch'));
  const said = el('p', { role: 'status' });
  const form = el('form', { onsubmit: submit }, list, two, el('div.buttons', {}, nameField, watch));
  const element = el('section.panel.setup', { hidden: true, 'aria-label': t('setup_is') }, form, said);
  return { element, update };

  /** What was typed stays: rows are added as they are found, and made anew when another scan has begun. */
  function update({ scan, families, drives }) {
    const isOver = scan && !['listening', 'asking'].includes(scan.state);
    const found = (scan?.found ?? []).filter(one => !isKnown(one, drives));
    element.hidden = !found.length && !said.textContent;
    form.hidden = !found.length;
    const now = JSON.stringify([scan?.line, found.map(one => [one.line, one.address, one.text])]);
    watch.disabled = !isOver;
    const line = mostOf(found);
    // The line that was added comes with the state, which may be later than the answer; another line is called anew.
    const there = [...plant.lines.values()].find(one => one.port === line)?.name;
    const isAnother = form.dataset.line !== (line ?? '');
    if (there ?? isAnother) lineName.value = there ?? usualLine(line ?? '');
    lineName.disabled = there !== undefined;
    form.dataset.line = line ?? '';
    if (now === shown) return;
    const before = new Map(rows.map(row => [row.key, row]));
    shown = now;
    rows = found.map(one => before.get(keyOf(one)) ?? makeRow(one, families, one.line === line));
    list.replaceChildren(...rows.map(row => row.element));
    two.hidden = found.every(one => one.line === line);
    setText(two, t('setup_two_lines', { line: line ?? '' }));
    write();
  }

  function write() {
    const chosen = rows.filter(row => row.box.checked);
    setText(watch, t(chosen.length === 1 ? 'setup_watch_one' : 'setup_watch'));
  }

  function makeRow(one, families, isOfLine) {
    const { address, verdict } = one;
    const isDrive = ['drive', 'unknown_slave'].includes(verdict) && isOfLine;
    const [first] = one.families;
    const box = el('input', { type: 'checkbox', 'aria-label': t('setup_take', { address }), disabled: !isDrive, checked: isDrive && verdict === 'drive', onchange: write });
    const alike = one.families.map(({ family }) => family);
    const rest = families.filter(({ name }) => !alike.includes(name));
    const option = ({ name, title }) => el('option', { value: name, selected: name === first?.family }, `${name} – ${title}`);
    const choose = () => {
      box.checked = family.value !== '';
      write();
    };
    const family = el('select', { 'aria-label': t('setup_family_of', { address }), disabled: !isDrive, onchange: choose },
      first ? null : el('option', { value: '' }, t('setup_choose')),
      ...families.filter(({ name }) => alike.includes(name)).map(option), ...rest.map(option));
    const name = el('input', { type: 'text', value: t('setup_usual_name', { address }), 'aria-label': t('setup_name_of', { address }), disabled: !isDrive, autocomplete: 'off' });
    const known = verdict === 'drive' ? [first.says, t(first.certain ? 'setup_certain' : 'setup_likely')].filter(Boolean).join(', ')
      : verdict === 'unknown_slave' ? t('setup_stranger') : t('setup_not', { why: told(one.text) });
    const fed = one.fed_every_ms ? t('setup_fed', { time: duration(one.fed_every_ms * 2) }) : '';
    const element = el('div.find', {}, el('label.check', {}, box, el('b.number', {}, quantity(address, 0))),
      el('span.known', {}, el('span', {}, known), el('small', {}, [one.setting, fed].filter(Boolean).join(' · '))), family, name);
    return { key: keyOf(one), element, box, address, family, name };
  }

  async function submit(event) {
    event.preventDefault();
    const chosen = rows.filter(row => row.box.checked);
    const open = chosen.find(row => !row.family.value);
    if (open) return void open.family.focus();
    if (!chosen.length) return;
    watch.disabled = true;
    const changes = await take({ name: lineName.value, line: form.dataset.line,
      drives: chosen.map(row => ({ address: row.address, family: row.family.value, name: row.name.value })) });
    watch.disabled = false;
    if (!changes) return;
    setText(said, t('setup_added', { names: chosen.map(row => row.name.value).join(', ') }));
  }
}

function keyOf({ line, address }) {
  return `${line} ${address}`;
}

function isKnown({ line, address }, drives) {
  return drives.some(one => Number(one.drive.split('@')[1]) === address && plant.lines.get(one.line)?.port === line);
}

/** The settings at which most answer: a port has one. */
function mostOf(found) {
  const counts = new Map();
  for (const { line, verdict } of found) counts.set(line, (counts.get(line) ?? 0) + (verdict === 'drive' ? 100 : 1));
  return [...counts].sort((one, other) => other[1] - one[1])[0]?.[0];
}

/** Lines are told by their ports until somebody has a better name. */
function usualLine(line) {
  const port = line.split(',')[0].replace(/^[a-z+]+:\/\//, '').split('/').at(-1);
  return plant.lines.size ? port : 'main';
}
