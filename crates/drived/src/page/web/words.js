// The API's words (states, outcomes, kinds of stop, checks …) in plain words of both languages.

import { quantity } from './format.js';
import { language, named, t } from './texts.js';
import { told } from './told.js';

const WORDS = {
  // What a drive does.
  stop_pending: ['Stop pending', 'Arrêt en attente'],
  not_ready: ['Not ready', 'Non prêt'],
  disabled: ['Disabled', 'Verrouillé'],
  ready: ['Ready', 'Prêt'],
  running: ['Running', 'En marche'],
  stopping: ['Stopping', 'Décélération'],
  quick_stop: ['Quick stop', 'Arrêt rapide'],
  fault_reaction: ['Fault reaction', 'Réaction au défaut'],
  fault: ['Fault', 'En défaut'],
  unknown: ['Unknown', 'État inconnu'],
  // Links.
  connecting: ['Connecting', 'Connexion'],
  connected: ['Connected', 'Raccordé'],
  lost: ['Lost', 'Liaison perdue'],
  missing: ['Not known', 'Inconnu'],
  // Directions and control.
  forward: ['forward', 'avant'],
  reverse: ['reverse', 'arrière'],
  bus: ['bus', 'bus'],
  terminals: ['terminals', 'bornier'],
  panel: ['panel', 'terminal'],
  local: ['local', 'local'],
  other_bus: ['other bus', 'autre bus'],
  // Outcomes of a command.
  pending: ['pending', 'en attente'],
  confirmed: ['confirmed', 'confirmé'],
  not_confirmed: ['NOT confirmed', 'NON confirmé'],
  outcome_unknown: ['outcome unknown', 'issue inconnue'],
  refused: ['refused', 'refusé'],
  expired: ['expired', 'expiré'],
  superseded: ['superseded by a later command', 'remplacé par un ordre ultérieur'],
  // Actions.
  start: ['Start', 'Démarrage'],
  stop: ['Stop', 'Arrêt'],
  setpoint: ['Setpoint', 'Consigne'],
  reset: ['Reset', 'Acquittement'],
  release: ['Give control back', 'Rendre la main'],
  parameter: ['Parameter', 'Paramètre'],
  // Kinds of stop.
  ramp: ['along the ramp', 'sur rampe'],
  fast: ['fast', 'rapide'],
  freewheel: ['freewheel', 'roue libre'],
  dc_injection: ['DC injection', 'injection de courant continu'],
  trip: ['trip', 'mise en défaut'],
  // Checks of identity and watchdog.
  same: ['as it was', 'inchangée'],
  unchecked: ['not checked yet', 'pas encore contrôlée'],
  cannot_say: ['the drive does not tell', 'le variateur ne la donne pas'],
  changed: ['CHANGED', 'CHANGÉE'],
  no_contract: ['left as it is found', 'laissée telle quelle'],
  waits_for_standstill: ['waits for standstill', 'attend l’arrêt du moteur'],
  verified: ['armed and verified', 'armée et vérifiée'],
  broken: ['NOT as the contract says', 'NON conforme au contrat'],
  // Errors on a line.
  no_answer: ['no answer', 'sans réponse'],
  damaged: ['damaged', 'altérée'],
  late: ['late', 'en retard'],
  mismatched: ['not fitting', 'discordante'],
  foreign: ['foreign', 'étrangère'],
  exception: ['exception', 'exception'],
  echo: ['own echo', 'écho propre'],
  ok: ['ok', 'ok'],
  doubted: ['may be that to an earlier request', 'peut-être celle d’une requête antérieure'],
  busy: ['slave busy', 'esclave occupé'],
  broadcast: ['broadcast', 'diffusion'],
  put_aside: ['slave not ready, goes on later', 'esclave pas prêt, suite plus tard'],
  given_up: ['made way for a stop', 'a cédé la place à un arrêt'],
  line_lost: ['line lost', 'ligne perdue'],
  // Access of a parameter.
  read: ['read', 'lecture'],
  read_write: ['read, write', 'lecture, écriture'],
  write_stopped: ['read, write at standstill', 'lecture, écriture à l’arrêt'],
  write: ['write', 'écriture'],
  // Kinds of events.
  tripped: ['Tripped', 'Défaut'],
  trip_explained: ['Trip explained', 'Défaut expliqué'],
  fault_cleared: ['Fault cleared', 'Défaut effacé'],
  state_changed: ['State', 'État'],
  warning: ['Alarm of the drive', 'Alarme du variateur'],
  limit: ['Limit', 'Limite'],
  control_taken: ['Control taken', 'Commande prise'],
  control_elsewhere: ['Control elsewhere', 'Commande ailleurs'],
  control_returned: ['Control returned', 'Commande rendue'],
  start_took_command: ['Start took command', 'Démarrage : commande prise'],
  run_command_stands: ['Run command stands', 'Ordre de marche présent'],
  restarts_itself: ['Restarts itself', 'Redémarre seul'],
  identified: ['Identified', 'Identifié'],
  identity_changed: ['Identity changed', 'Identité changée'],
  other_family: ['Another family', 'Autre famille'],
  watchdog_verified: ['Watchdog verified', 'Surveillance vérifiée'],
  watchdog_broken: ['Watchdog broken', 'Surveillance non conforme'],
  stop_mode_replaced: ['Stop mode replaced', 'Type d’arrêt remplacé'],
  stop_took_command: ['Stop took command', 'Arrêt : commande prise'],
  stop_unconfirmed: ['STOP NOT CONFIRMED', 'ARRÊT NON CONFIRMÉ'],
  stop_confirmed: ['Stop confirmed', 'Arrêt confirmé'],
  command: ['Command', 'Commande'],
  eeprom_written: ['EEPROM written', 'EEPROM écrite'],
  value_withdrawn: ['Value withdrawn', 'Valeur retirée'],
  output_blocked: ['Output blocked', 'Sortie bloquée'],
  reference_taken: ['Reference taken', 'Consigne prise'],
  command_overridden: ['Command overridden', 'Commande supplantée'],
  contract_changed: ['Contract changed', 'Contrat modifié'],
  run_adopted: ['Run is ours again', 'Marche reprise à son compte'],
  run_not_adopted: ['Run is not ours', 'Marche étrangère'],
  exit: ['Exit', 'Fin du service'],
  removed: ['Removed', 'Retiré'],
  reconfigured: ['Settings changed', 'Réglages modifiés'],
  reload: ['Reload', 'Rechargement'],
  clock_stepped: ['Clock stepped', 'Horloge recalée'],
  audit_log: ['Audit log', 'Journal d’audit'],
};

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
];

/** The plain word for a word of the API; words that are not in the table stand for themselves. */
export function word(name) {
  if (name === undefined || name === null) return '';
  const key = String(name).replaceAll(' ', '_');
  return WORDS[key]?.[language() === 'fr' ? 1 : 0] ?? String(name).replaceAll('_', ' ');
}

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

/** What happened, without the kind of event that stands before it. */
export function eventText({ event, text = '' }) {
  const kind = String(event).replaceAll('_', ' ');
  const rest = text.startsWith(kind) ? text.slice(kind.length).replace(/^: /, '') : text;
  const change = rest.match(/^(\w+) to (\w+)$/);
  if (change) return `${word(change[1])} → ${word(change[2])}`;
  const given = rest.match(/^(.+) by (.+?): (confirmed|not confirmed|outcome unknown|refused|expired)(?:: (.+))?$/);
  if (given) {
    const [, what, who, how, why] = given;
    const became = why ? named(outcome(how), told(why)) : outcome(how);
    return named(`${command({ command: what })}, ${told(who)}`, became);
  }
  return told(rest);
}

/** What a drive does, in the one word with which its row begins everywhere: the daemon says which. */
export function stateWord(drive) {
  return word(drive.shows);
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
