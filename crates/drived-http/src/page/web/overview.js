// All drives, trouble first, with the lines' health above them.

import { path } from './api.js';
import { confirmed } from './ask.js';
import { arrange, el, setAttribute, setClass, setText } from './dom.js';
import { quantity } from './format.js';
import { command } from './orders.js';
import { mayCommand, plant, quality } from './plant.js';
import { COLUMNS, makeRow } from './row.js';
import { named, t } from './texts.js';
import { isTrouble, trouble } from './trouble.js';
import { word } from './vocabulary.js';
import { stateWord } from './words.js';

/** Rows that are shown at once, and how many more each frame: the worst are read while the rest is made. */
const ROWS_AT_ONCE = 24;

const MOVING = new Set(['running', 'stopping', 'quick_stop', 'fault_reaction']);
const STANDING = new Set(['at_rest', 'held']);
const FILTERS = {
  all: () => true,
  trouble: drive => isTrouble(trouble(drive)),
  running_drives: drive => MOVING.has(drive.status?.state),
  // What stands is known to: no output is not standstill, and of a drive that is lost nobody knows.
  standing_drives: drive => quality(drive.status) === 'good' && STANDING.has(drive.status.motion),
};

/** What the user looks for stays when he comes back. */
const asked = { search: '', filter: 'all', group: '' };

/** Shows the overview in `root`. */
export function overview(root) {
  const rows = new Map();
  let room = ROWS_AT_ONCE;
  const tiles = new Map();
  const strip = el('section.strip', { 'aria-label': t('lines') });
  const filters = Object.keys(FILTERS).map(name =>
    el('button.chip', { type: 'button', 'data-filter': name, onclick: () => ask({ filter: name }) }));
  const search = el('input', { type: 'search', value: asked.search, 'aria-label': t('search'),
    placeholder: named(t('search'), t('search_hint')), oninput: () => ask({ search: search.value }) });
  const group = el('select', { 'aria-label': t('group'), onchange: () => ask({ group: group.value }) });
  const startGroup = el('button', { type: 'button', onclick: () => orderGroup('start') }, t('start_group'));
  const stopGroup = el('button', { type: 'button', onclick: () => orderGroup('stop') }, t('stop_group'));
  const groupOrders = el('span.group-orders', { hidden: true }, startGroup, stopGroup);
  const body = el('div.rows', { role: 'rowgroup' });
  const nothing = el('p.hint', { hidden: true }, t('nothing_found'));

  root.append(
    el('h1.unseen', { tabindex: -1 }, t('overview')), strip,
    el('div.tools', {}, el('div.chips', { role: 'group', 'aria-label': t('state') }, ...filters), search, group, groupOrders),
    el('div.drives', { role: 'table', 'aria-label': t('overview') },
      el('div.row.head', { role: 'row' }, ...COLUMNS.map(name => el(`div.${name}`, { role: 'columnheader' }, t(name)))),
      body),
    nothing);
  fillGroups();
  update(new Set(['state']));
  return { update, tick: () => rows.forEach(row => row.tick()) };

  function ask(changes) {
    Object.assign(asked, changes);
    order();
  }

  function update(names) {
    const all = names.has('state');
    if (all) fillGroups();
    for (const [name, row] of rows) {
      const drive = plant.drives.get(name);
      if (!drive) rows.delete(name);
      else if (all || names.has(`drive ${name}`)) row.update(drive);
    }
    updateStrip();
    order();
  }

  function order() {
    const drives = [...plant.drives.values()];
    const members = plant.groups.find(one => one.name === asked.group)?.drives;
    const inGroup = members ? drives.filter(drive => members.includes(drive.name)) : drives;
    for (const chip of filters) {
      const name = chip.dataset.filter;
      const count = inGroup.filter(FILTERS[name]).length;
      setText(chip, `${t(name)} ${count}`);
      setAttribute(chip, 'aria-pressed', String(name === asked.filter));
      setClass(chip, 'some', name === 'trouble' && count > 0);
    }
    const words = asked.search.toLowerCase().split(/\s+/).filter(Boolean);
    const shown = inGroup.filter(FILTERS[asked.filter]).filter(drive => fits(drive, words));
    // The order of the configuration among equals: a row moves only when its trouble begins or ends.
    const ranked = shown.map(drive => [trouble(drive).rank, drive.name]).sort((a, b) => a[0] - b[0]);
    arrange(body, ranked.slice(0, room).map(([, name]) => rowOf(name).element));
    if (room < ranked.length) setTimeout(more);
    nothing.hidden = shown.length > 0 || plant.drives.size === 0;
    groupOrders.hidden = !members;
    startGroup.hidden = !inGroup.every(mayCommand);
    stopGroup.hidden = !plant.daemon.rights.stop;
  }

  function more() {
    room += ROWS_AT_ONCE;
    if (root.contains(body)) requestAnimationFrame(order);
  }

  function rowOf(name) {
    if (!rows.has(name)) rows.set(name, makeRow(plant.drives.get(name)));
    return rows.get(name);
  }

  function updateStrip() {
    for (const [name, line] of plant.lines) {
      if (!tiles.has(name)) tiles.set(name, makeTile(name));
      tiles.get(name)(line);
    }
    arrange(strip, [...plant.lines.keys()].map(name => tiles.get(name).element));
  }

  function fillGroups() {
    group.replaceChildren(el('option', { value: '' }, named(t('group'), t('all'))),
      ...plant.groups.map(one => el('option', { value: one.name, selected: one.name === asked.group }, one.name)));
    group.hidden = plant.groups.length === 0;
  }

  async function orderGroup(action) {
    const chosen = plant.groups.find(one => one.name === asked.group);
    if (action === 'start'
      && !await confirmed(chosen.drives, t('confirm_start_group', { count: chosen.drives.length, group: chosen.name }), t('start_group'))) return;
    command(chosen.name, action, path('groups', chosen.name, action));
  }
}

/** A line in the strip: a link with its name, its utilisation and how many of its drives answer. */
function makeTile(name) {
  const title = el('b', {}, name);
  const load = el('span.number');
  const drives = el('span.counted');
  const meter = el('span.meter', { 'aria-hidden': 'true' }, el('i.fill'));
  const element = el('a.tile', { href: `#/line/${encodeURIComponent(name)}` }, title, load, meter, drives);
  const update = line => {
    const members = [...plant.drives.values()].filter(drive => drive.line === name);
    const connected = members.filter(drive => drive.link === 'connected').length;
    setText(load, quantity(line.utilisation_percent, 0, '%'));
    meter.firstChild.style.transform = `scaleX(${Math.min((line.utilisation_percent ?? 0) / 100, 1).toFixed(3)})`;
    setText(drives, line.link === 'away' ? t('line_away') : t('line_health', { connected, count: members.length }));
    setClass(element, 'in-trouble', line.link === 'away' || connected < members.length);
  };
  return Object.assign(update, { element });
}

function fits(drive, words) {
  const text = [drive.name, drive.line, drive.family, drive.slave, stateWord(drive), trouble(drive).text, drive.fault?.mnemonic,
    drive.fault?.code, word(drive.status?.control)].join(' ').toLowerCase();
  return words.every(one => text.includes(one));
}
