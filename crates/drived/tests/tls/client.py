"""Reads the state by TLS as Python does it: client.py PORT CERTIFICATE. By the standard library in each version, and by requests.

Prints a line for each: how, and the drives that it was told. The last says what comes of a certificate that nobody vouches for."""

import json
import ssl
import sys
import urllib.request

import requests

port, certificate = sys.argv[1:3]
address = f"https://localhost:{port}/api/v1/state"


def drives(state):
    return ", ".join(drive["name"] for drive in state["drives"])


for version in [ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3]:
    context = ssl.create_default_context(cafile=certificate)
    context.minimum_version = context.maximum_version = version
    with urllib.request.urlopen(address, context=context, timeout=60) as answer:
        spoken = answer.fp.raw._sock.version()
        print(spoken, drives(json.load(answer)))
print("requests", drives(requests.get(address, verify=certificate, timeout=60).json()))
try:
    requests.get(address, timeout=60)
    print("trusted")
except requests.exceptions.SSLError:
    print("not trusted")
