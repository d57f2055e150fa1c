// The frame of the page: which view is shown, what the header says, who is told.

import { writeDemo } from './demo.js';
import { setAttribute, setClass, setText } from './dom.js';
import { clock } from './format.js';
import { askToken, logOut } from './login.js';
import { overview } from './overview.js';
import { onChange, plant, start } from './plant.js';
import { watchStop, writeAccount } from './stop.js';
import { named, switchLanguage, t, writeTexts } from './texts.js';
import { eventText, word } from './words.js';

/** The views by the first word of the address; those that are not needed for the first look are loaded when they are. */
const VIEWS = {
  '': async () => overview,
  drive: async () => (await import('./drive.js')).drive,
  lines: async () => (await import('./line.js')).lines,
  line: async () => (await import('./line.js')).line,
  events: async () => (await import('./events.js')).events,
};

const place = id => document.getElementById(id);
let view;
let told;
let opening = 0;

writeTexts();
watchStop();
addEventListener('hashchange', open);
place('language').addEventListener('click', () => {
  switchLanguage();
  writeTexts();
  writeAccount();
  writeFrame();
  open();
});
place('login').addEventListener('click', () => (isKnown() ? logOut() : askToken()));
onChange(names => {
  writeFrame();
  view?.update(names);
  if (names.has('event')) tellAlarm();
});
setInterval(() => view?.tick?.(), 1_000);
writeFrame();
start().then(open);

async function open() {
  const mine = ++opening;
  const [, name = '', argument = ''] = location.hash.split('/');
  const show = await (VIEWS[name] ?? VIEWS[''])();
  if (mine !== opening) return;
  view?.end?.();
  const root = place('view');
  root.replaceChildren();
  root.className = `view-${name || 'overview'}`;
  const first = view === undefined;
  view = show(root, decodeURIComponent(argument));
  for (const link of document.querySelectorAll('nav a')) {
    const own = link.getAttribute('href').slice(2);
    setAttribute(link, 'aria-current', own === name || (own === 'lines' && name === 'line') ? 'page' : false);
  }
  document.title = [decodeURIComponent(argument) || (name ? t(name) : ''), 'drived'].filter(Boolean).join(' – ');
  writeFrame();
  if (!first) {
    scrollTo(0, 0);
    root.querySelector('h1')?.focus({ preventScroll: true });
  }
}

function writeFrame() {
  const { connection, daemon } = plant;
  const isOld = connection === 'silent' || connection === 'away';
  setText(place('connection'), isKnown() ? `${t(connection)} · ${daemon.caller}` : t(connection));
  setAttribute(place('connection'), 'data-connection', connection);
  setClass(document.body, 'silent', isOld);
  const banner = place('banner');
  banner.hidden = !isOld && connection !== 'refused';
  setText(banner, connection === 'silent' ? t('banner_silent', { time: clock(plant.heardUnixMs) })
    : connection === 'away' ? t('banner_away') : connection === 'refused' ? t('refused') : '');
  setText(place('login'), t(isKnown() ? 'log_out' : 'log_in'));
  const [, name, argument] = location.hash.split('/');
  writeDemo(place('demo'), name === 'drive' ? decodeURIComponent(argument ?? '') : undefined);
}

/** Whether the daemon knows who looks at the page. */
function isKnown() {
  return !['anonymous', undefined].includes(plant.daemon.caller);
}

/** Says a new alarm to whoever does not see the page. */
function tellAlarm() {
  const newest = plant.events.find(event => event.kind === 'event' && event.alarm && event.live);
  if (!newest || newest === told) return;
  told = newest;
  const text = [word(newest.event), eventText(newest)].filter(Boolean).join(' ');
  setText(place('alarms'), newest.drive ? named(newest.drive, text) : text);
}
