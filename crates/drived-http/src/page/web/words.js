// What the API tells (commands, events, setpoints, values) in plain words of both languages.

import { quantity } from './format.js';
import { language, named, t } from './texts.js';
import { foundWords, told } from './told.js';
import { word } from './vocabulary.js';

const COMMANDS = [
  [/^start (forward|reverse)(?: at (.+))?$/, (direction, at) =>
    `démarrage ${direction === 'forward' ? 'en avant' : 'en arrière'}${at ? ` à ${number(at)}` : ''}`],
  [/^setpoint (.+)$/, value => `consigne ${number(value)}`],
  [/^(?:stop|stop along the ramp|ramp stop)$/, () => 'arrêt sur rampe'],
  [/^stop by ramp$/, () => 'arrêt sur rampe'],
  [/^stop by freewheel$/, () => 'arrêt roue libre'],
  [/^fast stop$/, () => 'arrêt rapide'],
  [/^freewheel stop$/, () => 'arrêt roue libre'],
  [/^DC injection stop$/i, () => 'arrêt par injection de courant continu'],
  [/^fault reset$/, () => 'acquittement du défaut'],
  [/^withdrawal of the run command$/, () => 'retrait de l’ordre de marche'],
  [/^release$/, () => 'rendre la main'],
  [/^accepting the identity$/, () => 'acceptation de l’identité'],
];

/** The plain word for an outcome. */
export function outcome(name) {
  return word(name === 'unknown' ? 'outcome_unknown' : name);
}

/** What a command asked for. */
export function command(given) {
  const said = given.command ?? given.action ?? '';
  if (language() !== 'fr') return said;
  for (const [pattern, french] of COMMANDS) {
    const found = said.match(pattern);
    if (found) return french(...found.slice(1));
  }
  return said;
}

/** What a drive says that it is, as it is accepted by `drived accept` too. */
export function identityText({ vendor, model, firmware, codes = [] } = {}) {
  return [vendor, model, firmware, ...codes.map(({ code, value }) => `${code} ${value}`)].filter(Boolean).join(' ');
}

/** What happened, without the kind of event that stands before it. */
export function eventText(happened) {
  const { event, text = '' } = happened;
  if (event === 'line_finding' && language() === 'fr') return findingText(happened);
  if (event === 'connected' && happened.status && language() === 'fr') return connectedText(happened.status);
  const kind = String(event).replaceAll('_', ' ');
  const rest = text.startsWith(kind) ? text.slice(kind.length).replace(/^[:,]? /, '') : text;
  const change = rest.match(/^(\w+) to (\w+)$/);
  if (change) return `${word(change[1])} → ${word(change[2])}`;
  const given = rest.match(/^(.+) by (.+?): (confirmed|not confirmed|outcome unknown|refused|expired|superseded|nothing to be done)(?:: (.+))?$/);
  if (given) {
    const [, what, who, how, why] = given;
    const became = why ? named(outcome(how), told(why)) : outcome(how);
    return named(`${command({ command: what })}, ${told(who)}`, became);
  }
  return told(rest);
}

/** How a drive was when it was heard again. */
function connectedText(status) {
  return [word(status.state), frequencyText(status), currentText(status), status.control && word(status.control)].filter(Boolean).join(', ');
}

/** What a line has found, or does not find any more. */
function findingText(happened) {
  const { text, next } = foundWords(happened);
  const whose = [happened.of_line && t('line_name'), !happened.present && word('not_any_more')].filter(Boolean).join(', ');
  const first = happened.present && next[0] ? `. ${named(t('to_do_next'), next[0])}` : '';
  return `${whose ? named(whose, text) : text}${first}`;
}

/** What a drive does, in the one word with which its row begins everywhere: the daemon says which. */
export function stateWord(drive) {
  return word(drive.shows);
}

/** The frequency of a status. */
export function frequencyText(status) {
  return quantity(status?.output_frequency_hz, 1, 'Hz');
}

/** The current of a status, as a share of the drive's own where that is all that it tells. */
export function currentText(status) {
  const isShare = typeof status?.current_a !== 'number' && typeof status?.current_percent === 'number';
  return isShare ? quantity(status.current_percent, 0, '%') : quantity(status?.current_a, 1, 'A');
}

/** The setpoint of a drive: the one that the daemon gave it, else what the drive itself says that it follows, whoever gave that. */
export function setpointOf(drive) {
  const reference = drive.status?.reference_hz;
  return drive.setpoint ?? (typeof reference === 'number' ? { frequency_hz: reference } : undefined);
}

/** By how much the output of a drive is off its setpoint, in hertz; `undefined` where it does not run or one of both is not known. */
export function deviationOf(drive) {
  const output = drive.status?.output_frequency_hz;
  const setpoint = setpointOf(drive)?.frequency_hz;
  const isKnown = typeof output === 'number' && typeof setpoint === 'number' && drive.status.state === 'running';
  return isKnown ? output - setpoint : undefined;
}

/** The same with its sign. */
export function deviationText(drive) {
  const deviation = deviationOf(drive);
  if (deviation === undefined) return '';
  const text = quantity(Math.abs(deviation), 1, 'Hz');
  return Math.abs(deviation) < 0.05 ? text : `${deviation < 0 ? '−' : '+'}${text}`;
}

/** A setpoint of the API. */
export function setpointText(setpoint) {
  if (typeof setpoint?.frequency_hz === 'number') return quantity(setpoint.frequency_hz, 1, 'Hz');
  if (typeof setpoint?.speed_rpm === 'number') return quantity(setpoint.speed_rpm, 0, t('rpm'));
  return quantity(setpoint?.share_percent, 1, '%');
}

function number(text) {
  return text.replace(/(\d)\.(\d)/, '$1,$2').replace(/ ?rpm/, ' tr/min');
}
