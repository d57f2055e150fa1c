// The story of a drive around a moment, as the daemon tells it, with how sure each sentence is.

import { path, read } from './api.js';
import { el } from './dom.js';
import { clock } from './format.js';
import { language, t } from './texts.js';
import { told } from './told.js';

const PARTS = ['why', 'before', 'course', 'not_known'];

/** The story of `drive` at `moment`, as soon as it is told. */
export function whyPanel(drive, moment) {
  const element = el('section.story', { 'aria-live': 'polite', 'aria-label': t('at_why_of', { drive }) }, el('h3', {}, t('at_why_of', { drive })));
  read(`${path('drives', drive, 'why')}?at_unix_ms=${moment}`).then(write, problem =>
    element.append(el('p', {}, problem.isUnheard ? t('not_reached') : told(problem.message))));
  return element;

  function write(story) {
    element.append(story.about ? el('p', {}, sentence(story.about)) : el('p', {}, t('why_nothing')));
    for (const part of PARTS) {
      if (!story[part]?.length) continue;
      element.append(el('h4', {}, t(`why_${part}`)), el('ul.history', {}, ...story[part].map(one => el('li', {}, sentence(one)))));
    }
    if (language() === 'fr') element.append(el('p.hint', {}, t('why_english')));
  }
}

function sentence({ time_unix_ms: time, certainty, text }) {
  const sure = certainty === 'likely' ? ` (${t('why_likely')})` : certainty === 'said' ? ` (${t('why_said')})` : '';
  return el('span', { lang: language() === 'fr' && told(text) === text ? 'en' : undefined }, `${time ? `${clock(time)}  ` : ''}${told(text)}${sure}`);
}
