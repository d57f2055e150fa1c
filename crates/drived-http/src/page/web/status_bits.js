// What the bits of the drives' status words mean when they are 1, from the manuals of the families.

import { language } from './texts.js';

const BITS = {
  // Altivar 28, 58 and 312: the DRIVECOM status word, and the extended one.
  ETA: {
    0: ['ready to switch on', 'prêt à l’enclenchement'], 1: ['switched on', 'enclenché'], 2: ['operation enabled', 'opération validée'],
    3: ['fault', 'défaut'], 4: ['voltage disabled', 'tension coupée'], 5: ['no quick stop', 'pas d’arrêt rapide'],
    6: ['switch on disabled', 'enclenchement verrouillé'], 7: ['alarm', 'alarme'], 9: ['no forced local mode', 'pas de forçage local'],
    10: ['reference reached', 'consigne atteinte'], 11: ['reference outside LSP to HSP', 'consigne hors LSP à HSP'],
    14: ['stopped by the STOP key', 'arrêt par la touche STOP'], 15: ['reverse', 'sens arrière'],
  },
  ETI: {
    0: ['EEPROM being written', 'écriture EEPROM en cours'], 1: ['parameters checked', 'contrôle de cohérence'], 2: ['reset authorised', 'acquittement autorisé'],
    4: ['motor running', 'moteur en marche'], 5: ['DC injection', 'injection de courant continu'], 6: ['transient state', 'régime transitoire'],
    7: ['motor thermal alarm', 'alarme thermique moteur'], 8: ['excessive braking', 'freinage excessif'], 9: ['accelerating', 'accélération'],
    10: ['decelerating', 'décélération'], 11: ['current limit', 'limitation de courant'], 12: ['fast stop', 'arrêt rapide'],
    15: ['reverse requested', 'sens arrière demandé'],
  },
  // Altivar 21.
  FD01: {
    0: ['fault relay on', 'relais de défaut'], 1: ['tripped', 'en défaut'], 2: ['alarm', 'alarme'], 3: ['undervoltage alarm', 'alarme de sous-tension'],
    4: ['motor 2', 'moteur 2'], 5: ['PID forbidden', 'PID interdit'], 6: ['ramp 2', 'rampe 2'], 7: ['DC braking', 'freinage par courant continu'],
    9: ['reverse', 'sens arrière'], 10: ['run', 'marche'], 11: ['freewheel stop', 'roue libre'], 12: ['emergency stop state', 'état d’arrêt d’urgence'],
    13: ['standby with run', 'en attente avec marche'], 14: ['standby', 'en attente'], 15: ['local', 'local'],
  },
  // 3G3EV.
  '0020h': {
    0: ['run', 'marche'], 1: ['reverse', 'sens arrière'], 2: ['ready', 'prêt'], 3: ['fault', 'défaut'], 4: ['error in the data', 'erreur de données'],
    5: ['output 1', 'sortie 1'], 6: ['output 2', 'sortie 2'],
  },
  '002Ch': {
    0: ['run', 'marche'], 1: ['zero speed', 'vitesse nulle'], 2: ['at the reference', 'consigne atteinte'], 3: ['frequency OK', 'fréquence OK'],
  },
};

/** What `bit` of the register `code` means, or nothing where the table has no word for it. */
export function bitName(code, bit) {
  return BITS[code]?.[bit]?.[language() === 'fr' ? 1 : 0];
}
