"""The gateway of drived beside mbusd, each on a line of its own of the same simulated drives: what one, four and eight clients get.

    python3 gateway_table.py --drived target/dist/drived --mbusd /usr/bin/mbusd [--seconds 20] [--drives 8]

Each client asks for ETA and the three registers behind it of an Altivar 312, one request after the other: all of the same drive, or each of one
of its own. mbusd runs with -R 1, for its pause is 100 ms else, and -N 0. The daemon polls the drives meanwhile; its polls are told beside the
answers of its gateway, for the wire carries both. Needs nothing but Python and the two programs; without --mbusd its columns are empty."""

import argparse
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request

WORKER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "gateway_figures.py")


def free_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


def until_open(port, child):
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port), timeout=1).close()
        except OSError:
            if child.poll() is not None:
                sys.exit(f"{child.args[0]} has ended")
            time.sleep(0.05)


class Line:
    """Simulated drives on a pty."""

    def __init__(self, args, folder, name):
        self.link = os.path.join(folder, name)
        drives = f"atv312@1-{args.drives}"
        self.child = subprocess.Popen(
            [args.drived, "sim", "--pty", self.link, "--drive", drives, "--baud", "19200", "--format", "8E1"],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
        )
        while not os.path.exists(self.link):
            time.sleep(0.05)

    def end(self):
        self.child.kill()
        self.child.wait()


def ask(port, clients, args, which):
    """Answers a second, and what was refused."""
    told = subprocess.run(
        [sys.executable, WORKER, str(port), str(clients), str(args.seconds), f"1-{args.drives}", which],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    found = re.search(r"([\d.]+) answers a second, exceptions (\{.*\}), worst wait (\d+) ms", told)
    return float(found[1]), found[2], int(found[3])


def counted(http):
    """The exchanges on the wire, and those of them that are the gateway's."""
    text = urllib.request.urlopen(f"http://127.0.0.1:{http}/metrics").read().decode()

    def total(metric, having=""):
        rows = re.findall(rf"^{metric}\{{([^}}]*)\}} (\S+)$", text, re.M)
        return sum(float(value) for labels, value in rows if having in labels)

    asked = total("drived_gateway_requests_total", 'result="answered"')
    saved = total("drived_gateway_saved_exchanges_total")
    return total("drived_line_exchanges_total", 'result="answered"'), asked - saved


def ours(args, folder, cases):
    line, gateway, http = Line(args, folder, "ours"), free_port(), free_port()
    config = os.path.join(folder, "drives.toml")
    with open(config, "w") as file:
        file.write(
            f'[http]\nlisten = "127.0.0.1:{http}"\n[[gateways]]\nlisten = "127.0.0.1:{gateway}"\nline = "bench"\n'
            f'[lines.bench]\nport = "{line.link},19200,8E1"\n'
            f'[[drives]]\nline = "bench"\ndrive = "atv312@1-{args.drives}"\nname = "pump {{}}"\n'
        )
    daemon = subprocess.Popen(
        [args.drived, "run", "--config", config, "--socket", os.path.join(folder, "socket")],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        until_open(gateway, daemon)
        until_open(http, daemon)
        while 'drived_drive_up{line="bench",drive="pump %d"} 1' % args.drives not in urllib.request.urlopen(
            f"http://127.0.0.1:{http}/metrics"
        ).read().decode():
            time.sleep(0.2)
        found = []
        for clients, which in cases:
            (all_before, own_before), began = counted(http), time.monotonic()
            told = ask(gateway, clients, args, which)
            (all_after, own_after), took = counted(http), time.monotonic() - began
            polls = (all_after - all_before) - (own_after - own_before)
            found.append((*told, polls / took, (own_after - own_before) / took))
        return found
    finally:
        daemon.terminate()
        daemon.wait()
        line.end()


def theirs(args, folder, cases):
    if not args.mbusd:
        return [None] * len(cases)
    line, port = Line(args, folder, "theirs"), free_port()
    command = [args.mbusd, "-d", "-L", "-", "-v", "0", "-p", line.link, "-s", "19200", "-m", "8E1"]
    command += ["-A", "127.0.0.1", "-P", str(port), "-C", "32", "-N", "0", "-R", "1", "-W", "500", "-T", "60"]
    mbusd = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        until_open(port, mbusd)
        return [ask(port, clients, args, which) for clients, which in cases]
    finally:
        mbusd.kill()
        mbusd.wait()
        line.end()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--drived", required=True)
    parser.add_argument("--mbusd")
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--drives", type=int, default=8)
    args = parser.parse_args()
    folder = tempfile.mkdtemp(prefix="gateway-table-")
    cases = [(clients, which) for clients in (1, 4, 8) for which in ("same", "own")]
    try:
        ours_told, theirs_told = ours(args, folder, cases), theirs(args, folder, cases)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    print(f"{args.drives} Altivar 312 at 19200 8E1, {args.seconds:g} s each; answers and exchanges a second")
    print("| Clients | Reads | drived: answers | its exchanges for them | its polls | exchanges together | worst wait | mbusd: answers | worst wait | together / mbusd |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for (clients, which), (answers, refused, wait, polls, exchanges), other in zip(cases, ours_told, theirs_told):
        together = polls + exchanges
        mbusd, mbusd_wait, share = ("", "", "")
        if other:
            mbusd, mbusd_wait, share = f"{other[0]:.1f}", f"{other[2]} ms", f"{together / other[0]:.2f}" if other[0] else ""
        said = "" if refused == "{}" else f", refused {refused}"
        print(
            f"| {clients} | {which} | {answers:.1f}{said} | {exchanges:.1f} | {polls:.1f} | {together:.1f} | {wait} ms "
            f"| {mbusd} | {mbusd_wait} | {share} |"
        )


main()
