//! Reads the subset of G-code the model knows.

/// One command: its G number and its words, such as `('X', 100.0)`.
pub struct Command {
    pub code: u32,
    words: Vec<(char, f64)>,
    /// K of a G40: the axes that move as always.
    pub usual: String,
}

impl Command {
    pub fn word(&self, letter: char) -> Option<f64> {
        self.words
            .iter()
            .find(|word| word.0 == letter)
            .map(|word| word.1)
    }
}

/// Reads a line; none if there is nothing on it but blanks and comments.
pub fn read(line: &str) -> Result<Option<Command>, String> {
    let text = without_comments(line).to_ascii_uppercase();
    let mut words = Vec::new();
    let mut usual = String::new();
    for part in text.split_whitespace() {
        let (letter, number) = part.split_at_checked(1).ok_or("not a letter")?;
        if letter == "K" && words.first() == Some(&('G', 40.0)) && usual.is_empty() {
            usual = number.to_owned();
            continue;
        }
        let value: f64 = number
            .parse()
            .map_err(|_| format!("{part:?} has no number"))?;
        if !value.is_finite() {
            return Err(format!("{part:?} is not finite"));
        }
        words.push((letter.as_bytes()[0] as char, value));
    }
    if words.is_empty() {
        return Ok(None);
    }
    let (code, allowed) = match words.remove(0) {
        ('G', 0.0) => (0, "XYZF"),
        ('G', 1.0) => (1, "XYZF"),
        ('G', 4.0) => (4, "PS"),
        ('G', 28.0) => (28, ""),
        ('G', 40.0) => (40, "XYZ"),
        ('G', 54.0) => (54, "XYS"),
        ('G', 94.0) => (94, "SFP"),
        _ => return Err("not a command the model knows".into()),
    };
    for (i, &(letter, _)) in words.iter().enumerate() {
        if !allowed.contains(letter) || words[..i].iter().any(|word| word.0 == letter) {
            return Err(format!("{letter} does not belong here, or is repeated"));
        }
    }
    Ok(Some(Command { code, words, usual }))
}

fn without_comments(line: &str) -> String {
    let mut in_parentheses = false;
    let mut rest = String::new();
    for c in line.chars() {
        match c {
            '(' => in_parentheses = true,
            ')' if in_parentheses => in_parentheses = false,
            ';' if !in_parentheses => break,
            _ if !in_parentheses => rest.push(c),
            _ => {}
        }
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn k_of_a_bare_move_is_a_word() {
        let command = read("G40 X5 Kxy").unwrap().unwrap();
        assert_eq!((command.code, command.word('X')), (40, Some(5.0)));
        assert_eq!(command.usual, "XY");
        assert!(read("G01 Kxy").is_err());
    }

    #[test]
    fn reads_words_and_skips_comments() {
        let command = read("g1 (to Z9; the) x1.5e-07  Y-2 ; X3").unwrap().unwrap();
        assert_eq!(
            (command.code, command.word('X'), command.word('Y')),
            (1, Some(1.5e-7), Some(-2.0))
        );
        assert_eq!(command.word('Z'), None);
        assert!(read("  (nothing) ; at all").unwrap().is_none());
        for bad in [
            "G02 X1",
            "M114",
            "G01 X",
            "G01 Xnan",
            "G01 X1 X2",
            "G01 Q1",
            "G28 X1",
            "G1.5",
            "G-1",
            "G01 é1",
        ] {
            assert!(read(bad).is_err(), "{bad}");
        }
    }
}
