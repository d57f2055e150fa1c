"""Home Assistant itself, with its own mqtt integration, told by lines on stdin what to do and answering each by a line on stdout.

It is set up as its own bootstrap does, without the parts that a test has no use for (recorder, frontend, discovery of other
things). Nothing of it is replaced.

usage: home_assistant.py FOLDER PORT OWN-PORT      the port of the broker, and one for its own server

    wait ENTITY STATE     waits until an entity is in this state: its attributes; `-` for none: until there is no such entity
    outcome ENTITY TIME   waits until a last command came at another time than this and its outcome is known: its attributes
    entity ENTITY         an entity as it is now: state, attributes, and when that came; `-` for none
    states                every entity with its state
    named ENTITY NAME     waits until the device of an entity has this name
    forget                what follows begins here
    seen ENTITY           the states that an entity has been in since then
    press ENTITY          presses a button
    set ENTITY VALUE      sets a number
    log                   its warnings and errors since then
    end                   ends as its own service does
"""

import asyncio
import json
import logging
import sys

from homeassistant import auth, bootstrap, config_entries, core, loader
from homeassistant.components.mqtt import DOMAIN
from homeassistant.const import EVENT_STATE_CHANGED, __version__
from homeassistant.helpers import device_registry, entity_registry
from homeassistant.setup import async_setup_component

# Longer than anything takes: what does not come is an error.
PATIENCE = 60
COMPLAINTS = []
SEEN = []


class Complaints(logging.Handler):
    """Keeps what it warns of."""

    def emit(self, record):
        if record.levelno >= logging.WARNING and record.name.startswith("homeassistant"):
            COMPLAINTS.append(f"{record.name}: {record.getMessage()}")


def say(value):
    print(json.dumps(value, default=str), flush=True)


async def begin(folder, port, http_port):
    hass = core.HomeAssistant(folder)
    hass.config.skip_pip = True
    hass.config.skip_pip_packages = []
    loader.async_setup(hass)
    hass.config_entries = config_entries.ConfigEntries(hass, {})
    await bootstrap.async_load_base_functionality(hass)
    hass.auth = await auth.auth_manager_from_config(hass, [{"type": "homeassistant"}], [])
    await async_setup_component(hass, "homeassistant", {})
    # Nobody asks its own server for anything.
    own = {"server_host": "127.0.0.1", "server_port": http_port}
    assert await async_setup_component(hass, "http", {"http": own}), COMPLAINTS
    hass.bus.async_listen(EVENT_STATE_CHANGED, note)
    if hass.config_entries.async_entries(DOMAIN):
        await async_setup_component(hass, DOMAIN, {})
    else:
        # As a person does by its dialog.
        flow = await hass.config_entries.flow.async_init(DOMAIN, context={"source": "user"})
        asked = {"broker": "127.0.0.1", "port": port}
        made = await hass.config_entries.flow.async_configure(flow["flow_id"], asked)
        assert made["type"] == "create_entry", made
    await hass.async_start()
    return hass


@core.callback
def note(event):
    state = event.data["new_state"]
    SEEN.append((event.data["entity_id"], state.state if state else "-"))


async def wait(hass, entity, wanted):
    """Until the entity is so; its attributes."""

    def is_so(state):
        return state is None if wanted == "-" else state is not None and state.state == wanted

    return await until(hass, entity, is_so, wanted)


async def outcome(hass, entity, before):
    """Until the outcome of another command than that which came then is known; its attributes."""

    def is_known(state):
        told = state.attributes if state else {}
        return str(told.get("arrived_unix_ms", before)) != before and told.get("outcome") != "accepted"

    return await until(hass, entity, is_known, f"the outcome of one behind {before}")


async def until(hass, entity, is_so, wanted):
    changed = asyncio.Event()
    stop = hass.bus.async_listen(EVENT_STATE_CHANGED, core.callback(lambda _: changed.set()))
    try:
        async with asyncio.timeout(PATIENCE):
            while not is_so(hass.states.get(entity)):
                changed.clear()
                await changed.wait()
    except TimeoutError:
        states = {state.entity_id: state.state for state in hass.states.async_all()}
        state = hass.states.get(entity)
        attributes = dict(state.attributes) if state else {}
        return {"error": f"{entity} is not {wanted}", "it has": attributes, "states": states, "log": COMPLAINTS}
    finally:
        stop()
    state = hass.states.get(entity)
    return dict(state.attributes) if state else {}


async def named(hass, entity, name):
    """Until the device of an entity has this name."""
    device = entity_registry.async_get(hass).async_get(entity).device_id
    changed = asyncio.Event()
    updated = device_registry.EVENT_DEVICE_REGISTRY_UPDATED
    stop = hass.bus.async_listen(updated, core.callback(lambda _: changed.set()))
    try:
        async with asyncio.timeout(PATIENCE):
            while (is_called := device_registry.async_get(hass).async_get(device).name) != name:
                changed.clear()
                await changed.wait()
    except TimeoutError:
        return {"error": f"{entity} is of {is_called}, and not of {name}"}
    finally:
        stop()
    return {}


async def call(hass, domain, service, entity, **data):
    try:
        await hass.services.async_call(domain, service, {"entity_id": entity, **data}, blocking=True)
    except Exception as error:  # A service refuses by whatever it likes.
        return {"error": f"{type(error).__name__}: {error}"}
    return {}


async def answer(hass, word, words):
    match word, words:
        case "wait", [entity, wanted]:
            return await wait(hass, entity, wanted)
        case "outcome", [entity, before]:
            return await outcome(hass, entity, before)
        case "entity", [entity]:
            now = hass.states.get(entity)
            if now is None:
                return {"state": "-"}
            return {"state": now.state, "attributes": dict(now.attributes), "at": now.last_updated.timestamp()}
        case "states", []:
            return {state.entity_id: state.state for state in hass.states.async_all()}
        case "named", [entity, *name]:
            return await named(hass, entity, " ".join(name))
        case "forget", []:
            SEEN.clear()
            COMPLAINTS.clear()
            return {}
        case "seen", [entity]:
            return {"states": [state for seen, state in SEEN if seen == entity]}
        case "press", [entity]:
            return await call(hass, "button", "press", entity)
        case "set", [entity, value]:
            return await call(hass, "number", "set_value", entity, value=float(value))
        case "log", []:
            return {"log": COMPLAINTS}
    return {"error": f"what is {word}?"}


async def main(folder, port, http_port):
    logging.getLogger().addHandler(Complaints())
    hass = await begin(folder, port, http_port)
    say({"version": __version__, "python": sys.version.split()[0]})
    loop = asyncio.get_running_loop()
    while words := (await loop.run_in_executor(None, sys.stdin.readline)).split():
        if words == ["end"]:
            break
        say(await answer(hass, words[0], words[1:]))
    await hass.async_stop(force=True)
    say({})


asyncio.run(main(sys.argv[1], *map(int, sys.argv[2:])))
