"""Drives an arm with the official Python client, as it comes from PyPI (package lineus 1.0.3).

    python lineus_client.py ADDRESS

The arm has just been started: it is at home and called line-us. Exit status 0 when it did everything
the client expects.
"""

import sys

import lineus


def check(what, got, expected):
    if got != expected:
        sys.exit(f"{what}: got {got!r}, expected {expected!r}")
    print(f"{what}: {got!r}")


def main(address):
    arm = lineus.LineUs()
    try:
        draw(arm, address)
    finally:
        # Or its threads keep the program alive.
        arm.zeroconf.close()


def draw(arm, address):
    check("not connected", arm.connected(), False)
    check("connect", arm.connect(address), True)
    check("connected", arm.connected(), True)
    check("get_name", arm.get_name(), address)

    hello = arm.get_hello_string()
    check("keys of the greeting", sorted(hello), ["NAME", "SERIAL", "VERSION"])
    check("name in the greeting", hello["NAME"], "line-us")
    check("serial is decimal", hello["SERIAL"].isdigit(), True)

    info = arm.get_info()
    check("name in M122", info["name"], "line-us")
    check("bytes of the mac in M122", len(info["mac"].split(":")), 6)
    check("serial in M122", info["Serial"], hello["SERIAL"])
    check("angles of Cal in M122", len(info["Cal"].split(",")), 3)
    for key in ("Uptime", "FreeHeap", "ResetReason"):
        check(f"{key} in M122 is empty", info[key] == "", False)

    check("g01 ints", arm.g01(1000, 500, 1000), "ok X:1000 Y:500 Z:1000")
    check("g01 floats", arm.g01(900.4, 300.6, 0.0), "ok X:900 Y:301 Z:0")
    check("g01 z only", arm.g01(z=1000), "ok X:900 Y:301 Z:1000")
    check("g01 x and y", arm.g01(1200, -300), "ok X:1200 Y:-300 Z:1000")
    check("g01 y=1.5e-07", arm.g01(y=1.5e-07), "ok X:1200 Y:0 Z:1000")
    check("g01 y=1e+2", arm.g01(y=1e2), "ok X:1200 Y:100 Z:1000")
    check("g01 nothing", arm.g01(), False)
    check("out of reach starts with ok", arm.g01(0, 0, 1000)[:21], "ok X:500 Y:0 Z:1000 I")

    check("G28", arm.send_gcode("G28"), "ok X:1000 Y:1000 Z:1000")
    check("G94 S7", arm.send_gcode("G94", "S7"), "ok ")
    check("G54", arm.send_gcode("G54", "X10 Y20 S1.5"), "ok ")
    check("G54 has its effect", arm.g01(600, 600), "ok X:910 Y:920 Z:1000")
    check("G54 back", arm.send_raw_gcode("G54 X0 Y0 S1"), "ok ")
    check("M550 P", arm.send_gcode("M550", "Probs-lineus"), "ok MACHINENAME:robs-lineus")
    check("M550", arm.send_gcode("M550"), "ok MACHINENAME:robs-lineus")
    check("M115", arm.send_raw_gcode("M115"), "ok CONNECTMODE:ST MACHINENAME:robs-lineus")
    check("a refusal", arm.send_gcode("G01", "Xnan")[:12], 'error INFO:"')
    check("set_timeout", arm.set_timeout(3), True)
    check("disconnect", arm.disconnect(), True)
    check("disconnected", arm.connected(), False)

    times = arm.ping(address)
    check("ping", sorted(times), ["max", "mean", "min", "stdev"])
    check("connect again", arm.connect(address, timeout=5), True)
    check("the name it got", arm.get_hello_string()["NAME"], "robs-lineus")
    check("disconnect again", arm.disconnect(), True)


if __name__ == "__main__":
    main(sys.argv[1])
