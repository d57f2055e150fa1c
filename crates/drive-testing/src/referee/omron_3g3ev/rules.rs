//! What S1 says, and what it does not say.

use crate::referee::Family;
use crate::referee::answer::{Mark, Rule, Silence, rules, silences};

rules! { Omron3g3ev RULES
    N02_BUS A "S1 §2.1 p.6" "n02 = 2 or 5, as delivered 5: RUN comes by communication";
    N02_KEYPAD A "S1 §2.1 p.6" "n02 = 0 or 3: RUN comes from the console";
    N02_TERMINALS A "S1 §2.1 p.6" "n02 = 1 or 4: RUN comes from the terminals";
    REFERENCE_BUS A "S1 §2.1 p.6" "n02 = 4 or 5: the reference comes by communication";
    REFERENCE_KEYPAD A "S1 §2.1 p.6" "n02 = 0, 1 or 2: the reference is the console's";
    UNIT A "S1 §2.1 p.6 and its note 1" "n39: 0 is 0.1 Hz, 1 is 0.01 Hz of which only the first decimal counts";
    RUN A "S1 §5.1 p.17" "0001h bit 0 = 1 runs; bit 1 = 0 forward, 1 reverse";
    STOP A "S1 §5.1 p.17" "0001h bit 0 = 0 stops";
    WAITING A "S1 §5.3 p.20 (CAL)" "until a frame comes the drive waits for communication";
    EXTERNAL_FAULT A "S1 §5.1 p.17" "broadcast 0001h bit 4 = 1: external fault EF0";
    RESET A "S1 §3.1.1 p.10, §5.1 p.17" "broadcast 0001h bit 5 = 1 resets faults";
    FAULT A "S1 §5.2 p.18 (0020h bit 3, 0021h)" "a fault: the drive is not ready";
    NO_REVERSE A "S1 §5.3 p.20 (OP6)" "n05 = 1 forbids reverse";
    POWER_CYCLE A "S1 §2 p.5, §2.1 p.6 note 3" "n02 and the other settings of the table act after the supply is cut and restored";
    ENTER A "S1 §4.5 p.16" "a write to 0900h stores the changed constants";
    VOLATILE B "register facts §3.4 (V7 p.12)" "0001h to 0009h are volatile; constants without ENTER are lost with the supply";
    UNDERVOLTAGE A "S1 §5.2 p.18 (0021h bit C, UV1)" "loss of power is a fault";
}

silences! { Omron3g3ev SILENCES
    TERMINAL_RUN "S1 §2 p.5" "which terminals run the motor, level or edge, and what ends it"
        => "a start and a reset are refused while bit A of 002Ch does not name the bus";
    KEYPAD_RUN "S1 §2 p.5" "what the keys of the console do, and whether STOP acts while the bus commands"
        => "the same; a run command that stands while neither 0020h nor 002Ch shows RUN has lost its output, and is withdrawn";
    ROW_3 "S1 §2.1 p.6" "n02 = 3 is printed like n02 = 0; one of the two rows is wrong"
        => "bits 9 and A of 002Ch decide, and n02 does not";
    FUNCTION_BITS "S1 §5.1 p.17 (0001h bits 4 to 6)" "what the functions of n06 to n08 are: a bit may reset, stop, jog, reverse or trip, and act while the bus does not command"
        => "they stay as the drive holds them; one whose number for fault reset its owner gives is pulsed; none is on when n06 to n08 are changed";
    STOP_MODE "S1 §5.1 p.17" "how the motor stops: ramp or freewheel"
        => "every mode is bit 0 = 0, and told to be replaced; an output that goes faster than it came down leaves a shaft that may coast";
    FULL_SCALE "S1 §2.1 p.6, §5.1 p.17" "what 100 % is: n39 = 2 and 3, and every reference by broadcast"
        => "where n39 is 2 or 3 a setpoint is taken in percent and refused in hertz";
    LIMITS "S1 §5.4 p.20" "the highest and the lowest output frequency, and whether a run at 0 turns the motor"
        => "0023h has to be what 0002h holds but for the rounding of n39; at a reference of 0 an output that is off lacks nothing";
    REVERSE_FORBIDDEN "S1 §5.3 p.20 (OP6)" "what the motor does after a reverse command with n05 = 1: stays, stops, or trips"
        => "a start in reverse is refused";
    LINK_LOST "S1 §2.1 p.6 (n40), §5.3 p.20 (BUS)" "how long the time-over is, whether BUS stops the motor and how, and whether it goes on when frames come back"
        => "BUS is a trip that ends no lease: the run command is withdrawn on the wire";
    RESET_AND_RUN "S1 §5.1 p.17" "whether a broadcast with reset and run in one word runs"
        => "no reset carries bit 0";
    FAULT_AND_RUN "S1 §5.1 p.17" "whether a run bit that stood through a fault runs again after a reset by other means"
        => "a reset by the bus takes bit 0 away; before that the lease stays, and the run command is withdrawn";
    RESTART "S1 §5.2 p.18 (0021h bit C)" "whether the drive runs again by itself after a short loss of power or by retries"
        => "undervoltage ends no lease: the run command is withdrawn on the wire";
    CHANGED_WHILE_RUNNING "S1 §4.4 p.16 (error 22)" "which constants are refused during RUN"
        => "n02 and n06 to n08 are refused under a run command; of the others error 22 is told";
    BROADCAST_NOT_COMMANDED "S1 §3.1.1 p.10" "whether a broadcast run reaches a drive whose n02 gives RUN to others"
        => "a broadcast confirms nothing: each drive is stopped and read behind it";
}
