"""A SCADA host that was not written here: pysparkplug prints what the devices of an edge node tell, a line of JSON for each metric of a birth
or of data: whether it is of the past, the device, the name, the time, and the value. It says `ready` when it listens.

Argument: the port of the broker."""

import json
import sys
import threading

import pysparkplug as psp


def hear(_client, message):
    device = message.topic.device_id
    for metric in message.payload.metrics:
        assert metric.name, f"{message.topic}: an alias that no birth has told: {metric}"
        assert metric.is_null == (metric.value is None), metric
        told = [metric.is_historical, device, metric.name, metric.timestamp, metric.value]
        print(json.dumps(told, default=str), flush=True)


client = psp.Client()
for kind in (psp.MessageType.DBIRTH, psp.MessageType.DDATA):
    topic = psp.Topic(message_type=kind, group_id="plant", edge_node_id="hall 1", device_id="+")
    client.subscribe(topic, psp.QoS.AT_MOST_ONCE, hear)
client.connect("127.0.0.1", port=int(sys.argv[1]), callback=lambda _: print("ready", flush=True))
# Until whoever has started it ends it.
threading.Event().wait()
