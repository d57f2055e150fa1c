// What every chart has: its code, which is loaded when the first is looked at, its colours and its axes.

import { el } from './dom.js';
import { quantity } from './format.js';

let plotter;

/** Loads the chart's code when the first trend is looked at. */
export function loadPlotter() {
  plotter ??= new Promise((loaded, failed) => {
    document.head.append(el('link', { rel: 'stylesheet', href: 'vendor/uplot.css' }),
      el('script', { src: 'vendor/uplot.js', onload: loaded, onerror: () => failed(new Error('uplot.js')) }));
  });
  return plotter;
}

/** A colour by its name. */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** The axis of a scale with this unit, on this side. */
export function axis(scale, side = 3) {
  return { scale, side, size: 52, font: font(), stroke: colour('--ink-soft'), grid: { show: side === 3, stroke: colour('--edge'), width: 1 },
    ticks: { stroke: colour('--edge') }, values: (_, ticks) => ticks.map(value => quantity(value, Number.isInteger(value) ? 0 : 1, scale)) };
}

/** The axis of time; `text(unixMs)` writes its ticks. */
export function timeAxis(text, space = 80) {
  return { font: font(), stroke: colour('--ink-soft'), grid: { stroke: colour('--edge'), width: 1 }, ticks: { stroke: colour('--edge') }, space,
    values: (_, ticks) => ticks.map(seconds => text(seconds * 1000)) };
}

/** From zero to the largest value, at least `least`, so that noise is not shown as a movement. */
export function upTo(least) {
  return (_, min, max) => [Math.min(0, min ?? 0), Math.max(least, (max ?? 0) * 1.1)];
}

function font() {
  return `12px ${getComputedStyle(document.documentElement).fontFamily}`;
}
