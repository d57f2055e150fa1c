// What a line finds wrong with itself, in French: by its kind and its figures, never by the daemon's own sentence. The reports of the
// command line read these tables as they stand (page/french/findings.rs), line by line: plain strings, one to a line.

/** What an exception says (Modbus Application Protocol V1.1b3, section 7). */
const EXCEPTIONS = {
  1: 'il n’a pas cette fonction',
  2: 'il n’a pas ce registre',
  3: 'il n’accepte pas cette valeur ou ce nombre',
  4: 'il n’a pas pu l’exécuter',
  5: 'cela lui prendra longtemps',
  6: 'il est occupé',
  10: 'la passerelle n’a pas de chemin vers lui',
  11: 'la passerelle n’a pas eu de réponse de lui',
  253: 'une réponse négative d’UNI-TE, qui ne dit pas pourquoi',
};

/** From what it cannot be told. */
const ALIKE = {
  speed_too_low: 'd’une vitesse réglée trop bas',
  never_replies: 'd’esclaves qui acquittent tout et ne répondent jamais',
  old_answers: 'd’un intermédiaire qui redonne d’anciennes réponses',
  damaged_cable: 'd’un câble abîmé à ce variateur',
  twins: 'de deux variateurs pareils à la même adresse',
};

const TWO = [
  'couper un variateur après l’autre : si cette adresse répond encore quand le variateur qui doit l’avoir est coupé, un autre l’a aussi',
  'sinon un intermédiaire répète ce qu’il entend : un répéteur, une radio, une boucle de deux lignes',
];

/** What each kind says of its figures, and what to do next, the likeliest first. */
const KINDS = {
  far_end_faster: {
    says: ({ part }) => `${part} réponses sont arrivées plus tôt que la vitesse réglée ne le permet, et aucune à son heure : aucune n’a été prise`,
    next: [
      'un adaptateur sans UART, ou un programme, est plus rapide qu’une ligne : ajouter far-end-paces=no après le port, ou far_end_paces = false dans le fichier',
      'sinon la vitesse est réglée trop bas : voir dans les menus des variateurs laquelle c’est',
    ],
  },
  first_byte_cut: {
    says: ({ part, of }) => `il manque à ${part} réponses sur ${of} leur premier octet, et rien d’autre : leur contrôle le prouve`,
    next: [
      'l’adaptateur commence à écouter trop tard : le laisser changer de sens de lui-même, ou régler à 0 le délai de rs485 après l’émission',
      'donner à l’esclave une pause plus longue avant sa réponse, s’il a ce réglage (n65 d’un 3G3EV)',
      'voir la polarisation de la ligne : sans elle le premier caractère se perd souvent',
    ],
  },
  last_byte_cut: {
    says: ({ part, of }) => `il manque à ${part} réponses sur ${of} leur dernier octet, et rien d’autre : leur contrôle le prouve`,
    next: [
      'l’autre bout coupe son émetteur trop tôt : un adaptateur ou un convertisseur chez l’esclave, qui a un réglage pour cela',
      'prendre un autre adaptateur et comparer',
    ],
  },
  bytes_behind: {
    says: ({ part, of }) => `des octets qui n’appartiennent à rien suivent ${part} réponses sur ${of}`,
    next: [
      'un adaptateur qui entend sa propre commutation, ou une ligne sans polarisation : vérifier que la ligne a sa polarisation une fois et sa terminaison aux deux bouts',
      'prendre un autre adaptateur et comparer',
    ],
  },
  one_answer_behind: {
    says: ({ part, of }) => `${part} réponses sur ${of} sont arrivées avec la question suivante : quelque chose retient chacune`,
    next: [
      'un intermédiaire garde chaque réponse jusqu’à la question suivante : voir les réglages de tampon ou de mise en paquets du serveur série (« packing length », « force transmit »), et le redémarrer',
      'un délai plus long n’aide pas : la réponse arrive avec la question suivante, quel que soit son moment',
    ],
  },
  refuses_all: {
    says: ({ part, of, exception }) => `${part} questions sur ${of} ont eu pour réponse l’exception ${exception}, aucune n’a eu de valeur`,
    says_all: ({ of, exception }) => `les ${of} questions ont toutes eu pour réponse l’exception ${exception}, aucune n’a eu de valeur`,
    next: [
      'une autre famille que celle qui est nommée, ou un autre appareil, par exemple un compteur, a cette adresse : voir ce qui s’y trouve',
      'drived scan dit quelles familles ce pourrait être',
    ],
  },
  refuses_all_gateway: {
    next: ['c’est la passerelle qui le dit : vérifier que le variateur derrière elle est sous tension, et que vitesse et format sont justes sur la ligne de la passerelle'],
  },
  refuses_all_busy: {
    next: [
      'voir ce qui occupe le variateur : un autre maître, son clavier, un paramètre en cours d’enregistrement',
      'couper et remettre le variateur, quand rien n’en dépend',
    ],
  },
  two_at_one_address: {
    says: ({ part, of }) => `${part} questions sur ${of} ont eu deux réponses différentes, ou une que deux ont dite à la fois`,
    next: TWO,
  },
  answers_twice: {
    says: ({ part, of }) => `${part} réponses sur ${of} sont arrivées deux fois`,
    next: TWO,
  },
  second_master: {
    says: ({ part }) => `quelqu’un d’autre interroge sur cette ligne : ${part} requêtes entendues`,
    says_every: ({ part, every }) => `quelqu’un d’autre interroge sur cette ligne : ${part} requêtes entendues, une toutes les ${every} s`,
    next: ['trouver l’autre maître (un automate, un terminal, une passerelle, un second programme) et mettre fin à ses questions : une ligne Modbus en a un seul'],
  },
  number_zero: {
    says: ({ part }) => `${part} réponses portent le numéro de transaction 0, quel que soit celui de leur question : aucune n’a été prise`,
    next: ['l’autre bout ne rend pas le numéro de transaction comme Modbus TCP le veut : voir s’il parle RTU sur TCP (rtu+tcp://), ou prendre le dernier logiciel de son constructeur'],
  },
  fell_silent: {
    says: ({ part, silent }) => `il répondait, et ne répond plus depuis ${silent} s : les ${part} dernières questions n’ont pas apporté un seul octet`,
    next: [
      'vérifier l’alimentation des variateurs et le câble à l’adaptateur : aucun réglage ne change tout seul',
      'débrancher l’adaptateur et le rebrancher : s’ils répondent alors, c’est lui qui était bloqué',
    ],
  },
  link_timeout: {
    says: ({ part, of }) => `à ${part} questions sur ${of} un acquittement est arrivé quand la ligne les avait abandonnées, et rien d’autre`,
    next: ['des esclaves acquittent plus tard que la ligne n’attend : ajouter link-timeout=200ms ou plus après unitelway'],
  },
};

/** A finding in French, as the daemon tells it in English; nothing where its kind is not known here. */
export function findingFr(finding) {
  const kind = KINDS[finding.defect];
  if (!kind) return undefined;
  const { part, of, code, every_ms: every, silent_ms: silent } = finding;
  const alike = ALIKE[finding.alike];
  const says = (part === of && kind.says_all) || (every && kind.says_every) || kind.says;
  return {
    text: says({ part, of, exception: exception(code), every: every && seconds(every), silent: silent && Math.floor(silent / 1000) }),
    alike: alike ? `un maître ne peut pas le distinguer ${alike}` : '',
    next: (KINDS[`${finding.defect}_${refuser(code)}`] ?? kind).next,
  };
}

/** Who refuses by this exception. */
function refuser(code) {
  if (code === 10 || code === 11) return 'gateway';
  return code === 5 || code === 6 ? 'busy' : '';
}

function exception(code) {
  return code && `${code.toString(16).toUpperCase().padStart(2, '0')}h (${EXCEPTIONS[code] ?? 'que la spécification ne nomme pas'})`;
}

function seconds(ms) {
  return (ms / 1000).toFixed(1).replace('.', ',');
}
