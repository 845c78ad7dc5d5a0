//! What a host and the page know of a line and its reply, written from the page and `reference/lasaurgrbl.md` alone.

/// The page's algorithm.
pub fn checksum(body: &[u8]) -> u32 {
    let mut checksum = 0;
    for &byte in body {
        checksum += u32::from(byte);
        if checksum >= 128 {
            checksum -= 128;
        }
    }
    (checksum >> 1) + 128
}

/// A line as a host sends it, without its newline.
pub fn with_checksum(prefix: u8, body: &[u8]) -> Vec<u8> {
    let kept = kept(body);
    let sum = u8::try_from(checksum(&kept)).expect("bodies are ASCII");
    [&[prefix, sum], body].concat()
}

/// What is kept of a line: no blanks, nothing that takes effect on receipt.
pub fn kept(line: &[u8]) -> Vec<u8> {
    let real_time = |byte: &u8| matches!(byte, b'!' | b'~' | 0x14);
    line.iter()
        .copied()
        .filter(|byte| *byte > b' ' && !real_time(byte))
        .collect()
}

/// Whether a reply has the form that the page gives it.
pub fn is_well_formed(reply: &[u8]) -> bool {
    let Some((b'\n', rest)) = reply.split_last() else {
        return false;
    };
    if rest.contains(&b'\n') {
        return false;
    }
    // A line that was wrong, repeated.
    if !rest.is_ascii() || rest.ends_with(b" -> checksum outside [128,255]") {
        return true;
    }
    let text: String = rest.iter().map(|&byte| char::from(byte)).collect();
    let answer = match text.as_bytes() {
        [b'!', b'P' | b'L' | b'R' | b'B' | b'I' | b'T', ..] => 2,
        [b'^'] => 1,
        [b'N' | b'E' | b'U', ..] => 1,
        _ => 0,
    };
    let mut rest = &text[answer..];
    for flag in ["D", "C", "P", "L1", "L2", "L3", "L4"] {
        rest = rest.strip_prefix(flag).unwrap_or(rest);
    }
    let number = |text: &str| {
        let digits = text.strip_prefix('-').unwrap_or(text);
        let decimals = digits.split_once('.').map(|(_, decimals)| decimals.len());
        digits.parse::<f64>().is_ok() && decimals == Some(3)
    };
    match rest.strip_prefix('X') {
        None => rest.is_empty(),
        Some(rest) => rest.split_once('Y').is_some_and(|(x, rest)| {
            let version = rest.split_once('V');
            number(x) && version.is_some_and(|(y, v)| number(y) && !v.contains(char::is_uppercase))
        }),
    }
}
