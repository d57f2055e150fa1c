//! What BBV51701 and BBV52816 say, and what they do not say.

use crate::referee::Family;
use crate::referee::answer::{Mark, Rule, Silence, rules, silences};

rules! { Atv312 RULES
    TOLD A "BBV p.22 (ETI bits 13, 14)" "the drive itself tells who controls it";
    PRIORITY_MODE A "BBV p.11 (note)" "LAC = L1 or L2: at switching on the terminals command in operation enabled, and a run command such as 000Fh starts without the chart";
    LCC_YES A "BBV p.38 (LCC)" "LCC = YES with L1 or L2: the remote terminal commands; of the terminals only freewheel, fast stop and DC injection are left";
    TCC_LOCAL A "BBV p.33 (tCC)" "tCC = LOC, not with L3: RUN, STOP and RESET of the drive command";
    FORCED_LOCAL A "BBV p.55 (FLO, FLOC), p.21 (ETA bit 9)" "forced local: terminals or display terminal regain control, by FLOC";
    COMBINED A "BBV p.36 (CHCF, Fr1), p.23 (LRS3 bits 0, 1)" "CHCF = SIM: command and reference are combined in the channel Fr1 or Fr2 that rFC selects";
    SEPARATE A "BBV p.37 (Cd1, Cd2, CCS)" "CHCF = SEP with L3: CCS selects the control channel, by a setting, an input or a bit of CMD";
    NO_SWITCH_ON A "BBV p.11, p.12" "outside operation enabled the drive is locked; voltage disabled or shutdown coasts (p.10)";
    QUICK_STOP A "BBV p.11" "quick stop: a short ramp, then locked until disable voltage";
    RUN A "BBV p.10, p.12, p.19 (CMD)" "operation enabled with xxxFh runs, bit 11 = 1 in reverse";
    NO_RUN A "BBV p.40 (Stt)" "the run command disappears: the stop that Stt says";
    NOT_WRITTEN A "BBV p.11" "no run command has been applied";
    CMD_STOP A "BBV p.19 (CMD bit 12), p.40 (Stt)" "CMD bit 12: stop by Stt; with L3 as long as the bit is not assigned to something else";
    CMD_INJECTION A "BBV p.19 (CMD bit 13)" "CMD bit 13 with L1 or L2: DC injection";
    CMD_FAST A "BBV p.19 (CMD bit 14), p.11" "CMD bit 14 with L1 or L2: fast stop, operation stays enabled";
    FAST_INPUT A "BBV p.8, p.40 (FSt)" "fast stop: the input at 0 or the bit of CMD at 1";
    INJECTION_INPUT A "BBV p.8, p.40 (dCI)" "DC injection: the input or the bit of CMD at 1, as long as it is";
    FREEWHEEL_INPUT A "BBV p.8, p.41 (nSt)" "freewheel: the input at 0; the chart goes to switch on disabled";
    THREE_WIRE_STOP A "BBV p.8" "3-wire control: LI1 at 0 stops in line mode too; the chart goes to switch on disabled";
    STOP_KEY A "BBV p.8, p.38 (PSt)" "PSt = YES, as delivered: STOP stops whatever channel commands; the chart goes to switch on disabled";
    STOPS_FIRST A "BBV p.14" "stop functions have priority over run commands";
    SPENT_RUN A "BBV p.40 (FSt), p.41 (nSt)" "stop input released: without 2-wire level control a new run command must be sent";
    LEVEL A "BBV p.33 (tCt)" "2-wire LEL: the state of the input is run or stop";
    EDGE A "BBV p.33 (tCt)" "2-wire trn, as delivered: a change of state is needed to start, against restarts after a break of the supply";
    FORWARD_FIRST A "BBV p.33 (tCt)" "2-wire PFO: as LEL, forward before reverse";
    REVERSE_INPUT A "BBV p.33 (rrS)" "rrS names the input for reverse; LI2 in 2-wire as delivered";
    RUN_KEY A "BBV p.33 (tCC), p.38 (rOt)" "RUN starts, in the direction that rOt allows";
    REMOTE_KEYS A "BBV p.38 (LCC), p.55 (FLOC)" "RUN, STOP and FWD/REV of the remote terminal";
    SIGNED A "BBV p.19 (LFr)" "LFr is signed, 0.1 Hz or with CMI bit 9 32767 for 600 Hz";
    SIGNED_RPM A "BBV p.16 (LFRD)" "LFRD is signed, in rpm or with CMI bit 9 32767 for 600 Hz";
    L1_BUS B "BBV p.35 (LAC), S2 p.12 (15 and 200 in W400 and W401)" "L1 is interchangeable with the ATV28, whose command and reference are written together";
    LIMITS A "BBV p.27 (LSP, HSP)" "LSP is the frequency at the lowest reference, HSP at the highest: a run at 0 turns at LSP";
    ANALOG A "BBV p.27, p.35 (Fr1)" "Fr1 or Fr2 is an analog input, from LSP to HSP";
    SUMMING A "BBV p.42 (SA2, SA3), p.15" "SA2 and SA3 are added to Fr1, whatever Fr1 is; SA2 is AI2 as delivered";
    PRESET_SPEEDS A "BBV p.42 to p.44, p.14" "preset speeds count before analog references; LI3 and LI4 select them as delivered";
    JOGGING A "BBV p.45 (JOG, JGF)" "the jog input selects JGF";
    OTHER_REFERENCES A "BBV p.35, p.36" "Fr1 or Fr2 is +/- speed, the remote terminal, or CANopen";
    LOW_SPEED_TIME A "BBV p.28 (tLS)" "after tLS at LSP the motor stops; it restarts when the reference exceeds LSP and the run command is still there";
    AUTOMATIC_RESTART A "BBV p.51 (Atr)" "Atr = YES with 2-wire level: restarts by itself after ten kinds of fault, after 1, 5, 10 s, then every minute until tAr";
    TRIPPED A "BBV p.11, p.52 to p.54" "a detected fault: the stop its setting says, then locked";
    LINK_LOST A "BBV p.9, p.53 (SLL)" "the time-out runs out: SLF, stop by SLL, freewheel as delivered";
    EXTERNAL A "BBV p.20 (CMI bit 3), p.52 (EtF, LEt, EPL)" "external fault: stop by EPL, freewheel as delivered";
    MAINS_LOST A "BBV p.54 (StP)" "mains lost: StP, as delivered lock and freewheel";
    SWITCHED_ON_L3 A "BBV p.11" "at switching on a drive with L3 controlled by the bus is in switch on disabled and must follow the chart";
    LOCKED_AT_REST A "BBV p.20 (CMI bits 13, 15)" "CMI bit 13 or 15: locked on standstill";
    STANDSTILL_INJECTION A "BBV p.41 (AdC)" "AdC = YES as delivered: current at standstill for tdC1, even without a run command";
    RESET A "BBV p.12 (transition 15), p.16" "CMD bit 7 from 0 to 1 resets a fault whose cause is gone; the chart goes to switch on disabled";
    RESET_WORD A "BBV p.56 (rP)" "rP = 1 resets all faults";
    RESET_INPUT A "BBV p.51 (rSF)" "an input resets the present fault";
    CONFIGURATION A "BBV p.7, p.10, p.11" "a configuration parameter is taken at standstill only, and leads to switch on disabled";
    LAC_L3 A "BBV p.35 (LAC)" "LAC = L3 puts Fr1, Cd1, CHCF and tCC back to factory settings; only factory settings lead back";
    TCC_WRITTEN A "BBV p.33 (tCC)" "a change of tCC puts rrS, tCt and every function assigned to a logic input back to factory settings";
    FACTORY A "BBV p.20 (CMI bit 0), p.32 (FCS, CFG), p.55" "factory settings, at standstill only; communication, FLO, FLOC, LCC and bFr stay";
    SAVE A "BBV p.20 (CMI bit 1)" "the parameters are stored in the EEPROM";
    FLYING A "BBV p.52 (FLr, OPL)" "a run command kept through a loss of the mains, a reset or a freewheel starts again; by 2-wire level; with FLr or OPL = OAC from the speed of the motor";
    NO_WATCH A "BBV p.20 (CMI bit 14), p.53 (SLL)" "NTO = 1 or SLL = 0: no watch, a motor that runs goes on without its master";
}

silences! { Atv312 SILENCES
    PRIORITIES "BBV p.8, p.11 (the programming manual is named)" "L1 and L2: which of terminals, keys and bus has priority when two have commanded"
        => "believes ETI and FrH: a start that follows another reference is not confirmed";
    CHART_AFTER_DISABLE "BBV p.11" "L1 and L2: whether after a disable voltage or a fault the chart must be followed, or 000Fh starts again at once"
        => "climbs the chart, and waits until the motor turns";
    SIM_DIAL "BBV p.36 (CHCF)" "SIM: who commands when Fr1 is the dial or +/- speed"
        => "believes ETI";
    FORCED_LOCAL_LEVEL "BBV p.55 (FLO)" "which level of the input forces local, and what a run that stands does when local begins or ends"
        => "told as taken; the run command is withdrawn by 100Fh";
    FORCED_LOCAL_NOT_L3 "BBV p.55 (FLOC)" "forced local with L1 or L2: FLOC is active with L3 only, so which of terminals and display terminal commands"
        => "believes ETA bit 9 and ETI: not in force while they name another";
    OTHER_BUS_RUN "BBV p.11" "how words of Modbus and of another bus share one chart"
        => "reads CMD again in its turn: another word in its place ends the lease; the chart is believed as it shows";
    CHANNEL_RETURNS "BBV p.37 (CCS, COP)" "what the chart and the last word of the bus do when its channel is switched to; a change of direction is announced"
        => "writes nothing that moves control while CMD holds a run command or an input asks for one";
    COPIED "BBV p.37 (COP)" "COP with a control channel copied: what stands after the switch until the bus writes"
        => "reads CMD and the references before it believes them";
    SAME_WORD_AGAIN "BBV p.8 against p.40" "fast stop by input under bus control: p.8 asks for nothing but the input, p.40 for a new run command; whether the same 000Fh again is one"
        => "not in force from the stop on; the run command is withdrawn, and nothing of this side starts again";
    FREEWHEEL_LEVEL "BBV p.8 against p.41" "freewheel input released under bus control with 2-wire level: p.8 wants the chart, p.41 lets a run that stands restart"
        => "not in force from the input on; the run command is withdrawn, and nothing of this side starts again";
    INJECTION_RELEASED "BBV p.8, p.40 (dCI)" "whether a run that stands goes on when a DC injection input is released: no word on a new run command there"
        => "not in force while the input injects; the run command is withdrawn, and nothing of this side starts again";
    STOP_KEY_MODE "BBV p.8, p.10" "whether the STOP key and a 3-wire stop come down on a ramp or coast into switch on disabled, and what a level at the terminals does when STOP is released"
        => "may coast unless it was seen to come down";
    BOTH_DIRECTIONS "BBV p.33 (tCt)" "2-wire LEL or trn with forward and reverse closed together"
        => "refuses a reset where a closed input may start the motor, and judges a motion by ETA, ETI and the output";
    THREE_WIRE_START "BBV p.8, p.15, p.33" "3-wire: which input starts forward (p.15 has LI1 forward with 2C and 3C, p.8 has LI1 stop)"
        => "refuses a reset where a closed input may start the motor, whichever it is";
    BOTH_SIGNS "BBV p.19" "reverse command with a negative reference: nothing says that direction is command times sign"
        => "starts nothing at a negative reference; a setpoint keeps the sign of a motor that runs";
    TWO_REFERENCES "BBV p.16, p.19" "which of LFr and LFRD counts"
        => "takes the later one to count; confirmed by FrH or FRHD";
    PRESET_AND_BUS "BBV p.14" "preset speeds and jog are said to go before analog references: whether before a reference of the bus too, and which speed two inputs make"
        => "refuses a start while one is selected";
    REFERENCE_NONE "BBV p.36 (Fr2)" "what the motor does when rFC selects an Fr2 that is not assigned"
        => "refuses a start: Fr2 is not Mdb";
    ASSIGNED_BITS "BBV p.19 (CMD bits 11, 12)" "L3: whether bits 11 and 12 keep reverse and stop when they are assigned too"
        => "takes each bit for what the assignments read from the drive say; a stop whose bit means something else is replaced, and says so";
    STOP_BITS_ELSEWHERE "BBV p.40 (FSt, dCI), p.8" "whether a bit of CMD that a stop is assigned to acts while another channel commands: p.40 prints the bit, p.8 names the inputs only"
        => "writes it, and says that it is not confirmed while the motor turns";
    LIMIT_SWITCHES "BBV p.50 (LAF, LAr)" "at which level a limit switch stops, and whether the motor goes on when it is left"
        => "not in force while one stops";
    RESTART_BY_BUS "BBV p.51 (Atr)" "automatic restart under bus control: the chart is in fault and then in switch on disabled, yet Atr restarts"
        => "refuses a start until the restart is accepted by name";
    RESTART_AFTER_RESET "BBV p.52 (FLr)" "whether a run at terminals in 3-wire control starts again at the reset of a fault: FLr speaks of 2-wire level only"
        => "refuses the reset where a level would start it";
    AFTER_FACTORY "BBV p.20, p.32, p.35" "state and commander right after factory settings, by which L3 becomes L1 and terminals command"
        => "writes no factory settings: they are no parameter";
    L3_AND_INPUTS "BBV p.35 against p.33" "whether LAC = L3, which puts tCC back, also unassigns the stop inputs as every change of tCC does"
        => "reads the functions of the inputs again behind what it writes of the level and of tCC";
    WORDS_OVER_POWER "BBV p.11" "L1 and L2: whether CMD and LFr are 0 after a power cycle, where operation is enabled at once"
        => "reads CMD and LFr before it believes them";
    LINK_NOT_COMMANDING "BBV p.9" "whether SLF comes while the bus does not command, and from which first frame the time-out runs"
        => "says what is set, and no more";
    STOPS_TOGETHER "BBV p.14 (table)" "which of two stops at once: the arrows of the table are lost"
        => "believes the chart and ETI; where the words do not show a ramp, the motor may coast";
    STATE_AFTER_RP "BBV p.56 (rP)" "which state rP = 1 leads to, and whether it needs the cause gone"
        => "never writes rP";
    TUNING "BBV p.30 (tUn)" "whether the motor may turn while tuning puts nominal current into it, at a run, at power-up or at an input"
        => "never writes tUn = YES";
    TERMINALS_IN_L3 "BBV p.11" "L3 with a terminal channel: the state of the chart, and whether switch on disabled locks the terminals too"
        => "believes ETA and ETI: a run is in force only under the bus";
}
