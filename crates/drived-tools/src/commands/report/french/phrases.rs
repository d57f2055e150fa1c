//! What the program says with figures or names in it, in French. `{}` is a number, `{w}` what has French words itself, `{s}` what has or
//! stays, `{r}` what stays as it is; `{0}` is the first of them.

/// English and French; longer patterns stand before those that would take a part of them.
pub(super) const PHRASES: &[(&str, &str)] = &[
    // The line.
    ("{} as the line has been", "{0} avec la ligne telle qu’elle a été"),
    ("{} half of them, {} at the most", "{0} pour la moitié, {1} au plus"),
    ("{} of 99 in 100, {} at the most", "{0} pour 99 sur 100, {1} au plus"),
    ("{} at the most, of {}", "{0} au plus, sur {1}"),
    ("{} are needed", "{0} nécessaires"),
    ("{} at the least", "{0} au moins"),
    ("{} ({} of {})", "{0} ({1} sur {2})"),
    ("unknown ({})", "inconnu ({0})"),
    ("{} ({} lately)", "{0} ({1} récemment)"),
    (
        "{r}: half of the answers within {}, the longest {}",
        "{0} : la moitié des réponses en {1}, la plus longue {2}",
    ),
    ("all: {} of {} exchanges went wrong", "tous : {0} échanges sur {1} ont échoué"),
    ("{r}: {} of {} exchanges went wrong", "{0} : {1} échanges sur {2} ont échoué"),
    ("{r}: {} of {} statuses came", "{0} : {1} états sur {2} sont arrivés"),
    ("{r}\u{a0}·\u{a0}no drive of the program", "{0}\u{a0}·\u{a0}aucun variateur du programme"),
    ("address {}", "adresse {0}"),
    // A drive.
    ("would be refused now: {s}", "serait refusé maintenant : {0}"),
    (
        "could NOT be brought to what the settings say: {s}",
        "n’a PAS pu être amenée à ce que disent les réglages : {0}",
    ),
    ("{} times today", "{0} fois aujourd’hui"),
    ("{} times", "{0} fois"),
    ("code {}, whose meaning is not known here", "code {0}, dont la signification n’est pas connue ici"),
    ("the manual has a rule: {s}", "règle : {0}"),
    ("it depends on {s}, which is not known", "il dépend de {0}, qui n’est pas connu"),
    ("the manual prints no factory setting with {s}", "le manuel n’imprime pas de réglage usine avec {0}"),
    ("{s}, with {r} = {r}: {s}, with {r} = {r}: {s}", "{0}, avec {1} = {2} : {3}, avec {4} = {5} : {6}"),
    ("{s}, with {r} = {r}: {s}", "{0}, avec {1} = {2} : {3}"),
    ("{s}, on {r}: {s}", "{0}, sur {1} : {2}"),
    // What troubles it.
    ("for {}: {s}", "depuis {0} : {1}"),
    ("for {}", "depuis {0}"),
    ("{s} stop, sent in {} attempts", "arrêt {0}, envoyé en {1} tentatives"),
    ("{s} stop, sent in 1 attempt", "arrêt {0}, envoyé en 1 tentative"),
    ("{s} stop, not sent yet", "arrêt {0}, pas encore envoyé"),
    ("{s} stop for {}, the drive is stopping", "arrêt {0} depuis {1}, le variateur s’arrête"),
    ("{s} stop for {}, it is repeated", "arrêt {0} depuis {1}, il est répété"),
    ("{r} instead of {r}", "{0} au lieu de {1}"),
    ("current {} of {}", "courant {0} pour {1}"),
    ("thermal state of the drive {} of {}", "état thermique du variateur {0} pour {1}"),
    ("thermal state of the motor {} of {}", "état thermique du moteur {0} pour {1}"),
    ("the watchdog is {s}; the contract says {s}", "surveillance : {0} ; contrat : {1}"),
    ("off, then {s}", "coupée, puis {0}"),
    ("{}, then {s}", "{0}, puis {1}"),
    ("by {r}", "par {0}"),
    // What happened.
    ("lost for {}: {s}", "liaison perdue depuis {0} : {1}"),
    ("lost for {}", "liaison perdue depuis {0}"),
    (
        "tripped, found so by its communication watchdog after {} without a message: {s}",
        "en défaut, trouvé ainsi, par sa surveillance de communication après {0} sans message : {1}",
    ),
    (
        "tripped by its communication watchdog after {} without a message: {s}",
        "déclenché par sa surveillance de communication après {0} sans message : {1}",
    ),
    (
        "tripped, found so after {} without a message: {s}",
        "en défaut, trouvé ainsi, après {0} sans message : {1}",
    ),
    ("tripped after {} without a message: {s}", "déclenché après {0} sans message : {1}"),
    (
        "tripped, found so by its communication watchdog: {s}",
        "en défaut, trouvé ainsi, par sa surveillance de communication : {0}",
    ),
    ("tripped by its communication watchdog: {s}", "déclenché par sa surveillance de communication : {0}"),
    ("tripped, found so: {s}", "en défaut, trouvé ainsi : {0}"),
    ("tripped, found so", "en défaut, trouvé ainsi"),
    ("tripped: {s}", "déclenché : {0}"),
    (
        "stop unconfirmed since {} after {} attempts: {s}",
        "arrêt non confirmé depuis {0} après {1} essais : {2}",
    ),
    (
        "run command stands, it may start the motor when control is given back: {s}",
        "un ordre de marche subsiste, il peut démarrer le moteur quand la commande est rendue : {0}",
    ),
    (
        "restarts itself: {s} (not accepted, so that a start is refused)",
        "redémarre seul : {0} (non accepté, de sorte qu’un démarrage est refusé)",
    ),
    ("limit: {s}, exceeded", "limite : {0}, dépassée"),
    // What an exchange brought.
    ("slave {}, reading register {} ({r}): {s}", "esclave {0}, lecture du registre {1} ({2}) : {3}"),
    ("slave {}, writing register {} ({r}): {s}", "esclave {0}, écriture du registre {1} ({2}) : {3}"),
    ("slave {}, function {r}: {s}", "esclave {0}, fonction {1} : {2}"),
    ("slave {}: {s}", "esclave {0} : {1}"),
    ("exception {r}, {s}", "exception {0}, {1}"),
    ("no answer within {}", "sans réponse en {0}"),
    ("the answer was damaged ({r})", "réponse altérée ({0})"),
    ("the answer does not fit the request ({r})", "la réponse ne correspond pas à la demande ({0})"),
    ("the outcome of the write is unknown ({s})", "l’issue de l’écriture est inconnue ({0})"),
    ("the slave is off-line, {s}", "l’esclave est hors ligne, {0}"),
    ("next probe in {}", "prochain essai dans {0}"),
    ("the line is down ({s})", "la ligne est coupée ({0})"),
    // A fault of a manual: its number, its mnemonic and what it means.
    ("{} {r}: {s}", "{0} {1} : {2}"),
    // What a drive does, and how; in brackets where it did.
    ("({w})", "({0})"),
    ("fault {r}", "défaut {0}"),
    ("{w} forward", "{0}, avant"),
    ("{w} reverse", "{0}, arrière"),
    // Any other event, by its kind.
    ("{w}: {s}", "{0} : {1}"),
];
