// Commands on their way: sent once, followed until they are settled, told in words and time.

import { el, setClass, setText } from './dom.js';
import { follow } from './follow.js';
import { clock, duration } from './format.js';
import { askToken } from './login.js';
import { named, t } from './texts.js';
import { told } from './told.js';
import { command, outcome, word } from './words.js';

const KEPT = 20;
const SHOWN_MS = 12_000;

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

/** Sends by `send`, and ends when the outcome is known; what becomes of it later is told all the same. */
export async function carryOut(to, action, send) {
  const order = { to, action, at: Date.now(), outcome: 'pending' };
  orders.unshift(order);
  orders.length = Math.min(orders.length, KEPT);
  tell(order);
  let answer;
  try {
    answer = await send();
    take(order, answer);
  } catch (problem) {
    answer = fail(order, problem);
  }
  tell(order);
  if (answer?.open) await settled(order, answer);
}

/** An order in words: "Start: confirmed at 14:03:22, after 0.4 s". */
export function orderText(order) {
  const what = order.command ? command(order) : word(order.action);
  if (order.outcome === 'pending') return named(what, t('sent_at', { time: clock(order.at) }));
  if (order.outcome === 'not_sent') return named(what, t('not_sent', { why: told(order.text) }));
  const how = t('outcome_after', { outcome: outcome(order.outcome), time: clock(order.endedAt), took: duration(order.took_ms ?? order.endedAt - order.at) });
  const counts = order.drives ? ` (${order.confirmed}/${order.drives.length})` : '';
  return `${named(what, how)}${counts}${order.text ? `. ${told(order.text)}` : ''}`;
}

/** Whether an order did what it asked for. */
export function isDone(order) {
  return order.outcome === 'confirmed';
}

function settled(order, answer) {
  return new Promise(over => {
    const isSettled = () => order.outcome !== 'pending' && over();
    isSettled();
    follow(answer, news => {
      if (news.told) take(order, news.told);
      if (news.gone) Object.assign(order, { outcome: 'unknown', text: news.gone, endedAt: Date.now() });
      tell(order);
      isSettled();
    }).then(over);
  });
}

function take(order, answer) {
  const { id, outcome: what, text, took_ms: took, command: said, drives, confirmed } = answer;
  Object.assign(order, { id, outcome: what ?? 'confirmed', text, took_ms: took, command: said, drives, confirmed, endedAt: Date.now() });
}

function fail(order, problem) {
  if (problem.lacksRight) askToken();
  if (problem.document?.outcome) {
    take(order, { text: problem.message, ...problem.document });
    return problem.document;
  }
  const why = problem.status === 0 ? t('not_reached') : problem.message;
  Object.assign(order, { outcome: problem.status === 0 ? 'unknown' : 'not_sent', text: why, endedAt: Date.now() });
  return undefined;
}

function tell(order) {
  for (const listener of [...listeners]) listener(order);
  const place = document.getElementById('outcomes');
  order.note ??= el('p');
  if (!order.note.isConnected) place.prepend(order.note);
  setText(order.note, named(order.to, orderText(order)));
  setClass(order.note, 'bad', order.outcome !== 'pending' && !isDone(order));
  if (order.outcome !== 'pending') setTimeout(() => order.note.remove(), SHOWN_MS);
}
