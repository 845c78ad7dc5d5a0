//! What makes the setup page come up by itself: phones and computers that join a network ask a certain
//! address of the Internet for a certain answer, and show whatever they are redirected to instead.
//!
//! In setup every name leads to the machine (see [`super::names`]), so these requests arrive here.

/// Where the setup page is: the machine itself, by its address, because a name would lead anywhere.
pub const URL: &str = "http://192.168.4.1/";

/// Paths that are asked for to find out whether there is Internet, for requests that do not say whom they
/// are for. What is asked of a name of the Internet needs no list: see [`redirect`].
const PROBES: [&str; 15] = [
    // Android, ChromeOS
    "/generate_204",
    "/gen_204",
    "/mobile/status.php",
    // Apple
    "/hotspot-detect.html",
    "/library/test/success.html",
    "/bag",
    // Windows
    "/connecttest.txt",
    "/ncsi.txt",
    "/redirect",
    // Firefox
    "/success.txt",
    "/canonical.html",
    // GNOME, Debian, Fedora, Ubuntu, Arch
    "/nm",
    "/nm-check.txt",
    "/static/hotspot.txt",
    "/check_network_status.txt",
];

/// Where a request is sent instead of being served, with status 302; `None` if it is the machine's own.
///
/// `host` is the header's value as it came, `path` the target's path with or without a query. In setup, what
/// is asked of any name of the Internet is redirected, whatever the method: the machine answers to that name
/// only because it answers to all. What is asked of an address, of a name in `.local` or of one without a
/// dot is meant for the machine. Where no host is said, the path decides. As a station nothing is redirected.
pub fn redirect(setup: bool, host: Option<&str>, path: &str) -> Option<&'static str> {
    let foreign = match host.map(name).filter(|host| !host.is_empty()) {
        Some(host) => is_of_the_internet(host),
        None => {
            let path = path.split(['?', '#']).next().unwrap_or_default();
            PROBES.contains(&path)
        }
    };
    (setup && foreign).then_some(URL)
}

/// The host without its port and the dot at its end.
fn name(host: &str) -> &str {
    let host = host.trim();
    // An IPv6 address has colons of its own.
    let end = match host.starts_with('[') {
        true => host.len(),
        false => host.find(':').unwrap_or(host.len()),
    };
    let name = host.get(..end).unwrap_or(host);
    name.strip_suffix('.').unwrap_or(name)
}

fn is_of_the_internet(host: &str) -> bool {
    let Some((_, top)) = host.rsplit_once('.') else {
        return false;
    };
    let is_address = host.starts_with('[') || top.bytes().all(|byte| byte.is_ascii_digit());
    !is_address && !top.eq_ignore_ascii_case("local")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Host and path that systems ask for when they have joined a network.
    const ASKED: &[(&str, &str, &str)] = &[
        ("Android", "connectivitycheck.gstatic.com", "/generate_204"),
        (
            "Android",
            "connectivitycheck.android.com",
            "/generate_204?x=1",
        ),
        ("Android", "clients3.google.com", "/generate_204"),
        ("Android", "www.google.com", "/gen_204"),
        ("Android of Samsung", "connectivity.samsung.com", "/"),
        (
            "Android of Huawei",
            "connectivitycheck.platform.hicloud.com",
            "/generate_204",
        ),
        ("Android of Xiaomi", "connect.rom.miui.com", "/generate_204"),
        ("ChromeOS", "www.gstatic.com", "/generate_204"),
        ("Apple", "captive.apple.com", "/hotspot-detect.html"),
        ("Apple", "captive.apple.com", "/"),
        ("Apple", "www.apple.com", "/library/test/success.html"),
        ("Windows 10", "www.msftconnecttest.com", "/connecttest.txt"),
        ("Windows 10", "ipv6.msftconnecttest.com", "/connecttest.txt"),
        ("Windows 10", "www.msftconnecttest.com", "/redirect"),
        ("Windows 7", "www.msftncsi.com", "/ncsi.txt"),
        ("Firefox", "detectportal.firefox.com", "/success.txt?ipv4"),
        ("Firefox", "detectportal.firefox.com", "/canonical.html"),
        ("Ubuntu", "connectivity-check.ubuntu.com", "/"),
        (
            "Ubuntu, with a port",
            "connectivity-check.ubuntu.com:80",
            "/",
        ),
        ("Debian", "network-test.debian.org", "/nm"),
        ("Fedora", "fedoraproject.org", "/static/hotspot.txt"),
        ("GNOME", "nmcheck.gnome.org", "/check_network_status.txt"),
        ("KDE", "networkcheck.kde.org", "/"),
        ("Arch", "ping.archlinux.org", "/nm-check.txt"),
        (
            "Kindle",
            "spectrum.s3.amazonaws.com",
            "/kindle-wifi/wifistub.html",
        ),
        ("somebody who reads the news", "example.com", "/index.html"),
        (
            "a name in capitals, with its last dot",
            "WWW.EXAMPLE.COM.",
            "/",
        ),
        (
            "a name that begins like an address",
            "192.168.4.1.example.com",
            "/",
        ),
    ];

    #[test]
    fn what_is_asked_of_the_internet_leads_to_the_setup_page() {
        for (who, host, path) in ASKED {
            assert_eq!(
                redirect(true, Some(host), path),
                Some("http://192.168.4.1/"),
                "{who} asks {host} for {path}"
            );
        }
    }

    #[test]
    fn a_station_redirects_nothing() {
        for (who, host, path) in ASKED {
            assert_eq!(redirect(false, Some(host), path), None, "{who}");
            assert_eq!(redirect(false, None, path), None, "{who}");
        }
    }

    #[test]
    fn what_is_asked_of_the_machine_is_served() {
        for host in [
            "192.168.4.1",
            "192.168.4.1:80",
            " 192.168.4.1 ",
            "line-us.local",
            "Line-Us.LOCAL.",
            "line-us.local:80",
            "line-us",
            "localhost:8080",
            "127.0.0.1:8080",
            "[::1]:8080",
            "[fe80::1.2.3.4]",
        ] {
            for path in ["/", "/api/state", "/generate_204"] {
                assert_eq!(redirect(true, Some(host), path), None, "{host} {path}");
            }
        }
    }

    #[test]
    fn where_no_host_is_said_the_path_decides() {
        for host in [None, Some(""), Some(" "), Some(":80")] {
            for path in [
                "/generate_204",
                "/gen_204?a=b",
                "/hotspot-detect.html",
                "/library/test/success.html",
                "/connecttest.txt",
                "/ncsi.txt",
                "/success.txt?ipv6",
                "/canonical.html",
            ] {
                assert_eq!(redirect(true, host, path), Some(URL), "{host:?} {path}");
            }
            for path in ["/", "/index.html", "/api/state", "", "?", "/generate_204/x"] {
                assert_eq!(redirect(true, host, path), None, "{host:?} {path}");
            }
        }
    }
}
