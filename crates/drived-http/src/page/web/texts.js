// Every text of the page, in English and French, and the choice between them.

const TABLE = {
  // The frame.
  skip: ['Skip to the drives', 'Aller aux variateurs'],
  views: ['Views', 'Vues'],
  overview: ['Drives', 'Variateurs'],
  lines: ['Lines', 'Lignes'],
  events: ['Events', 'Événements'],
  language: ['Langue : français', 'Language: English'],
  other_language: ['FR', 'EN'],
  reading: ['reading…', 'lecture…'],
  live: ['live', 'en direct'],
  interrupted: ['reconnecting…', 'reconnexion…'],
  resting: ['the stop goes first, values are old', 'l’arrêt d’abord, valeurs anciennes'],
  silent: ['no news', 'plus de nouvelles'],
  away: ['daemon not reachable', 'service injoignable'],
  refused: ['log in to see the drives', 'identifiez-vous pour voir les variateurs'],
  banner_silent: ['No news from the daemon since {time}. Everything below is old.', 'Aucune nouvelle du service depuis {time}. Tout ce qui suit est ancien.'],
  banner_away: ['The daemon cannot be reached. It is tried again.', 'Le service est injoignable. Nouvel essai en cours.'],
  old: ['{age} old', 'il y a {age}'],
  named: ['{name}: {value}', '{name} : {value}'],
  close: ['Close', 'Fermer'],
  cancel: ['Cancel', 'Annuler'],
  all: ['All', 'Tous'],
  none: ['none', 'aucun'],
  yes: ['yes', 'oui'],
  no: ['no', 'non'],


  // The overview.
  search: ['Search', 'Rechercher'],
  search_hint: ['name, line, fault…', 'nom, ligne, défaut…'],
  group: ['Group', 'Groupe'],
  trouble: ['Trouble', 'Anomalies'],
  running_drives: ['Running', 'En marche'],
  standing_drives: ['Standing', 'À l’arrêt'],
  drives_shown: ['{count} drives', '{count} variateurs'],
  nothing_found: ['No drive fits the search.', 'Aucun variateur ne correspond.'],
  drive: ['Drive', 'Variateur'],
  state: ['State', 'État'],
  frequency: ['Frequency', 'Fréquence'],
  setpoint: ['Setpoint', 'Consigne'],
  current: ['Current', 'Courant'],
  note: ['Fault or remark', 'Défaut ou remarque'],
  control: ['Control', 'Commande'],
  age: ['Age', 'Âge'],
  to_setpoint: ['of {setpoint}', 'sur {setpoint}'],
  start_group: ['Start group', 'Démarrer le groupe'],
  stop_group: ['Stop group', 'Arrêter le groupe'],
  line_health: ['{connected} of {count} drives', '{connected} variateurs sur {count}'],
  line_away: ['line not connected', 'ligne non raccordée'],
  only_read: ['only read', 'lecture seule'],

  concern_stop_unconfirmed: ['STOP NOT CONFIRMED, the motor may turn', 'ARRÊT NON CONFIRMÉ, le moteur peut tourner'],
  concern_run_command_stands: ['a run command stands, the motor may start when control is given back', 'un ordre de marche subsiste, le moteur peut démarrer quand la commande est rendue'],
  concern_lost_running: ['lost while it was running, the motor may turn', 'perdu en marche, le moteur peut tourner'],
  concern_tripped: ['tripped', 'en défaut'],
  concern_run_suspended: ['its run command is not in force, the motor may start by it', 'son ordre de marche n’est pas en vigueur, le moteur peut démarrer par lui'],
  concern_identity_changed: ['another drive than before answers at its address', 'un autre variateur qu’auparavant répond à son adresse'],
  concern_other_family: ['a drive of another family answers at its address', 'un variateur d’une autre famille répond à son adresse'],
  concern_watchdog_broken: ['its watchdog is not as the contract says', 'sa surveillance n’est pas conforme au contrat'],
  concern_watchdog_not_in_force: ['its motor turns without the watchdog of its contract', 'son moteur tourne sans la surveillance de son contrat'],
  concern_lost: ['does not answer', 'ne répond pas'],
  concern_stale: ['what it shows is old', 'ce qu’il montre est ancien'],
  concern_restarts_itself: ['its own settings start the motor again by themselves', 'ses propres réglages redémarrent le moteur seuls'],
  concern_eeprom_worn: ['its EEPROM is written more often than it lasts', 'son EEPROM est écrite plus souvent qu’elle ne dure'],
  concern_limit_exceeded: ['above its limit', 'au-dessus de sa limite'],
  concern_warning: ['the drive shows an alarm', 'le variateur montre une alarme'],
  concern_control_taken: ['somebody else has taken control', 'quelqu’un d’autre a pris la commande'],
  concern_stop_pending: ['a stop is on its way, not confirmed yet', 'un arrêt est en cours, pas encore confirmé'],
  concern_coasting: ['output off, the shaft may coast', 'sortie coupée, l’arbre peut encore tourner'],
  concern_held: ['direct current holds the shaft', 'un courant continu maintient l’arbre'],
  concern_never_seen: ['not seen yet', 'pas encore vu'],
  fault_unexplained: ['the drive has not said why yet', 'le variateur n’a pas encore dit pourquoi'],
  fault_number: ['fault {code}', 'défaut {code}'],

  // One drive.
  unknown_drive: ['There is no drive of that name.', 'Aucun variateur de ce nom.'],
  line_of: ['line {line}, slave {slave}, {family}', 'ligne {line}, esclave {slave}, {family}'],
  torque: ['Torque', 'Couple'],
  speed: ['Speed', 'Vitesse'],
  rpm: ['rpm', 'tr/min'],
  output_power: ['Output power', 'Puissance de sortie'],
  trend: ['Trend', 'Tendance'],
  trend_pause: ['Pause', 'Pause'],
  trend_live: ['Live', 'Direct'],
  trend_minute: ['1 min', '1 min'],
  trend_ten: ['10 min', '10 min'],
  trend_hint: ['Drag to zoom. Gaps: nothing was known.', 'Glisser pour agrandir. Lacunes : rien n’était connu.'],
  trend_table: ['Values as a table', 'Valeurs en tableau'],
  trend_missing: ['There is no history of this drive: {why}', 'Pas d’historique de ce variateur : {why}'],
  time: ['Time', 'Heure'],
  orders: ['Commands', 'Commandes'],
  start: ['Start', 'Démarrer'],
  start_forward: ['Start forward', 'Marche avant'],
  start_reverse: ['Start reverse', 'Marche arrière'],
  stop: ['Stop', 'Arrêter'],
  stop_mode: ['Kind of stop', 'Type d’arrêt'],
  reset: ['Reset fault', 'Acquitter le défaut'],
  release: ['Give control back', 'Rendre la main'],
  set: ['Set', 'Appliquer'],
  set_setpoint: ['Set the setpoint', 'Régler la consigne'],
  limits_are: ['Limits {low} to {high}', 'Limites de {low} à {high}'],
  forbidden_are: ['Forbidden: {bands}', 'Bandes interdites : {bands}'],
  forbidden_now: ['{value} is forbidden here.', '{value} est interdit ici.'],
  only_read_long: ['This drive is only read: its configuration does not say control = true.', 'Ce variateur est seulement lu : sa configuration ne dit pas control = true.'],
  may_not_command: ['To command this drive, log in with a token that is for it.', 'Pour commander ce variateur, identifiez-vous avec un jeton qui vaut pour lui.'],
  start_refused: ['A start would be refused now: {why}', 'Un démarrage serait refusé à présent : {why}'],
  confirm_start: ['{drive}: start {direction}? The motor will turn.', '{drive} : démarrer {direction} ? Le moteur va tourner.'],
  confirm_start_at: ['{drive}: start {direction} at {setpoint}? The motor will turn.', '{drive} : démarrer {direction} à {setpoint} ? Le moteur va tourner.'],
  withdrawn_by_stop: ['question closed, a stop came meanwhile. Ask again if it is wanted still.', 'question fermée, un arrêt est arrivé entre-temps. Redemandez si cela reste voulu.'],
  withdrawn_by_stop_all: ['question closed, all drives are to stop. Ask again if it is wanted still.', 'question fermée, tous les variateurs doivent s’arrêter. Redemandez si cela reste voulu.'],
  confirm_reset: ['{drive}: reset the fault {fault}? No motor starts by it. See first that its cause is gone.', '{drive} : acquitter le défaut {fault} ? Aucun moteur ne démarre de ce fait. Vérifiez d’abord que sa cause a disparu.'],
  confirm_release: ['{drive}: give control back to panel or terminals?', '{drive} : rendre la main au terminal ou au bornier ?'],
  confirm_start_group: ['Start the {count} drives of the group {group}? The motors will turn.', 'Démarrer les {count} variateurs du groupe {group} ? Les moteurs vont tourner.'],
  confirm_parameter: ['{drive}: write {value} to {name}?', '{drive} : écrire {value} dans {name} ?'],
  in_direction_forward: ['forward', 'en avant'],
  in_direction_reverse: ['reverse', 'en arrière'],
  sent_at: ['sent at {time}', 'envoyé à {time}'],
  outcome_after: ['{outcome} at {time}, after {took}', '{outcome} à {time}, après {took}'],
  not_sent: ['not done: {why}', 'non exécuté : {why}'],
  not_found_again: ['not known: the daemon has no record of it. It did not arrive, or the daemon was restarted since', 'inconnu : le service n’en a pas trace. Il n’est pas arrivé, ou le service a redémarré depuis'],
  not_reached: ['the daemon cannot be reached; whether it took the command is not known', 'le service est injoignable ; on ignore s’il a pris la commande'],
  latest_orders: ['Latest commands', 'Dernières commandes'],
  measurements: ['Measurements', 'Mesures'],
  line_voltage: ['Line voltage', 'Tension réseau'],
  output_voltage: ['Output voltage', 'Tension de sortie'],
  dc_bus_voltage: ['DC bus voltage', 'Tension du bus continu'],
  power: ['Power', 'Puissance'],
  input_power: ['Input power', 'Puissance d’entrée'],
  drive_load: ['Drive load', 'Charge du variateur'],
  motor_load: ['Motor load', 'Charge du moteur'],
  energy_counts: ['Energy counter', 'Compteur d’énergie'],
  before_trip_values: ['Values from before the trip', 'Valeurs d’avant le défaut'],
  motor_thermal: ['Motor thermal state', 'État thermique moteur'],
  drive_thermal: ['Drive thermal state', 'État thermique variateur'],
  running_time: ['Motor running time', 'Temps de marche moteur'],
  powered_time: ['Powered time', 'Temps sous tension'],
  energy: ['Energy', 'Énergie'],
  inputs: ['Inputs', 'Entrées'],
  outputs: ['Outputs', 'Sorties'],
  identity: ['Identity', 'Identité'],
  model: ['Model', 'Modèle'],
  identity_codes: ['Codes', 'Codes'],
  firmware: ['Firmware', 'Logiciel'],
  checked: ['Check', 'Contrôle'],
  watchdog: ['Communication watchdog', 'Surveillance de la communication'],
  watchdog_time: ['Time', 'Temps'],
  watchdog_reaction: ['Reaction', 'Réaction'],
  counters: ['Counters', 'Compteurs'],
  polls: ['Polls', 'Scrutations'],
  answered: ['Answered', 'Avec réponse'],
  missed: ['Missed', 'Manquées'],
  failures: ['Failures', 'Échecs'],
  times_lost: ['Times lost', 'Pertes de liaison'],
  trips: ['Trips', 'Déclenchements'],
  saves: ['EEPROM saves', 'Sauvegardes EEPROM'],
  starts_by_itself: ['Starts by itself', 'Redémarre seul'],
  commanders: ['Commanders', 'Donneurs d’ordres'],
  anyone: ['anyone with the right', 'quiconque en a le droit'],
  words: ['Words of the drive', 'Mots du variateur'],
  register: ['Register', 'Registre'],
  value: ['Value', 'Valeur'],
  bits: ['Bits 15 … 0', 'Bits 15 … 0'],
  parameters: ['Parameters', 'Paramètres'],
  read_parameters: ['Read the parameters', 'Lire les paramètres'],
  reading_parameters: ['Reading register by register, behind everything urgent…', 'Lecture registre par registre, après tout ce qui est urgent…'],
  name: ['Name', 'Nom'],
  access: ['Access', 'Accès'],
  factory: ['Factory', 'Usine'],
  differs: ['changed', 'modifié'],

  // Faults.
  fault: ['Fault', 'Défaut'],
  fault_of: ['Tripped: {code} {mnemonic}', 'En défaut : {code} {mnemonic}'],
  what_to_do: ['What to do', 'Que faire'],
  by_watchdog: ['Its communication watchdog tripped it.', 'Déclenché par sa surveillance de la communication.'],
  freeze_frame: ['Freeze-frame', 'Instantané du défaut'],
  before_trip: ['Before the trip', 'Avant le défaut'],
  at_trip: ['At the trip', 'Au défaut'],
  now: ['Now', 'Maintenant'],
  fault_history: ['Fault history kept by the drive', 'Historique des défauts du variateur'],
  read_history: ['Read the history', 'Lire l’historique'],
  history_empty: ['The drive keeps no fault.', 'Le variateur n’a mémorisé aucun défaut.'],
  reset_not_now: ['Reset: only with a fault.', 'Acquittement : seulement en présence d’un défaut.'],

  // Lines.
  utilisation: ['Utilisation', 'Charge'],
  worst_stop: ['Worst-case stop on the wire', 'Arrêt sur le fil, pire cas'],
  cycle: ['Cycle', 'Cycle'],
  exchanges: ['Exchanges', 'Échanges'],
  errors: ['Errors', 'Erreurs'],
  port: ['Port', 'Port'],
  line_findings: ['What is wrong with this line', 'Ce qui ne va pas sur cette ligne'],
  to_do_next: ['Next', 'À faire'],
  exchange_times: ['Exchange times and errors by drive', 'Temps d’échange et erreurs par variateur'],
  usual: ['usual', 'usuel'],
  longest: ['longest', 'maximal'],
  of_hundred: ['99 of 100', '99 sur 100'],
  line_name: ['Line', 'Ligne'],
  answer_times: ['Until the answer begins', 'Jusqu’au début de la réponse'],
  only_probed: ['off-line, only probed: {count} probes, the next in {next}', 'hors ligne, sondé seulement : {count} sondages, le prochain dans {next}'],
  since_opening: ['since it was opened', 'depuis son ouverture'],
  last_exchanges: ['The last 100 exchanges, newest first', 'Les 100 derniers échanges, les plus récents en tête'],
  request: ['Request', 'Requête'],
  answer: ['Answer', 'Réponse'],
  hold: ['Hold', 'Figer'],
  go_on: ['Go on', 'Reprendre'],
  decimal: ['.', ','],
  answers: ['answers', 'répond'],
  no_answer_yet: ['no answer yet', 'pas encore de réponse'],
  slave: ['Slave', 'Esclave'],
  took: ['Took', 'Durée'],
  capture: ['Capture 10 s for Wireshark', 'Capturer 10 s pour Wireshark'],
  unknown_line: ['There is no line of that name.', 'Aucune ligne de ce nom.'],

  // Events.
  events_since: ['Commands with their outcome and what happened to the drives, newest first.', 'Les ordres avec leur issue et ce qui est arrivé aux variateurs, les plus récents en tête.'],
  no_events: ['Nothing has happened yet.', 'Rien ne s’est encore passé.'],
  kind: ['Kind', 'Type'],
  kind_all: ['Everything', 'Tout'],
  kind_command: ['Commands', 'Commandes'],
  kind_alarm: ['Alarms', 'Alarmes'],
  who: ['Who, from where', 'Qui, d’où'],
  what: ['What', 'Quoi'],
  outcome: ['Outcome', 'Issue'],
  csv: ['Save as CSV', 'Enregistrer en CSV'],

  // Rights.
  log_out: ['Log out', 'Se déconnecter'],
  log_in: ['Log in', 'S’identifier'],
  token: ['Token', 'Jeton'],
  login_why: ['This needs a right that you do not have here. A token that has it is made by: drived token add NAME --role operate', 'Il faut un droit que vous n’avez pas ici. Un jeton qui le donne se crée par : drived token add NOM --role operate'],
  login_wrong: ['No token is like that.', 'Ce jeton n’existe pas.'],
  login_done: ['Logged in. Nothing was sent: press the command again.', 'Identifié. Rien n’a été envoyé : redonnez la commande.'],

  // The demo.
  demo: ['Demonstration with simulated drives', 'Démonstration avec des variateurs simulés'],
  demo_trip: ['Trip a drive', 'Provoquer un défaut'],
  demo_trip_this: ['Trip {drive}', 'Mettre {drive} en défaut'],
  demo_pull: ['Pull the cable of {line}', 'Débrancher la ligne {line}'],
  demo_plug: ['Plug the cable of {line} in', 'Rebrancher la ligne {line}'],
};

const LANGUAGES = ['en', 'fr'];
const KEPT = 'drived.language';
// The path of the stop, which comes first, has chosen it.
let column = LANGUAGES.indexOf(document.documentElement.lang);

/** The language, as in `lang` attributes. */
export function language() {
  return LANGUAGES[column];
}

/** The text of this name, with `{names}` filled in. */
export function t(name, values = {}) {
  const text = TABLE[name]?.[column] ?? name;
  return text.replace(/\{(\w+)\}/g, (whole, key) => values[key] ?? whole);
}

/** A name with its value, as "Group: all". */
export function named(name, value) {
  return t('named', { name, value });
}

/** Changes to the other language; what is shown must be written again. */
export function switchLanguage() {
  column = 1 - column;
  try {
    localStorage.setItem(KEPT, language());
  } catch {
    // A browser that keeps nothing asks again the next time.
  }
}

/** Writes the texts of all elements that name one by `data-text` or `data-label`. */
export function writeTexts(root = document) {
  document.documentElement.lang = language();
  for (const element of root.querySelectorAll('[data-text]')) element.textContent = t(element.dataset.text);
  for (const element of root.querySelectorAll('[data-label]')) element.setAttribute('aria-label', t(element.dataset.label));
}
