//! What S0 says, and what it does not say.

use crate::referee::Family;
use crate::referee::answer::{Mark, Rule, Silence, rules, silences};

rules! { Atv21 RULES
    CMOD_TERMINALS A "S0 §6.2 p.12, p.13" "CMOD = 0, as delivered: commands come from the terminals";
    CMOD_KEYPAD A "S0 §8.6 p.35 (list of FE45)" "CMOD = 1: commands come from the keypad";
    CMOD_BUS A "S0 §6.2 p.12" "CMOD = 2: commands come from Modbus, the signals at the terminals are ignored";
    COMMAND_PRIORITY A "S0 §6.2 p.14, §8.4 p.31" "FA00 bit 15 = 1: commands come from Modbus whatever CMOD is";
    FORCED_LOCAL_INPUT A "S0 §6.2 p.15, §8.4 p.31" "function 48 with its input on: commands and reference come from the terminals";
    LOC_REM A "S0 §6.2 p.12 to p.16" "LOC/REM is always active and takes control to the keypad";
    FMOD_VIA A "S0 §6.2 p.13" "FMOD = 1, as delivered: the reference is the analog input VIA";
    FMOD_LIST A "S0 §8.6 p.35 (list of FE46)" "FMOD 2 VIB, 3 keypad, 5 faster and slower by the terminals";
    FMOD_BUS A "S0 §6.2 p.12, §8.5 p.33" "FMOD = 4: the reference is FA01, in 0.01 Hz";
    REFERENCE_PRIORITY A "S0 §6.2 p.14, §8.5 p.33" "FA00 bit 14 = 1: the reference is Modbus's whatever FMOD is";
    PRESET A "S0 §8.4 p.31" "FA00 bits 0 to 2 not 0: the preset speed counts whatever reference is selected";
    FCHG A "S0 §6.2 p.16" "F112 = 38 and F207 = 1: with R on the reference is VIA, with R off Modbus's";
    RUN A "S0 §8.4 p.31" "FA00 bit 10 = 1 runs; bit 9 = 0 forward, 1 reverse";
    RAMP_STOP B "S0 §8.4 p.31; register facts §2.3" "FA00 bit 10 = 0 stops, on the ramp";
    FREEWHEEL A "S0 §8.4 p.31, §8.6 p.34 (FD01 bits 11, 13)" "FA00 bit 11 = 1: freewheel; to run, ST and RUN must both be on";
    FORCED_INJECTION A "S0 §8.4 p.31" "FA00 bit 7 = 1: forced DC braking";
    EMERGENCY A "S0 §8.4 p.31" "FA00 bit 12 = 1: emergency stop, trip E, even without command priority";
    RESET A "S0 §8.4 p.31" "FA00 bit 13 = 1 resets a trip";
    RAM A "S0 §8.2 p.28" "FA00, FA20, FA01, FA13 go back to 0 when the supply is cut, at the reset of a trip and with TYP";
    TIME_OUT A "S0 §6.4 p.19" "no valid request for F803 seconds after the first one: trip Err5, whoever commands";
    TRIPPED A "S0 §8.6 p.34 (FD01 bits 13, 14)" "no standby while stopped by a trip: the motor is not driven";
    UNDERVOLTAGE A "S0 §8.6 p.34 (FD01 bits 3, 13, 14)" "MOFF, undervoltage of the power circuit: no standby, the motor is not driven";
    UPPER_LIMIT B "register facts §2.5 (0012h)" "UL is the upper frequency";
    NOTHING_STANDS A "S0 §8.2 p.28" "FA00 is 0 until it is written";
}

silences! { Atv21 SILENCES
    TERMINAL_RUN "S0 §8.8 p.38 (F111 to F113, F118)" "which function F, R, RES and VIA have as delivered, level or edge: so whether the terminals ask for motion, and what ends it"
        => "where the terminals would command, any input that is on counts as a run command, but one of function 0, 38 or 48";
    KEYPAD_RUN "S0 §6.2 p.12" "what the keys of the keypad do, and whether a motor goes on when LOC/REM is pressed"
        => "a start is refused under LOC/REM; a run under it is not in force, and its run command is withdrawn";
    FORCED_FUNCTIONS "S0 §8.4 p.31, §8.5 p.33" "what functions 52 (forced operation) and 53 (forced run) do to the motor, at which reference, and what stops it then"
        => "an input of 52 or 53 that is on refuses reset, release and parameters, and a stop is not confirmed while the motor runs";
    F110_TERMINAL "S0 §8.4 p.31, §8.5 p.33, against §8.8 p.38" "which input F110 belongs to: it may carry functions 48, 52 and 53, but FD06 has no terminal for it"
        => "F110 is taken to be always on: 1 releases ST, any other function is an input that is on";
    SWITCHED_BY_INPUT "S0 §6.2 p.14 against p.15" "F112 = 48 with R off and CMOD = 0: p.15 gives control to Modbus, p.14 wants FA00 bits 15 and 14 for that"
        => "bits 15 and 14 are set unless CMOD = 2 and FMOD = 4; FE45 and FE46 decide what is confirmed";
    FCHG_AND_PRIORITY "S0 §6.2 p.16 against §8.5 p.33" "which reference counts with FCHG on and FA00 bit 14 set"
        => "FE46 decides: where it does not name the bus a start and a setpoint are refused, and a run has lost its reference";
    TWO_REFERENCES "S0 §8.5 p.33" "which of FA01 and FA13 counts when both are written"
        => "the other of the two is set to 0 before one is written";
    LOWER_LIMIT "S0 §8.1 p.27" "whether a run at a reference below LL, or at 0, turns the motor at LL"
        => "FE02 has to be what FA01 holds, and a motor that comes no nearer to it for 10 s does not follow the reference";
    INJECTION_AND_RUN "S0 §8.4 p.31" "what FA00 bit 7 does together with bit 10, and how long it brakes"
        => "they are never written together; an injection is held for 5 s or as its owner says, 30 s at the most";
    RESET_WITHOUT_COMMAND "S0 §8.4 p.31" "whether FA00 bit 13 resets while the bus does not command: only emergency stop and output hold are said to"
        => "bit 15 goes with the reset unless CMOD = 2";
    RESET_BY_PANEL "S0 §8.6 p.34" "whether keys or an input reset a trip"
        => "a trip ends no lease: the run command is withdrawn on the wire while it lasts";
    RETRY "S0 §8.6 p.34 (FD01 bit 1)" "what the retries are that the trip bit includes: whether a tripped drive starts again by itself"
        => "a trip ends no lease: the run command is withdrawn on the wire while it lasts";
    TIME_OUT_REACTION "S0 §6.4 p.19" "F603 is delivered as 4, outside its list 0 to 2: how the motor stops at Err5"
        => "4 is told as unknown and written only to put back what was found; arming writes 0, 1 or 2";
    TIME_OUT_BROADCAST "S0 §6.4 p.19" "whether a broadcast arms or feeds the time-out of requests at the drive's own address"
        => "it is fed by reads of FD01 at its own address";
    TIME_OUT_OFF "S0 §6.4 p.19" "the warning names 0829 = 0 as what takes the watch away; 0803 = 0 is printed so in the table"
        => "0803 = 0 is written for off, and read back; 0829 is left alone";
    STANDING_RUN "S0 §6.2 p.12 to p.16" "whether a run bit that stands in FA00 starts the motor when control comes back from LOC/REM or from an input"
        => "a run command that is not in force stays a lease, and is withdrawn before control comes back";
    POWER_LOSS_STOP "S0 §8.7 p.36 (FC91 bits 14, 15)" "after a forced stop at power loss or an automatic stop at the low limit: whether the motor goes on by itself"
        => "without standby (FD01 bit 14) the output is withheld: the lease stays, and the run command is withdrawn";
    EMERGENCY_STOP_MODE "S0 §8.4 p.31" "how the motor stops at an emergency stop by FA00 bit 12"
        => "a shaft that was not seen to come down may coast";
    LOCAL_INPUT_LEVELS "S0 §6.2 p.15" "whether a run standing at the terminals starts the motor when function 48 hands control to them"
        => "with function 48 on every other input that is on counts as a run command";
}
