// All drives, trouble first, with the lines' health above them: a list to work in, or tiles for a screen on the wall.

import { path } from './api.js';
import { confirmed } from './ask.js';
import { arrange, el, setAttribute, setClass, setText } from './dom.js';
import { folds, makeFold } from './fold.js';
import { load } from './format.js';
import { command } from './orders.js';
import { here, keepAsked } from './place.js';
import { mayCommand, plant, quality } from './plant.js';
import { COLUMNS, makeRow } from './row.js';
import { found } from './search.js';
import { isTripped, listed, mayChoose, selectionBar } from './selection.js';
import { severalPanel } from './several.js';
import { shown as shownOf, shownToStart, shownToStop, withSetpoints } from './shown.js';
import { isSortable, sorted } from './sort.js';
import { named, t } from './texts.js';
import { makeTile } from './tile.js';
import { isTrouble, trouble } from './trouble.js';
import { word } from './vocabulary.js';
import { deviationOf, stateWord } from './words.js';

/** Rows that are shown at once, and how many more each frame: the worst are read while the rest is made. */
const ROWS_AT_ONCE = 24;
/** As the rule of the alerts has it. */
const OFF_SETPOINT_HZ = 2;

const MOVING = new Set(['running', 'stopping', 'quick_stop', 'fault_reaction']);
const UNDRIVEN = new Set(['at_rest', 'held', 'coasting']);
const FILTERS = {
  all: () => true,
  trouble: drive => isTrouble(trouble(drive)),
  // One that stands in a quick stop is none.
  running_drives: drive => MOVING.has(drive.status?.state) && !UNDRIVEN.has(drive.status.motion),
  // Of a drive that is lost nobody knows whether it is driven.
  undriven_drives: drive => quality(drive.status) === 'good' && UNDRIVEN.has(drive.status.motion),
  off_setpoint: drive => Math.abs(deviationOf(drive) ?? 0) > OFF_SETPOINT_HZ,
};

/** Whom somebody has chosen, and which folds he has opened, stays when he comes back; what he asks for stands in the address. */
const chosen = new Set();
const opened = new Set();

/** Shows the overview in `root`; all rows at once for who comes back to a place in it. */
export function overview(root, _, isBack) {
  const asked = { search: '', filter: '', group: '', sort: '', view: '', ...Object.fromEntries(here().asked) };
  if (!FILTERS[asked.filter]) asked.filter = '';
  const rows = new Map();
  const cards = new Map();
  const foldRows = new Map();
  let room = isBack ? Infinity : ROWS_AT_ONCE;
  const tiles = new Map();
  const strip = el('section.strip', { 'aria-label': t('lines') });
  const filters = Object.keys(FILTERS).map(name =>
    el('button.chip', { type: 'button', 'data-filter': name, onclick: () => ask({ filter: name === 'all' ? '' : name }) }));
  const search = el('input', { type: 'search', value: asked.search, 'aria-label': t('search'),
    placeholder: named(t('search'), t('search_hint')), oninput: () => ask({ search: search.value }) });
  const group = el('select', { 'aria-label': t('group'), onchange: () => ask({ group: group.value }) });
  const sortBy = el('select.sort', { 'aria-label': t('sort_by'), onchange: () => ask({ sort: sortBy.value }) },
    el('option', { value: '' }, named(t('sort_by'), t('sort_trouble'))),
    ...COLUMNS.filter(isSortable).flatMap(name => [el('option', { value: name }, t('sort_of', { what: t(name) })), el('option', { value: `-${name}` }, t('sort_down', { what: t(name) }))]));
  const shape = el('button.shape', { type: 'button', onclick: () => ask({ view: asked.view ? '' : 'tiles' }) });
  const startGroup = el('button', { type: 'button', onclick: () => orderGroup('start') }, t('start_group'));
  const stopGroup = el('button', { type: 'button', onclick: () => orderGroup('stop') }, t('stop_group'));
  const resetGroup = el('button', { type: 'button', onclick: () => orderGroup('reset') }, t('reset_group'));
  const groupOrders = el('span.group-orders', { hidden: true }, startGroup, stopGroup, resetGroup);
  const selection = selectionBar(chosen, order);
  const several = severalPanel();
  const body = el('div.rows', { role: 'rowgroup' });
  const wall = el('div.wall', { hidden: true });
  const said = el('span');
  const begin = el('a.button', { href: '#/setup' }, t('setup'));
  const nothing = el('p.nothing', { hidden: true }, said, ' ', begin);
  const allBox = el('input', { type: 'checkbox', 'aria-label': t('select_all'), onchange: () => chooseShown(allBox.checked) });
  const heads = new Map(COLUMNS.map(name => [name, el(`div.${name}`, { role: 'columnheader' },
    isSortable(name) ? el('button', { type: 'button', onclick: () => ask({ sort: asked.sort === name ? `-${name}` : asked.sort === `-${name}` ? '' : name }) }, t(name)) : t(name))]));
  const list = el('div.drives', { role: 'table', 'aria-label': t('overview') },
    el('div.row.head', { role: 'row' }, el('div.select', { role: 'columnheader' }, el('label', {}, allBox)), ...heads.values()), body);
  let shown = [];

  root.append(
    el('h1.unseen', { tabindex: -1 }, t('overview')), strip,
    el('div.tools', {}, el('div.chips', { role: 'group', 'aria-label': t('state') }, ...filters), search, group, sortBy, shape, groupOrders),
    selection.element, several.element, list, wall, nothing);
  fillGroups();
  update(new Set(['state']));
  return {
    update, end: several.end,
    tick: () => rows.forEach(row => row.tick()),
    rowAt: y => [...body.children].find(row => row.getBoundingClientRect().bottom > y),
  };

  function ask(changes) {
    Object.assign(asked, changes);
    keepAsked(asked);
    order(true);
  }

  function update(names) {
    const all = names.has('state');
    if (all) fillGroups();
    for (const made of [rows, cards]) {
      for (const [name, one] of made) {
        const drive = plant.drives.get(name);
        if (!drive) made.delete(name);
        else if (all || names.has('event') || names.has(`drive ${name}`)) one.update(drive);
      }
    }
    updateStrip();
    order();
  }

  function order(isAsked = false) {
    const drives = [...plant.drives.values()];
    const members = plant.groups.find(one => one.name === asked.group)?.drives;
    const inGroup = members ? drives.filter(drive => members.includes(drive.name)) : drives;
    writeChips(inGroup);
    shown = sorted(found(inGroup.filter(FILTERS[asked.filter || 'all']), asked.search, textOf), asked.sort, isAsked || !body.matches(':hover, :focus-within'));
    const isWall = asked.view === 'tiles';
    list.hidden = isWall;
    wall.hidden = !isWall;
    setText(shape, t(isWall ? 'rows' : 'tiles'));
    setClass(document.body, 'on-wall', isWall);
    if (isWall) showWall();
    else showList();
    nothing.hidden = shown.length > 0;
    setText(said, t(plant.drives.size ? 'nothing_found' : 'no_drives'));
    begin.hidden = plant.drives.size > 0;
    list.hidden ||= !plant.drives.size;
    writeOrders(inGroup, members);
  }

  function showWall() {
    wall.style.setProperty('--columns', Math.max(2, Math.ceil(Math.sqrt(shown.length * 1.3))));
    arrange(wall, shown.map(({ name }) => made(cards, name, makeTile).element));
  }

  function showList() {
    const isFolded = !asked.sort && !asked.search;
    const entries = isFolded ? folds(shown.map(drive => drive.name)) : shown.map(({ name }) => ({ name }));
    const elements = entries.flatMap(entry => {
      if (entry.name) return [() => rowOf(entry.name)];
      const isOpen = opened.has(entry.key);
      const head = () => foldOf(entry, isOpen);
      return isOpen ? [head, ...entry.names.map(name => () => rowOf(name))] : [head];
    });
    arrange(body, elements.slice(0, room).map(make => make()));
    if (room < elements.length) setTimeout(more);
    for (const [name, head] of heads) {
      if (isSortable(name)) setAttribute(head, 'aria-sort', asked.sort === name ? 'ascending' : asked.sort === `-${name}` ? 'descending' : 'none');
    }
    sortBy.value = asked.sort;
  }

  function more() {
    room += ROWS_AT_ONCE;
    if (root.contains(body)) requestAnimationFrame(() => order());
  }

  function made(those, name, make) {
    if (!those.has(name)) those.set(name, make(plant.drives.get(name), choose));
    return those.get(name);
  }

  function rowOf(name) {
    const row = made(rows, name, makeRow);
    row.choose(chosen.has(name));
    return row.element;
  }

  function foldOf(fold, isOpen) {
    if (!foldRows.has(fold.key)) foldRows.set(fold.key, makeFold(fold.key, chooseAll, toggle));
    const row = foldRows.get(fold.key);
    row.update(fold, isOpen, chosen);
    return row.element;
  }

  function toggle(key) {
    if (!opened.delete(key)) opened.add(key);
    order();
  }

  function choose(name, isChosen) {
    chooseAll([name], isChosen);
  }

  function chooseShown(isChosen) {
    chooseAll(shown.map(drive => drive.name), isChosen);
  }

  function chooseAll(names, isChosen) {
    for (const name of names) {
      if (isChosen) chosen.add(name);
      else chosen.delete(name);
    }
    order();
  }

  function writeChips(drives) {
    for (const chip of filters) {
      const name = chip.dataset.filter;
      const count = drives.filter(FILTERS[name]).length;
      setText(chip, `${t(name)} ${count}`);
      setAttribute(chip, 'aria-pressed', String(name === (asked.filter || 'all')));
      setClass(chip, 'some', name === 'trouble' && count > 0);
    }
  }

  /** What would be refused is not offered. */
  function writeOrders(inGroup, members) {
    const isTheirs = inGroup.every(drive => mayCommand(drive) && drive.control);
    groupOrders.hidden = !members;
    startGroup.hidden = !isTheirs || inGroup.some(drive => drive.start_refused);
    stopGroup.hidden = !plant.daemon.rights.stop;
    resetGroup.hidden = !isTheirs || !inGroup.some(isTripped);
    setClass(list, 'selectable', mayChoose());
    allBox.checked = shown.length > 0 && shown.every(drive => chosen.has(drive.name));
    allBox.indeterminate = !allBox.checked && shown.some(drive => chosen.has(drive.name));
    selection.update(new Set(shown.map(drive => drive.name)));
  }

  function updateStrip() {
    for (const [name, line] of plant.lines) {
      if (!tiles.has(name)) tiles.set(name, makeLine(name));
      tiles.get(name)(line);
    }
    arrange(strip, [...plant.lines.keys()].map(name => tiles.get(name).element));
  }

  function fillGroups() {
    group.replaceChildren(el('option', { value: '' }, named(t('group'), t('all'))),
      ...plant.groups.map(one => el('option', { value: one.name, selected: one.name === asked.group }, one.name)));
    group.hidden = plant.groups.length === 0;
  }

  /** A stop is sent whatever this page knows of the group; anything else to the drives that the question was about. */
  async function orderGroup(action) {
    const name = asked.group;
    const members = () => plant.groups.find(one => one.name === name)?.drives ?? [];
    const those = members();
    const give = body => command(name, action, path('groups', name, action), body);
    if (action === 'stop') return void give(shownToStop(those));
    const expects = action === 'start' ? shownToStart(those) : shownOf(those);
    const question = t(`confirm_${action}_group`, { count: those.length, group: name });
    const these = t('these_are', { names: listed(action === 'start' ? withSetpoints(expects) : those) });
    const changed = () => String([...members()].sort()) !== String([...those].sort()) && t('group_changed');
    if (await confirmed(expects, `${question} ${these}`, t(`${action}_group`), { changed })) give({ expects });
  }
}

/** A line in the strip: a link with its name, its utilisation and how many of its drives answer. */
function makeLine(name) {
  const title = el('b', {}, name);
  const used = el('span.number');
  const drives = el('span.counted');
  const meter = el('span.meter', { 'aria-hidden': 'true' }, el('i.fill'));
  const element = el('a.tile', { href: `#/line/${encodeURIComponent(name)}` }, title, used, meter, drives);
  const update = line => {
    const members = [...plant.drives.values()].filter(drive => drive.line === name);
    const connected = members.filter(drive => drive.link === 'connected').length;
    setText(used, load(line));
    const share = line.link === 'away' ? 0 : (line.utilisation_percent ?? 0) / 100;
    meter.firstChild.style.transform = `scaleX(${Math.min(share, 1).toFixed(3)})`;
    setText(drives, line.link === 'away' ? t('line_away') : t('line_health', { connected, count: members.length }));
    setClass(element, 'in-trouble', line.link === 'away' || connected < members.length);
  };
  return Object.assign(update, { element });
}

/** What of a drive is found by a search. */
function textOf(drive) {
  return [drive.name, t('line_name'), drive.line, drive.family, drive.slave, stateWord(drive), trouble(drive).text, drive.fault?.mnemonic,
    drive.fault?.code, word(drive.status?.control)].join(' ');
}
