// The daemon's sentences in French: why it refuses, what a drive says instead, what to do. They come in English, put
// together from the phrases and patterns here; the manuals' mnemonics stay as they are. What is not here stays English.

import { FAULTS_FR } from './faults_fr.js';

/** Whole sentences, and the phrases that stand in others. */
export const SENTENCES_FR = {
  'the history begins: nothing is known of before': 'l’historique commence : rien n’est connu d’avant',
  'the daemon began': 'le service a commencé',
  'the daemon ended as it should': 'le service a pris fin comme il se doit',
  'the run before had ended as it should': 'le précédent avait pris fin comme il se doit',
  'the run before ended without a word: it was killed, power was cut, or its end could not be written': 'le précédent a cessé sans un mot : tué, privé de courant, ou sa fin n’a pu être écrite',
  'the configuration was read again, or too much happened at once: what was told just before may be missing here': 'la configuration a été relue, ou trop de choses sont arrivées à la fois : ce qui fut dit juste avant peut manquer ici',
  // Why a command is refused.
  'the drive is only read: its settings say control = false': 'le variateur est seulement lu : sa configuration indique control = false',
  'the drive does not answer': 'le variateur ne répond pas',
  'its status is too old': 'son état est trop ancien',
  'it is another drive than before: accept its identity first': 'ce n’est plus le même variateur : accepter d’abord son identité',
  'it has not been possible to check which drive it is': 'son identité n’a pas pu être contrôlée',
  'its communication watchdog is not verified': 'sa surveillance de communication n’est pas vérifiée',
  'a stop of it is not confirmed yet': 'un arrêt n’est pas encore confirmé',
  'a stop came before it was sent': 'un arrêt est arrivé avant son envoi',
  'a later command took its place before it was sent': 'un ordre ultérieur l’a remplacé avant son envoi',
  'it was withdrawn before it was sent': 'il a été retiré avant son envoi',
  'too many commands for this drive wait': 'trop d’ordres attendent pour ce variateur',
  'the daemon is about to end: until it has, only stops are carried out': 'le service est sur le point de s’arrêter : d’ici là, seuls les arrêts sont exécutés',
  'the fleet has shut down': 'le service est arrêté',
  'no run command of this side stood any more': 'aucun ordre de marche de ce côté n’était plus donné',
  'its time was over': 'son délai est passé',
  'the fleet has ended meanwhile: it was sent, or may have been, and nobody looks after it any more': 'le service s’est arrêté entre-temps : il a été envoyé, ou peut l’avoir été, et personne ne le suit plus',
  'its time was over before it was sent: it never will be': 'son délai est passé avant l’envoi : il ne sera jamais envoyé',
  'another start of a group was under way': 'un autre démarrage de groupe était en cours',
  'nobody of the group was started: another of its drives was not ready': 'aucun variateur du groupe n’a été démarré : un autre n’était pas prêt',
  'the group was stopped again, because not all of its drives started': 'le groupe a été arrêté de nouveau, car tous ses variateurs n’ont pas démarré',
  'the drive has tripped: remove the cause, then reset it': 'le variateur est en défaut : supprimer la cause, puis acquitter',
  'this bus commands the drive already: stop it first': 'ce bus commande déjà le variateur : l’arrêter d’abord',
  'the terminals command the drive: switch off the input that gives them command, or set the channel of commands to the bus': 'le bornier commande le variateur : ouvrir l’entrée qui lui donne la commande, ou régler le canal de commande sur le bus',
  'the panel commands the drive: give command back at the panel, or set the channel of commands to the bus': 'le terminal commande le variateur : y rendre la commande, ou régler le canal de commande sur le bus',
  'the terminals or the panel command the drive: switch off what forces local control, or set the channel of commands to the bus': 'le bornier ou le terminal commande le variateur : supprimer le forçage local, ou régler le canal de commande sur le bus',
  'another bus commands the drive: give command back there, or set the channel of commands to this one': 'un autre bus commande le variateur : y rendre la commande, ou régler le canal de commande sur celui-ci',
  'the drive\'s settings forbid this direction: allow it there, or start the other way': 'les réglages du variateur interdisent ce sens : l’y autoriser, ou démarrer dans l’autre sens',
  'nothing has changed since the last save: change a parameter first': 'rien n’a changé depuis la dernière sauvegarde : modifier d’abord un paramètre',
  'the saves that were counted have used up the EEPROM\'s life: replace the drive, or correct the count': 'les sauvegardes comptées ont épuisé la durée de vie de l’EEPROM : remplacer le variateur, ou corriger le compte',
  'the motor runs: stop it first': 'le moteur tourne : l’arrêter d’abord',
  'the drive is another one than before, by what it says of itself: see which one stands there, and accept it if it is meant': 'le variateur n’est plus celui d’avant, d’après ce qu’il dit de lui-même : voir lequel est là, et l’accepter si c’est bien lui',
  'the limits are in hertz, give the setpoint in hertz': 'les limites sont en hertz : donner la consigne en hertz',
  'the drive has limits: give the setpoint with the start': 'le variateur a des limites : donner la consigne avec le démarrage',

  // What to do about alarms that are of no drive.
  'look at its adapter or serial server, and at the plug': 'examiner son adaptateur ou son serveur série, et la prise',
  'look at the motors, then at the cable of the line and at the supply of its drives': 'regarder les moteurs, puis le câble de la ligne et l’alimentation de ses variateurs',
  'have it done, and say so: drived alarms done NUMBER': 'faites-le faire, et dites-le : drived alarms done NUMÉRO',
  'drived doctor says more': 'drived doctor en dit davantage',
  'see whether the motor turns; once its drive is in the configuration again, it is watched and can be stopped from here': 'voir si le moteur tourne ; dès que son variateur est de nouveau dans la configuration, il est surveillé et peut être arrêté d’ici',
  'see whether the motor turns; once its drive is in the configuration again, the stop is given anew': 'voir si le moteur tourne ; dès que son variateur est de nouveau dans la configuration, l’arrêt est redonné',
  'see whether its disk is full; the log of the program says why': 'voir si son disque est plein ; le journal du programme dit pourquoi',
  'see what is said of it, mend the file, and read it again': 'voir ce qui en est dit, corriger le fichier et le relire',
  'look at its supply, its address and its cable': 'vérifier son alimentation, son adresse et son câble',

  // What happens to the daemon itself.
  'the audit log cannot be written: only stops are carried out': 'le journal d’audit ne peut pas être écrit : seuls les arrêts sont exécutés',
  'the audit log is written again': 'le journal d’audit est de nouveau écrit',

  // What to do about a state of the drive.
  'switch on the supply of its power part and wait until it is ready': 'mettre sous tension sa partie puissance et attendre qu’il soit prêt',
  'wait until the motor stands': 'attendre l’arrêt du moteur',
  'stop it first': 'l’arrêter d’abord',
  'remove the cause, then reset it': 'supprimer la cause, puis acquitter',
  'start it first': 'le démarrer d’abord',
  'see what its display says, for its manual does not explain its status word': 'voir son afficheur, car son manuel n’explique pas ce mot d’état',

  // What to do about what troubles a drive.
  'use the emergency stop, then look at the drive; the stop is repeated': 'utiliser l’arrêt d’urgence, puis voir le variateur ; l’arrêt est répété',
  'stop the drive at its panel before control is given back': 'arrêter le variateur à son terminal avant de rendre la commande',
  'look at the motor, then at the drive\'s supply and its cable': 'voir le moteur, puis l’alimentation du variateur et son câble',
  'see which drive it is, then accept its identity': 'voir quel variateur c’est, puis accepter son identité',
  'set it up as what it is: until then it is only read, and stopped when that is asked for': 'le configurer comme ce qu’il est : d’ici là il n’est que lu, et arrêté sur demande',
  'set it at the drive as is said; until then it is not started': 'le régler sur le variateur comme il est dit ; d’ici là il n’est pas démarré',
  'see who writes its parameters, and why its watchdog does not stay as it is set': 'voir qui écrit ses paramètres, et pourquoi sa surveillance ne reste pas comme réglée',
  'set it at the drive, or change the contract': 'la régler sur le variateur, ou changer le contrat',
  'stop the motor: it is set up at standstill': 'arrêter le moteur : elle est réglée à l’arrêt',
  'look at its supply, its address and its cable': 'voir son alimentation, son adresse et son câble',
  'see which drive it is, and whether it is set up as that': 'voir quel variateur c’est, et s’il est configuré comme tel',
  'see how busy its line is': 'voir à quel point sa ligne est chargée',
  'switch them off at the drive, or accept them by name': 'les désactiver sur le variateur, ou les accepter par leur nom',
  'look at load, fan and filters, or at who gives a frequency above its limit': 'voir la charge, le ventilateur et les filtres, ou qui donne une fréquence au-dessus de sa limite',
  'see what 100 % is at the drive (its reference frequency), its lowest and highest speed, and who else gives it a setpoint': 'voir ce que valent 100 % au variateur (sa fréquence de référence), ses vitesses minimale et maximale, et qui d’autre lui donne une consigne',
  'read its faults: they name the alarm': 'lire ses défauts : ils nomment l’alarme',
  'give control back there': 'y rendre la commande',
  'wait until it is confirmed': 'attendre qu’il soit confirmé',
  'the current heats the motor: it ends with its time, or with a ramp stop': 'le courant échauffe le moteur : il cesse à son terme, ou par un arrêt sur rampe',
  'keep away from the shaft until it is seen to stand': 'se tenir à l’écart de l’arbre tant qu’on ne l’a pas vu à l’arrêt',
  'wait, or look at its supply, its address and its cable': 'attendre, ou voir son alimentation, son adresse et son câble',

  // What became of it.
  'a later command took its place': 'un ordre ultérieur l’a remplacé',
  'it was withdrawn': 'il a été retiré',
  'a stop came': 'un arrêt est arrivé',
  'the drive tripped': 'le variateur est passé en défaut',
  'the drive was lost': 'la liaison avec le variateur a été perdue',
  'nothing has confirmed it yet': 'rien ne l’a encore confirmé',
  'the drive has never been seen': 'le variateur n’a jamais été vu',
  'left as it is': 'laissé tel quel',
  'left turning, it was not started here': 'laissé en marche, il n’a pas été démarré ici',
  'given up, its stop is not confirmed': 'abandonné, son arrêt n’est pas confirmé',

  // Who commands by itself.
  'the demo': 'la démonstration',
  tripped: 'après un défaut',

  // What the line or the drive answered.
  'another answer came to the same question': 'une autre réponse est arrivée à la même question',
  'the drive does not have this function': 'le variateur n’a pas cette fonction',
  'the drive does not have this register, or not for this access': 'le variateur n’a pas ce registre, ou pas pour cet accès',
  'the drive does not take this value or quantity': 'le variateur n’accepte pas cette valeur ou cette quantité',
  'the drive refuses it now: stop the motor first, and see that it is supplied and not busy': 'le variateur refuse pour l’instant : arrêter d’abord le moteur, vérifier qu’il est alimenté et libre',
  'the drive could not complete it': 'le variateur n’a pas pu l’achever',
  'the drive has accepted it and takes long for it': 'le variateur l’a accepté et met du temps à l’exécuter',
  'the drive is busy': 'le variateur est occupé',
  'the drive refuses it and says no reason': 'le variateur le refuse sans dire pourquoi',
  'what stands between has no way to the drive': 'ce qui est entre deux n’a pas de chemin vers le variateur',
  'a code that the manual does not list': 'un code que le manuel ne cite pas',
  'the register cannot hold it': 'le registre ne peut pas la contenir',
  'expired before it was sent': 'délai passé avant l’envoi',
  'superseded by a later call before it was sent': 'remplacé par un appel ultérieur avant l’envoi',
  'the line is closed': 'la ligne est fermée',

  // Altivar 21.
  'a freewheel stop that the bus has not ordered (ST = OFF, FD01 bit 11)': 'un arrêt roue libre que le bus n’a pas demandé (ST = OFF, FD01 bit 11)',
  'see to the input or the setting that holds it': 'voir l’entrée ou le réglage qui le maintient',
  'another command word in FA00 than was written': 'un autre mot de commande dans FA00 que celui écrit',
  'see who else writes to this drive': 'chercher qui d’autre écrit dans ce variateur',
  'another reference than the one that was given (FE02 shows it)': 'une autre référence que celle qui a été donnée (FE02 la montre)',
  'a DC injection that the bus has not ordered (FD01 bit 7)': 'une injection de courant continu que le bus n’a pas demandée (FD01 bit 7)',
  'a main circuit without its voltage (MOFF, FD01 bit 3)': 'un circuit de puissance sans tension (MOFF, FD01 bit 3)',
  'switch its supply on, and start it again if it is to run': 'rétablir son alimentation, puis le redémarrer s’il doit tourner',
  'an emergency stop (FD01 bit 12)': 'un arrêt d’urgence (FD01 bit 12)',
  'see who has given it, and reset it': 'chercher qui l’a donné, et le réarmer',
  'a stop by the drive itself, at its lower limit or by a lack of supply (FD01 bit 14 is off)': 'un arrêt par le variateur lui-même, à sa petite vitesse ou par manque d’alimentation (FD01 bit 14 à 0)',
  'see to its alarms (FC91)': 'voir ses alarmes (FC91)',
  'a stop at the drive (FD01 bits 10 and 13 do not show that it runs)': 'un arrêt au variateur (FD01 bits 10 et 13 ne montrent pas qu’il tourne)',
  'see to the keypad and the inputs, and start it again if it is to run': 'voir le terminal et les entrées, puis le redémarrer s’il doit tourner',
  'something behind the reference (FD00 comes no nearer to FE02)': 'quelque chose après la référence (FD00 ne se rapproche pas de FE02)',
  'see to the PID control (FA00 bit 5), the lower limit, the jump frequencies and an overload': 'voir le régulateur PID (FA00 bit 5), la petite vitesse, les fréquences occultées et une surcharge',
  'an input that cannot be read, for the drive has no FD06, and that may be on,': 'une entrée qui ne peut pas être lue, car le variateur n’a pas de FD06, et qui est peut-être fermée,',
  'set CMOD = 2, so that the inputs command nothing': 'régler CMOD = 2, pour que les entrées ne commandent rien',
  'the drive refuses its watchdog (exception 04) though the motor stands: see to the supply of its power part and to a lock of its parameters': 'le variateur refuse son chien de garde (exception 04) bien que le moteur soit arrêté : voir l’alimentation de sa partie puissance et un verrouillage de ses paramètres',
  'it says that it is an Altivar 212: no family here fits, and nothing but a stop is written to it': 'il dit être un Altivar 212 : aucune famille d’ici ne convient, et rien d’autre qu’un arrêt ne lui est écrit',
  'it says that it is an Altivar 312: set it up as one of the family atv312': 'il dit être un Altivar 312 : le déclarer de la famille atv312',
  'it says that it is an Altivar 28: set it up as one of the family atv28': 'il dit être un Altivar 28 : le déclarer de la famille atv28',
  'it says that it is an Altivar 58: set it up as one of the family atv58': 'il dit être un Altivar 58 : le déclarer de la famille atv58',
  'its identification (43/14) names no Altivar 21: see what it is, for nothing but a stop is written to it': 'son identification (43/14) ne nomme pas d’Altivar 21 : voir ce qu’il est, car rien d’autre qu’un arrêt ne lui est écrit',
  'give the setpoint again, and see to the drive\'s lower limit': 'redonner la consigne et vérifier la petite vitesse du variateur',
  'switch it off first, or set CMOD = 2': 'l’ouvrir d’abord, ou régler CMOD = 2',
  'the keypad (FE45 = 1)': 'le terminal (FE45 = 1)',
  'press its LOC/REM key, or set CMOD = 2': 'appuyer sur sa touche LOC/REM, ou régler CMOD = 2',
  'the terminal strip (FE45 = 0)': 'le bornier (FE45 = 0)',
  'switch off the input whose function is 48, 52 or 53 (F110 to F113, F118), or set CMOD = 2': 'ouvrir l’entrée dont la fonction est 48, 52 ou 53 (F110 à F113, F118), ou régler CMOD = 2',
  'local control (FD01 bit 15)': 'la commande locale (FD01 bit 15)',
  'press the keypad\'s LOC/REM key': 'appuyer sur la touche LOC/REM du terminal',
  'a source that the manual does not list (FE45)': 'une source que le manuel ne cite pas (FE45)',
  'set CMOD = 2': 'régler CMOD = 2',
  'set FMOD = 4, or switch off the input that switches the reference (F112 = 38) or forces local control (48)': 'régler FMOD = 4, ou ouvrir l’entrée qui commute la référence (F112 = 38) ou force le local (48)',
  'the analog input VIA (FE46 = 1)': 'l’entrée analogique VIA (FE46 = 1)',
  'the analog input VIB (FE46 = 2)': 'l’entrée analogique VIB (FE46 = 2)',
  'the keypad\'s reference (FE46 = 3)': 'la référence du terminal (FE46 = 3)',
  'press its LOC/REM key, or set FMOD = 4': 'appuyer sur sa touche LOC/REM, ou régler FMOD = 4',
  'the up and down inputs (FE46 = 5)': 'les entrées plus vite et moins vite (FE46 = 5)',
  'a preset speed (FE46 = 255)': 'une vitesse présélectionnée (FE46 = 255)',
  'stop by the bus, or switch off the inputs that choose it': 'arrêter par le bus, ou ouvrir les entrées qui la choisissent',
  'a reference that the manual does not list (FE46)': 'une référence que le manuel ne cite pas (FE46)',
  'CMOD = 2 leaves the command with the bus: set CMOD to 0 or 1': 'CMOD = 2 laisse la commande au bus : régler CMOD à 0 ou 1',
  'FA20 bit 12 works only with FA00 bit 15, the command priority: open the drive with Authority::Priority': 'FA20 bit 12 n’agit qu’avec FA00 bit 15, la priorité de commande : ouvrir le variateur avec Authority::Priority',

  // Altivar 28 and 58.
  'a limit of the drive (ETA bit 11: LFRD is below LSP or above HSP)': 'une limite du variateur (ETA bit 11 : LFRD est sous LSP ou au-dessus de HSP)',
  'see LSP and HSP at the drive, then give a setpoint between them': 'voir LSP et HSP au variateur, puis donner une consigne entre elles',
  'another reference (FrH is not the reference of the bus)': 'une autre référence (FrH n’est pas la référence du bus)',
  'see which inputs are in use: preset speeds (SP2 to SP7), jog, summing inputs, the PI regulator': 'voir quelles entrées servent : vitesses présélectionnées (SP2 à SP7), pas à pas, entrées sommatrices, régulateur PI',
  'a run command of the terminals (LI1 or LI2)': 'un ordre de marche du bornier (LI1 ou LI2)',
  'open the inputs first': 'ouvrir d’abord les entrées',
  'the drive has no IOLR (W478), so nothing tells which logic inputs are closed': 'le variateur n’a pas IOLR (W478) : rien n’indique quelles entrées logiques sont fermées',
  'an input that is on (002Bh, or bits 4 to 6 of 0001h), which may start the motor by another function,': 'une entrée active (002Bh, ou bits 4 à 6 de 0001h), qui pourrait démarrer le moteur par une autre fonction,',
  'open the input first: it might start the motor': 'ouvrir d’abord l’entrée : elle pourrait démarrer le moteur',
  'a reference on the bus (LFr or LFRD) is negative: give a setpoint in its unit first': 'une référence du bus (LFr ou LFRD) est négative : donner d’abord une consigne dans son unité',
  'another reference (the mapped reference is not that of W401)': 'une autre référence (la référence affectée n’est pas celle de W401)',
  'see which input gives it, or correct the map of the words': 'voir quelle entrée la donne, ou corriger l’affectation des mots',
  'the reference W401 is negative: give a setpoint first': 'la référence W401 est négative : donner d’abord une consigne',

  'a reference on the bus (LFr or LFRD) is negative: stop the motor, and give a setpoint in its unit first': 'une référence du bus (LFr ou LFRD) est négative : arrêter le moteur et donner d’abord une consigne dans son unité',
  'a reference that another master has written (LFr or LFRD)': 'une référence écrite par un autre maître (LFr ou LFRD)',
  'see which one it is, and give the setpoint again': 'voir lequel, et donner la consigne à nouveau',
  'stop the motor by the bus first, which says whom it takes command from, or reset the fault at the drive': 'arrêter d’abord le moteur par le bus, ce qui dit à qui il prend la commande, ou réarmer le défaut au variateur',
  'whoever has command, for any word of the bus takes it from him,': 'celui qui a la commande, que tout mot du bus lui prend,',
  'CMD holds a run command, which may act when control moves: stop the motor first': 'CMD contient un ordre de marche, qui peut agir quand la commande change de main : arrêter d’abord le moteur',
  'the reference on the bus is negative: stop the motor, and give a setpoint before the start': 'la référence du bus est négative : arrêter le moteur et donner une consigne avant la mise en marche',
  'whoever has command, for at LAC = L1 and L2 any word of the bus takes it from him,': 'celui qui a la commande, qu’avec LAC = L1 ou L2 tout mot du bus lui prend,',
  'a reference that another master has written (W401)': 'une référence écrite par un autre maître (W401)',
  'a run command of the terminals, whose inputs no word tells, while local control is forced,': 'un ordre de marche du bornier, dont aucun mot ne dit les entrées, pendant que la commande locale est forcée,',
  'a stop at the drive that has disabled operation, by an input or a key,': 'un arrêt au variateur qui a interdit la marche, par une entrée ou une touche,',
  'a stop at the drive, by an input or a key,': 'un arrêt au variateur, par une entrée ou une touche,',
  'give control back to the line first, or reset the fault at the drive': 'rendre d’abord la commande à la liaison, ou réarmer le défaut au variateur',
  'see which one it is, and start again': 'voir lequel, et remettre en marche',
  'see which one it is, release it, and start again': 'voir lequel, le relâcher, et remettre en marche',
  'stop the motor, and give a setpoint': 'arrêter le moteur et donner une consigne',
  'the drive\'s map names no bit that tells whether local control is forced: name it (`remote`), or reset the fault at the drive': 'l’affectation du variateur ne nomme aucun bit qui dise si la commande locale est forcée : le nommer (`remote`), ou réarmer le défaut au variateur',
  'the reference W401 is negative: stop the motor, and give a setpoint': 'la référence W401 est négative : arrêter le moteur et donner une consigne',
  'the sign of the reference W401, which another master has turned round,': 'le signe de la référence W401, qu’un autre maître a inversé,',
  'whoever turns the motor the other way, the sign of a reference, an input or a key,': 'ce qui fait tourner le moteur dans l’autre sens, le signe d’une consigne, une entrée ou une touche,',
  'see what decides instead; the run command is withdrawn, unless that was accepted': 'voir ce qui décide à la place ; l’ordre de marche est retiré, sauf si cela a été accepté',

  // Altivar 312.
  'see which inputs and channels are in use (Fr1, Fr2, rFC, SA2, SA3, PS2 to PS16, JOG, PIF)': 'voir quelles entrées et quels canaux servent (Fr1, Fr2, rFC, SA2, SA3, PS2 à PS16, JOG, PIF)',
  'a run command of the terminals (LI1, or the input of rrS)': 'un ordre de marche du bornier (LI1, ou l’entrée de rrS)',
  'open the input first, or set tCt to trn': 'ouvrir d’abord l’entrée, ou régler tCt sur trn',
  'a summing input (SA2, AI2 as the drive leaves the factory, or SA3)': 'une entrée sommatrice (SA2, AI2 en réglage usine, ou SA3)',
  'set SA2 and SA3 to nO': 'régler SA2 et SA3 sur nO',
  'the PI regulator (PIF)': 'le régulateur PI (PIF)',
  'set PIF to nO, or regulate by PISP': 'régler PIF sur nO, ou réguler par PISP',
  'the reference channel Fr1, which is not Mdb,': 'le canal de référence Fr1, qui n’est pas Mdb,',
  'the reference channel Fr2, which is not Mdb,': 'le canal de référence Fr2, qui n’est pas Mdb,',
  'a reference channel, Fr1 or Fr2, of which none is Mdb,': 'un canal de référence, Fr1 ou Fr2, dont aucun n’est Mdb,',
  'set Fr1 to Mdb and rFC to Fr1': 'régler Fr1 sur Mdb et rFC sur Fr1',
  'the reference channel Fr2, selected by rFC (LRS3 bit 0),': 'le canal de référence Fr2, sélectionné par rFC (LRS3 bit 0),',
  'the reference channel Fr1, selected by rFC (LRS3 bit 0),': 'le canal de référence Fr1, sélectionné par rFC (LRS3 bit 0),',
  'set rFC so that the channel which is Mdb is selected': 'régler rFC de sorte que le canal Mdb soit sélectionné',
  'a stop by a logic input (nSt, FSt or dCI)': 'un arrêt par une entrée logique (nSt, FSt ou dCI)',
  'close the input of nSt or FSt, or open that of dCI': 'fermer l’entrée de nSt ou FSt, ou ouvrir celle de dCI',
  'jog operation (JOG) by its input': 'la marche pas à pas (JOG) par son entrée',
  'open the input, or set JOG to nO': 'ouvrir l’entrée, ou régler JOG sur nO',
  'a preset speed (PS2 to PS16) by its input': 'une vitesse présélectionnée (PS2 à PS16) par son entrée',
  'open the input, or set PS2 to PS16 to nO': 'ouvrir l’entrée, ou régler PS2 à PS16 sur nO',
  'a function is assigned to bit 11 of CMD, so it does not reverse: free that bit': 'une fonction est affectée au bit 11 de CMD, qui n’inverse donc pas : libérer ce bit',
  'AdC injects current into a motor at rest without a run command (p. 41): disable operation first, by a freewheel stop': 'AdC injecte du courant dans un moteur à l’arrêt sans ordre de marche (p. 41) : verrouiller d’abord, par un arrêt roue libre',
  'the access level is none that the manual lists: set LAC to L1, L2 or L3': 'le niveau d’accès n’est pas de ceux du manuel : régler LAC sur L1, L2 ou L3',
  'the drive checks no consistency and is locked on standstill (CMI bit 15): clear that bit': 'le variateur ne contrôle pas la cohérence et est verrouillé à l’arrêt (CMI bit 15) : remettre ce bit à 0',
  'the drive is locked on standstill (CMI bit 13): clear that bit': 'le variateur est verrouillé à l’arrêt (CMI bit 13) : remettre ce bit à 0',
  'the drive is saving its parameters to EEPROM (ETI bit 0): try again in a moment': 'le variateur enregistre ses paramètres en EEPROM (ETI bit 0) : réessayer dans un instant',
  'the reference on the bus is negative: give a setpoint before the start': 'la référence du bus est négative : donner une consigne avant le démarrage',
  'by Atr the drive resets its fault and starts the motor again by itself, for as long as tAr says': 'par Atr le variateur acquitte son défaut et redémarre seul le moteur, aussi longtemps que le dit tAr',

  // 3G3EV.
  'the panel or the terminals (run command, bit A of 002Ch)': 'la console ou le bornier (ordre de marche, bit A de 002Ch)',
  'give the command back at the panel, or set n02 = 5, save it, and switch the drive off and on': 'rendre la commande à la console, ou régler n02 = 5, enregistrer, puis couper et remettre le variateur sous tension',
  'the panel or the terminals (reference, bit 9 of 002Ch)': 'la console ou le bornier (référence, bit 9 de 002Ch)',
  'give the reference back at the panel, or set n02 = 5, save it, and switch the drive off and on': 'rendre la référence à la console, ou régler n02 = 5, enregistrer, puis couper et remettre le variateur sous tension',
  'another reference than the one that was given (0023h shows it)': 'une autre référence que celle qui a été donnée (0023h la montre)',
  'see who else writes 0002h and which inputs choose a speed (n06 to n08), then give the setpoint again': 'voir qui d’autre écrit 0002h et quelles entrées choisissent une vitesse (n06 à n08), puis redonner la consigne',
  'another command word in 0001h than was written': 'un autre mot de commande dans 0001h que celui écrit',
  'something that keeps the output off (bit 8 of 002Ch)': 'quelque chose qui maintient la sortie coupée (bit 8 de 002Ch)',
  'see to the inputs (n06 to n08) and to the panel\'s STOP key': 'vérifier les entrées (n06 à n08) et la touche STOP de la console',
  'a lack of voltage (bit 7 of 002Ch)': 'un manque de tension (bit 7 de 002Ch)',
  'switch the supply on, and start it again if it is to run': 'rétablir l’alimentation, puis le redémarrer s’il doit tourner',
  'a stop at the drive (RUN is off in 0020h and 002Ch)': 'un arrêt au variateur (RUN est à 0 dans 0020h et 002Ch)',
  'see to the panel and the inputs (n06 to n08), and start it again if it is to run': 'voir la console et les entrées (n06 à n08), puis le redémarrer s’il doit tourner',
  'another reference in 0002h than was given': 'une autre référence dans 0002h que celle qui a été donnée',
  'n39 was changed and acts at the next power-up: switch the drive off and on, then forget() reads it again': 'n39 a été modifié et agit à la prochaine mise sous tension : couper et remettre le variateur, puis forget() le relit',

  // What a drive from a file does not tell, and why it refuses.
  'which way it turns cannot be seen, as far as is known': 'le sens de rotation ne se voit pas, pour autant qu’on sache',
  'the drive tells who commands it only where it is not the bus': 'le variateur ne dit qui le commande que si ce n’est pas le bus',
  'the drive tells who gives its reference only where it is not the bus': 'le variateur ne dit qui donne sa référence que si ce n’est pas le bus',
  'the drive does not tell who commands it': 'le variateur ne dit pas qui le commande',
  'the drive does not tell who gives its reference': 'le variateur ne dit pas qui donne sa référence',
  'whether the drive tells who commands it is not known': 'on ne sait pas si le variateur dit qui le commande',
  'whether the drive tells who gives its reference is not known': 'on ne sait pas si le variateur dit qui donne sa référence',
  'its communication watchdog is off from the factory': 'sa surveillance de communication est coupée en réglage usine',
  'its communication watchdog is off from the factory; whoever polls it reads how it is set, and feeds it': 'sa surveillance de communication est coupée en réglage usine ; qui l’interroge lit son réglage et l’entretient',
  'a command word alone feeds its communication watchdog, and none is repeated: where it is set, it acts behind each': 'seul un mot de commande relance sa surveillance de communication, et aucun n’est répété : si elle est réglée, elle agit après chacun',
  'it has no communication watchdog: it runs on when the line is lost': 'il n’a pas de surveillance de communication : il continue de tourner si la ligne est perdue',
  'whether it stops by itself when the line is lost is not known': 'on ne sait pas s’il s’arrête de lui-même quand la ligne est perdue',
  'whether each setpoint wears an EEPROM is not known': 'on ne sait pas si chaque consigne use une EEPROM',
  'a run command that stands may start the motor when its power comes back': 'un ordre de marche resté en place peut démarrer le moteur au retour du courant',
  'a run command that this side has not given': 'un ordre de marche que ce côté n’a pas donné',
  'stop the motor first, and see what else commands it; a setpoint alone changes the speed of one that runs': 'arrêter d’abord le moteur, et voir ce qui d’autre le commande ; une consigne seule change la vitesse d’un moteur qui tourne',
  'the drive does not tell who commands it, and a reset may start the motor by another\'s run command: see that nothing else commands it, and say so by commands-alone = yes': 'le variateur ne dit pas qui le commande, et un acquittement peut démarrer le moteur par l’ordre d’un autre : s’assurer que rien d’autre ne le commande, et le dire par commands-alone = yes',
  'its setpoint is its run command, and none was given since it was reached: give it one, then start it': 'sa consigne est son ordre de marche, et aucune n’a été donnée depuis qu’il est joint : en donner une, puis démarrer',
  'the setpoint that stands in it is negative and turns its motor the other way: stop the motor, and give a setpoint before the start': 'la consigne qui s’y trouve est négative et fait tourner son moteur dans l’autre sens : arrêter le moteur, et donner une consigne avant le démarrage',
  'the setpoint that stands in it is not the one that was given to it: another master has written it, or a power cut has taken it: give one before the start': 'la consigne qui s’y trouve n’est pas celle qui lui a été donnée : un autre maître l’a écrite, ou une coupure l’a effacée : en donner une avant le démarrage',
  'the setpoint that stands in it is above what may be given to it: give one before the start': 'la consigne qui s’y trouve dépasse ce qu’on peut lui donner : en donner une avant le démarrage',
  'the drive counts in percent of a frequency that it does not tell: say it by full-scale, or give a setpoint in percent': 'le variateur compte en pour cent d’une fréquence qu’il ne dit pas : la donner par full-scale, ou donner la consigne en pour cent',
  'the drive does not tell how fast it may turn: say it by highest': 'le variateur ne dit pas jusqu’où il peut tourner : le dire par highest',
  'something that the drive does not tell: its motor runs, and its output was not seen to go to this setpoint; another setpoint, perhaps,': 'quelque chose que le variateur ne dit pas : son moteur tourne, et sa sortie n’a pas été vue aller à cette consigne ; une autre consigne, peut-être,',
  'see whose reference the drive goes by': 'voir de qui le variateur suit la référence',
  'something else than the bus': 'autre chose que le bus',
  'give command and reference to the bus at the drive': 'donner au variateur commande et référence au bus',
  'another setpoint than was given': 'une autre consigne que celle qui a été donnée',
  'see who else writes to this drive, and that its reference is that of the bus': 'voir qui d’autre écrit à ce variateur, et que sa référence est celle du bus',
  'another command word than was written': 'un autre mot de commande que celui qui a été écrit',
  'something that the drive does not tell, such as a stop at it, an input, another master or its supply,': 'ce que le variateur ne dit pas, tel qu’un arrêt à lui-même, une entrée, un autre maître ou son alimentation,',
  'stop it, see what holds it, and start it again if it is to run': 'l’arrêter, voir ce qui le retient, et le redémarrer s’il doit tourner',
  'its setpoint is its run command, so that nothing was written: the next start gives it': 'sa consigne est son ordre de marche : rien n’a été écrit, le prochain démarrage la donne',
  'its register reads back as it was written, and the drive does not tell whose setpoint it goes by: start it, and see its output': 'son registre se relit comme il a été écrit, et le variateur ne dit pas de qui il suit la consigne : le démarrer, et voir sa sortie',
  'it was written, and its profile has no register that holds the setpoint in force: start it, and see its output': 'elle a été écrite, et son profil n’a pas de registre qui tienne la consigne en vigueur : le démarrer, et voir sa sortie',
  'its setpoint is its run command, and the motor does not run by the one that was given: stop it, then start it': 'sa consigne est son ordre de marche, et le moteur ne tourne pas par celle qui a été donnée : l’arrêter, puis le démarrer',
};

/** The plain French word for a word of the API, from the page's own table of them. */
let wordOf = name => name;

/** Takes the words of states, directions and places of control from the page's table. */
export function useWords(word) {
  wordOf = word;
}

// Longer patterns stand before those that would take a part of them.
const PATTERNS = [
  [/^it is not as it was shown: (.+)$/, why => `ce n’est plus comme affiché : ${french(why)}`],
  [/^the drive that was called (.+) is called (.+) now$/, (was, now) => `le variateur qui s’appelait ${was} s’appelle ${now} à présent`],
  [/^the drive that was called (.+) is there no more$/, name => `le variateur qui s’appelait ${name} n’est plus là`],
  [/^(.+) is the name of another drive now$/, name => `${name} est à présent le nom d’un autre variateur`],
  [/^(.+) has come to those that are meant$/, name => `${name} s’est ajouté à ceux qui sont visés`],
  [/^(.+) is none of those that are meant any more$/, name => `${name} n’est plus de ceux qui sont visés`],
  [/^the setpoint of (.+) is (\S+ \S+) now$/, (name, setpoint) => `la consigne de ${name} est ${number(setpoint)} à présent`],
  [/^(.+) is driven forward now$/, name => `${name} est entraîné en avant à présent`],
  [/^(.+) is driven in reverse now$/, name => `${name} est entraîné en arrière à présent`],
  [/^(.+) is not driven any more$/, name => `${name} n’est plus entraîné`],
  [/^the setpoint of (.+) is not known any more$/, name => `la consigne de ${name} n’est plus connue`],
  [/^another setpoint is on its way to (.+): (\S+ \S+)$/, (name, setpoint) => `une autre consigne est en route vers ${name} : ${number(setpoint)}`],
  [/^this is the port of line "(.+)", whose drives are asked there already: a scan would disturb them$/, line => `ce port est celui de la ligne « ${line} », dont les variateurs y sont déjà interrogés : une recherche les gênerait`],
  [/^another scan is under way: give it up first$/, () => 'une autre recherche est en cours : abandonnez-la d’abord'],
  [/^the port of line "(.+)" is being scanned: wait for it, or give the scan up$/, line => `le port de la ligne « ${line} » est en cours de recherche : attendez-en la fin, ou abandonnez-la`],
  [/^(.+) has a run command of this daemon, or a stop that is not confirmed: it could not be stopped from here any more\. Stop it first$/, drive => `${drive} a un ordre de marche de ce service, ou un arrêt non confirmé : on ne pourrait plus l’arrêter d’ici. Arrêtez-le d’abord`],
  [/^somebody else has begun to ask on this line, and the scan has ended: end his asking first, then scan again$/, () => 'quelqu’un d’autre s’est mis à interroger cette ligne, et la recherche a pris fin : mettez fin à ses questions, puis cherchez de nouveau'],
  [/^somebody else asks on this line: (\d+) requests in (.+?)\. This scan disturbs him, and he it: end his asking first, then scan again$/, (count, time) => `quelqu’un d’autre interroge cette ligne : ${count} requêtes en ${number(time)}. Cette recherche le gêne, et lui la gêne : mettez fin à ses questions, puis cherchez de nouveau`],
  [/^there is no serial port (.+?)(?:: present: (.+))?$/, (port, there) => `il n’y a pas de port série ${port}${there ? ` ; présents : ${there}` : ''}`],
  [/^the files have changed since they were read, and by them (.+): drived reload first$/, what => `les fichiers ont changé depuis leur lecture, et selon eux ${what} : d’abord drived reload`],
  [/^its setpoint of (.+) is in the drive, and its run word was not sent: (.+)$/, (setpoint, why) => `sa consigne de ${number(setpoint)} est dans le variateur, et son ordre de marche n’a pas été envoyé : ${french(why)}`],
  [/^after ([\d.]+) s the drive says (.+), ([\d.]+) s ago$/, (after, status, ago) => `après ${number(after)} s le variateur indique ${state(status)}, il y a ${number(ago)} s`],
  [/^the drive has said nothing for ([\d.]+) s$/, time => `le variateur n’a rien dit pendant ${number(time)} s`],
  [/^the drive was last seen (.+), ([\d.]+) s ago$/, (status, ago) => `vu pour la dernière fois ${state(status)}, il y a ${number(ago)} s`],
  [/^the drive says (.+)$/, status => `le variateur indique ${state(status)}`],
  [/^the drive's state is "(.+?)": (.+)$/, (status, remedy) => `état du variateur : « ${state(status)} » : ${french(remedy)}`],
  [/^the drive has tripped \(fault (\d+)\): remove the cause, then reset it$/, code => `le variateur est en défaut (${code}) : supprimer la cause, puis acquitter`],
  [/^"(.+)" may not command this drive$/, name => `« ${name} » n’a pas le droit de commander ce variateur`],
  [/^(\S+ Hz) is outside the limits (\S+ Hz) to (\S+ Hz)$/, (asked, low, high) => `${number(asked)} est hors des limites ${number(low)} à ${number(high)}`],
  [/^(\S+ Hz) is outside the limits from (\S+ Hz)$/, (asked, low) => `${number(asked)} est au-dessous de la limite ${number(low)}`],
  [/^(\S+ Hz) is outside the limits up to (\S+ Hz)$/, (asked, high) => `${number(asked)} est au-dessus de la limite ${number(high)}`],
  [/^(\S+ Hz) is in the forbidden band (\S+ Hz) to (\S+ Hz)$/, (asked, low, high) => `${number(asked)} est dans la bande interdite ${number(low)} à ${number(high)}`],
  [/^(\S+ Hz) is too far from the last setpoint: (\S+ Hz) to (\S+ Hz) is allowed now$/, (asked, low, high) =>
    `${number(asked)} est trop loin de la dernière consigne : ${number(low)} à ${number(high)} à présent`],
  [/^(?:input )?(\w+) by its function forced local control \((F\d+) = 48\)$/, (input, code) => `${input} par sa fonction forçage local (${code} = 48)`],
  [/^(?:input )?(\w+) by its function forced operation \((F\d+) = 52\)$/, (input, code) => `${input} par sa fonction fonctionnement forcé (${code} = 52)`],
  [/^(?:input )?(\w+) by its function forced run \((F\d+) = 53\)$/, (input, code) => `${input} par sa fonction marche forcée (${code} = 53)`],
  [/^switch it off, or give (F\d+) another function$/, code => `l’ouvrir, ou donner à ${code} une autre fonction`],
  [/^(?:input )?(\w+), which is on, with the terminals in command once FA00 is 0,$/, input => `${input}, qui est fermée, le bornier commandant dès que FA00 vaut 0,`],
  [/^started (forward|reverse)(?: at ([\d.]+ Hz))?(: its motor still turns the other way, and comes down first)?(: its setpoint is zero)?$/, (way, at, round, zero) =>
    `démarré en ${way === 'forward' ? 'avant' : 'arrière'}${at ? ` à ${number(at)}` : ''}${round ? ' : le moteur tourne encore dans l’autre sens et ralentit d’abord' : ''}${zero ? ' : sa consigne est nulle' : ''}`],
  [/^setpoint (.+?): (.+)$/, (setpoint, why) => `consigne ${number(setpoint)} : ${french(why)}`],
  [/^(.+) decides instead: (.+)$/, (by, remedy) => `${french(by)} décide à la place : ${french(remedy)}`],
  [/^(.+): switch (\w+) off, or accept it by name \(accept-self-restart \w+\)$/, (what, code) => `${french(what)} : désactiver ${code}, ou l’accepter par son nom (accept-self-restart ${code})`],
  [/^slave (\d+), (reading|writing) register (\d+) \((\w+)\): (.+)$/, (slave, verb, register, hex, why) =>
    `esclave ${slave}, ${verb === 'reading' ? 'lecture' : 'écriture'} du registre ${register} (${hex}) : ${french(why)}`],
  [/^slave (\d+), function (\w+): (.+)$/, (slave, code, why) => `esclave ${slave}, fonction ${code} : ${french(why)}`],
  [/^slave (\d+): (.+)$/, (slave, why) => `esclave ${slave} : ${french(why)}`],
  [/^exception (\w+), (.+)$/, (code, meaning) => `exception ${code}, ${french(meaning)}`],
  [/^negative reply (\w+), (.+)$/, (code, meaning) => `réponse négative ${code}, ${french(meaning)}`],
  [/^no answer within (.+)$/, time => `sans réponse pendant ${number(time)}`],
  [/^the answer was damaged \((.+)\)$/, why => `réponse altérée (${why})`],
  [/^the answer does not fit the request \((.+)\)$/, why => `la réponse ne correspond pas à la demande (${why})`],
  [/^the outcome of the write is unknown \((.+)\)$/, why => `l’issue de l’écriture est inconnue (${french(why)})`],
  [/^the slave is off-line, (.+)$/, when => `l’esclave est hors ligne, ${french(when)}`],
  [/^the line is down \((.+)\)$/, why => `la ligne est coupée (${why})`],
  [/^its owner allows (.+) to (.+)$/, (low, high) => `son propriétaire admet ${number(low)} à ${number(high)}`],
  [/^the drive allows (.+) to (.+)$/, (low, high) => `le variateur admet ${number(low)} à ${number(high)}`],
  [/^the drive lets its motor turn no faster than (\S+ Hz) \((.+)\), and its setpoint is (\S+ Hz): raise that at the drive, or give a lower setpoint$/, (high, code, asked) =>
    `le variateur ne laisse pas tourner son moteur au-delà de ${number(high)} (${code}), et sa consigne est ${number(asked)} : relever cette limite sur le variateur, ou donner une consigne plus basse`],
  [/^the drive takes steps of (.+)$/, step => `le variateur procède par pas de ${number(step)}`],
  [/^the watchdog is (.+); the contract says (.+)$/, (is, contract) => `surveillance : ${reaction(is)} ; contrat : ${reaction(contract)}`],
  [/^nothing was heard for ([\d.]+) s, whoever was asked$/, time => `rien n’a été entendu pendant ${number(time)} s, qui que l’on ait interrogé`],
  [/^expired before it was sent$/, () => 'expiré avant d’être envoyé'],
  [/^for ([\d.]+) s(?:: (.+))?$/, (time, why) => `depuis ${number(time)} s${why ? ` : ${french(why)}` : ''}`],
  [/^fault (\d+)$/, code => `défaut ${code}`],
  [/^(\d+) (\w+): (.+)$/, (code, mnemonic, meaning) => `${code} ${mnemonic} : ${FAULTS_FR[meaning] ?? meaning}`],
  [/^by its communication watchdog(?: after (.+) without a message)?(?:: (.+))?$/, (time, what) =>
    `par sa surveillance de communication${time ? ` après ${number(time)} sans message` : ''}${what ? ` : ${french(what)}` : ''}`],
  [/^after (.+) without a message(?:: (.+))?$/, (time, what) =>
    `après ${number(time)} sans message${what ? ` : ${french(what)}` : ''}`],
  [/^(.+ stop), sent (\d+) times?$/, (stop, times) => `${reaction(stop)}, envoyé ${times} fois`],
  [/^(.+ stop) for (.+), (the drive is stopping|it is repeated)$/, (stop, time, how) =>
    `${reaction(stop)} depuis ${number(time)}, ${how === 'it is repeated' ? 'il est répété' : 'le variateur s’arrête'}`],
  [/^((?:current|thermal state) [^,]+ of [^,]+, .+)$/, all => all.split(', ').map(french).join(', ')],
  [/^current (.+) of (.+)$/, (is, limit) => `courant ${number(is)} pour ${number(limit)}`],
  [/^thermal state of the (drive|motor) (.+) of (.+)$/, (whose, is, limit) =>
    `état thermique ${whose === 'drive' ? 'du variateur' : 'du moteur'} ${number(is)} pour ${number(limit)}`],
  [/^(.*) instead of (.*)$/, (found, remembered) => `${found} au lieu de ${remembered}`],
  [/^it is an? (.+): (.+)$/, (what, family) => `c’est un ${what} : ${family}`],
  [/^(\d+) times today$/, times => `${times} fois aujourd’hui`],
  [/^next probe in (.+)$/, time => `prochain essai dans ${number(time)}`],
  [/^it was called (.+)$/, name => `il s’appelait ${name}`],
  [/^by (bus|terminals|panel|local|other bus)$/, who => ({ bus: 'par le bus', terminals: 'par le bornier', panel: 'par le terminal', local: 'en local', 'other bus': 'par un autre bus' })[who]],
  [/^(present|gone)$/, how => (how === 'present' ? 'présente' : 'disparue')],
  [/^this needs a token with the right to (.+)$/, right => `il faut un jeton avec le droit « ${right} »`],
  [/^there is no (drive|group) "(.+)"$/, (what, name) => `il n’y a pas de ${what === 'drive' ? 'variateur' : 'groupe'} « ${name} »`],
];

/** A sentence of the daemon in French; what is not known here stays as it is. */
export function french(text) {
  if (SENTENCES_FR[text]) return SENTENCES_FR[text];
  for (const [pattern, put] of PATTERNS) {
    const found = text.match(pattern);
    if (found) return put(...found.slice(1));
  }
  const parts = text.split('; ');
  return parts.length > 1 ? parts.map(french).join(' ; ') : text;
}

function state(text) {
  return text.split(', ').map(part => (part.startsWith('control: ') ? `commande : ${inside(part.slice(9))}` : number(inside(part)))).join(', ');
}

/** A word as it stands inside a sentence. */
function inside(name) {
  const word = wordOf(name);
  return word[0].toLowerCase() + word.slice(1);
}

/** What the drive does, also after a time. */
function reaction(text) {
  const reactions = { nothing: 'rien', freewheel: 'roue libre', 'ramp stop': 'arrêt sur rampe', 'fast stop': 'arrêt rapide', 'DC injection': 'injection de courant continu',
    'freewheel stop': 'arrêt roue libre', 'DC injection stop': 'arrêt par injection de courant continu',
    'trip (how the motor stops is not in the manual)': 'défaut (le manuel ne dit pas comment le moteur s’arrête)' };
  return reactions[text] ?? text.replace(/, then (.+)$/, (whole, then) => `, puis ${reactions[then] ?? then}`).replace(/^off/, 'coupée');
}

function number(text) {
  return text.replace(/(\d)\.(\d)/g, '$1,$2');
}
