//! The signature of a message, by the specification of [Standard Webhooks](https://www.standardwebhooks.com): [`Secret`].

use base64::{Engine as _, engine::general_purpose::STANDARD};
use ring::hmac;

const PREFIX: &str = "whsec_";

/// What a receiver knows too. Never shown.
#[derive(Clone)]
pub(crate) struct Secret(hmac::Key);

impl Secret {
    /// As it stands in a file: `whsec_` and 24 to 64 bytes in base64.
    ///
    /// # Errors
    /// It is none.
    pub(crate) fn read(text: &str) -> Result<Self, &'static str> {
        const EXPECTED: &str =
            "expected whsec_ and 24 to 64 bytes in base64: echo \"whsec_$(openssl rand -base64 32)\"";
        let bytes = text.trim().strip_prefix(PREFIX).and_then(|text| STANDARD.decode(text).ok());
        let bytes = bytes.filter(|bytes| (24..=64).contains(&bytes.len())).ok_or(EXPECTED)?;
        Ok(Self(hmac::Key::new(hmac::HMAC_SHA256, &bytes)))
    }

    /// The value of the header `webhook-signature`.
    pub(crate) fn sign(&self, id: &str, unix_s: u64, body: &str) -> String {
        let signed = hmac::sign(&self.0, format!("{id}.{unix_s}.{body}").as_bytes());
        format!("v1,{}", STANDARD.encode(signed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of the specification's own libraries (`test_sign_function` of standardwebhooks 1.1.0).
    #[test]
    fn a_message_is_signed_as_the_specification_signs_its_example() {
        let secret = Secret::read("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw\n").unwrap();
        let signed = secret.sign("msg_p5jXN8AQM9LWM0D4loKWxJek", 1_614_265_330, "{\"test\": 2432232314}");
        assert_eq!(signed, "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
    }

    #[test]
    fn what_is_no_secret_is_refused() {
        for text in ["", "MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw", "whsec_", "whsec_####", "whsec_c2hvcnQ="] {
            assert!(Secret::read(text).is_err(), "{text:?}");
        }
    }
}
