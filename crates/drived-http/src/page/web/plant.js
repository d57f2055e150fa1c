// What is known of the plant: the state once, then what the events change. The views read it and are told of changes.

import { read } from './api.js';
import { useZone } from './format.js';
import { follow } from './stream.js';

const EVENTS_KEPT = 2_000;

/** What the daemon has said; replaced and patched here alone. */
export const plant = {
  daemon: { rights: {} }, drives: new Map(), lines: new Map(), groups: [], alarms: new Map(), events: [],
  /** `reading`, `live`, `interrupted` (for less than 12 s), `resting` (the stream is closed for a stop), `silent`, `away` or `refused`. */
  connection: 'reading',
  /** When the daemon was heard last, by its own clock and by ours. */
  heardUnixMs: 0,
  /** The daemon's wall clock where this page's own began: every time that is shown is the daemon's. */
  beganUnixMs: Date.now() - performance.now(),
};

const listeners = new Set();
const changed = new Set();
let endStream;
let due = false;
let starts = 0;

/** Calls `listener(names)` at most once a frame; `names` holds what has changed: `drive NAME`, `line NAME`, `alarm`, `event`, `state`. */
export function onChange(listener) {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

/** Reads the state, again and again until there is one, and follows the events from there. */
export async function start() {
  rest();
  const mine = starts;
  try {
    const state = await read('state');
    if (mine !== starts) return;
    takeState(state);
  } catch (problem) {
    if (mine !== starts) return;
    plant.connection = problem.lacksRight ? 'refused' : 'away';
    tell('state');
    if (!problem.lacksRight) setTimeout(start, 2_000);
    return;
  }
  readEarlier();
  endStream = follow(plant.revision, {
    news: take,
    reset: start,
    silence(silent) {
      if (!silent) return void start();
      plant.connection = 'silent';
      tell('state');
    },
    interrupted() {
      if (plant.connection === 'live') plant.connection = 'interrupted';
      tell('state');
    },
  });
}

/** Closes the page's stream: a stop needs its connection. Nothing is live until `start` follows the events again. */
export function rest() {
  starts++;
  endStream?.();
  endStream = undefined;
  if (plant.connection !== 'live' && plant.connection !== 'interrupted') return;
  plant.connection = 'resting';
  tell('state');
}

/** Now, by the daemon's clock. */
export function daemonNow() {
  return plant.beganUnixMs + performance.now();
}

/** How old a group of values is now, in milliseconds; `undefined` where there are none. */
export function age(values, drive) {
  if (!values || values.quality === 'missing' || typeof values.age_ms !== 'number') return undefined;
  return values.age_ms + performance.now() - drive.receivedAt;
}

/** `good`, `stale` or `missing`; nothing is good while the daemon is silent, or from before the drive's last change of state. */
export function quality(values, drive) {
  if (!values || values.quality === 'missing') return 'missing';
  if (drive?.changedAt && drive.receivedAt - values.age_ms < drive.changedAt) return 'stale';
  return plant.connection === 'live' || plant.connection === 'interrupted' ? values.quality : 'stale';
}

/** Whether the asker may command a drive: by his rights, by the drives that his token is for, and by whom the drive takes commands of. */
export function mayCommand({ name, commanders }) {
  const { rights, scope, caller } = plant.daemon;
  return Boolean(rights.operate) && (!scope || scope.includes(name)) && (!commanders || commanders.includes(caller));
}

/** A fresh `DRIVE`, by the events or another way. Who is there the state alone says: one that has gone is not shown again by what was on its way. */
export function takeDrive(drive) {
  const before = plant.drives.get(drive.name);
  if (!before) return;
  drive.receivedAt = performance.now();
  const isSame = before.status?.state === drive.status?.state;
  drive.changedAt = isSame ? before.changedAt : drive.receivedAt;
  plant.drives.set(drive.name, drive);
  tell(`drive ${drive.name}`);
}

/** An alarm as it is now; one at its end is kept no more. */
export function takeAlarm(alarm) {
  if (alarm.state === 'over') plant.alarms.delete(alarm.id);
  else plant.alarms.set(alarm.id, alarm);
  tell('alarm');
}

function takeState(state) {
  const receivedAt = performance.now();
  plant.revision = state.revision;
  plant.daemon = state.daemon;
  plant.groups = state.groups ?? [];
  plant.drives = new Map(state.drives.map(drive => [drive.name, Object.assign(drive, { receivedAt })]));
  plant.lines = new Map(state.lines.map(line => [line.name, line]));
  plant.alarms = new Map((state.alarms ?? []).map(alarm => [alarm.id, alarm]));
  useZone(state.daemon.zone);
  plant.beganUnixMs = state.time_unix_ms - receivedAt;
  plant.heardUnixMs = daemonNow();
  plant.connection = 'live';
  tell('state');
}

function take(kind, data) {
  plant.heardUnixMs = daemonNow();
  if (plant.connection === 'interrupted') {
    plant.connection = 'live';
    tell('state');
  }
  if (kind === 'drive') takeDrive(data);
  if (kind === 'line') {
    plant.lines.set(data.name, data);
    tell(`line ${data.name}`);
  }
  if (kind === 'command') {
    stopAll.news(data);
    const known = plant.events.find(event => event.id === data.id);
    if (known) Object.assign(known, data);
    else keep({ kind, ...data });
    tell('event');
  }
  if (kind === 'alarm') {
    takeAlarm(data);
  }
  if (kind === 'event') {
    keep({ kind, ...data });
    tell('event', data);
  }
}

/** Reads what happened before the state; the stream tells what comes after it. */
async function readEarlier() {
  const { revision, events: known } = plant;
  for (const event of known) event.live = false;
  plant.events = [];
  const recent = await read('events/recent').catch(() => []);
  if (revision !== plant.revision) return;
  const told = new Set(plant.events.map(event => event.id).filter(Boolean));
  const earlier = recent.filter(event => event.revision <= revision && !told.has(event.id)).reverse();
  const oldest = earlier.at(-1)?.time_unix_ms ?? Infinity;
  plant.events = [...plant.events, ...earlier, ...known.filter(event => event.time_unix_ms < oldest)].slice(0, EVENTS_KEPT);
  tell('state');
}

function keep(event) {
  event.live = true;
  plant.events.unshift(event);
  if (plant.events.length > EVENTS_KEPT) plant.events.length = EVENTS_KEPT;
}

function tell(name) {
  changed.add(name);
  if (due) return;
  due = true;
  // A page in the background has no frames.
  const next = document.hidden ? callback => setTimeout(callback, 200) : requestAnimationFrame;
  next(() => {
    due = false;
    const names = new Set(changed);
    changed.clear();
    for (const listener of [...listeners]) listener(names);
  });
}
