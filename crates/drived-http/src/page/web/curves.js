// A small curve of the last ten minutes for each drive: the daemon's own record, asked for once and counted on from what comes live.

import { read } from './api.js';
import { daemonNow, plant, quality } from './plant.js';

const USUAL_HIGH_HZ = 50;
/** The first look goes first, on a slow network too. */
const AFTER_MS = 1_500;
const WIDTH = 100;
const HEIGHT = 24;

const curves = new Map();
let stepMs = 15_000;
let readUntil = 0;
let isReading = false;
let changes = 0;

/** Begins to keep the curves; once is enough. */
export function keepCurves() {
  setTimeout(step, AFTER_MS);
  setInterval(step, stepMs);
}

/** The curve in a cell: what `drawCurve` draws on. */
export function curveOf(cell) {
  const svg = document.getElementById('curve-form').cloneNode(true);
  svg.removeAttribute('id');
  svg.removeAttribute('hidden');
  cell.append(svg);
  return { svg, line: svg.firstElementChild, drawn: undefined };
}

/** Draws the curve of a drive where it has changed; a gap where nothing was known. */
export function drawCurve(curve, { name, limits }) {
  const values = curves.get(name);
  if (!values || curve.drawn === changes) return;
  curve.drawn = changes;
  const high = Math.max(limits?.high_hz ?? USUAL_HIGH_HZ, ...values.map(value => value ?? 0));
  const at = (value, index) => `${(index / (values.length - 1 || 1) * WIDTH).toFixed(1)} ${(HEIGHT - 1 - value / high * (HEIGHT - 2)).toFixed(1)}`;
  let isGap = true;
  const path = values.map((value, index) => {
    if (value === null) {
      isGap = true;
      return '';
    }
    const part = `${isGap ? 'M' : 'L'}${at(value, index)}`;
    isGap = false;
    return part;
  });
  curve.line.setAttribute('d', path.join(''));
}

/** One step further: read where something is missing, else what is shown now. */
async function step() {
  if (document.hidden || isReading || plant.connection !== 'live') return;
  const isWhole = daemonNow() - readUntil < 2 * stepMs && [...plant.drives.keys()].every(name => curves.has(name));
  if (!isWhole) return void await readAll();
  readUntil += stepMs;
  for (const [name, drive] of plant.drives) {
    const values = curves.get(name);
    values.push(quality(drive.status) === 'good' ? drive.status.output_frequency_hz ?? null : null);
    values.shift();
  }
  changes++;
}

async function readAll() {
  isReading = true;
  try {
    const told = await read('curves');
    stepMs = told.step_ms;
    readUntil = told.time_unix_ms;
    curves.clear();
    const length = Math.round(600_000 / stepMs);
    for (const [name, values] of Object.entries(told.frequency_hz)) {
      curves.set(name, [...Array(Math.max(length - values.length, 0)).fill(null), ...values]);
    }
    changes++;
  } catch {
    // What is missing now is asked for the next time.
  }
  isReading = false;
}
