"""Common helper of the strangers: a shaft, a Modbus RTU face on pymodbus' own servers, stdin/stdout.

pymodbus does the transport (ModbusSerialServer, ModbusTcpServer with the RTU framer), the CRC and
the coding of PDUs.  This file adds what a real drive has and pymodbus' data store has not: frames
cut by silence, other slaves' frames ignored, exceptions of the maker, silence, a shaft.
"""
import argparse, asyncio, json, os, queue, stat, struct, sys, threading, time
from pymodbus.framer import FramerType
from pymodbus.framer.rtu import FramerRTU
from pymodbus.pdu import ExceptionResponse
from pymodbus.pdu import bit_message as bm, register_message as rm
from pymodbus.pdu.diag_message import ReturnQueryDataResponse
from pymodbus.pdu.mei_message import ReadDeviceInformationResponse
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.server.requesthandler import ServerRequestHandler
from pymodbus.simulator import SimData, SimDevice, DataType

TICK = 0.02


class Ex(Exception):
    """A Modbus exception answer."""
    def __init__(self, code):
        self.code = code


def s16(v):
    return v - 0x10000 if v & 0x8000 else v


def u16(v):
    return int(round(v)) & 0xFFFF


def lim(v, lo, hi):
    return lo if v < lo else hi if v > hi else v


def bits(**kw):
    """bits(b0=True, b5=False) -> word"""
    return sum(1 << int(k[1:]) for k, v in kw.items() if v)


class Drive:
    """Base of all strangers: tables of registers and coils, shaft, trips, watchdog."""
    name = "drive"
    fcs = (3, 6, 16)            # function codes the drive knows; others get exception 01
    max_read, max_write, max_coils = 125, 123, 2000
    too_many = 3                # exception for too many words
    no_reg, ro = 2, 2           # exceptions: no such register, register not writable
    holes_zero = False          # unmapped words inside a block read as 0
    boot_s = 0.0                # silence after power-up
    baud, parity, stop, slave = 9600, "N", 1, 1
    nominal, max_hz = 50.0, 50.0
    ident = {}                  # objects of FC 43/14
    local_stops = True          # taking command at the panel ramps the motor down

    def __init__(self, args):
        self.args = args
        self.R, self.W, self.C, self.CW, self.D = {}, {}, {}, {}, {}
        self.P = {}             # the drive's parameters, by name: --set NAME=VALUE
        self.acc = self.dec = args.ramp
        self.quick_s, self.coast_s = args.ramp / 3, args.coast
        self.hz, self.mode, self.last_dir = 0.0, "off", "forward"
        self.tripped, self.why, self.stay = 0, "", False
        self.powered, self.ready_at, self.deaf_until = True, 0.0, 0.0
        self.local, self.panel_ref = False, None
        self.wd_armed, self.wd_last = False, time.monotonic()
        self.rated_a = 4.0
        self.setup()
        for item in args.set or []:
            k, v = item.split("=", 1)
            if k not in self.P:
                sys.exit("unknown parameter %s; known: %s" % (k, ", ".join(sorted(self.P))))
            self.P[k] = type(self.P[k])(float(v))
        self.power_up()

    # ---- to be given by each drive
    def setup(self): pass                   # fill R, W, C, CW, P
    def power_up(self): pass                # volatile words to power-up state
    def target(self): return 0.0            # signed Hz while mode == "run"
    def logic(self, now): pass              # each tick
    def on_trip(self): pass
    def on_remote(self): pass               # panel gave command back
    def fed(self, fc, addr, n, wrote): pass  # called after each good request to this slave

    # ---- tables
    def reg(self, addr, get, put=None):
        self.R[addr] = get
        if put:
            self.W[addr] = put

    def par(self, addr, name, value, lo=0, hi=65535, bad=3, ok=None):
        """A plain parameter at addr."""
        self.P.setdefault(name, value)

        def put(v):
            if not lo <= v <= hi:
                raise Ex(bad)
            if ok and not ok():
                raise Ex(4)
            self.P[name] = v
        self.reg(addr, lambda: u16(self.P[name]), put if ok is not False else None)

    # ---- physics
    @property
    def out_hz(self):
        """Output frequency: nothing when the output stage is off, though the shaft may turn."""
        return 0.0 if self.mode == "off" else self.hz

    @property
    def running(self):
        return self.mode != "off"

    @property
    def amps(self):
        if self.mode == "off":
            return 0.0
        return self.rated_a * (0.35 + 0.35 * min(1.0, abs(self.hz) / self.nominal))

    def run(self):
        if self.mode != "run" and not self.tripped and self.powered:
            self.mode = "run"

    def ramp_stop(self):
        if self.mode in ("run", "quick"):
            self.mode = "stop"

    def quick_stop(self):
        if self.mode in ("run", "stop"):
            self.mode = "quick"

    def coast(self):
        self.mode = "off"

    @property
    def at_ref(self):
        return self.mode == "run" and abs(self.hz - self.goal()) < 0.05

    def goal(self):
        v = self.panel_ref if self.local and self.panel_ref is not None else self.target()
        return lim(v, -self.max_hz, self.max_hz)

    def move(self, dt):
        if self.mode == "run":
            goal, t = self.goal(), self.acc
            if abs(goal) < abs(self.hz) or goal * self.hz < 0:
                t = self.dec
        elif self.mode == "off":
            goal, t = 0.0, self.coast_s
        else:
            goal, t = 0.0, self.dec if self.mode == "stop" else self.quick_s
        step = self.nominal / max(t, 0.01) * dt
        if self.hz > 0 > goal or self.hz < 0 < goal:
            goal = 0.0                       # through zero, never across it in one step
        self.hz += lim(goal - self.hz, -step, step)
        if abs(self.hz) < 1e-6:
            self.hz = 0.0
            if self.mode in ("stop", "quick"):
                self.stopped(self.mode)
        if self.hz:
            self.last_dir = "forward" if self.hz > 0 else "reverse"

    def stopped(self, how):
        self.mode = "off"

    def tick(self, dt):
        now = time.monotonic()
        if self.powered:
            self.logic(now)
        self.move(dt)

    # ---- trips
    def trip(self, code, why=""):
        if self.powered and not self.tripped:
            self.tripped, self.why = code, why or "fault %d" % code
            self.coast()
            self.on_trip()

    def reset_fault(self):
        """Acknowledge; refused while the cause stays. True if no trip is left."""
        if self.tripped and not self.stay:
            self.tripped, self.why = 0, ""
            self.after_reset()
        return not self.tripped

    def after_reset(self): pass

    def expired(self, limit, now):
        return limit > 0 and self.wd_armed and now - self.wd_last > limit

    # ---- requests
    def read_words(self, a, n, fc=3):
        if not 1 <= n <= self.max_read:
            raise Ex(self.too_many)
        out = []
        for i in range(a, a + n):
            g = self.R.get(i)
            if g is None and not (self.holes_zero and self.R.get(a)):
                raise Ex(self.no_reg)
            out.append(u16(g()) if g else 0)
        return out

    def write_words(self, a, vals, fc=16):
        if not 1 <= len(vals) <= self.max_write:
            raise Ex(self.too_many)
        for i in range(a, a + len(vals)):
            if i not in self.W:
                raise Ex(self.ro if i in self.R else self.no_reg)
        for i, v in enumerate(vals):
            self.W[a + i](v)
        self.written(a, len(vals))

    def written(self, a, n): pass            # after a whole write has been taken in

    def read_bits(self, a, n, fc=1):
        table = self.D if fc == 2 else self.C
        if not 1 <= n <= self.max_coils:
            raise Ex(self.too_many)
        if any(i not in table for i in range(a, a + n)):
            raise Ex(2)
        return [bool(table[i]()) for i in range(a, a + n)]

    def write_bits(self, a, vals, fc=15):
        if not 1 <= len(vals) <= self.max_coils:
            raise Ex(self.too_many)
        if any(i not in self.CW for i in range(a, a + len(vals))):
            raise Ex(2)
        for i, v in enumerate(vals):
            self.CW[a + i](bool(v))
        self.written_bits(a, len(vals))

    def written_bits(self, a, n): pass

    def other(self, fc, pdu): raise Ex(1)    # FC 7, 11, 17 ... -> response PDU

    def answer(self, fc, pdu, body):
        """One decoded request -> response PDU (or None)."""
        if fc in (1, 2):
            b = self.read_bits(pdu.address, pdu.count, fc)
            r = (bm.ReadCoilsResponse if fc == 1 else bm.ReadDiscreteInputsResponse)(bits=b)
            self.fed(fc, pdu.address, pdu.count, False)
        elif fc in (3, 4):
            w = self.read_words(pdu.address, pdu.count, fc)
            r = (rm.ReadHoldingRegistersResponse if fc == 3 else rm.ReadInputRegistersResponse)(registers=w)
            self.fed(fc, pdu.address, pdu.count, False)
        elif fc == 5:
            val = struct.unpack(">H", body[3:5])[0]
            if val not in (0, 0xFF00):
                raise Ex(3)
            self.write_bits(pdu.address, [val == 0xFF00], 5)
            r = bm.WriteSingleCoilResponse(address=pdu.address, bits=[val == 0xFF00])
            self.fed(fc, pdu.address, 1, True)
        elif fc == 6:
            self.write_words(pdu.address, list(pdu.registers), 6)
            r = rm.WriteSingleRegisterResponse(address=pdu.address, registers=list(pdu.registers))
            self.fed(fc, pdu.address, 1, True)
        elif fc == 8:
            if body[1:3] != b"\0\0":
                raise Ex(3)
            r = ReturnQueryDataResponse()
            r.encode = lambda: body[1:]
            self.fed(fc, 0, 0, False)
        elif fc == 15:
            if pdu.byte_count != (pdu.count + 7) // 8 or len(body) - 6 != pdu.byte_count:
                raise Ex(3)
            self.write_bits(pdu.address, list(pdu.bits)[:pdu.count], 15)
            r = bm.WriteMultipleCoilsResponse(address=pdu.address, count=pdu.count)
            self.fed(fc, pdu.address, pdu.count, True)
        elif fc == 16:
            if pdu.byte_count != 2 * pdu.count or len(pdu.registers) != pdu.count:
                raise Ex(3)
            self.write_words(pdu.address, list(pdu.registers), 16)
            r = rm.WriteMultipleRegistersResponse(address=pdu.address, count=pdu.count)
            self.fed(fc, pdu.address, pdu.count, True)
        elif fc == 23:
            if pdu.write_byte_count != 2 * pdu.write_count or len(pdu.write_registers) != pdu.write_count:
                raise Ex(3)
            self.write_words(pdu.write_address, list(pdu.write_registers), 23)
            self.fed(fc, pdu.write_address, pdu.write_count, True)
            r = rm.ReadWriteMultipleRegistersResponse(
                registers=self.read_words(pdu.read_address, pdu.read_count, 23))
        elif fc == 43:
            if pdu.read_code not in (1, 2, 3, 4):
                raise Ex(3)
            if pdu.read_code == 4 and pdu.object_id not in self.ident:
                raise Ex(2)
            objs = {pdu.object_id: self.ident[pdu.object_id]} if pdu.read_code == 4 else dict(self.ident)
            r = ReadDeviceInformationResponse(read_code=pdu.read_code, information=objs)
            r.conformity = 0x81
            self.fed(fc, 0, 0, False)
        else:
            r = self.other(fc, pdu)
        return r

    # ---- commands of the tester
    def command(self, line):
        w = line.split()
        if not w:
            return
        now = time.monotonic()
        if w[0] == "trip":                       # trip N [stay]: stay = the cause persists
            self.stay = "stay" in w
            self.trip(int(w[1], 0), self.fault_name(int(w[1], 0)))
        elif w[0] == "cause":                    # "cause gone"
            self.stay = False
        elif w[0] == "clear":
            self.stay = False
            self.reset_fault()
        elif w[:2] == ["power", "off"]:
            self.powered = False
            self.coast()
        elif w[:2] == ["power", "on"]:
            if not self.powered:
                self.powered, self.ready_at = True, now + self.boot_s
                self.tripped, self.why, self.stay, self.wd_armed = 0, "", False, False
                self.local, self.panel_ref = False, None
                self.power_up()
        elif w[0] == "panel":                    # panel [HZ]: stopped at the panel, or run from it
            self.local, self.panel_ref = True, (float(w[1]) if len(w) > 1 else None)
            if self.panel_ref is not None:
                self.run()
            elif self.local_stops:
                self.ramp_stop()
        elif w[0] == "remote":
            if self.local:
                self.local = False
                if self.panel_ref is not None:
                    self.ramp_stop()
                self.panel_ref = None
                self.on_remote()
        elif w[0] == "deaf":
            self.deaf_until = now + float(w[1])
        elif w[0] == "quit":
            raise SystemExit(0)
        elif w[0] != "look":
            self.extra(w)

    faults = {}

    def fault_name(self, code):
        return self.faults.get(code, "fault %d" % code)

    def extra(self, w): pass

    def state(self):
        return {"shaft_hz": round(self.hz, 1) + 0.0, "running": self.running, "direction": self.last_dir,
                "tripped": bool(self.tripped), "why": self.why}


class Handler(ServerRequestHandler):
    """pymodbus' handler, with frames cut by silence and requests answered by a Drive."""
    drive = None
    timer = None
    on_lost = None

    def callback_data(self, data, addr=None):
        if self.timer:
            self.timer.cancel()
        try:
            used = self.hunt(data)
        except Exception as exc:              # a bad frame must never kill a stranger
            print("frame:", repr(exc), file=sys.stderr)
            used = len(data)
        if used < len(data):
            self.timer = self.loop.call_later(self.drive.gap if self.on_lost else 0.06, self.silence)
        return used

    def hunt(self, data):
        """Answer a request addressed to this slave at the start, or as the last thing, of data."""
        for i in range(len(data) - 3):
            if data[i] not in (self.drive.args.slave, 0) or data[i + 1] & 0x80:
                continue
            try:
                cls = self.framer.decoder.lookupPduClass(data[i:])
                n = cls.calculateRtuFrameSize(data[i:]) if cls else 0
            except Exception:
                n = 0
            if n and n <= len(data) - i and (i == 0 or i + n == len(data)) and self.good(data[i:i + n]):
                self.request(data[i:i + n])
                return i + n
        return 0

    def silence(self):
        """The line went quiet: what is left is one frame (perhaps of an unknown function) or noise."""
        data, self.recv_buffer = self.recv_buffer, b""
        if len(data) >= 4 and data[0] == self.drive.args.slave and self.good(data):
            fc = data[1]
            if not fc & 0x80 and (fc not in self.drive.fcs or not self.framer.decoder.lookupPduClass(data)):
                self.reply(ExceptionResponse(fc, 1))

    @staticmethod
    def good(frame):
        return FramerRTU.check_CRC(frame[:-2], (frame[-2] << 8) + frame[-1])

    def request(self, frame):
        d, now, fc, body = self.drive, time.monotonic(), frame[1], bytes(frame[1:-2])
        if not d.powered or now < d.ready_at or now < d.deaf_until:
            return
        try:
            if fc not in d.fcs:
                raise Ex(1)
            pdu = self.framer.decoder.decode(body)
            if pdu is None:                   # count 0 or more than Modbus allows
                raise Ex(3)
            resp = d.answer(fc, pdu, body)
        except Ex as e:
            resp = ExceptionResponse(fc, e.code)
        if resp is not None and frame[0] and time.monotonic() >= d.deaf_until and d.powered:
            self.reply(resp)

    def reply(self, resp):
        resp.dev_id = self.drive.args.slave
        out = self.framer.buildFrame(resp)
        self.loop.call_later(self.drive.args.delay / 1000, self.put, out)

    def put(self, out):
        if self.transport and self.drive.powered:
            self.send(out)

    def callback_disconnected(self, exc):
        super().callback_disconnected(exc)
        if self.on_lost:
            self.on_lost()


class Out:
    """stdout by a thread, so that a reader who sleeps cannot stop the drive."""
    def __init__(self):
        self.q = queue.Queue()
        threading.Thread(target=self.pump, daemon=True).start()

    def pump(self):
        while True:
            line = self.q.get()
            try:
                sys.stdout.write(line + "\n")
                sys.stdout.flush()
            except (OSError, ValueError):
                return
            finally:
                self.q.task_done()

    def put(self, obj):
        if self.q.qsize() < 5000:
            self.q.put(json.dumps(obj))


async def serve(drive):
    args, loop, out = drive.args, asyncio.get_running_loop(), Out()
    over = asyncio.Event()
    dummy = SimDevice(0, simdata=[SimData(0, values=0, datatype=DataType.REGISTERS)])
    drive.gap = max(0.020, 3.5 * 11 / args.baud)
    lost = asyncio.Event()

    def handler_for(server, on_lost=None):
        def new():
            h = Handler(server, None, None, None)
            h.drive, h.on_lost = drive, on_lost
            return h
        server.callback_new_connection = new
        return server

    async def serial_keeper():
        while not over.is_set():
            lost.clear()
            srv = handler_for(ModbusSerialServer(dummy, framer=FramerType.RTU, port=args.port, baudrate=args.baud,
                                                 parity=args.parity, stopbits=args.stop), lost.set)
            try:
                await srv.serve_forever(background=True)
                opened.set()
                await lost.wait()
            except Exception as exc:
                print("serial:", exc, file=sys.stderr)
            await srv.shutdown()
            await asyncio.sleep(0.3)

    tasks, opened = [], asyncio.Event()
    if args.port:
        tasks.append(asyncio.create_task(serial_keeper()))
        await opened.wait()
    if args.tcp is not None:
        srv = handler_for(ModbusTcpServer(dummy, framer=FramerType.RTU, address=(args.host, args.tcp)))
        await srv.serve_forever(background=True)
        args.tcp = srv.transport.sockets[0].getsockname()[1]

    shown = {}

    def show(force=False):
        s, now = drive.state(), time.monotonic()
        other = {k: v for k, v in s.items() if k != "shaft_hz"} != {k: v for k, v in shown.get("s", {}).items()
                                                                  if k != "shaft_hz"}
        moved = s != shown.get("s")
        if force or other or (moved and now - shown["t"] >= 0.1):
            shown["s"], shown["t"] = s, now
            out.put(s)

    def command(line):
        if line is None:
            over.set()
            return
        if line.startswith("look "):            # whoever asks knows by the number that he has all of before
            out.put({**drive.state(), "look": int(line.split()[1])})
            return
        try:
            drive.command(line)
        except SystemExit:
            over.set()
            return
        except Exception as exc:
            print("command %r: %r" % (line, exc), file=sys.stderr)
        show(force=line.strip() == "look")

    def reader():
        for line in sys.stdin:
            loop.call_soon_threadsafe(command, line)
        try:                                    # a closed pipe: whoever started us has gone
            mode = os.fstat(0).st_mode
            if stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode):
                loop.call_soon_threadsafe(command, None)
        except (OSError, RuntimeError):
            pass

    threading.Thread(target=reader, daemon=True).start()
    ready = {"ready": True}
    if args.tcp is not None:
        ready["tcp"] = args.tcp
    out.put(ready)
    show(force=True)
    last = time.monotonic()
    while not over.is_set():
        try:
            await asyncio.wait_for(over.wait(), TICK)
        except asyncio.TimeoutError:
            pass
        now = time.monotonic()
        try:
            drive.tick(now - last)
        except Exception as exc:
            print("tick:", repr(exc), file=sys.stderr)
        last = now
        show()
    deadline = time.monotonic() + 1
    while out.q.unfinished_tasks and time.monotonic() < deadline:
        time.sleep(0.01)
    os._exit(0)


def main(cls):
    p = argparse.ArgumentParser(description=cls.__doc__)
    p.add_argument("--port", help="serial device or pty")
    p.add_argument("--baud", type=int, default=cls.baud)
    p.add_argument("--parity", default=cls.parity)
    p.add_argument("--stop", type=int, default=cls.stop)
    p.add_argument("--slave", type=int, default=cls.slave)
    p.add_argument("--tcp", type=int, help="TCP port, RTU framing (0: any)")
    p.add_argument("--host", default="127.0.0.1")
    p.add_argument("--delay", type=float, default=5.0, help="answer delay in ms")
    p.add_argument("--ramp", type=float, default=5.0, help="seconds 0..nominal")
    p.add_argument("--coast", type=float, default=10.0, help="seconds nominal..0 freely")
    p.add_argument("--set", action="append", metavar="NAME=VALUE", help="a parameter of the drive")
    args = p.parse_args()
    if not args.port and args.tcp is None:
        p.error("--port or --tcp is needed")
    asyncio.run(serve(cls(args)))
