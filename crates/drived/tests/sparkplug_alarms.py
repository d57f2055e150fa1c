"""A SCADA host that was not written here follows the alarm of a trip: pysparkplug reads what the edge node tells of a drive's alarms, and takes
note of it. It says `ready` when it listens, then a line of JSON whenever what it knows of the trip is another; each line on its stdin is a note
by which it acknowledges the trip.

Arguments: the port of the broker, the id of the drive."""

import json
import queue
import sys
import threading
import time

import pysparkplug as psp

GROUP, NODE = "plant", "hall 1"
OWN = f"Drives/{sys.argv[2]}/Alarms/"

heard = queue.Queue()
values = {}


def hear(_client, message):
    heard.put(message)


def trip():
    """What the node tells of the trip among all alarms of the drive; of the one that matters most in metrics of their own, too."""
    alarms = json.loads(values.get(OWN + "All") or "[]")
    found = next((alarm for alarm in alarms if alarm["kind"] == "tripped"), None)
    if found and values.get(OWN + "Number") == found["id"]:
        seen = found.get("acknowledged", {})
        alone = {
            "State": found["state"],
            "Kind": found["kind"],
            "Count": found["count"],
            "Acknowledged By": seen.get("by"),
            "Note": seen.get("note"),
        }
        told = {name: values.get(OWN + name) for name in alone}
        assert told == alone, f"{told} and {alone}"
    return found


def take_note(client):
    for note in sys.stdin:
        alarm = trip()
        said = {
            "id": f"note-{alarm['id']}",
            "action": "acknowledge",
            "alarms": [{"id": alarm["id"], "count": alarm["count"]}],
            "note": note.strip(),
        }
        now = int(time.time() * 1000)
        metric = psp.Metric(timestamp=now, name="Alarms/Command", datatype=psp.DataType.STRING, value=json.dumps(said))
        topic = psp.Topic(message_type=psp.MessageType.NCMD, group_id=GROUP, edge_node_id=NODE)
        payload = psp.NCmd(timestamp=now, metrics=(metric,))
        client.publish(psp.Message(topic=topic, payload=payload, qos=psp.QoS.AT_MOST_ONCE, retain=False))


def main():
    client = psp.Client()
    client.subscribe(psp.Topic(group_id="#"), psp.QoS.AT_MOST_ONCE, hear)
    client.connect("127.0.0.1", port=int(sys.argv[1]), callback=lambda _: print("ready", flush=True))
    threading.Thread(target=take_note, args=(client,), daemon=True).start()
    known = None
    while True:
        message = heard.get()
        if message.topic.message_type not in (psp.MessageType.NBIRTH, psp.MessageType.NDATA):
            continue
        for metric in message.payload.metrics:
            assert metric.name, f"{message.topic}: an alias that no birth has told: {metric}"
            values[metric.name] = metric.value
        found = trip()
        told = {
            "trip": found and {"state": found["state"], "text": found["text"], "acknowledged": found.get("acknowledged")},
            "outcome": values.get("Alarms/LastCommand/Outcome"),
        }
        if told != known:
            known = told
            print(json.dumps(told), flush=True)


main()
