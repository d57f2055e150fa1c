// The buttons of the demonstration: trip a drive, pull a cable.

import { post } from './api.js';
import { el } from './dom.js';
import { plant } from './plant.js';
import { t } from './texts.js';

let shown = '';
/** Which cables were pulled or plugged in here, until their drives show it. */
const asked = new Map();

/** Shows the buttons in a demonstration; `driveName` is the drive that is looked at, if one is. */
export function writeDemo(place, driveName) {
  place.hidden = !plant.daemon.demo || !plant.daemon.rights.operate;
  if (place.hidden) return;
  const lines = [...plant.lines.values()].map(line => [line.name, isPulled(line.name)]);
  const now = JSON.stringify([document.documentElement.lang, driveName, lines]);
  if (now === shown) return;
  shown = now;
  const trip = driveName ? t('demo_trip_this', { drive: driveName }) : t('demo_trip');
  place.replaceChildren(
    el('span', {}, t('demo')),
    el('button', { type: 'button', id: 'demo-trip', onclick: () => tripOne(driveName) }, trip),
    ...lines.map(([line, away]) => el('button', { type: 'button', 'data-cable': line, onclick: () => cable(line, away) },
      t(away ? 'demo_plug' : 'demo_pull', { line }))));
}

function tripOne(name) {
  const running = [...plant.drives.values()].filter(drive => drive.status?.state === 'running' && drive.link === 'connected');
  const drive = name ?? running[Math.floor(Math.random() * running.length)]?.name ?? plant.drives.keys().next().value;
  post('demo/trip', { drive }).catch(() => {});
}

function cable(line, connected) {
  asked.set(line, connected);
  post('demo/cable', { line, connected }).catch(() => asked.delete(line));
}

/** A line whose cable is pulled keeps its port: only that nobody on it answers tells it. */
function isPulled(line) {
  const isSilent = [...plant.drives.values()].every(drive => drive.line !== line || drive.link !== 'connected');
  if (asked.get(line) === !isSilent) asked.delete(line);
  return asked.has(line) ? !asked.get(line) : isSilent;
}
