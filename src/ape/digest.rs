//! The digest of a run.

use std::fmt;
use std::str::FromStr;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A hash of all parameters of a run at one moment: two runs share it only when they agree to the last bit. Written as
/// sixteen hexadecimal digits, also in JSON; in messages it is the number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Digest(pub u64);

/// Why a text is no digest.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("must be 16 hexadecimal digits")]
pub struct DigestError;

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

impl FromStr for Digest {
    type Err = DigestError;

    fn from_str(text: &str) -> Result<Digest, DigestError> {
        let is_digest = text.len() == 16 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
        let number = u64::from_str_radix(text, 16).ok().filter(|_| is_digest);
        number.map(Digest).ok_or(DigestError)
    }
}

impl Serialize for Digest {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() { serializer.collect_str(self) } else { self.0.serialize(serializer) }
    }
}

impl<'de> Deserialize<'de> for Digest {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Digest, D::Error> {
        if deserializer.is_human_readable() {
            String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
        } else {
            u64::deserialize(deserializer).map(Digest)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Digest;

    #[test]
    fn digests_are_sixteen_digits_in_text_and_eight_bytes_in_messages() {
        let digest = Digest(0x5db8);
        assert_eq!(digest.to_string(), "0000000000005db8");
        assert_eq!("0000000000005db8".parse(), Ok(digest));
        assert_eq!(serde_json::to_string(&digest).unwrap(), "\"0000000000005db8\"");
        assert_eq!(serde_json::from_str::<Digest>("\"0000000000005db8\"").unwrap(), digest);
        assert_eq!(postcard::from_bytes::<Digest>(&postcard::to_allocvec(&digest).unwrap()).unwrap(), digest);
        for wrong in ["", "5db8", "+000000000005db8", "0000000000005dbg", "00000000000005db8"] {
            assert!(wrong.parse::<Digest>().is_err(), "{wrong}");
        }
    }
}
