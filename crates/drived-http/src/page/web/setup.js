// The first hour: choose a port, see who answers, name him, look, and take control of one drive after another.

import { post, read } from './api.js';
import { el, setText } from './dom.js';
import { askToken } from './login.js';
import { plant } from './plant.js';
import { addedPanel } from './setup_added.js';
import { foundPanel } from './setup_found.js';
import { portPanel } from './setup_port.js';
import { scanPanel } from './setup_scan.js';
import { SETUP_TEXTS } from './setup_texts.js';
import { addTexts, t } from './texts.js';
import { told } from './told.js';

addTexts(SETUP_TEXTS);

const LOOK_MS = 400;
const AGAIN_MS = 2_000;

/** Shows how drives are added in `root`. */
export function setup(root) {
  let known;
  let ended = false;
  let timer;
  let may;
  let isUnheard = false;
  const where = el('p.hint');
  const closed = el('p.remark', { hidden: true });
  const said = el('p.said', { role: 'alert' });
  const right = el('section.panel.setup', { hidden: true },
    el('p', {}, t('setup_right')), el('p.hint', {}, t('setup_link')),
    el('p', {}, el('code', {}, 'drived token link NAME --role engineer')),
    el('p', {}, el('button', { type: 'button', onclick: askToken }, t('setup_token'))));
  const port = portPanel(scan, look);
  const progress = scanPanel(() => act(() => post('setup/scan/cancel')));
  const found = foundPanel(wanted => change('setup/drives', wanted));
  const added = addedPanel((drive, control) => change('setup/control', { drive, control }));
  const hunt = el('div', {}, port.element, progress.element, found.element);
  root.append(el('h1', { tabindex: -1 }, t('setup_view')), el('p.hint', {}, t('setup_about')), where, closed, right, said, hunt, added.element);
  write();
  look();
  return {
    update(names) {
      if (names.has('state')) {
        write();
        // Somebody else's reload may have changed who takes commands.
        look();
      }
      added.update();
    },
    tick: added.tick,
    end() {
      ended = true;
      clearTimeout(timer);
    },
  };

  async function look() {
    clearTimeout(timer);
    try {
      take(await read('setup'));
      if (isUnheard) setText(said, '');
      isUnheard = false;
    } catch (problem) {
      if (ended) return;
      isUnheard = true;
      setText(said, problem.isUnheard ? t('not_reached') : told(problem.message));
      // A poll that is lost is no end of the scan.
      clearTimeout(timer);
      timer = setTimeout(look, AGAIN_MS);
    }
  }

  function take(view) {
    if (ended) return;
    known = view;
    write();
    clearTimeout(timer);
    if (['listening', 'asking'].includes(known.scan?.state)) timer = setTimeout(look, LOOK_MS);
  }

  function write() {
    may = Boolean(plant.daemon.rights.engineer) && !plant.daemon.scope;
    if (!known) return;
    const files = { file: known.file ?? '', configuration: known.configuration };
    setText(where, known.closed || !known.file ? '' : t('setup_file', files));
    setText(closed, known.closed === 'own_drives' ? t('setup_own', files) : known.closed === 'no_folder' ? t('setup_no_folder', files) : '');
    closed.hidden = !known.closed;
    right.hidden = may || Boolean(known.closed);
    hunt.hidden = !may || Boolean(known.closed);
    port.update(known);
    progress.update(known.scan);
    found.update(known);
    added.show(known, may);
  }

  function scan(wanted) {
    act(() => post('setup/scan', wanted));
  }

  async function act(send) {
    setText(said, '');
    try {
      take(await send());
    } catch (problem) {
      fail(problem);
    }
  }

  /** Writes something down; what has changed is said, and the rest comes with the state. */
  async function change(where, wanted) {
    setText(said, '');
    try {
      const { changes } = await post(where, wanted);
      await look();
      return changes;
    } catch (problem) {
      fail(problem);
      return undefined;
    }
  }

  function fail(problem) {
    if (problem.lacksRight) askToken();
    setText(said, problem.isUnheard ? t('not_reached') : told(problem.message));
    said.scrollIntoView({ block: 'nearest' });
  }
}
