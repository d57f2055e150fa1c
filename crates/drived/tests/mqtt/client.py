"""Asks a daemon over MQTT v5 as a control system would, and checks its discovery documents by others' models."""

import json
import queue
import sys

import paho.mqtt.client as mqtt
from ha_mqtt_models_pydantic import parse_device_discovery_payload
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

PATIENCE = 30
arrived = queue.Queue()
client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, client_id="tester", protocol=mqtt.MQTTv5)
subscribed = queue.Queue()
client.on_message = lambda client, userdata, message: arrived.put(message)
client.on_subscribe = lambda client, userdata, mid, codes, properties: subscribed.put(mid)
client.connect("127.0.0.1", int(sys.argv[1]))
client.loop_start()
client.subscribe([("reply/tester", 1), ("homeassistant/#", 1)])
subscribed.get(timeout=PATIENCE)


def ask(action, correlation, expiry=None, **more):
    properties = Properties(PacketTypes.PUBLISH)
    properties.ResponseTopic = "reply/tester"
    properties.CorrelationData = correlation
    if expiry:
        properties.MessageExpiryInterval = expiry
    payload = json.dumps({"action": action, **more})
    client.publish("drived/drive/pump_1/command", payload, qos=1, properties=properties).wait_for_publish(PATIENCE)


documents = {}


def answer(correlation):
    while True:
        message = arrived.get(timeout=PATIENCE)
        if message.topic.startswith("homeassistant/"):
            documents[message.topic] = json.loads(message.payload)
        elif message.properties.CorrelationData == correlation:
            assert not message.retain and message.properties.ContentType == "application/json"
            return json.loads(message.payload)


def outcome(correlation):
    told = answer(correlation)
    while told["outcome"] == "accepted":
        told = answer(correlation)
    return told


ask("start", b"\x00\x01", expiry=5, setpoint={"frequency_hz": 30.0})
first = outcome(b"\x00\x01")
assert first["outcome"] == "confirmed", first
ask("stop", b"\x00\x02")
assert outcome(b"\x00\x02")["outcome"] == "confirmed"
# The same request once more, as a client sends it that has not heard of the acknowledgement.
ask("start", b"\x00\x01", expiry=5, setpoint={"frequency_hz": 30.0})
again = outcome(b"\x00\x01")
assert (again["id"], again["time_unix_ms"]) == (first["id"], first["time_unix_ms"]), again

assert len(documents) == 3, list(documents)
for topic, document in documents.items():
    parsed = parse_device_discovery_payload(document)
    assert set(parsed.components) == set(document["components"]), topic
client.loop_stop()
