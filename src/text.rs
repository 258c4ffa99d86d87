//! Text from outside: bytes of a text file as a string, and text that is safe to repeat in a message. Names of the members of enums.

/// An enum whose members have one name each in configurations, reports and files.
macro_rules! named {
    ($(#[$doc:meta])* $visibility:vis enum $type:ident { $($(#[$of:meta])* $member:ident = $name:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        $visibility enum $type { $($(#[$of])* $member,)* }

        impl $type {
            /// All members, in the order of their definition.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$member),*];

            /// The one name of the member.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$member => $name,)* }
            }
        }
    };
}
pub(crate) use named;

/// The mark with which some editors begin a UTF-8 file.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// Characters of a value, key or name that a message repeats.
pub const VALUE_CHARS: usize = 80;

/// Characters of a path that a message repeats.
pub const PATH_CHARS: usize = 400;

/// Characters of a sentence that a message repeats, and of a word in it.
const SENTENCE_CHARS: usize = 1500;
const WORD_CHARS: usize = 200;

/// The text without a byte order mark in front.
pub fn without_mark(text: &str) -> &str {
    text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text)
}

/// Bytes of a text file as a string, without a byte order mark in front. Fails on bytes that are not UTF-8, in words that follow the
/// file's name.
pub fn from_bytes(bytes: Vec<u8>) -> Result<String, String> {
    let is_utf16 = bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]);
    match String::from_utf8(bytes) {
        Ok(mut text) => {
            if text.starts_with(BYTE_ORDER_MARK) {
                text.drain(..BYTE_ORDER_MARK.len_utf8());
            }
            Ok(text)
        }
        Err(_) if is_utf16 => Err("is not text in UTF-8 but in UTF-16; save it as UTF-8".to_owned()),
        Err(error) => {
            let offset = error.utf8_error().valid_up_to();
            Err(format!("is not text: byte {offset} is not UTF-8; save it as UTF-8"))
        }
    }
}

/// Text from outside as a message may repeat it: control characters (and those that change the direction of writing) are escaped, and of
/// more than `chars_max` characters the middle is left out, with the number of all characters.
pub fn shown(text: &str, chars_max: usize) -> String {
    let chars = text.chars().count();
    if chars <= chars_max {
        return escaped(text);
    }
    // Most of a value is told by its beginning; a sentence ends with what to do.
    let tail = chars_max / 4;
    let head = chars_max - tail;
    let part = |skipped: usize, taken: usize| text.chars().skip(skipped).take(taken).collect::<String>();
    format!("{}...{} ({chars} characters)", escaped(&part(0, head)), escaped(&part(chars - tail, tail)))
}

/// A sentence that may hold values, as a message may repeat it: long words are cut as values are, then the whole.
pub fn sentence_shown(sentence: &str) -> String {
    let words: Vec<String> = sentence.split(' ').map(|word| shown(word, WORD_CHARS)).collect();
    shown(&words.join(" "), SENTENCE_CHARS)
}

/// The text with its control characters escaped.
pub fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        let turns = matches!(letter, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        if letter.is_control() || turns || letter == BYTE_ORDER_MARK {
            safe.extend(letter.escape_default());
        } else {
            safe.push(letter);
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_order_mark_is_taken_off_and_other_encodings_are_named() {
        assert_eq!(from_bytes(b"\xef\xbb\xbfseed = 1".to_vec()).unwrap(), "seed = 1");
        assert_eq!(from_bytes(b"seed = 1".to_vec()).unwrap(), "seed = 1");
        assert_eq!(without_mark("\u{feff}a\u{feff}"), "a\u{feff}");
        assert!(from_bytes(vec![0xff, 0xfe, b'a', 0]).unwrap_err().contains("UTF-16"));
        assert!(from_bytes(vec![b'a', 0xe4]).unwrap_err().contains("byte 1"));
    }

    #[test]
    fn what_a_message_repeats_has_no_control_character_and_an_end() {
        assert_eq!(shown("\u{1b}[31mred\u{7}\n\u{9b}1m\u{202e}", 80), r"\u{1b}[31mred\u{7}\n\u{9b}1m\u{202e}");
        assert_eq!(shown("f/2 \u{b5}m 'x'", 80), "f/2 \u{b5}m 'x'");
        let long = shown(&"x".repeat(100_000), VALUE_CHARS);
        assert!(long.ends_with("(100000 characters)") && long.chars().count() < VALUE_CHARS + 30, "{long}");
        assert_eq!(shown(&"x".repeat(VALUE_CHARS), VALUE_CHARS).len(), VALUE_CHARS);
        let sentence = sentence_shown(&format!("'{}' is unknown; use 'sensor'", "x".repeat(100_000)));
        assert!(sentence.ends_with("is unknown; use 'sensor'") && sentence.chars().count() < 300, "{sentence}");
        assert!(sentence_shown(&"x ".repeat(100_000)).chars().count() < 1600);
    }
}
