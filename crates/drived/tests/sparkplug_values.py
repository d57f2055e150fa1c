"""A SCADA host that was not written here: pysparkplug keeps what the devices of an edge node have told last. It says `ready` when it listens; at
each line on its stdin it prints, as a line of JSON, each device that is alive with its metrics: value, quality and time.

Argument: the port of the broker."""

import json
import sys
import threading

import pysparkplug as psp

alive = {}
lock = threading.Lock()


def hear(_client, message):
    device, kind = message.topic.device_id, message.topic.message_type
    with lock:
        if kind == psp.MessageType.NBIRTH or kind == psp.MessageType.NDEATH:
            alive.clear()
        elif kind == psp.MessageType.DDEATH:
            alive.pop(device, None)
        elif kind in (psp.MessageType.DBIRTH, psp.MessageType.DDATA):
            if kind == psp.MessageType.DBIRTH:
                alive[device] = {}
            for metric in message.payload.metrics:
                assert metric.name, f"{message.topic}: an alias that no birth has told: {metric}"
                alive.setdefault(device, {})[metric.name] = [metric.value, metric.timestamp]


def main():
    client = psp.Client()
    client.subscribe(psp.Topic(group_id="#"), psp.QoS.AT_MOST_ONCE, hear)
    client.connect("127.0.0.1", port=int(sys.argv[1]), callback=lambda _: print("ready", flush=True))
    for _ in sys.stdin:
        with lock:
            print(json.dumps(alive, default=str), flush=True)


main()
