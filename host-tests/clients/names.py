"""Asks the machine's name service as a resolver does (package dnspython).

    python names.py PORT
"""

import sys

import dns.exception
import dns.message
import dns.query
import dns.rdatatype
import dns.resolver


def check(what, got, expected):
    if got != expected:
        sys.exit(f"{what}: got {got!r}, expected {expected!r}")
    print(f"{what}: {got!r}")


def main(port):
    resolver = dns.resolver.Resolver(configure=False)
    resolver.nameservers = ["127.0.0.1"]
    resolver.port = port
    resolver.lifetime = 20
    for name in ("captive.apple.com", "connectivitycheck.gstatic.com", "line-us.local", "a.very.long.name.example"):
        answer = resolver.resolve(name, "A")
        check(name, [record.address for record in answer], ["192.168.4.1"])
        check("remembered for", answer.rrset.ttl, 10)
    for kind in ("AAAA", "HTTPS", "TXT"):
        try:
            resolver.resolve("captive.apple.com", kind)
            sys.exit(f"{kind}: there is an answer")
        except dns.resolver.NoAnswer:
            print(f"{kind}: no such data")
    # With extensions (EDNS), as resolvers of today ask.
    query = dns.message.make_query("example.com", "A", use_edns=0, payload=1232)
    answer = dns.query.udp(query, "127.0.0.1", port=port, timeout=20)
    check("with extensions", answer.answer[0][0].address, "192.168.4.1")


if __name__ == "__main__":
    main(int(sys.argv[1]))
