"""Finds desktop arms by name: with the official client (package lineus), a resolver that knows multicast
(zeroconf), and one that does not (dnspython).

    python found.py PROGRAM FOLDER

PROGRAM is the desktop arm's. To be run in a network namespace of its own.
"""

import fcntl
import os
import random
import socket
import struct
import subprocess
import sys
import time

import dns.message
import dns.rdatatype
import lineus
import zeroconf

GROUP = ("224.0.0.251", 5353)
KIND = "_lineus._tcp.local."
PATIENCE = 30


def fail(what):
    sys.exit(what)


def check(what, got, expected):
    if got != expected:
        fail(f"{what}: got {got!r}, expected {expected!r}")
    print(f"{what}: {got!r}")


def until(what, done):
    deadline = time.monotonic() + PATIENCE
    while not done():
        if time.monotonic() > deadline:
            fail(f"waited in vain for {what}")
        time.sleep(0.05)
    print(f"came: {what}")


def bring_up_loopback():
    """A new network namespace has a loopback interface that is down."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        get_flags, set_flags, up = 0x8913, 0x8914, 1
        request = struct.pack("16sh14x", b"lo", 0)
        flags = struct.unpack("16sh14x", fcntl.ioctl(any_socket, get_flags, request))[1]
        if not flags & up:
            fcntl.ioctl(any_socket, set_flags, struct.pack("16sh14x", b"lo", flags | up))


class Arm:
    def __init__(self, program, folder, address):
        self.address = address
        state = os.path.join(folder, f"state-{address}")
        picture = os.path.join(folder, f"picture-{address}.svg")
        self.process = subprocess.Popen(
            [program, "--mdns", "--line-us", f"{address}:1337", "--state", state, "--picture", picture],
            stdout=subprocess.DEVNULL,
        )

    def ask(self, command):
        with socket.create_connection((self.address, 1337), timeout=PATIENCE) as client:
            client.settimeout(PATIENCE)
            stream = client.makefile("rwb")
            read = lambda: b"".join(iter(lambda: stream.read(1), b"\0")).decode().strip()
            read()
            stream.write(command.encode() + b"\n")
            stream.flush()
            return read()

    def host(self):
        tokens = self.ask("M122").split()
        return next((token[5:] for token in tokens if token.startswith("Host:")), None)

    def is_up(self):
        try:
            socket.create_connection((self.address, 1337), timeout=1).close()
            return True
        except OSError:
            return False


class Seen(zeroconf.ServiceListener):
    """Which instances there are, as a browser of services shows them."""

    def __init__(self):
        self.names = set()

    def add_service(self, zc, kind, name):
        self.names.add(name.removesuffix("." + kind))

    def remove_service(self, zc, kind, name):
        self.names.discard(name.removesuffix("." + kind))

    def update_service(self, zc, kind, name):
        pass


def one_shot(name, kind):
    """Asks as a program does that knows nothing of multicast."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asker:
        asker.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        asker.settimeout(1)
        question = dns.message.make_query(name, kind, use_edns=False)
        # A message may be lost, and resolvers ask again.
        for _ in range(PATIENCE):
            asker.sendto(question.to_wire(), GROUP)
            try:
                answer = dns.message.from_wire(asker.recv(9000))
                break
            except TimeoutError:
                continue
        else:
            fail(f"nobody answers for {name} {kind}")
        check("the answer's number", answer.id, question.id)
        return [
            record.to_text()
            for answers in answer.answer
            if answers.rdtype == dns.rdatatype.from_text(kind)
            for record in answers
        ]


def official_client(name):
    client = lineus.LineUs()
    try:
        check("the official client connects without an address", client.connect(), True)
        check("to", client.get_name(), name)
        check("which says that it is found as", client.get_info()["Host"], f"{name}.local")
        client.disconnect()
    finally:
        # Or its threads keep the program alive.
        client.zeroconf.close()


def flood(seed):
    """Two thousand messages of all kinds of bytes, some of them nearly right."""
    dice = random.Random(seed)
    good = dns.message.make_query("robs-lineus.local", "A", use_edns=False).to_wire()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        for number in range(2000):
            if number % 2:
                message = bytearray(good)
                for _ in range(3):
                    message[dice.randrange(2, len(message))] = dice.randrange(256)
            else:
                message = dice.randbytes(dice.randrange(1, 1400))
            sender.sendto(bytes(message), GROUP)


def main(program, folder):
    bring_up_loopback()
    arms = []
    browser = zeroconf.Zeroconf(interfaces=["127.0.0.1"])
    try:
        arms.append(Arm(program, folder, "127.0.0.1"))
        until("the arm to start", arms[0].is_up)
        official_client("line-us")

        seen = Seen()
        browser.add_service_listener(KIND, seen)
        until("line-us in the browser", lambda: seen.names == {"line-us"})
        check("M550", arms[0].ask("M550 Probs-lineus"), "ok MACHINENAME:robs-lineus")
        until("robs-lineus instead", lambda: seen.names == {"robs-lineus"})
        info = browser.get_service_info(KIND, f"robs-lineus.{KIND}", PATIENCE * 1000)
        check("its host", info.server, "robs-lineus.local.")
        check("its address", info.parsed_addresses(), ["127.0.0.1"])
        check("its port", info.port, 1337)

        check("one-shot A", one_shot("robs-lineus.local", "A"), ["127.0.0.1"])
        check("one-shot AAAA", one_shot("robs-lineus.local", "AAAA"), [])
        check("one-shot PTR", one_shot(KIND, "PTR"), [f"robs-lineus.{KIND}"])

        arms.append(Arm(program, folder, "127.0.0.2"))
        until("another arm to start", arms[1].is_up)
        until("it to be line-us", lambda: arms[1].host() == "line-us.local")
        check("M550", arms[1].ask("M550 Probs-lineus"), "ok MACHINENAME:robs-lineus")
        until("it to be number 2", lambda: arms[1].host() == "robs-lineus-2.local")
        check("its name stays", arms[1].ask("M550"), "ok MACHINENAME:robs-lineus")
        check("the first one is what it was", arms[0].host(), "robs-lineus.local")
        until("both in the browser", lambda: seen.names == {"robs-lineus", "robs-lineus-2"})
        check("the second's address", one_shot("robs-lineus-2.local", "A"), ["127.0.0.2"])

        flood(1)
        check("after a flood", one_shot("robs-lineus.local", "A"), ["127.0.0.1"])
        check("the arm lives", arms[0].ask("M550"), "ok MACHINENAME:robs-lineus")
    finally:
        browser.close()
        for arm in arms:
            arm.process.kill()


if __name__ == "__main__":
    main(*sys.argv[1:])
