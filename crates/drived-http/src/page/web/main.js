// The frame of the page: which view is shown, what the header says, who is told.

import { withdraw } from './ask.js';
import { callAttention } from './attention.js';
import { keepCurves } from './curves.js';
import { writeDemo } from './demo.js';
import { setAttribute, setClass, setText } from './dom.js';
import { clock } from './format.js';
import { askToken, logOut } from './login.js';
import { overview } from './overview.js';
import { here, keepScroll, leftAt, overviewAddress, scrollBack } from './place.js';
import { onChange, plant, rest, start } from './plant.js';
import { named, switchLanguage, t, writeTexts } from './texts.js';
import { knowLanguage, told } from './told.js';

/** The views by the first word of the address. All but the first come when the first stands. */
const VIEWS = {
  '': () => overview,
  drive: async () => (await import('./drive.js')).drive,
  alarms: async () => (await import('./alarms.js')).alarms,
  lines: async () => (await import('./line.js')).lines,
  line: async () => (await import('./line.js')).line,
  events: async () => (await import('./events.js')).events,
  at: async () => (await import('./at.js')).at,
  past: async () => (await import('./past.js')).past,
  setup: async () => (await import('./setup.js')).setup,
  enter: async () => (await import('./enter.js')).enter,
};
/** So long the first look has the network for itself. */
const AFTER_MS = 1_500;

const place = id => document.getElementById(id);
const SCROLLED_MS = 150;
let view;
let shownAt;
let scrolling;
let opens = 0;

writeTexts();
place('view').before(place('stop-account'));
Object.assign(stopAll.later, {
  closeStream: rest, openStream: start, lacksRight: askToken, told, withdraw, clock,
  isAlarmed: name => plant.drives.get(name)?.concerns?.some(concern => concern.kind === 'stop_unconfirmed'),
});
history.scrollRestoration = 'manual';
addEventListener('hashchange', open);
addEventListener('scroll', () => {
  clearTimeout(scrolling);
  scrolling = setTimeout(() => keepScroll(view?.rowAt?.(0)), SCROLLED_MS);
}, { passive: true });
document.addEventListener('click', event => {
  const link = event.target.closest?.('a[href^="#"]');
  if (!link) return;
  if (link.classList.contains('skip')) {
    event.preventDefault();
    place('view').focus();
    return;
  }
  // Where he was is noted before he goes.
  clearTimeout(scrolling);
  keepScroll(link.closest('[data-name]') ?? view?.rowAt?.(0));
}, { capture: true });
place('language').addEventListener('click', async () => {
  switchLanguage();
  await knowLanguage();
  writeTexts();
  stopAll.write();
  writeFrame();
  open();
});
// A page that nobody looks at keeps no connection from those that somebody does.
document.addEventListener('visibilitychange', () => (document.hidden ? rest() : start()));
place('login').addEventListener('click', () => (isKnown() ? logOut() : askToken()));
onChange(names => {
  writeFrame();
  view?.update(names);
  stopAll.write();
});
setInterval(() => view?.tick?.(), 1_000);
writeFrame();
start().then(open);
keepCurves();
// The other views are there before somebody asks for them, also when the daemon is away by then.
setTimeout(() => VIEWS.drive().catch(() => {}), AFTER_MS);
// The daemon's sentences in French come after the first values.
knowLanguage().then(() => view?.update(new Set(['state', 'event'])));

async function open() {
  const { name, argument } = here();
  const mine = ++opens;
  const left = leftAt();
  clearTimeout(scrolling);
  let show;
  try {
    show = await (VIEWS[name] ?? VIEWS[''])();
  } catch {
    // The frame says that the daemon is away; it is opened when somebody asks for it again.
    return;
  }
  if (mine !== opens) return;
  view?.end?.();
  const root = place('view');
  root.replaceChildren();
  root.className = `view-${VIEWS[name] ? name || 'overview' : 'overview'}`;
  document.body.classList.remove('on-wall');
  const first = view === undefined;
  view = show(root, argument, Boolean(left));
  for (const link of document.querySelectorAll('nav a')) {
    const [, own] = link.getAttribute('href').split(/[/?]/);
    setAttribute(link, 'aria-current', own === name || (own === 'lines' && name === 'line') || (own === 'events' && ['at', 'past'].includes(name)) ? 'page' : false);
  }
  shownAt = [(name !== 'enter' && argument) || (VIEWS[name] && name ? t(name) : ''), 'drived'].filter(Boolean).join(' – ');
  writeFrame();
  if (left) scrollBack(root, left);
  else if (!first) {
    scrollTo(0, 0);
    root.querySelector('h1')?.focus({ preventScroll: true });
  }
}

function writeFrame() {
  const { connection, daemon } = plant;
  const isOld = ['silent', 'away', 'resting'].includes(connection);
  setText(place('connection'), isKnown() ? `${t(connection)} · ${daemon.caller}` : t(connection));
  setAttribute(place('connection'), 'data-connection', connection);
  setClass(document.body, 'silent', isOld);
  const banner = place('banner');
  const why = connection === 'silent' ? t('banner_silent', { time: clock(plant.heardUnixMs) })
    : connection === 'away' ? t('banner_away') : connection === 'refused' ? t('refused')
      : daemon.names_problem ? t('banner_names', { why: told(daemon.names_problem) }) : '';
  banner.hidden = !why;
  setText(banner, why);
  setText(place('login'), t(isKnown() ? 'log_out' : 'log_in'));
  const { name, argument } = here();
  writeDemo(place('demo'), name === 'drive' ? argument : undefined);
  document.querySelector('nav a').href = overviewAddress();
  const { count, news } = callAttention(shownAt ?? 'drived');
  const link = document.querySelector('nav a[href="#/alarms"]');
  setText(link.lastChild, count ? String(count) : '');
  setAttribute(link, 'aria-label', count ? named(t('alarms'), t('alarms_waiting_count', { count })) : t('alarms'));
  // Said to whoever does not see the page.
  if (news.length) setText(place('alarms'), news.join('. '));
}

/** Whether the daemon knows who looks at the page. */
function isKnown() {
  return !['anonymous', undefined].includes(plant.daemon.caller);
}
