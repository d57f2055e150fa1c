// STOP ALL: sent at once, without a question, and followed until every drive is accounted for.

import { commandId, post } from './api.js';
import { el } from './dom.js';
import { follow } from './follow.js';
import { clock } from './format.js';
import { askToken } from './login.js';
import { plant } from './plant.js';
import { named, t } from './texts.js';
import { told } from './told.js';
import { outcome } from './words.js';

const AGAIN_MS = 1_000;
const GIVE_UP_MS = 30_000;
const NAMED = 12;

const account = { phase: 'none' };
let place;
let run = 0;

/** Makes the button and its key work. */
export function watchStop() {
  place = document.getElementById('stop-account');
  document.getElementById('stop').addEventListener('click', stopAll);
  addEventListener('keydown', event => {
    if (event.ctrlKey && event.shiftKey && event.code === 'KeyS') {
      event.preventDefault();
      if (!event.repeat) stopAll();
    }
  });
}

/** Writes the account again, in the language of now. */
export function writeAccount() {
  place.hidden = account.phase === 'none';
  if (place.hidden) return;
  place.replaceChildren();
  place.className = `stop-account ${account.phase}`;
  place.append(...[
    el('p.head', { role: 'alert' }, headline()),
    counts(),
    notYet(),
    el('button.quiet', { type: 'button', onclick: close }, t('close')),
  ].filter(Boolean));
}

async function stopAll() {
  const mine = ++run;
  const began = Date.now();
  // What is said first does not wait for the daemon.
  show({ phase: 'sending', count: plant.drives.size, at: began, drives: undefined, tries: 0 });
  const id = commandId();
  let answer;
  while (!answer && mine === run) {
    try {
      answer = await post('stop?wait=0', { id });
    } catch (problem) {
      if (problem.document?.drives) {
        answer = problem.document;
        break;
      }
      if (problem.lacksRight) askToken();
      const over = problem.status !== 0 || Date.now() - began > GIVE_UP_MS;
      show({ phase: over ? 'over' : 'failed', why: problem.status === 0 ? undefined : told(problem.message), tries: account.tries + 1 });
      if (over) return;
      await pause(AGAIN_MS);
    }
  }
  if (mine === run) await followUp(answer, mine);
}

/** Reads the account for as long as something may become of it; what it said last stays when it cannot be read. */
async function followUp(answer, mine) {
  take(answer);
  await follow(answer, news => {
    const wasUnreadable = account.unreadable;
    account.unreadable = !news.told;
    if (news.told) take(news.told);
    if (account.unreadable !== wasUnreadable) writeAccount();
  }, () => mine === run);
}

function take(answer) {
  const drives = answer.drives ?? [];
  const open = drives.some(isOpen);
  const bad = drives.filter(one => !isOpen(one) && one.outcome !== 'confirmed').length;
  const next = { phase: open ? 'sent' : bad ? 'bad' : 'done', count: drives.length, drives, confirmed: answer.confirmed ?? 0,
    notReachable: answer.not_reachable ?? 0, pending: answer.pending ?? 0, bad };
  const same = ['phase', 'count', 'confirmed', 'pending', 'notReachable', 'bad'].every(key => account[key] === next[key]);
  Object.assign(account, next, open ? {} : { endedAt: account.endedAt ?? Date.now() });
  if (!same) writeAccount();
}

function headline() {
  const { phase, count, at } = account;
  if (phase === 'sending') return t('stop_sending', { count });
  if (phase === 'failed' || phase === 'over') {
    const said = account.why ? t('stop_failed_why', { why: account.why }) : t('stop_failed');
    return `${said} ${account.why ? '' : phase === 'over' ? t('stop_given_up') : t('stop_tried_again', { count: account.tries })}`;
  }
  if (phase === 'done') return t('stop_done', { count, time: clock(account.endedAt) });
  return `${t('stop_sent', { count, time: clock(at) })}${account.unreadable ? `. ${t('stop_lost_sight')}` : ''}`;
}

function counts() {
  if (!account.drives) return null;
  const shown = [['confirmed', account.confirmed], ['pending', account.pending], ['not_reachable', account.notReachable], ['not_confirmed', account.bad]];
  return el('dl.counts', {}, ...shown.filter(([name, count]) => name !== 'not_confirmed' || count).map(([name, count]) =>
    el('div', {}, el('dt', {}, t(`stop_${name}`)), el(count ? `dd.${name}` : 'dd', { 'data-count': name }, String(count)))));
}

/** Who is not accounted for yet, by name, while they are few enough to be read. */
function notYet() {
  const left = (account.drives ?? []).filter(one => one.outcome !== 'confirmed');
  const texts = [...new Set(left.map(one => one.outcome))].map(what => {
    const names = left.filter(one => one.outcome === what).map(one => one.drive);
    const rest = names.length > NAMED ? ` ${t('stop_others', { count: names.length - NAMED })}` : '';
    return named(outcome(what), names.slice(0, NAMED).join(', ') + rest);
  });
  return texts.length ? el('p.left', {}, texts.join(' · ')) : null;
}

function isOpen(one) {
  return one.outcome === 'pending';
}

function show(changes) {
  Object.assign(account, changes.phase === 'sending' ? { endedAt: undefined, unreadable: false, why: undefined } : {}, changes);
  writeAccount();
}

function close() {
  run++;
  account.phase = 'none';
  writeAccount();
}

function pause(ms) {
  return new Promise(over => setTimeout(over, ms));
}
