"""A SCADA host that was not written here: pysparkplug reads every payload of the edge node, asks for its births, and
commands a pump by its metrics. It says `ready` when it listens, and `done` when all was as it should be."""

import json
import queue
import sys
import time

import pysparkplug as psp

GROUP, NODE, PUMP = "plant", "hall 1", "pump 1"
# Longer than anything takes: a guard against waiting for ever.
FOR_EVER = 120

heard = queue.Queue()
values = {}


def hear(_client, message):
    heard.put(message)


def is_of(message, kind, device=None):
    topic = message.topic
    return topic.message_type == kind and topic.device_id == device


def wait(what, is_so):
    """Reads on until a message is what is waited for; the values of the pump are kept by their names."""
    while True:
        try:
            message = heard.get(timeout=FOR_EVER)
        except queue.Empty:
            sys.exit(f"never heard: {what}")
        if message.topic.device_id == PUMP and message.topic.message_type in (
            psp.MessageType.DBIRTH,
            psp.MessageType.DDATA,
        ):
            for metric in message.payload.metrics:
                assert metric.name, f"{message.topic}: an alias that no birth has told: {metric}"
                values[metric.name] = metric.value
        if is_so(message):
            return message


def metric_of(payload, name):
    return next(metric for metric in payload.metrics if metric.name == name)


def write(client, device, name, datatype, value):
    kind = psp.MessageType.DCMD if device else psp.MessageType.NCMD
    payload = psp.DCmd if device else psp.NCmd
    now = int(time.time() * 1000)
    metric = psp.Metric(timestamp=now, name=name, datatype=datatype, value=value)
    topic = psp.Topic(message_type=kind, group_id=GROUP, edge_node_id=NODE, device_id=device)
    message = psp.Message(
        topic=topic, payload=payload(timestamp=now, metrics=(metric,)), qos=psp.QoS.AT_MOST_ONCE, retain=False
    )
    client.publish(message)


def ask(client, **command):
    write(client, PUMP, "Control/Command", psp.DataType.STRING, json.dumps(command))
    last = "Control/LastCommand"
    wait(
        f"{command} confirmed",
        lambda _: (values.get(f"{last}/Id"), values.get(f"{last}/Outcome")) == (command["id"], "confirmed"),
    )


def main():
    client = psp.Client()
    client.subscribe(psp.Topic(group_id="#"), psp.QoS.AT_MOST_ONCE, hear)
    client.connect("127.0.0.1", port=int(sys.argv[1]), callback=lambda _: print("ready", flush=True))

    birth = wait("birth of the node", lambda message: is_of(message, psp.MessageType.NBIRTH)).payload
    assert birth.seq == 0, birth
    assert metric_of(birth, "Node Control/Rebirth").value is False
    bd_seq = metric_of(birth, "bdSeq").value
    pump = wait("birth of the pump", lambda message: is_of(message, psp.MessageType.DBIRTH, PUMP)).payload
    assert metric_of(pump, "Properties/Family").value == "atv312", pump
    assert metric_of(pump, "Control/Setpoint").datatype == psp.DataType.DOUBLE

    write(client, None, "Node Control/Rebirth", psp.DataType.BOOLEAN, True)
    again = wait("birth again", lambda message: is_of(message, psp.MessageType.NBIRTH)).payload
    assert metric_of(again, "bdSeq").value == bd_seq, again
    wait("birth of the pump again", lambda message: is_of(message, psp.MessageType.DBIRTH, PUMP))

    write(client, PUMP, "Control/Setpoint", psp.DataType.DOUBLE, 25.5)
    wait("the setpoint", lambda _: values.get("Control/Setpoint") == 25.5)
    ask(client, id="p-1", action="start", direction="reverse")
    wait("running", lambda _: (values["Status/State"], values["Status/Direction"]) == ("running", "reverse"))
    wait("25.5 Hz", lambda _: values["Status/Output Frequency"] == 25.5)
    ask(client, id="p-2", action="stop")
    wait("standstill", lambda _: values["Status/Output Frequency"] == 0.0)
    client.disconnect()
    print("done", flush=True)


main()
