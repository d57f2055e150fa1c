// The frame of the page: which view is shown, what the header says, who is told.

import { withdraw } from './ask.js';
import { writeDemo } from './demo.js';
import { setAttribute, setClass, setText } from './dom.js';
import { drive } from './drive.js';
import { events } from './events.js';
import { clock } from './format.js';
import { line, lines } from './line.js';
import { askToken, logOut } from './login.js';
import { overview } from './overview.js';
import { onChange, plant, rest, start } from './plant.js';
import { named, switchLanguage, t, writeTexts } from './texts.js';
import { knowLanguage, told } from './told.js';
import { word } from './vocabulary.js';
import { eventText } from './words.js';

/** The views by the first word of the address. */
const VIEWS = {
  '': overview,
  drive,
  lines,
  line,
  events,
};

const place = id => document.getElementById(id);
let view;
let alarm;

writeTexts();
place('view').before(place('stop-account'));
Object.assign(stopAll.later, {
  closeStream: rest, openStream: start, lacksRight: askToken, told, withdraw,
  isAlarmed: name => plant.drives.get(name)?.concerns?.some(concern => concern.kind === 'stop_unconfirmed'),
});
addEventListener('hashchange', open);
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
  if (names.has('event')) tellAlarm();
});
setInterval(() => view?.tick?.(), 1_000);
writeFrame();
start().then(open);
// The daemon's sentences in French come after the first values.
knowLanguage().then(() => view?.update(new Set(['state', 'event'])));

function open() {
  const [, name = '', argument = ''] = location.hash.split('/');
  const show = VIEWS[name] ?? overview;
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
  const isOld = ['silent', 'away', 'resting'].includes(connection);
  setText(place('connection'), isKnown() ? `${t(connection)} · ${daemon.caller}` : t(connection));
  setAttribute(place('connection'), 'data-connection', connection);
  setClass(document.body, 'silent', isOld);
  const banner = place('banner');
  banner.hidden = !['silent', 'away', 'refused'].includes(connection);
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
  if (!newest || newest === alarm) return;
  alarm = newest;
  const text = [word(newest.event), eventText(newest)].filter(Boolean).join(' ');
  setText(place('alarms'), newest.drive ? named(newest.drive, text) : text);
}
