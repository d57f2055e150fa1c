//! The words of a report in French. What a drive, its manual or its owner says stays as it was said.

/// A document whose own words are French: headings, labels, heads of tables, and sentences that are marked as the program's.
pub(super) fn translated(html: &str) -> String {
    let mut text = String::with_capacity(html.len() + html.len() / 8);
    let mut rest = html;
    while let Some((at, open, close)) = next(rest) {
        let begin = at + open;
        let Some(length) = rest[begin..].find(close) else { break };
        let said = &rest[begin..begin + length];
        text.push_str(&rest[..begin]);
        text.push_str(french(said).unwrap_or(said));
        rest = &rest[begin + length..];
    }
    text.push_str(rest);
    text.replacen("<html lang=\"en\">", "<html lang=\"fr\">", 1)
}

/// What of a document is the program's own and has no French words: nothing, in a document of known parts.
#[cfg(test)]
pub(super) fn untranslated(html: &str) -> Vec<String> {
    let (mut all, mut rest) = (Vec::new(), html);
    while let Some((at, open, close)) = next(rest) {
        let begin = at + open;
        let length = rest[begin..].find(close).unwrap();
        let said = &rest[begin..begin + length];
        if french(said).is_none() {
            all.push(said.to_owned());
        }
        rest = &rest[begin + length..];
    }
    all
}

/// The elements whose text is the program's own.
const OURS: [(&str, &str); 8] = [
    ("<h2>", "</h2>"),
    ("<h2 class=\"new\">", "</h2>"),
    ("<h4>", "</h4>"),
    ("<th scope=\"row\">", "</th>"),
    ("<th scope=\"col\">", "</th>"),
    ("<th scope=\"col\" class=\"number\">", "</th>"),
    ("<span class=\"own\">", "</span>"),
    ("<summary>", "</summary>"),
];

/// Where the next of them begins, how long its tag is, and how it ends.
fn next(html: &str) -> Option<(usize, usize, &'static str)> {
    let found = OURS.iter().filter_map(|(open, close)| Some((html.find(open)?, open.len(), *close)));
    found.min_by_key(|(at, ..)| *at)
}

fn french(english: &str) -> Option<&'static str> {
    WORDS.iter().find(|(known, _)| *known == english).map(|(_, french)| *french)
}

/// English as it stands in the document, and French.
const WORDS: &[(&str, &str)] = &[
    // Headings.
    ("What needs attention", "Ce qui demande attention"),
    ("The drives at a glance", "Les variateurs en un coup d’œil"),
    ("Lines", "Lignes"),
    ("Drives", "Variateurs"),
    ("Alarms", "Alarmes"),
    ("Settings of the program", "Réglages du programme"),
    ("How this report is to be read", "Comment lire ce rapport"),
    ("Signatures", "Signatures"),
    ("What it is", "Identité"),
    ("State now", "État actuel"),
    ("Hours, energy, measured values", "Heures, énergie, valeurs mesurées"),
    ("Communication watchdog", "Surveillance de la communication"),
    ("What nobody can know of it", "Ce que personne ne peut en savoir"),
    ("The last thirty days", "Les trente derniers jours"),
    ("Faults", "Défauts"),
    ("Changed since the backup", "Modifié depuis la sauvegarde"),
    ("Parameters that differ from the factory setting", "Paramètres différents du réglage usine"),
    ("What is wrong with it", "Ce qui ne va pas"),
    ("Plan against measured", "Prévu et mesuré"),
    ("How long answers took", "Durée des réponses"),
    ("Errors by kind", "Erreurs par type"),
    ("Availability", "Disponibilité"),
    // Labels.
    ("customer", "client"),
    ("technician", "technicien"),
    ("written", "rédigé"),
    ("told by", "source"),
    ("running since", "en marche depuis"),
    ("drives", "variateurs"),
    ("note", "remarque"),
    ("family", "famille"),
    ("vendor", "constructeur"),
    ("model", "modèle"),
    ("firmware", "version du logiciel"),
    ("serial number", "numéro de série"),
    ("compared with earlier", "comparé à avant"),
    ("state", "état"),
    ("read", "lu"),
    ("why", "raison"),
    ("output frequency", "fréquence de sortie"),
    ("shaft", "arbre"),
    ("motor current", "courant moteur"),
    ("control", "commande par"),
    ("fault code", "code de défaut"),
    ("warning", "avertissement"),
    ("words", "mots"),
    ("at reference", "à la consigne"),
    ("setpoint given", "consigne donnée"),
    ("starts by itself", "redémarre seul"),
    ("start", "démarrage"),
    ("statuses answered", "états répondus"),
    ("lost", "perdu"),
    ("trips seen by the program", "déclenchements vus par le programme"),
    ("running time", "temps de marche"),
    ("powered time", "temps sous tension"),
    ("input energy", "énergie absorbée"),
    ("output energy", "énergie fournie"),
    ("measured", "mesuré"),
    ("reference", "consigne"),
    ("speed", "vitesse"),
    ("output voltage", "tension de sortie"),
    ("line voltage", "tension réseau"),
    ("DC bus voltage", "tension du bus continu"),
    ("torque", "couple"),
    ("power", "puissance"),
    ("input power", "puissance absorbée"),
    ("output power", "puissance de sortie"),
    ("drive thermal", "état thermique du variateur"),
    ("motor thermal", "état thermique du moteur"),
    ("drive load", "charge du variateur"),
    ("motor load", "charge du moteur"),
    ("inputs", "entrées"),
    ("outputs", "sorties"),
    ("the program", "le programme"),
    ("armed", "armée"),
    ("timeout", "délai"),
    ("reaction", "réaction"),
    ("fed within", "alimentée en"),
    ("fed within, by the plan", "alimentée en, selon le plan"),
    ("margin", "marge"),
    ("days with readings", "jours avec des lectures"),
    ("known of them", "connu de ceux-ci"),
    ("the motor ran", "le moteur a tourné"),
    ("starts seen", "démarrages vus"),
    ("energy", "énergie"),
    ("above its limits", "au-dessus de ses limites"),
    ("with a warning of its own", "avec un avertissement du variateur"),
    ("greatest current", "courant le plus élevé"),
    ("tripped", "déclenchements"),
    (" by its own counter", " à son propre compteur"),
    (" summed up from its power", " calculés à partir de sa puissance"),
    (
        "not known: the drive tells neither a counter nor its power",
        "inconnue : le variateur ne donne ni compteur ni puissance",
    ),
    ("Nothing is kept of it.", "Rien n’en est conservé."),
    // Heads of tables.
    ("drive", "variateur"),
    ("line, address", "ligne, adresse"),
    ("answered", "répondu"),
    ("run time", "temps de marche"),
    ("differ from factory", "différents de l’usine"),
    ("history", "historique"),
    ("code", "code"),
    ("mnemonic", "mnémonique"),
    ("meaning", "signification"),
    ("what to do", "que faire"),
    ("parameter", "paramètre"),
    ("name", "nom"),
    ("value", "valeur"),
    ("factory", "usine"),
    ("before", "avant"),
    ("now", "maintenant"),
    ("figure", "grandeur"),
    ("planned", "prévu"),
    ("verdict", "jugement"),
    ("slave", "esclave"),
    ("milliseconds, each on the same axis", "millisecondes, même axe pour tous"),
    ("half within", "la moitié en"),
    ("99 of 100", "99 sur 100"),
    ("longest", "la plus longue"),
    ("given up after", "abandon après"),
    ("what went wrong", "ce qui a échoué"),
    ("sent", "envoyés"),
    ("no answer", "sans réponse"),
    ("damaged", "endommagée"),
    ("late", "en retard"),
    ("not fitting", "discordante"),
    ("exception", "exception"),
    ("damaged share", "part endommagée"),
    ("statuses that came", "états reçus"),
    ("share", "part"),
    ("due", "attendus"),
    ("not before the next", "pas avant le suivant"),
    ("off-line", "hors ligne"),
    ("time", "heure"),
    ("alarm", "alarme"),
    // Sentences.
    ("see the manual of the drive", "voir le manuel du variateur"),
    ("Alarms and history: ", "Alarmes et historique : "),
    (", address ", ", adresse "),
    (" on line ", " sur la ligne "),
    (", may be commanded", ", peut être commandé"),
    (", only read", ", en lecture seule"),
    ("yes", "oui"),
    ("no", "non"),
    (
        "a motor keeps turning when the line is lost",
        "un moteur continue de tourner quand la ligne est perdue",
    ),
    ("this family has none that can be read", "cette famille n’en a pas qui puisse être lue"),
    (", unless it is set at the drive", ", sauf réglage au variateur"),
    ("none: too late by ", "aucune : trop tard de "),
    (
        "None among the last events that the program remembers: ",
        "Aucune parmi les derniers événements que le programme a retenus : ",
    ),
    ("Older ones that are left out: ", "Plus anciennes, laissées de côté : "),
    (
        "Parameters as the manual prints the factory setting: ",
        "Paramètres conformes au réglage usine que le manuel imprime : ",
    ),
    (". Read at ", ". Lu le "),
    ("Parameters that cannot be judged: ", "Paramètres qui ne peuvent être jugés : "),
    ("it could not be read", "il n’a pas pu être lu"),
    ("the drive was not asked for it", "il n’a pas été demandé au variateur"),
    ("the manual prints no factory setting", "le manuel n’imprime pas de réglage usine"),
    ("left out", "laissé de côté"),
    ("not read", "non lu"),
    ("a line: ", "une ligne : "),
    ("line ", "ligne "),
    ("its port is away", "son port est absent"),
    (" of the exchanges: ", " des échanges : "),
    (
        "frames of somebody else were heard: a second master may be on it",
        "des trames de quelqu’un d’autre ont été entendues : un second maître y est peut-être",
    ),
    ("the settings ask for more than the line has: ", "les réglages demandent plus que la ligne n’a : "),
    ("The line", "La ligne"),
    ("Line ", "Ligne "),
    ("The port is away: ", "Le port est absent : "),
    ("Measured since the line was opened: ", "Mesuré depuis l’ouverture de la ligne : "),
    (", requests sent: ", ", requêtes envoyées : "),
    ("not measured", "non mesuré"),
    ("within the plan", "dans le plan"),
    ("MORE THAN PLANNED", "PLUS QUE PRÉVU"),
    ("more: questions and commands come on top", "plus : questions et ordres s’y ajoutent"),
    ("TOO SHORT", "TROP COURT"),
    ("kept", "respecté"),
    ("none is needed", "aucun n’est nécessaire"),
    ("one status of every drive", "un état de chaque variateur"),
    (
        "polls and watchdogs use, all drives running",
        "part des lectures et surveillances, tous les variateurs en marche",
    ),
    ("a stop is on the wire within", "un arrêt est sur le fil en"),
    ("  stops that were sent waited", "  les arrêts envoyés ont attendu"),
    ("all have confirmed a stop within", "tous ont confirmé un arrêt en"),
    ("a status waits for its turn", "un état attend son tour"),
    ("silence before a request", "silence avant une requête"),
    ("this computer writes later than it may by", "cet ordinateur écrit plus tard qu’il ne le peut, de"),
    ("requests sent again", "requêtes répétées"),
    ("frames of somebody else", "trames de quelqu’un d’autre"),
    ("bytes that make no frame", "octets qui ne font pas de trame"),
    ("port lost", "port perdu"),
    ("has not answered", "n’a pas répondu"),
    ("No slave of this line has answered.", "Aucun esclave de cette ligne n’a répondu."),
    (
        "From the end of a request to the first character of its answer. A bar is as high as its share of the highest of its slave; answers that were far shorter than the others stand at the left end.",
        "De la fin d’une requête au premier caractère de sa réponse. Une barre est haute comme sa part de la plus haute de son esclave ; les réponses bien plus courtes que les autres sont à l’extrémité gauche.",
    ),
    ("A full bar, as a share of the exchanges: ", "Une barre pleine, en part des échanges : "),
    ("from left to right: ", "de gauche à droite : "),
    ("asked", "interrogé"),
    ("OFF-LINE, asked again in ", "HORS LIGNE, de nouveau interrogé dans "),
    ("OFF-LINE", "HORS LIGNE"),
    ("not read: ", "non lu : "),
    ("not told by this family", "non communiqué par cette famille"),
    ("None.", "Aucun."),
    ("No fault is present.", "Aucun défaut présent."),
    ("The history of the drive is empty.", "L’historique du variateur est vide."),
    ("This family keeps no history of faults.", "Cette famille ne garde pas d’historique des défauts."),
    ("The drive would accept a reset.", "Le variateur accepterait un réarmement."),
    (
        "The drive would not accept a reset: its cause is still there.",
        "Le variateur n’accepterait pas de réarmement : la cause est toujours là.",
    ),
    ("Tripped: ", "Déclenché : "),
    ("What to do: ", "Que faire : "),
    (
        "Nothing: every drive answers, none has a fault, and every line is as it was planned.",
        "Rien : tous les variateurs répondent, aucun n’a de défaut, et chaque ligne est comme prévu.",
    ),
    ("Nothing was changed.", "Rien n’a été modifié."),
    ("No backup from before has this drive.", "Aucune sauvegarde d’avant ne contient ce variateur."),
    (
        "the line itself, watched for this report; nothing was written to it",
        "la ligne elle-même, observée pour ce rapport ; rien n’y a été écrit",
    ),
    ("the running daemon", "le démon en marche"),
    ("whose drives are simulated", "dont les variateurs sont simulés"),
    ("The program saw it at ", "Le programme l’a vu à "),
    ("Alarm without a trip: ", "Alarme sans déclenchement : "),
    (" before this report", " avant ce rapport"),
    ("NOT LIVE: ", "PAS ACTUEL : "),
    (", by the communication watchdog", ", par la surveillance de la communication"),
    ("place and date", "lieu et date"),
    (
        "Counts begin when the daemon began, or when the line was opened; hours and energy are the drive's own.",
        "Les compteurs partent du démarrage du démon ou de l’ouverture de la ligne ; heures et énergie sont celles du variateur.",
    ),
    (
        "“not read” says that something was asked for and did not come, with the reason; “not told by this family” that its manual has \
         no such value; “–” that there is nothing to count yet.",
        "« non lu » dit qu’une valeur a été demandée et n’est pas venue, avec la raison ; « non communiqué par cette famille », que son \
         manuel n’a pas cette valeur ; « – », qu’il n’y a encore rien à compter.",
    ),
    (
        "Factory settings are those of the manuals. A parameter for which the manual prints a rule instead of a number cannot be \
         judged, and stands in a list of its own.",
        "Les réglages usine sont ceux des manuels. Un paramètre pour lequel le manuel imprime une règle au lieu d’un nombre ne peut \
         être jugé, et figure dans une liste à part.",
    ),
    (
        "A figure of the plan is the longest there can be while no commands are given. “as the line has been” is the same with the \
         answer times that were measured.",
        "Une grandeur du plan est la plus longue possible tant qu’aucune commande n’est donnée. « as the line has been » est la même avec \
         les temps de réponse mesurés.",
    ),
    (
        "States, faults and the words of the program are as the program and the manuals say them.",
        "États, défauts et paroles du programme sont tels que le programme et les manuels les disent, en anglais.",
    ),
];
