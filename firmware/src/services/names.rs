//! Names for the guests of the machine's own network: whatever they ask for, it is the machine.
//!
//! That is how the setup page comes up by itself (see [`super::portal`]).

use super::dhcp::OWN_ADDRESS;
use crate::log::warning;
use core::net::{IpAddr, Ipv4Addr, SocketAddr};
use core::time::Duration;
use edge_captive::reply;
use edge_nal::{UdpBind, UdpReceive, UdpSend};
use embassy_time::Timer;

/// Port of DNS, at every address that the machine has.
pub const ANYWHERE: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::UNSPECIFIED), 53);
/// Longest message without extensions (RFC 1035, section 4.2.1). A longer question is not answered.
pub const MAX_MESSAGE: usize = 512;
/// How long an answer may be remembered: not much longer than a guest stays, or names of the Internet would
/// lead here when it is back in its own network.
const TTL: Duration = Duration::from_secs(10);
/// Bytes before the questions.
const HEADER: usize = 12;

/// Answers questions for an address (A) with the machine's own, and all others with "no such data", for ever.
pub async fn serve(udp: &impl UdpBind, at: SocketAddr) -> ! {
    loop {
        if let Ok(mut socket) = udp.bind(at).await {
            let mut question = [0; MAX_MESSAGE];
            let mut buffer = [0; MAX_MESSAGE];
            // A socket that fails is made anew.
            while let Ok((length, guest)) = socket.receive(&mut question).await {
                let question = question.get(..length).unwrap_or_default();
                if let Some(answer) = answer(question, &mut buffer)
                    && socket.send(guest, answer).await.is_err()
                {
                    break;
                }
            }
        }
        warning!("the name service starts again");
        Timer::after_secs(1).await;
    }
}

/// The answer to a message; `None` if it is no question, or does not fit.
fn answer<'a>(message: &[u8], buffer: &'a mut [u8]) -> Option<&'a [u8]> {
    // An answer is never answered, or two such services would talk to each other for ever.
    let is_answer = message.get(2)? & 0x80 != 0;
    if is_answer || message.len() < HEADER {
        return None;
    }
    let length = reply(message, &OWN_ADDRESS.octets(), TTL, buffer).ok()?;
    buffer.get(..length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A question as it is on the wire (RFC 1035, section 4.1).
    fn question(labels: &[&str], kind: u16) -> Vec<u8> {
        let mut message = vec![0xab, 0xcd, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0];
        for label in labels {
            message.push(u8::try_from(label.len()).unwrap());
            message.extend(label.as_bytes());
        }
        message.push(0);
        message.extend(kind.to_be_bytes());
        message.extend([0, 1]);
        message
    }

    fn answered(message: &[u8]) -> Option<Vec<u8>> {
        answer(message, &mut [0; MAX_MESSAGE]).map(<[u8]>::to_vec)
    }

    #[test]
    fn every_name_is_the_machine() {
        for labels in [
            &["captive", "apple", "com"][..],
            &["connectivitycheck", "gstatic", "com"],
            &["line-us", "local"],
            &["x"],
        ] {
            let asked = question(labels, 1);
            let answer = answered(&asked).unwrap();
            // The same number and question, one answer, no error.
            assert_eq!(&answer[..2], &asked[..2]);
            assert_eq!(answer[2] & 0x80, 0x80, "an answer");
            assert_eq!(answer[3] & 0x0f, 0, "no error");
            assert_eq!(&answer[4..12], [0, 1, 0, 1, 0, 0, 0, 0]);
            assert_eq!(&answer[12..asked.len()], &asked[12..]);
            // Type, class, 10 s, four bytes.
            let record = [0, 1, 0, 1, 0, 0, 0, 10, 0, 4, 192, 168, 4, 1];
            assert_eq!(&answer[answer.len() - record.len()..], record);
        }
    }

    #[test]
    fn other_questions_are_answered_with_nothing() {
        for kind in [28, 65, 16, 255] {
            let asked = question(&["example", "com"], kind);
            let answer = answered(&asked).unwrap();
            assert_eq!(answer[3] & 0x0f, 0, "{kind}: no error");
            assert_eq!(&answer[4..12], [0, 1, 0, 0, 0, 0, 0, 0], "{kind}");
        }
    }

    #[test]
    fn an_answer_is_not_answered() {
        let answer = answered(&question(&["example", "com"], 1)).unwrap();
        assert_eq!(answered(&answer), None);
        assert_eq!(answered(&[]), None);
        assert_eq!(answered(&[0; 11]), None);
    }

    #[test]
    fn what_does_not_fit_is_not_answered() {
        let one = question(&["a"], 1);
        let mut asked = one.clone();
        for _ in 0..60 {
            asked.extend(&one[HEADER..]);
        }
        asked[5] = 61;
        assert!(asked.len() <= MAX_MESSAGE);
        assert_eq!(answered(&asked), None);
    }

    proptest! {
        #[test]
        fn any_bytes_get_an_answer_that_fits_or_none(
            bytes in proptest::collection::vec(any::<u8>(), 0..MAX_MESSAGE),
        ) {
            let _ = answered(&bytes);
        }

        #[test]
        fn a_damaged_question_does_no_harm(
            at in 0_usize..30,
            value: u8,
            cut in 0_usize..40,
        ) {
            let mut asked = question(&["captive", "apple", "com"], 1);
            asked[at] = value;
            asked.truncate(cut.max(1));
            if let Some(answer) = answered(&asked) {
                prop_assert_eq!(&answer[..2], &asked[..2]);
            }
        }
    }
}
