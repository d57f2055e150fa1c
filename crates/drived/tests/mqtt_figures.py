"""Messages and bytes a second that a daemon tells an MQTT broker: ten drives at rest, and of one that moves all the time.

    python3 mqtt_figures.py --drived target/dist/drived [--seconds 120]

Ten simulated Altivar 312 on one pty, a mosquitto, and mosquitto_sub, which counts topics and payloads as they come. The drive that moves is given
another setpoint every five seconds. Needs Python, mosquitto and its clients."""

import argparse
import os
import shutil
import socket
import subprocess
import tempfile
import threading
import time


def free_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


def until_open(port):
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port), timeout=1).close()
        except OSError:
            time.sleep(0.05)


def heard(port, topic, seconds):
    """Messages and bytes of topics and payloads, by the last level of the topic; what the broker had kept is not counted."""
    said = subprocess.run(
        ["mosquitto_sub", "-V", "5", "-p", str(port), "-t", topic, "-F", "%r %l %t", "-W", str(seconds)],
        capture_output=True,
        text=True,
    ).stdout
    counts = {}
    for line in said.splitlines():
        retained, length, topic = line.split(" ", 2)
        if retained == "0":
            what = topic.rsplit("/", 1)[-1]
            messages, size = counts.get(what, (0, 0))
            counts[what] = messages + 1, size + int(length) + len(topic)
    return counts


def tell(title, counts, seconds):
    messages, size = (sum(count[at] for count in counts.values()) for at in (0, 1))
    print(f"{title}: {messages / seconds:.2f} messages and {size / seconds:.0f} bytes a second")
    for what, (messages, size) in sorted(counts.items()):
        print(f"    {what}: {messages / seconds:.2f} messages and {size / seconds:.0f} bytes a second")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--drived", required=True)
    parser.add_argument("--seconds", type=int, default=120)
    args = parser.parse_args()
    folder, port = tempfile.mkdtemp(prefix="mqtt-figures-"), free_port()
    line, config, control = (os.path.join(folder, name) for name in ("line", "drives.toml", "socket"))
    with open(os.path.join(folder, "mosquitto.conf"), "w") as file:
        file.write(f"listener {port} 127.0.0.1\nallow_anonymous true\n")
    with open(config, "w") as file:
        file.write(
            f'[http]\nlisten = "off"\n[mqtt]\nservers = ["mqtt://127.0.0.1:{port}"]\n[lines.bench]\nport = "{line},19200,8E1"\n'
            '[[drives]]\nline = "bench"\ndrive = "atv312@1-10"\nname = "pump {}"\ncontrol = true\n'
        )
    silent = {"stdin": subprocess.PIPE, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    started = [subprocess.Popen(["mosquitto", "-c", os.path.join(folder, "mosquitto.conf")], **silent)]
    try:
        until_open(port)
        sim = ["sim", "--pty", line, "--drive", "atv312@1-10", "--baud", "19200", "--format", "8E1"]
        started.append(subprocess.Popen([args.drived, *sim], **silent))
        while not os.path.exists(line):
            time.sleep(0.05)
        run = [args.drived, "run", "--config", config, "--socket", control]
        started.append(subprocess.Popen(run, **silent))
        # Everything has been told once when the second heartbeat is over.
        heard(port, "drived/#", 60)
        tell("ten drives at rest", heard(port, "drived/#", args.seconds), args.seconds)

        def order(*what):
            done = subprocess.run([args.drived, *what, "--socket", control], capture_output=True, text=True)
            if done.returncode:
                print(" ".join(what), done.stderr.strip())

        order("start", "pump 1", "--setpoint", "20Hz")
        counting = subprocess.Popen(["sleep", str(args.seconds)])
        ear = []
        listening = threading.Thread(target=lambda: ear.append(heard(port, "drived/drive/pump_1/#", args.seconds)))
        listening.start()
        hertz = 20
        while counting.poll() is None:
            hertz = 60 - hertz
            order("setpoint", "pump 1", f"{hertz}Hz")
            time.sleep(5)
        listening.join()
        tell("one drive that moves", ear[0], args.seconds)
        order("stop", "pump 1")
    finally:
        for child in reversed(started):
            child.terminate()
            child.wait()
        shutil.rmtree(folder, ignore_errors=True)


main()
