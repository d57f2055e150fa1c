// Commands on their way: sent once, a stop until its fate is known; followed until they are settled, told in words and time.

import { commandId, path, post, read } from './api.js';
import { el, setClass, setText } from './dom.js';
import { follow } from './follow.js';
import { clock, duration } from './format.js';
import { askToken } from './login.js';
import { daemonNow, start } from './plant.js';
import { named, t } from './texts.js';
import { told } from './told.js';
import { word } from './vocabulary.js';
import { command as commandText, outcome } from './words.js';

const KEPT = 20;
const SHOWN_MS = 12_000;
/** How often a command is asked after of which nobody knows whether it arrived. */
const TRIES = 20;
const LOOK_AGAIN_MS = 1_000;
/** How a stop is sent, as STOP ALL is. */
const ATTEMPT_MS = 2_000;
const AGAIN_MS = 500;
const GIVE_UP_MS = 60_000;
/** What comes to a drive later than this after it was pressed is nobody's wish any more: a network may have kept it. */
const EXPIRES_MS = 5_000;
/** Several are commanded by turns, and a start asks its drive for much: each but the first has so much more, as far as the daemon takes it. */
const EACH_MORE_MS = 1_000;
const LONGEST_MS = 10_000;

const orders = [];
const listeners = new Set();

/** The commands that this page has given to a drive or group, newest first. */
export function ordersOf(name) {
  return orders.filter(order => order.to === name);
}

/** Calls `listener` whenever an order changes; gives the way to stop that. */
export function onOrder(listener) {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

/** Gives a command at this address, and ends when its outcome is known; what becomes of it later is told all the same. All but a stop expire. */
export function command(to, action, where, asked = {}) {
  const id = commandId();
  const more = EACH_MORE_MS * ((asked.drives?.length ?? 1) - 1);
  const expires_in_ms = Math.min(EXPIRES_MS + more, LONGEST_MS);
  const body = action === 'stop' ? asked : { expires_in_ms, issued_unix_ms: Math.round(daemonNow()), ...asked };
  const within = action === 'stop' ? ATTEMPT_MS : undefined;
  return carryOut(to, action, () => post(`${where}?wait=0`, { id, ...body }, 'POST', within), id);
}

/** Sends by `send`, as `command` does, once and a stop again; what has no id cannot be asked after. */
export async function carryOut(to, action, send, id) {
  const order = { to, action, id, at: daemonNow(), outcome: 'pending' };
  orders.unshift(order);
  orders.length = Math.min(orders.length, KEPT);
  tell(order);
  let answer;
  try {
    answer = await send();
    take(order, answer);
  } catch (problem) {
    answer = fail(order, problem);
    if (!answer && action === 'stop') answer = await sendAgain(order, send, problem);
    else if (!answer && problem.isUnheard) answer = await find(order);
  }
  tell(order);
  if (answer?.open) await settled(order, answer);
}

/** An order in words: "Start: confirmed at 14:03:22, after 0.4 s". */
export function orderText(order) {
  const what = order.command ? commandText(order) : word(order.action);
  if (order.outcome === 'pending') return named(what, t('sent_at', { time: clock(order.at) }));
  if (order.outcome === 'not_sent') return named(what, t('not_sent', { why: told(order.text) }));
  const how = t('outcome_after', { outcome: outcome(order.outcome), time: clock(order.endedAt), took: duration(order.took_ms ?? order.endedAt - order.at) });
  const counts = order.drives ? ` (${order.confirmed}/${order.drives.length})` : '';
  return `${named(what, how)}${counts}${order.text ? `. ${told(order.text)}` : ''}`;
}

/** Whether an order did what it asked for. */
export function isDone(order) {
  return order.outcome === 'confirmed' || order.outcome === 'nothing';
}

function settled(order, answer) {
  return new Promise(over => {
    const isSettled = () => order.outcome !== 'pending' && over();
    isSettled();
    follow(answer, news => {
      if (news.told) take(order, news.told);
      if (news.gone) Object.assign(order, { outcome: 'unknown', text: news.gone, endedAt: daemonNow() });
      tell(order);
      isSettled();
    }).then(over);
  });
}

/** Sends a stop under its one id, by which the daemon carries it out once, until its fate is known. Nothing else is ever sent again. */
async function sendAgain(order, send, problem) {
  const began = Date.now();
  for (let tries = 2; problem.isUnheard || problem.status >= 500 || problem.status === 429; tries++) {
    const isOver = Date.now() - began > GIVE_UP_MS;
    Object.assign(order, { outcome: 'unknown', text: t(isOver ? 'stop_given_up' : 'stop_sent_again', { tries, why: problem.isUnheard ? t('not_reached') : told(problem.message) }) });
    if (isOver) return undefined;
    tell(order);
    await new Promise(over => setTimeout(over, AGAIN_MS));
    try {
      const answer = await send();
      take(order, answer);
      return answer;
    } catch (next) {
      problem = next;
      const answer = fail(order, problem);
      if (answer) return answer;
    }
  }
  return undefined;
}

/** Asks what became of a command of which nobody knows whether it arrived: the daemon knows it by its id. */
async function find(order) {
  if (!order.id) return undefined;
  for (let tries = 0; tries < TRIES; tries++) {
    tell(order);
    await new Promise(over => setTimeout(over, LOOK_AGAIN_MS));
    try {
      const answer = await read(`${path('commands', order.id)}?wait=0`);
      take(order, answer);
      return answer;
    } catch (problem) {
      if (problem.isUnheard) continue;
      order.text = t(problem.status === 404 ? 'not_found_again' : 'not_reached');
      return undefined;
    }
  }
  return undefined;
}

function take(order, answer) {
  const { id, outcome: what, text, took_ms: took, command: said, drives, confirmed } = answer;
  Object.assign(order, { id, outcome: what ?? 'confirmed', text, took_ms: took, command: said, drives, confirmed, endedAt: daemonNow() });
}

function fail(order, problem) {
  if (problem.lacksRight) askToken();
  // The daemon's clock may have been set since it was read.
  if (problem.document?.outcome === 'expired' || problem.status === 422) start();
  if (problem.document?.outcome) {
    take(order, { text: problem.message, ...problem.document });
    return problem.document;
  }
  const why = problem.isUnheard ? t('not_reached') : problem.message;
  Object.assign(order, { outcome: problem.isUnheard ? 'unknown' : 'not_sent', text: why, endedAt: daemonNow() });
  return undefined;
}

function tell(order) {
  for (const listener of [...listeners]) listener(order);
  const place = document.getElementById('outcomes');
  order.note ??= el('p');
  if (!order.note.isConnected) place.prepend(order.note);
  setText(order.note, named(order.to, orderText(order)));
  setClass(order.note, 'bad', order.outcome !== 'pending' && !isDone(order));
  clearTimeout(order.timer);
  if (order.outcome !== 'pending') order.timer = setTimeout(() => order.note.remove(), SHOWN_MS);
}
