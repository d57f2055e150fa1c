// The ways through what was: events, a moment, long trends.

import { el } from './dom.js';
import { PAST_TEXTS } from './past_texts.js';
import { addressOf } from './past_time.js';
import { daemonNow } from './plant.js';
import { addTexts, t } from './texts.js';

addTexts(PAST_TEXTS);

/** Links to the other views of the past; `here` is that which is shown. */
export function pastLinks(here) {
  const views = [['events', '#/events'], ['at_moment', ofMoment(daemonNow())], ['past', '#/past']];
  return el('p.chips.ways', {}, ...views.map(([name, href]) => el('a.chip.button', { href, 'aria-current': name === here && 'page' }, t(name))));
}

/** The address of a moment. */
export function ofMoment(unixMs) {
  return `#/at/${addressOf(unixMs)}`;
}

/** The address of the long trend of some drives. */
export function ofPast(names) {
  return `#/past?${new URLSearchParams({ drives: names.map(encodeURIComponent).join(',') })}`;
}
