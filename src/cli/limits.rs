//! Options for the limits of decoders.

use crate::codec::Limits;

const HEADING: &str = "Limits of decoders";

/// What a stream may ask of a decoder. Bytes may end in K, M or G: times 2^10, 2^20, 2^30.
#[derive(Clone, Debug, clap::Args)]
pub struct LimitArgs {
    /// Bytes of a record's payload as stored.
    #[arg(long, value_name = "BYTES", default_value = "256M", value_parser = bytes32, help_heading = HEADING, hide_short_help = true)]
    max_stored_bytes: u32,
    /// Bytes of a record's payload unpacked.
    #[arg(long, value_name = "BYTES", default_value = "256M", value_parser = bytes32, help_heading = HEADING, hide_short_help = true)]
    max_unpacked_bytes: u32,
    /// Unpacked bytes of all model records of a frame.
    #[arg(long, value_name = "BYTES", default_value = "512M", value_parser = bytes32, help_heading = HEADING, hide_short_help = true)]
    max_frame_bytes: u32,
    /// Window of a zstd frame.
    #[arg(long, value_name = "BYTES", default_value = "8M", value_parser = bytes32, help_heading = HEADING, hide_short_help = true)]
    max_zstd_window_bytes: u32,
    /// Live tracks.
    #[arg(long, value_name = "COUNT", default_value = "65536", help_heading = HEADING, hide_short_help = true)]
    max_tracks: u32,
    /// Bytes of a track's path.
    #[arg(long, value_name = "BYTES", default_value = "1024", value_parser = bytes32, help_heading = HEADING, hide_short_help = true)]
    max_path_bytes: u32,
    /// Bytes of decoded state of all tracks.
    #[arg(long, value_name = "BYTES", default_value = "512M", value_parser = bytes, help_heading = HEADING, hide_short_help = true)]
    max_state_bytes: u64,
    /// Steps of work, of some 10 ns each, for a byte of the stream.
    #[arg(long, value_name = "STEPS", default_value = "400", help_heading = HEADING, hide_short_help = true)]
    max_work_per_byte: u32,
}

impl LimitArgs {
    /// The limits.
    pub fn limits(&self) -> Limits {
        Limits {
            stored_bytes: self.max_stored_bytes,
            unpacked_bytes: self.max_unpacked_bytes,
            frame_bytes: self.max_frame_bytes,
            zstd_window_bytes: self.max_zstd_window_bytes,
            tracks: self.max_tracks,
            path_bytes: self.max_path_bytes,
            state_bytes: self.max_state_bytes,
            work_per_byte: self.max_work_per_byte,
        }
    }
}

/// The option that sets the limit of a name, such as `state_bytes`.
pub fn option(name: &str) -> String {
    format!("--max-{}", name.replace('_', "-"))
}

fn bytes(text: &str) -> Result<u64, String> {
    let (digits, shift) = match text.as_bytes().last() {
        Some(b'K') => (&text[..text.len() - 1], 10),
        Some(b'M') => (&text[..text.len() - 1], 20),
        Some(b'G') => (&text[..text.len() - 1], 30),
        _ => (text, 0),
    };
    let number: Option<u64> = digits.parse().ok();
    let number = number.and_then(|number| number.checked_mul(1 << shift));
    number.ok_or_else(|| "a number of bytes such as 65536, 64K or 2M is wanted".to_owned())
}

fn bytes32(text: &str) -> Result<u32, String> {
    let number = bytes(text)?;
    u32::try_from(number).map_err(|_| format!("at most {} bytes are possible", u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::Limit;
    use clap::Parser as _;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        limits: LimitArgs,
    }

    #[test]
    fn limits_are_those_of_the_library_unless_given() {
        let line = |words: &[&str]| Line::try_parse_from([&["dapple"], words].concat());
        let plain = line(&[]).expect("no options");
        assert_eq!(plain.limits.limits(), Limits::default());
        for &which in Limit::ALL {
            let option = option(which.name());
            let given = line(&[&option, "7"]).expect(&option);
            let mut expected = Limits::default();
            assert!(expected.set(which, 7));
            assert_eq!(given.limits.limits(), expected);
        }
        let given = line(&["--max-state-bytes", "6G", "--max-stored-bytes", "3K"]);
        let limits = given.expect("units").limits.limits();
        assert_eq!((limits.state_bytes, limits.stored_bytes), (6 << 30, 3072));
        for wrong in ["4G", "x", "1.5M", "-1", "M", ""] {
            assert!(line(&["--max-stored-bytes", wrong]).is_err(), "{wrong}");
        }
    }
}
